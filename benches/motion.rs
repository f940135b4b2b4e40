//! From landmarks to a moving scan, and what smoothing costs in lag: `cargo bench --bench motion`.
//!
//! First a report that is no timing: jitter, lag and blinks on the demonstration clip for each way to smooth. Then
//! times per frame, on one thread.

#![allow(clippy::unwrap_used, reason = "a benchmark without its assets has nothing to measure")]

use std::sync::LazyLock;

use divan::{Bencher, bench, black_box, counter::ItemsCount};
use nalgebra::{Point3, Vector3};
use understudy::{
    assets::Assets,
    capture::{Frame, FrameSource, Timestamp, VideoFile},
    head::HeadPose,
    lift::{CausalSteadier, Expression, Repair, Smoothing, steady_recording, upright},
    pipeline::{
        Motion, Networks, Performance, SolveOptions, Stopwatch, Target, TargetOptions, read_canonical_face,
    },
    rig::{Method, Rig},
    tracking::{BlendshapeNetwork, LANDMARK_COUNT, Landmarks, TrackerOptions, index},
    view::Gpu,
};

static ASSETS: LazyLock<Assets> = LazyLock::new(|| Assets::locate().unwrap());

/// The clip as tracked, and as solved without smoothing.
static TAKE: LazyLock<Take> = LazyLock::new(Take::new);

struct Take {
    performance: Performance,
    unsmoothed: Motion,
}

impl Take {
    fn new() -> Self {
        let mut networks = networks();
        let source = Box::new(VideoFile::open(&ASSETS.verified("cap13").unwrap()).unwrap());
        let mut watch = Stopwatch::default();
        let performance = Performance::track(source, &mut networks.tracker, 1, &mut watch, |_| {}).unwrap();
        let unsmoothed = solve(&performance, &mut networks.blendshapes, Smoothing::Off);
        Self { performance, unsmoothed }
    }

    fn landmarks(&self) -> Vec<&Landmarks> {
        self.performance.frames.iter().filter_map(|frame| frame.landmarks.as_ref()).collect()
    }

    fn times(&self) -> Vec<Timestamp> {
        self.unsmoothed.frames.iter().map(|frame| frame.timestamp).collect()
    }

    /// Of each muscle whether it moves the lids.
    fn quick(&self) -> Vec<bool> {
        let basis = self.unsmoothed.basis.as_ref().unwrap();
        basis.elements.iter().map(|element| element.name.starts_with("eye")).collect()
    }

    fn expressions(&self) -> Vec<Expression> {
        self.unsmoothed.frames.iter().map(|frame| frame.expression.clone()).collect()
    }
}

fn networks() -> Networks {
    Networks::load(&ASSETS, TrackerOptions::default()).unwrap()
}

fn average_face() -> Vec<Point3<f64>> {
    read_canonical_face(&ASSETS.verified("canonical_face").unwrap()).unwrap()
}

fn solve(performance: &Performance, blendshapes: &mut BlendshapeNetwork, smoothing: Smoothing) -> Motion {
    let options = SolveOptions { smoothing, ..SolveOptions::default() };
    Motion::solve(performance, &average_face(), blendshapes, &options).unwrap()
}

fn main() {
    // Cargo's test of benchmarks runs each once and wants no report.
    if !std::env::args().any(|argument| argument == "--test" || argument == "--list") {
        report();
    }
    divan::main();
}

/// Times of the clip's own frames.
#[bench(sample_count = 3, sample_size = 1)]
fn decode_100_frames(bencher: Bencher<'_, '_>) {
    let clip = ASSETS.verified("cap13").unwrap();
    bencher.counter(ItemsCount::new(100_usize)).bench_local(|| {
        let (mut source, mut frame) = (VideoFile::open(&clip).unwrap(), Frame::default());
        (0..100).filter(|_| source.read(&mut frame).unwrap()).count()
    });
}

#[bench(sample_count = 200)]
fn pose(bencher: Bencher<'_, '_>) {
    let (landmarks, performer) = (TAKE.landmarks(), &TAKE.unsmoothed.performer);
    let (mut next, mut previous) = (landmarks.iter().cycle(), *performer.rest());
    bencher.bench_local(|| previous = performer.pose(next.next().unwrap(), Some(&previous)).unwrap());
}

#[bench(sample_count = 200)]
fn pose_from_nothing(bencher: Bencher<'_, '_>) {
    let landmarks = TAKE.landmarks();
    bencher.bench_local(|| TAKE.unsmoothed.performer.pose(black_box(landmarks[0]), None).unwrap());
}

#[bench(sample_count = 200)]
fn lift(bencher: Bencher<'_, '_>) {
    let (landmarks, performer) = (TAKE.landmarks(), &TAKE.unsmoothed.performer);
    let pose = performer.pose(landmarks[0], None).unwrap();
    bencher.bench_local(|| performer.lift(black_box(landmarks[0]), &pose));
}

#[bench(sample_count = 200)]
fn repair(bencher: Bencher<'_, '_>) {
    let (landmarks, performer) = (TAKE.landmarks(), &TAKE.unsmoothed.performer);
    let pose: HeadPose = performer.pose(landmarks[0], None).unwrap();
    let lifted = performer.lift(landmarks[0], &pose);
    let (mut repair, mut time) = (Repair::new(performer), Timestamp(0));
    bencher.with_inputs(|| lifted.clone()).bench_local_refs(|displacements| {
        time.0 += 40_000_000;
        repair.apply(time, &pose, displacements);
    });
}

#[bench(sample_count = 200)]
fn smooth_causally(bencher: Bencher<'_, '_>) {
    let reference = TAKE.unsmoothed.performer.rest().rotation;
    let expressions = TAKE.expressions();
    let (mut steadier, mut time) = (CausalSteadier::new(&TAKE.quick()), Timestamp(0));
    let mut next = expressions.iter().cycle();
    bencher.with_inputs(|| next.next().unwrap().clone()).bench_local_refs(|expression| {
        time.0 += 40_000_000;
        steadier.apply(time, &reference, expression);
    });
}

/// The whole clip; the counter tells frames.
#[bench(sample_count = 5, sample_size = 1)]
fn smooth_without_lag(bencher: Bencher<'_, '_>) {
    let (times, expressions) = (TAKE.times(), TAKE.expressions());
    let (reference, quick) = (TAKE.unsmoothed.performer.rest().rotation, TAKE.quick());
    bencher
        .counter(ItemsCount::new(times.len()))
        .with_inputs(|| expressions.clone())
        .bench_local_refs(|expressions| steady_recording(&times, &reference, &quick, expressions));
}

#[bench(sample_count = 300)]
fn pose_james(bencher: Bencher<'_, '_>) {
    let (gpu, mut networks) = (Gpu::headless().unwrap(), networks());
    let scan = ASSETS.verified("james_obj").unwrap();
    ASSETS.verified("james_jpg").unwrap();
    let options = TargetOptions::default();
    let mut target = Target::load(&scan, &options, &gpu, &mut networks.tracker).unwrap();
    let performer = &TAKE.unsmoothed.performer;
    let (face, _) = target.level_with(performer.rest_landmarks(), &mut networks.tracker).unwrap();
    let rig = Rig::new(performer, &face, &target.anatomy, &target.surface, Method::default()).unwrap();
    let (mut frame, expressions) = (rig.new_frame(), TAKE.expressions());
    let mut next = expressions.iter().cycle();
    bencher.bench_local(|| rig.pose(next.next().unwrap(), &mut frame).unwrap());
}

// The report.

/// Frames over which the face is called still.
const STILL: usize = 30;
/// Lags are sought up to this many frames.
const MOST_LAG: i64 = 6;
/// Lids closer than this share of their usual gap are a blink.
const BLINK: f64 = 0.6;

/// What is read off one way to smooth.
struct Curves {
    motion: Motion,
    mouth: Vec<f64>,
    yaw: Vec<f64>,
    lids: Vec<f64>,
    pixels: Vec<Vec<Vector3<f64>>>,
}

impl Curves {
    fn new(motion: Motion) -> Self {
        let performer = &motion.performer;
        let gap = |expression: &Expression, a: usize, b: usize| {
            let at = |i: usize| performer.neutral()[i] + expression.displacements.vectors[i];
            (at(a) - at(b)).norm()
        };
        let of = |read: &dyn Fn(&Expression) -> f64| {
            motion.frames.iter().map(|frame| read(&frame.expression)).collect::<Vec<_>>()
        };
        let mouth = of(&|e| gap(e, index::UPPER_LIP_INNER, index::LOWER_LIP_INNER));
        let lids = of(&|e| {
            gap(e, index::RIGHT_LID_UPPER, index::RIGHT_LID_LOWER)
                + gap(e, index::LEFT_LID_UPPER, index::LEFT_LID_LOWER)
        });
        let yaw = of(&|e| {
            let forward = upright() * e.pose.rotation * Vector3::z();
            forward.x.atan2(forward.z).to_degrees()
        });
        let pixels = motion
            .frames
            .iter()
            .map(|f| performer.project(&f.expression.displacements, &f.expression.pose))
            .collect();
        Self { motion, mouth, yaw, lids, pixels }
    }

    /// What trembles in the still stretch, as the spread of white noise with the same second differences: pixels in the
    /// picture, millimetres on the face, degrees of yaw.
    fn jitter(&self, still: usize) -> [f64; 3] {
        let frames = still..still + STILL;
        let pixels: Vec<_> = self.pixels[frames.clone()].iter().collect();
        let vectors: Vec<_> =
            self.motion.frames[frames.clone()].iter().map(|f| &f.expression.displacements.vectors).collect();
        [
            tremble(&pixels, |p| Vector3::new(p.x, p.y, 0.0)),
            tremble(&vectors, |v| *v),
            tremble(
                &self.yaw[frames].iter().map(|y| vec![*y]).collect::<Vec<_>>().iter().collect::<Vec<_>>(),
                |y| Vector3::new(*y, 0.0, 0.0),
            ),
        ]
    }
}

/// RMS of the second differences over √6, which is what independent noise of variance 1 has.
fn tremble<T>(frames: &[&Vec<T>], read: impl Fn(&T) -> Vector3<f64>) -> f64 {
    let mut sum = 0.0;
    for three in frames.windows(3) {
        for ((a, b), c) in three[0].iter().zip(three[1]).zip(three[2]) {
            sum += (read(a) - read(b) * 2.0 + read(c)).norm_squared();
        }
    }
    (sum / (6.0 * (frames.len() - 2) as f64 * frames[0].len() as f64)).sqrt()
}

/// Where the unsmoothed face moves least: the first of `STILL` frames.
fn stillest(motion: &Motion) -> usize {
    let moved: Vec<f64> = motion
        .frames
        .windows(2)
        .map(|pair| {
            let vectors = pair.iter().map(|f| &f.expression.displacements.vectors).collect::<Vec<_>>();
            let face: f64 = vectors[0].iter().zip(vectors[1]).map(|(a, b)| (a - b).norm()).sum();
            let head = pair[0].expression.pose.translation - pair[1].expression.pose.translation;
            face / LANDMARK_COUNT as f64 + head.norm()
        })
        .collect();
    let total = |first: usize| moved[first..first + STILL].iter().sum::<f64>();
    (0..moved.len() - STILL).min_by(|&a, &b| total(a).total_cmp(&total(b))).unwrap()
}

/// Frames by which `curve` follows `original`: the peak of their cross-correlation, between frames by a parabola.
fn lag(original: &[f64], curve: &[f64]) -> f64 {
    let n = original.len() as i64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / n as f64;
    let (a, b) = (mean(original), mean(curve));
    let at = |shift: i64| {
        (MOST_LAG + 1..n - MOST_LAG - 1)
            .map(|i| (original[(i - shift) as usize] - a) * (curve[i as usize] - b))
            .sum::<f64>()
    };
    let best = (-MOST_LAG..=MOST_LAG).max_by(|&i, &j| at(i).total_cmp(&at(j))).unwrap();
    let [before, peak, after] = [best - 1, best, best + 1].map(at);
    best as f64 + 0.5 * (before - after) / (before - 2.0 * peak + after)
}

/// Every blink's deepest frame.
fn blinks(lids: &[f64]) -> (f64, Vec<usize>) {
    let mut sorted = lids.to_vec();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted[sorted.len() / 2];
    let frames: Vec<usize> = (0..lids.len()).collect();
    let deepest = frames
        .chunk_by(|&a, &b| (lids[a] < BLINK * usual) == (lids[b] < BLINK * usual))
        .filter(|run| lids[run[0]] < BLINK * usual)
        .map(|run| *run.iter().min_by(|&&a, &&b| lids[a].total_cmp(&lids[b])).unwrap())
        .collect();
    (usual, deepest)
}

/// The share of the unsmoothed blinks' depth that is kept, within two frames of where it was.
fn blink_depth(original: &[f64], smoothed: &[f64]) -> f64 {
    let (usual, deepest) = blinks(original);
    let depth = |curve: &[f64], i: usize| {
        let near = &curve[i.saturating_sub(2)..(i + 3).min(curve.len())];
        usual - near.iter().copied().fold(f64::INFINITY, f64::min)
    };
    let kept: f64 = deepest.iter().map(|&i| depth(smoothed, i)).sum();
    kept / deepest.iter().map(|&i| depth(original, i)).sum::<f64>()
}

fn report() {
    let mut blendshapes = networks().blendshapes;
    let original = Curves::new(TAKE.unsmoothed.clone());
    let still = stillest(&original.motion);
    let info = &original.motion.info;
    println!(
        "Smoothing on {} ({}×{}, {} frames/s): jitter in the stillest {STILL} frames (from frame {still}), lag behind \
         the unsmoothed curves, depth kept of {} blinks\n",
        info.name,
        info.width,
        info.height,
        info.rate,
        blinks(&original.lids).1.len()
    );
    println!(
        "| | jitter, px | face, mm | yaw, ° | lag of the mouth, frames | of yaw | blinks |\n|---|---:|---:|---:|---:|---:|---:|"
    );
    for (name, smoothing) in
        [("off", Smoothing::Off), ("causal", Smoothing::Causal), ("zero-phase", Smoothing::ZeroPhase)]
    {
        let curves = Curves::new(solve(&TAKE.performance, &mut blendshapes, smoothing));
        let [pixels, millimetres, degrees] = curves.jitter(still);
        println!(
            "| {name} | {pixels:.3} | {millimetres:.3} | {degrees:.3} | {:.2} | {:.2} | {:.2} |",
            lag(&original.mouth, &curves.mouth),
            lag(&original.yaw, &curves.yaw),
            blink_depth(&original.lids, &curves.lids)
        );
    }
    println!();
}
