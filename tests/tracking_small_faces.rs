//! Small faces, no face, and more than one: what is found and which one is followed.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use nalgebra::Vector2;
use opencv::{core, imgproc, prelude::*};
use understudy::{
    assets::Assets,
    capture::{Frame, FrameSource, Image, VideoFile},
    pipeline::Networks,
    tracking::{Detector, FULL_RANGE, Runtime, SHORT_RANGE, Tracker, TrackerOptions, index},
};

const WIDTH: i32 = 1280;
const HEIGHT: i32 = 720;

/// The first frame of the demonstration clip, 400 × 300; its face is some 90 pixels wide.
fn performer() -> Image {
    let assets = Assets::locate().unwrap();
    let mut frame = Frame::default();
    assert!(VideoFile::open(&assets.verified("cap13").unwrap()).unwrap().read(&mut frame).unwrap());
    frame.image
}

fn tracker() -> Tracker {
    Networks::load(&Assets::locate().unwrap(), TrackerOptions::default()).unwrap().tracker
}

/// A grey picture with scaled copies of `picture`, each with its upper left corner at the given place.
fn collage(picture: &Image, copies: &[(f64, i32, i32)]) -> Image {
    let mut canvas = Mat::new_rows_cols_with_default(
        HEIGHT,
        WIDTH,
        core::CV_8UC3,
        core::Scalar::new(128.0, 128.0, 128.0, 0.0),
    )
    .unwrap();
    for &(scale, left, top) in copies {
        let mut small = Mat::default();
        imgproc::resize(picture.mat(), &mut small, core::Size::default(), scale, scale, imgproc::INTER_AREA)
            .unwrap();
        let place = core::Rect::new(left, top, small.cols(), small.rows());
        small.copy_to(&mut Mat::roi_mut(&mut canvas, place).unwrap()).unwrap();
    }
    Image::from_bgr(canvas)
}

#[test]
fn a_face_of_45_pixels_is_found_by_the_full_range_detector_alone() {
    let picture = collage(&performer(), &[(0.5, 600, 300)]);
    let assets = Assets::locate().unwrap();
    let runtime = Runtime::load(&assets.verified("onnxruntime").unwrap()).unwrap();
    let open = |name, layout| Detector::open(&runtime, &assets.verified(name).unwrap(), layout).unwrap();
    assert!(open("face_detector", SHORT_RANGE).detect(&picture).unwrap().is_empty());

    let mut full_range = open("face_detector_full_range", FULL_RANGE);
    for found in [full_range.detect(&picture).unwrap(), full_range.detect_tiled(&picture).unwrap()] {
        assert_eq!(found.len(), 1);
        // Another program's box for the same picture; the two networks draw theirs a little differently.
        let off = (found[0].minimum - Vector2::new(681.0, 367.0))
            .amax()
            .max((found[0].maximum - Vector2::new(726.0, 413.0)).amax());
        assert!(off < 8.0, "{:?} to {:?}", found[0].minimum, found[0].maximum);
    }
}

#[test]
fn small_faces_have_the_landmarks_of_the_large_one() {
    let performer = performer();
    let mut tracker = tracker();
    let large = tracker.track(&performer).unwrap().unwrap();
    for (scale, left, top) in [(0.5, 600, 300), (0.66, 40, 400)] {
        tracker.reset();
        let small = tracker.track(&collage(&performer, &[(scale, left, top)])).unwrap().unwrap();
        // Scaling takes pixel corners to pixel corners; landmarks count from pixel centres.
        let place = |pixel: Vector2<f64>| {
            (pixel.add_scalar(0.5) * scale).add_scalar(-0.5) + Vector2::new(f64::from(left), f64::from(top))
        };
        let distances = (0..large.points.len()).map(|i| (small.pixel(i) - place(large.pixel(i))).norm());
        let mean = distances.sum::<f64>() / large.points.len() as f64;
        let relative = mean / small.outer_canthal_distance();
        println!("scale {scale}: {mean:.2} px, {:.1} % of the eye distance", 100.0 * relative);
        assert!(relative < 0.05, "scale {scale}: {mean} px");
    }
}

#[test]
fn no_face_is_found_where_there_is_none() {
    let empty = collage(&performer(), &[]);
    let mut tracker = tracker();
    for _ in 0..3 {
        assert!(tracker.track(&empty).unwrap().is_none());
    }
    // A pattern with edges everywhere.
    let mut tiles = empty.mat().clone();
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let bright = ((x / 40) ^ (y / 40) ^ (x * y / 9000)) % 7 * 36;
            *tiles.at_2d_mut::<core::Vec3b>(y, x).unwrap() = [bright as u8; 3].into();
        }
    }
    tracker.reset();
    assert!(tracker.track(&Image::from_bgr(tiles)).unwrap().is_none());
    assert_eq!(tracker.faces_seen(), 0);
}

#[test]
fn a_face_that_leaves_is_lost_and_found_again_elsewhere() {
    let performer = performer();
    let mut tracker = tracker();
    let mut nose = |picture: &Image| Some(tracker.track(picture).unwrap()?.pixel(index::NOSE_TIP));
    let before = nose(&collage(&performer, &[(1.0, 0, 0)])).unwrap();
    assert!(nose(&collage(&performer, &[])).is_none());
    let after = nose(&collage(&performer, &[(1.0, 800, 350)])).unwrap();
    assert!((after - before - Vector2::new(800.0, 350.0)).norm() < 1.0);
}

#[test]
fn the_largest_of_two_faces_is_followed() {
    let performer = performer();
    let picture = collage(&performer, &[(1.4, 20, 150), (2.0, 480, 60)]);
    let mut tracker = tracker();
    let mut noses = Vec::new();
    for _ in 0..3 {
        let landmarks = tracker.track(&picture).unwrap().unwrap();
        noses.push(landmarks.pixel(index::NOSE_TIP));
    }
    assert_eq!(tracker.faces_seen(), 2);
    assert!(noses.iter().all(|nose| nose.x > 600.0), "{noses:?}");
    // What was followed first is followed on, however large a face comes later.
    tracker.reset();
    tracker.track(&collage(&performer, &[(1.4, 20, 150)])).unwrap().unwrap();
    let nose = tracker.track(&picture).unwrap().unwrap().pixel(index::NOSE_TIP);
    assert!(nose.x < 580.0, "{nose:?}");
}
