//! Lids and gaze against takes whose blinks and glances are known, and against clips whose blinks were counted by eye.

#![allow(clippy::float_cmp, reason = "a shut eye is exactly 1")]
#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use nalgebra::{Point3, Rotation3, Vector3, center};
use proptest::prelude::{Strategy, any, prop, prop_assert, prop_oneof, proptest};
use understudy::{
    capture::{Timestamp, VideoFile},
    head::{Camera, HeadPose},
    lift::{
        CausalEyes, EyeMeasure, EyeRun, Eyes, NeutralEyes, Performer, Side, Smoothing, eyes_of_recording,
        frontal_pose, measure_eyes, upright,
    },
    pipeline::{Motion, Networks, Performance, SolveOptions, Stopwatch, read_canonical_face},
    tracking::{LANDMARK_COUNT, LandmarkState, Landmarks, TrackerOptions, index},
};

// Takes made of measures.

/// Aperture of an open eye, were the neutral scan's a little wider.
const OPEN: f64 = 0.97;
/// Seconds of neutral before anything happens.
const NEUTRAL: f64 = 1.0;

/// What a take shows, and what the tracker makes of it.
#[derive(Clone, Copy)]
struct Tracker {
    rate: f64,
    /// Share of the open aperture that the network leaves shut eyes.
    shut: f64,
    /// Standard deviation of the aperture, of the open one: 0.009 on webcam clips, 0.02 on carphone.
    noise: f64,
    seed: u64,
}

/// Noise that is the same everywhere: a sum of four uniform numbers.
struct Noise(u64);

impl Noise {
    fn next(&mut self, deviation: f64) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
        };
        (0..4).map(|_| uniform()).sum::<f64>() * deviation * 3_f64.sqrt()
    }
}

impl Tracker {
    /// A take of four seconds after the neutral; `lids` gives the true closures of both eyes at a frame since then.
    fn take(&self, lids: impl Fn(i64) -> [f64; 2]) -> (NeutralEyes, EyeRun) {
        let mut noise = Noise(self.seed);
        let neutral = (NEUTRAL * self.rate) as i64;
        let mut run = EyeRun::default();
        for frame in 0..neutral + (4.0 * self.rate) as i64 {
            run.times.push(Timestamp((frame as f64 / self.rate * 1e9).round() as i64));
            let truth = if frame < neutral { [0.0; 2] } else { lids(frame - neutral) };
            run.measures.push(truth.map(|closure| EyeMeasure {
                aperture: OPEN * (1.0 - closure * (1.0 - self.shut) + noise.next(self.noise)),
                yaw: noise.next(0.7 * self.noise),
                pitch: noise.next(0.5 * self.noise),
                seen: true,
            }));
        }
        (NeutralEyes::new(&run.measures[..neutral as usize]), run)
    }
}

fn causal(neutral: NeutralEyes, run: &EyeRun) -> Vec<Eyes> {
    let mut eyes = CausalEyes::new(neutral);
    run.times.iter().zip(&run.measures).map(|(&time, measures)| eyes.apply(time, measures)).collect()
}

fn recorded(neutral: NeutralEyes, run: &EyeRun, steady: bool) -> Vec<Eyes> {
    eyes_of_recording(&neutral, std::slice::from_ref(run), steady).concat()
}

/// Unsmoothed, live, and as a recording.
fn every_way(neutral: NeutralEyes, run: &EyeRun) -> [(&'static str, Vec<Eyes>); 3] {
    [
        ("off", recorded(neutral, run, false)),
        ("causal", causal(neutral, run)),
        ("zero-phase", recorded(neutral, run, true)),
    ]
}

/// First and last frame of every time that this eye is shut.
fn blinks(eyes: &[Eyes], side: Side) -> Vec<(usize, usize)> {
    let frames: Vec<usize> = (0..eyes.len()).collect();
    let shut = |frame: usize| eyes[frame].of(side).closure == 1.0;
    let runs = frames.chunk_by(|&a, &b| shut(a) == shut(b)).filter(|run| shut(run[0]));
    runs.map(|run| (run[0], run[run.len() - 1])).collect()
}

/// Trackers at both rates, with webcam and telephone noise, and networks that shut the eyes more and less.
fn trackers() -> Vec<Tracker> {
    let mut all = Vec::new();
    for rate in [25.0, 30.0] {
        for noise in [0.009, 0.02] {
            for shut in [0.08, 0.15, 0.3] {
                all.extend((0..20).map(|seed| Tracker { rate, shut, noise, seed }));
            }
        }
    }
    all
}

/// The take shows exactly this many blinks of the right and of the left eye, each way to follow it.
#[track_caller]
fn counts(lids: impl Fn(f64, i64) -> [f64; 2], wanted: [usize; 2]) {
    for tracker in trackers() {
        let (neutral, run) = tracker.take(|frame| lids(tracker.rate, frame));
        for (way, eyes) in every_way(neutral, &run) {
            let found = Side::BOTH.map(|side| blinks(&eyes, side).len());
            let Tracker { rate, shut, noise, seed } = tracker;
            assert_eq!(found, wanted, "{way}, {rate} fps, shut {shut}, noise {noise}, seed {seed}");
        }
    }
}

/// 1 in `frames` frames from `first`.
fn in_frames(frame: i64, first: i64, frames: i64) -> f64 {
    f64::from((first..first + frames).contains(&frame))
}

#[test]
fn blinks_of_one_and_of_two_frames_count_once() {
    counts(|_, frame| [in_frames(frame, 30, 1); 2], [1, 1]);
    counts(|_, frame| [in_frames(frame, 30, 2); 2], [1, 1]);
    // With the lids on their way in the frames beside it.
    counts(
        |_, frame| [[0.45, 1.0, 0.9, 0.4, 0.15].get((frame - 30) as usize).copied().unwrap_or(0.0); 2],
        [1, 1],
    );
}

#[test]
fn a_slow_closing_counts_once() {
    // Down in a second, shut for half of one, up in a second.
    counts(
        |rate, frame| {
            let time = frame as f64 / rate - 0.5;
            [time.min(2.5 - time).clamp(0.0, 1.0); 2]
        },
        [1, 1],
    );
}

#[test]
fn two_blinks_a_fifth_of_a_second_apart_are_two() {
    counts(
        |rate, frame| {
            let second = 30 + (0.2 * rate) as i64;
            [in_frames(frame, 30, 2) + in_frames(frame, second, 2); 2]
        },
        [2, 2],
    );
}

#[test]
fn a_wink_shuts_one_eye_though_the_other_sags() {
    let wink = |frame| in_frames(frame, 30, 8);
    counts(|_, frame| [wink(frame), 0.3 * wink(frame)], [1, 0]);
    counts(|_, frame| [0.3 * wink(frame), wink(frame)], [0, 1]);
}

#[test]
fn noise_alone_closes_nothing_and_hardly_moves_the_lids() {
    counts(|_, _| [0.0; 2], [0, 0]);
    for tracker in trackers() {
        let (neutral, run) = tracker.take(|_| [0.0; 2]);
        for (way, eyes) in every_way(neutral, &run) {
            let most =
                eyes.iter().flat_map(|e| [e.right.closure, e.left.closure]).map(f64::abs).fold(0.0, f64::max);
            assert!(most < if tracker.noise < 0.01 { 0.03 } else { 0.12 }, "{way}: {most}");
        }
    }
}

#[test]
fn squints_and_glances_down_are_no_blinks_and_wide_eyes_are_below_zero() {
    // The network's aperture halves for a second: a squint, in a take that has no blink to learn from.
    let squint = Tracker { rate: 25.0, shut: 0.0, noise: 0.009, seed: 3 };
    let (neutral, run) = squint.take(|frame| [if (20..45).contains(&frame) { 0.5 } else { 0.0 }; 2]);
    for (way, eyes) in every_way(neutral, &run) {
        let narrow = &eyes[50..65];
        assert!(narrow.iter().all(|e| (0.6..0.8).contains(&e.left.closure)), "{way}: {narrow:?}");
    }
    let (neutral, run) = squint.take(|frame| [if frame > 20 { -0.2 } else { 0.0 }; 2]);
    for (way, eyes) in every_way(neutral, &run) {
        assert!(eyes[60..].iter().all(|e| (-0.4..-0.2).contains(&e.right.closure)), "{way}");
    }
}

#[test]
fn a_moving_lid_is_shown_without_lag_and_alike_live_and_recorded() {
    // This shut leaves the take's range at its default, which is also where the live one starts.
    let tracker = Tracker { rate: 25.0, shut: 0.22, noise: 0.0, seed: 0 };
    let shape = [0.15, 0.45, 0.75, 1.0, 1.0, 0.7, 0.5, 0.35, 0.2, 0.1];
    let lids = |frame: i64| [shape.get((frame - 30) as usize).copied().unwrap_or(0.0); 2];
    let (neutral, mut run) = tracker.take(lids);
    for eye in run.measures[25..].as_flattened_mut() {
        (eye.yaw, eye.pitch) = (0.2, -0.1);
    }
    let [(_, plain), (_, live), (_, steady)] = every_way(neutral, &run);
    for ((plain, live), steady) in plain.iter().zip(&live).zip(&steady) {
        for other in [live, steady] {
            assert_eq!(plain.right.closure == 1.0, other.right.closure == 1.0);
            assert!((plain.right.closure - other.right.closure).abs() < 0.03);
        }
    }
    // Nothing is learnt of the gaze.
    for eyes in [&plain, &live, &steady].map(|eyes| &eyes[40..]) {
        let off = eyes.iter().map(|e| (e.left.yaw - 0.2).abs().max((e.right.pitch + 0.1).abs()));
        assert!(off.fold(0.0, f64::max) < 1e-3);
    }
}

#[test]
fn the_gaze_is_held_through_a_blink() {
    let tracker = Tracker { rate: 25.0, shut: 0.1, noise: 0.0, seed: 0 };
    let (neutral, mut run) = tracker.take(|frame| [in_frames(frame, 30, 4); 2]);
    for (frame, [right, left]) in run.measures.iter_mut().enumerate().skip(25) {
        // While shut, the network's irises cross and sink, as on the clips.
        let guessed = (55..59).contains(&frame);
        (right.yaw, right.pitch) = if guessed { (0.3, -0.2) } else { (0.1, 0.05) };
        (left.yaw, left.pitch) = if guessed { (-0.3, -0.2) } else { (0.1, 0.05) };
    }
    for (way, eyes) in every_way(neutral, &run) {
        for eyes in &eyes[45..70] {
            let off = [eyes.right.yaw - 0.1, eyes.left.yaw - 0.1, eyes.right.pitch - 0.05];
            assert!(off.iter().all(|angle| angle.abs() < 0.01), "{way}: {eyes:?}");
        }
    }
}

fn extremes() -> impl Strategy<Value = f64> {
    use prop::num::f64::{INFINITE, NORMAL, SUBNORMAL, ZERO};
    prop_oneof![-0.2..0.8_f64, NORMAL | ZERO | SUBNORMAL | INFINITE]
}

proptest! {
    #[test]
    fn whatever_is_measured_the_eyes_stay_in_their_range(
        frames in prop::collection::vec((prop::array::uniform6(extremes()), any::<[bool; 2]>()), 1..30),
    ) {
        let measures: Vec<[EyeMeasure; 2]> = frames
            .iter()
            .map(|(v, seen)| {
                let eye = |i: usize| EyeMeasure { aperture: v[i], yaw: v[i + 1], pitch: v[i + 2], seen: seen[i / 3] };
                [eye(0), eye(3)]
            })
            .collect();
        let times = (0..measures.len() as i64).map(|i| Timestamp(i * 33_333_333)).collect();
        let open = EyeMeasure { aperture: OPEN, yaw: 0.0, pitch: 0.0, seen: true };
        for (way, eyes) in every_way(NeutralEyes::new(&[[open; 2]]), &EyeRun { times, measures }) {
            for eye in eyes.iter().flat_map(|eyes| [eyes.right, eyes.left]) {
                prop_assert!((-0.4..=1.0).contains(&eye.closure), "{way}: {eye:?}");
                prop_assert!(eye.yaw.abs() <= 40.1_f64.to_radians() && eye.pitch.abs() <= 30.1_f64.to_radians());
            }
            prop_assert!(eyes.iter().all(|eyes| eyes.right.yaw >= eyes.left.yaw), "{way} diverges");
        }
    }
}

// Takes made of landmarks: the canonical face with lids and irises moved, posed and projected.

const LIDS: [[(usize, usize); 3]; 2] =
    [[(160, 144), (159, 145), (158, 153)], [(387, 373), (386, 374), (385, 380)]];
const CORNERS: [(usize, usize); 2] =
    [(index::RIGHT_EYE_OUTER, index::RIGHT_EYE_INNER), (index::LEFT_EYE_OUTER, index::LEFT_EYE_INNER)];
/// How far the iris stands before the line through the eye's corners, millimetres.
const PROTRUSION: f64 = 4.0;

fn camera() -> Camera {
    Camera::with_field_of_view(640, 480, 60.0).unwrap()
}

fn average_face() -> Vec<Point3<f64>> {
    read_canonical_face(&common::asset("canonical_face")).unwrap()
}

/// The face with each eye closed by a share and turned by yaw and pitch, degrees.
fn face_with(average: &[Point3<f64>], closures: [f64; 2], turns: [[f64; 2]; 2]) -> Vec<Point3<f64>> {
    let mut face = average.to_vec();
    face.resize(LANDMARK_COUNT, Point3::origin());
    for side in [0, 1] {
        for (upper, lower) in LIDS[side] {
            face[upper] += (average[lower] - average[upper]) * closures[side];
        }
        let (outer, inner) = CORNERS[side];
        let radius = 0.4 * (average[outer] - average[inner]).norm();
        let [yaw, pitch] = turns[side].map(f64::to_radians);
        let gaze = Vector3::new(yaw.sin() * pitch.cos(), pitch.sin(), yaw.cos() * pitch.cos());
        let iris = center(&average[outer], &average[inner])
            + Vector3::z() * PROTRUSION
            + (gaze - Vector3::z()) * radius;
        face[LANDMARK_COUNT - 10 + 5 * side..LANDMARK_COUNT - 5 + 5 * side].fill(iris);
    }
    face
}

fn seen(face: &[Point3<f64>], pose: &HeadPose) -> Landmarks {
    let camera = camera();
    let points = face
        .iter()
        .map(|point| {
            let placed = pose.to_camera(point);
            let depth = (placed.z - pose.translation.z) * camera.focal / pose.translation.z;
            camera.project(&placed).push(depth)
        })
        .collect();
    Landmarks { points, states: vec![LandmarkState::Observed; LANDMARK_COUNT], presence: 1.0 }
}

fn turned(pitch: f64, yaw: f64) -> HeadPose {
    HeadPose {
        rotation: upright() * Rotation3::from_euler_angles(pitch.to_radians(), yaw.to_radians(), 0.0),
        translation: Vector3::new(15.0, -10.0, 520.0),
        ..frontal_pose()
    }
}

#[test]
fn apertures_and_glances_are_measured_at_every_pose_of_the_head() {
    let average = average_face();
    let open = seen(&face_with(&average, [0.0; 2], [[0.0; 2]; 2]), &frontal_pose());
    let performer = Performer::from_average_face(camera(), &average, &[&open]).unwrap();
    let neutral = measure_eyes(&performer, &open, performer.rest());
    for (pitch, yaw) in [(0.0, 0.0), (12.0, 0.0), (-12.0, 0.0), (0.0, 25.0), (8.0, -25.0)] {
        let pose = turned(pitch, yaw);
        for (closures, turns) in [
            ([0.0, 0.0], [[0.0, 0.0], [0.0, 0.0]]),
            ([0.0, 1.0], [[20.0, 0.0], [20.0, 0.0]]),
            ([0.5, 0.5], [[-15.0, -10.0], [-18.0, -10.0]]),
            ([1.0, 0.2], [[5.0, 15.0], [-5.0, 15.0]]),
        ] {
            let landmarks = seen(&face_with(&average, closures, turns), &pose);
            let found = measure_eyes(&performer, &landmarks, &performer.pose(&landmarks, None).unwrap());
            for side in [0, 1] {
                let share = found[side].aperture / neutral[side].aperture;
                let missed = share - (1.0 - closures[side]);
                assert!(missed.abs() < 0.06, "{share:.3} for {closures:?} at {pitch}, {yaw}");
                let [across, up] = turns[side];
                let found = [found[side].yaw, found[side].pitch].map(f64::to_degrees);
                assert!(
                    (found[0] - across).abs() < 1.0 && (found[1] - up).abs() < 1.0,
                    "{found:?} for {turns:?}"
                );
            }
        }
    }
}

#[test]
fn an_eye_outside_the_picture_does_as_the_other() {
    let average = average_face();
    let face = face_with(&average, [1.0, 0.0], [[0.0; 2]; 2]);
    let mut landmarks = seen(&face, &frontal_pose());
    let open = seen(&face_with(&average, [0.0; 2], [[0.0; 2]; 2]), &frontal_pose());
    let performer = Performer::from_average_face(camera(), &average, &[&open]).unwrap();
    let neutral = NeutralEyes::new(&[measure_eyes(&performer, &open, performer.rest())]);
    let eyes = |landmarks: &Landmarks| {
        CausalEyes::new(neutral).apply(Timestamp(0), &measure_eyes(&performer, landmarks, performer.rest()))
    };
    assert_eq!(eyes(&landmarks).right.closure, 1.0);
    landmarks.states[index::RIGHT_EYE_OUTER] = LandmarkState::Absent;
    assert!(eyes(&landmarks).right.closure < 0.01);
}

// Clips. Frames from 0; all frames of the clips were looked at for blinks (docs/lifting.md).

/// The frames in which the lids are seen to touch.
fn clip_blinks(clip: &str, wanted: &[std::ops::RangeInclusive<usize>]) {
    let assets = understudy::assets::Assets::locate().unwrap();
    let mut networks = Networks::load(&assets, TrackerOptions::default()).unwrap();
    let source = Box::new(VideoFile::open(&common::asset(clip)).unwrap());
    let performance =
        Performance::track(source, &mut networks.tracker, 1, &mut Stopwatch::default(), |_| {}).unwrap();
    for smoothing in [Smoothing::Off, Smoothing::Causal, Smoothing::ZeroPhase] {
        let options = SolveOptions { smoothing, ..SolveOptions::default() };
        let motion =
            Motion::solve(&performance, &average_face(), &mut networks.blendshapes, &options).unwrap();
        let eyes: Vec<Eyes> = motion.frames.iter().map(|frame| frame.expression.eyes).collect();
        for side in Side::BOTH {
            let found = blinks(&eyes, side);
            println!("{clip}, {smoothing:?}, {side:?}: {found:?}");
            assert_eq!(found.len(), wanted.len());
            for ((first, last), wanted) in found.iter().zip(wanted) {
                assert!(first <= wanted.start() && last >= wanted.end(), "{wanted:?}");
            }
        }
    }
}

#[test]
fn cap13_blinks_twice() {
    clip_blinks("cap13", &[98..=101, 426..=427]);
}

#[test]
fn cap12_blinks_twice() {
    clip_blinks("cap12", &[640..=643, 774..=776]);
}
