//! The networks and what surrounds them, on frames of the demonstration clip: `cargo bench --bench tracking`.
//!
//! Everything runs on one thread. Pin it to one processor for figures that can be compared:
//! `taskset -c 0 cargo bench --bench tracking`.

#![allow(clippy::unwrap_used, reason = "a benchmark without its assets has nothing to measure")]

use std::sync::LazyLock;

use divan::{Bencher, bench, black_box};
use opencv::core::Mat;
use understudy::{
    assets::Assets,
    capture::{Frame, FrameSource, Image, VideoFile},
    pipeline::Networks,
    tracking::{
        Detector, DetectorLayout, FULL_RANGE, FaceRegion, LandmarkNetwork, Landmarks, Runtime, SHORT_RANGE,
        Tracker, TrackerOptions,
    },
};

/// Frames held in memory.
const FRAMES: usize = 100;

static ASSETS: LazyLock<Assets> = LazyLock::new(|| Assets::locate().unwrap());

/// Frames, and what the tracker finds on the first.
static CLIP: LazyLock<(Vec<Image>, Landmarks)> = LazyLock::new(|| {
    let mut source = VideoFile::open(&ASSETS.verified("cap13").unwrap()).unwrap();
    let mut frame = Frame::default();
    let mut frames = Vec::new();
    while frames.len() < FRAMES && source.read(&mut frame).unwrap() {
        frames.push(frame.image.clone());
    }
    let landmarks = tracker().track(&frames[0]).unwrap().unwrap();
    (frames, landmarks)
});

fn main() {
    divan::main();
}

fn tracker() -> Tracker {
    Networks::load(&ASSETS, TrackerOptions::default()).unwrap().tracker
}

fn runtime() -> Runtime {
    Runtime::load(&ASSETS.verified("onnxruntime").unwrap()).unwrap()
}

/// One frame after another, the face followed.
#[bench(sample_count = 300, sample_size = 1)]
fn track_a_frame(bencher: Bencher<'_, '_>) {
    let (frames, _) = &*CLIP;
    let mut tracker = tracker();
    tracker.track(&frames[0]).unwrap();
    let mut next = frames.iter().cycle();
    bencher.bench_local(|| tracker.track(next.next().unwrap()).unwrap().is_some());
}

/// The crop as numbers, the network, and the way back into the picture.
#[bench(sample_count = 200, sample_size = 1)]
fn landmarks_in_a_region(bencher: Bencher<'_, '_>) {
    let (frames, landmarks) = &*CLIP;
    let mut network = LandmarkNetwork::open(&runtime(), &ASSETS.verified("face_landmarks").unwrap()).unwrap();
    let region = FaceRegion::around_landmarks(landmarks);
    bencher.bench_local(|| network.run(black_box(&frames[0]), region).unwrap().presence);
}

/// The landmark network alone, on numbers that are there already.
#[bench(sample_count = 200, sample_size = 1)]
fn bare_landmark_network(bencher: Bencher<'_, '_>) {
    let (frames, landmarks) = &*CLIP;
    let mut session = runtime().open(&ASSETS.verified("face_landmarks").unwrap()).unwrap();
    let mut crop = Mat::default();
    FaceRegion::around_landmarks(landmarks).cut(&frames[0], 256, &mut crop).unwrap();
    let bytes = Image::from_bgr(crop).bytes().unwrap().to_vec();
    let input: Vec<f32> = bytes.iter().map(|&value| f32::from(value) / 255.0).collect();
    bencher.bench_local(|| {
        let tensor = ort::value::TensorRef::from_array_view(([1_i64, 256, 256, 3], &*input)).unwrap();
        session.run(ort::inputs!["input_12" => tensor]).unwrap().len()
    });
}

#[bench(sample_count = 200)]
fn crop(bencher: Bencher<'_, '_>) {
    let (frames, landmarks) = &*CLIP;
    let region = FaceRegion::around_landmarks(landmarks);
    let mut crop = Mat::default();
    bencher.bench_local(|| region.cut(black_box(&frames[0]), 256, &mut crop).unwrap());
}

fn detector(name: &str, layout: DetectorLayout) -> Detector {
    Detector::open(&runtime(), &ASSETS.verified(name).unwrap(), layout).unwrap()
}

#[bench(sample_size = 1)]
fn detect_short_range(bencher: Bencher<'_, '_>) {
    let mut detector = detector("face_detector", SHORT_RANGE);
    bencher.bench_local(|| detector.detect(black_box(&CLIP.0[0])).unwrap().len());
}

#[bench(sample_size = 1)]
fn detect_full_range(bencher: Bencher<'_, '_>) {
    let mut detector = detector("face_detector_full_range", FULL_RANGE);
    bencher.bench_local(|| detector.detect(black_box(&CLIP.0[0])).unwrap().len());
}

#[bench(sample_count = 20, sample_size = 1)]
fn detect_full_range_tiled(bencher: Bencher<'_, '_>) {
    let mut detector = detector("face_detector_full_range", FULL_RANGE);
    bencher.bench_local(|| detector.detect_tiled(black_box(&CLIP.0[0])).unwrap().len());
}

#[bench(sample_size = 1)]
fn blendshape_scores(bencher: Bencher<'_, '_>) {
    let mut network = Networks::load(&ASSETS, TrackerOptions::default()).unwrap().blendshapes;
    bencher.bench_local(|| network.run(black_box(&CLIP.1)).unwrap().smile());
}
