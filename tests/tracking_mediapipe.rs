//! The tracker against MediaPipe's own Face Landmarker on single frames of three clips.
//!
//! The landmarks come from `tests/reference/mediapipe_reference.py`.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use nalgebra::Vector2;
use serde::Deserialize;
use understudy::{
    assets::Assets,
    capture::{Frame, FrameSource, VideoFile},
    pipeline::Networks,
    tracking::{LANDMARK_COUNT, TrackerOptions},
};

/// Mean distance of the landmarks, pixels of a clip that is 400 wide.
const AGREEMENT: f64 = 0.05;
/// Where all clips are measured.
const WIDTH: f64 = 400.0;

#[derive(Deserialize)]
struct Reference {
    frames: Vec<Seen>,
}

#[derive(Deserialize)]
struct Seen {
    clip: String,
    frame: u64,
    width: i32,
    mean_bgr: [f64; 3],
    pixels: Vec<[f64; 2]>,
}

#[test]
fn single_frames_agree_with_mediapipe() {
    let reference: Reference =
        serde_json::from_str(include_str!("reference/mediapipe_reference.json")).unwrap();
    let assets = Assets::locate().unwrap();
    // One run of the network after a detection, as MediaPipe does on a picture.
    let options = TrackerOptions { settling_runs: 1, ..TrackerOptions::default() };
    let mut tracker = Networks::load(&assets, options).unwrap().tracker;
    let mut compared = 0;
    for clip in reference.frames.chunk_by(|a, b| a.clip == b.clip) {
        let stem = clip[0].clip.trim_end_matches(".mp4");
        let name = stem.split('_').next().unwrap();
        let mut source = VideoFile::open(&assets.verified(name).unwrap()).unwrap();
        let mut frame = Frame::default();
        for wanted in clip {
            loop {
                assert!(source.read(&mut frame).unwrap(), "{name} ends before frame {}", wanted.frame);
                if frame.index == wanted.frame {
                    break;
                }
            }
            assert_eq!(frame.image.width(), wanted.width);
            let colour = mean_colour(frame.image.bytes().unwrap());
            for (found, wanted) in colour.iter().zip(wanted.mean_bgr) {
                assert!((found - wanted).abs() < 1.0, "{name}: another picture was decoded");
            }
            tracker.reset();
            let landmarks = tracker.track(&frame.image).unwrap().unwrap();
            let distances = wanted
                .pixels
                .iter()
                .zip(&landmarks.points)
                .map(|(wanted, found)| (found.xy() - Vector2::from(*wanted)).norm());
            let scale = WIDTH / f64::from(wanted.width);
            let mean = distances.sum::<f64>() * scale / LANDMARK_COUNT as f64;
            println!("{name} frame {}: {mean:.4} px", wanted.frame);
            assert_eq!(wanted.pixels.len(), LANDMARK_COUNT);
            assert!(mean <= AGREEMENT, "{name} frame {}: {mean} px", wanted.frame);
            compared += 1;
        }
    }
    assert_eq!(compared, 22);
}

fn mean_colour(bgr: &[u8]) -> [f64; 3] {
    let mut sums = [0_u64; 3];
    for pixel in bgr.chunks_exact(3) {
        for (sum, &value) in sums.iter_mut().zip(pixel) {
            *sum += u64::from(value);
        }
    }
    sums.map(|sum| sum as f64 / (bgr.len() / 3) as f64)
}
