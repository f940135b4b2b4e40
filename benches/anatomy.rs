//! A scan made able to perform, and what that costs: `cargo bench --bench anatomy`.
//!
//! First a report: how much dearer a frame of the opened scan is than one of the scan as it was. Then times of making a
//! target, without the cache, and its rig, on one thread; the clip's performer and the scan are the demonstration's.

#![allow(clippy::unwrap_used, reason = "a benchmark without its assets has nothing to measure")]

use std::{
    cell::RefCell,
    path::PathBuf,
    process::Command,
    sync::LazyLock,
    time::{Duration, Instant},
};

use divan::{Bencher, bench, black_box};
use understudy::{
    anatomy::{Anatomy, FaceFrame},
    assets::Assets,
    capture::VideoFile,
    lift::{Expression, Performer},
    pipeline::{
        Motion, Networks, Performance, Photographer, SolveOptions, Stopwatch, Target, TargetOptions,
        read_canonical_face,
    },
    rig::{Method, Rig, TargetFace},
    scan::{Surface, read_mesh},
    tracking::TrackerOptions,
    view::{Gpu, Model},
};

/// Names the folder in which targets are kept from run to run.
const CACHE: &str = "UNDERSTUDY_CACHE";

static ASSETS: LazyLock<Assets> = LazyLock::new(|| Assets::locate().unwrap());

thread_local! {
    /// The graphics device and the networks stay on the thread that runs the benchmarks.
    static STUDIO: RefCell<Studio> = RefCell::new(Studio::new());
}

/// What a target is made with, and one that has been made and levelled with the clip's performer.
struct Studio {
    gpu: Gpu,
    networks: Networks,
    target: Target,
    as_scanned: Anatomy,
    face: TargetFace,
    performer: Performer,
    expressions: Vec<Expression>,
}

impl Studio {
    fn new() -> Self {
        let gpu = Gpu::headless().unwrap();
        let mut networks = Networks::load(&ASSETS, TrackerOptions::default()).unwrap();
        let motion = motion(&mut networks);
        let mut target = load(&gpu, &mut networks);
        let as_scanned = target.anatomy.clone();
        target.prepare(&gpu).unwrap();
        let (face, _) = target.level_with(motion.performer.rest_landmarks(), &mut networks.tracker).unwrap();
        let expressions = motion.frames.into_iter().map(|frame| frame.expression).collect();
        Self { gpu, networks, target, as_scanned, face, performer: motion.performer, expressions }
    }

    fn anatomy(&self, opened: bool) -> &Anatomy {
        if opened { &self.target.anatomy } else { &self.as_scanned }
    }

    fn rig(&self, opened: bool) -> Rig {
        let (anatomy, surface) = (self.anatomy(opened), &self.target.surface);
        Rig::new(&self.performer, &self.face, anatomy, surface, Method::default()).unwrap()
    }
}

fn scan() -> PathBuf {
    for companion in ["james_mtl", "james_jpg"] {
        ASSETS.verified(companion).unwrap();
    }
    ASSETS.verified("james_obj").unwrap()
}

fn load(gpu: &Gpu, networks: &mut Networks) -> Target {
    Target::load(&scan(), &TargetOptions::default(), gpu, &mut networks.tracker).unwrap()
}

fn motion(networks: &mut Networks) -> Motion {
    let source = Box::new(VideoFile::open(&ASSETS.verified("cap13").unwrap()).unwrap());
    let average = read_canonical_face(&ASSETS.verified("canonical_face").unwrap()).unwrap();
    let mut watch = Stopwatch::default();
    let performance = Performance::track(source, &mut networks.tracker, 1, &mut watch, |_| {}).unwrap();
    Motion::solve(&performance, &average, &mut networks.blendshapes, &SolveOptions::default()).unwrap()
}

fn in_studio<T>(work: impl FnOnce(&mut Studio) -> T) -> T {
    STUDIO.with_borrow_mut(work)
}

fn main() {
    // A target that comes from the cache is not made: once more without, unless the caller wants to see just that.
    if std::env::var_os(CACHE).is_none() {
        let mut again = Command::new(std::env::current_exe().unwrap());
        let status = again.args(std::env::args_os().skip(1)).env(CACHE, "off").status().unwrap();
        std::process::exit(status.code().unwrap_or(1));
    }
    // Cargo's test of benchmarks runs each once and wants no report.
    if !std::env::args().any(|argument| argument == "--test" || argument == "--list") {
        report();
    }
    divan::main();
}

// Making a target, whole and by its stages.

/// Read, photographed, landmarked.
#[bench(sample_count = 10, sample_size = 1)]
fn target_load(bencher: Bencher<'_, '_>) {
    in_studio(|studio| bencher.bench_local(|| load(&studio.gpu, &mut studio.networks)));
}

#[bench(sample_count = 20, sample_size = 1)]
fn target_prepare(bencher: Bencher<'_, '_>) {
    in_studio(|studio| bencher.bench_local(|| studio.target.prepare(&studio.gpu).unwrap()));
}

#[bench(sample_count = 20, sample_size = 1)]
fn prepare_1_front_view(bencher: Bencher<'_, '_>) {
    in_studio(|studio| {
        let (photographer, frame) = (photographer(studio), FaceFrame::of(&studio.target.landmarks).unwrap());
        bencher.bench_local(|| photographer.front_view(&studio.gpu, &frame).unwrap());
    });
}

#[bench(sample_count = 20, sample_size = 1)]
fn prepare_2_anatomy(bencher: Bencher<'_, '_>) {
    in_studio(|studio| {
        let frame = FaceFrame::of(&studio.target.landmarks).unwrap();
        let view = photographer(studio).front_view(&studio.gpu, &frame).unwrap();
        let target = &studio.target;
        bencher.bench_local(|| {
            Anatomy::prepare(target.mesh(), &target.surface, black_box(&target.landmarks), Some(&view))
        });
    });
}

/// Textures included.
#[bench(sample_count = 20, sample_size = 1)]
fn prepare_3_upload(bencher: Bencher<'_, '_>) {
    in_studio(|studio| {
        bencher.bench_local(|| Model::upload(&studio.gpu, &studio.target.anatomy.mesh).unwrap());
    });
}

/// What of loading is the file.
#[bench(sample_count = 20, sample_size = 1)]
fn read_scan(bencher: Bencher<'_, '_>) {
    let scan = scan();
    bencher.bench_local(|| Surface::new(&read_mesh(&scan).unwrap()).unwrap());
}

fn photographer(studio: &Studio) -> Photographer {
    let model = std::sync::Arc::clone(studio.target.model());
    Photographer::new(&studio.gpu, model, studio.target.mesh()).unwrap()
}

// Tying a performer to it. `false` is the scan as it was.

#[bench(args = [true, false], sample_count = 5, sample_size = 1)]
fn rig_new(bencher: Bencher<'_, '_>, opened: bool) {
    in_studio(|studio| bencher.bench_local(|| studio.rig(opened)));
}

#[bench(args = [true, false], sample_count = 300, sample_size = 1)]
fn pose(bencher: Bencher<'_, '_>, opened: bool) {
    in_studio(|studio| {
        let rig = studio.rig(opened);
        let (mut frame, mut next) = (rig.new_frame(), studio.expressions.iter().cycle());
        bencher.bench_local(|| rig.pose(next.next().unwrap(), &mut frame).unwrap());
    });
}

/// What of it is not the product with the matrix.
#[bench(args = [true, false], sample_count = 300, sample_size = 1)]
fn pose_controls(bencher: Bencher<'_, '_>, opened: bool) {
    in_studio(|studio| {
        let rig = studio.rig(opened);
        let (mut frame, mut next) = (rig.new_frame(), studio.expressions.iter().cycle());
        bencher.bench_local(|| rig.pose_controls(next.next().unwrap(), &mut frame));
    });
}

// The report.

/// Times a frame is posed on each, turn by turn, so that a busy machine is as busy for both.
const TURNS: usize = 400;

fn report() {
    in_studio(|studio| {
        let rigs = [studio.rig(false), studio.rig(true)];
        let mut frames = rigs.each_ref().map(Rig::new_frame);
        let mut times: [Vec<Duration>; 2] = Default::default();
        for expression in studio.expressions.iter().cycle().take(TURNS) {
            for ((rig, frame), times) in rigs.iter().zip(&mut frames).zip(&mut times) {
                let start = Instant::now();
                rig.pose(expression, black_box(frame)).unwrap();
                times.push(start.elapsed());
            }
        }
        let [scanned, opened] = times.map(|mut times| {
            times.sort();
            times[times.len() / 2].as_secs_f64() * 1e3
        });
        println!("A frame of {}, median of {TURNS}:\n", studio.target.scan.name);
        println!("| | soft vertices | all | columns | controls | ms |\n|---|---:|---:|---:|---:|---:|");
        for (name, rig, time) in [("as scanned", &rigs[0], scanned), ("opened", &rigs[1], opened)] {
            println!(
                "| {name} | {} | {} | {} | {} | {time:.3} |",
                rig.warp().vertices(),
                rig.rest().len(),
                rig.warp().controls(),
                rig.controls().rest.len(),
            );
        }
        println!("\nThe opened scan costs {:.2} times what it cost as scanned.\n", opened / scanned);
    });
}
