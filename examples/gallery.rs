//! A sheet of scans that perform: `cargo run --release --example gallery -- -o sheet.png --clip a.mp4 --scan b.obj …`.
//!
//! For each expression the clips are searched for the frame that shows it best, by the blendshape network's scores; all
//! scans are driven by that same frame. The first row is the performer. `--view mouth` and `--view eyes` come closer,
//! `--yaw` looks from the subject's left.

#![allow(clippy::print_stdout, reason = "an example says what it does")]

use std::{error::Error, path::PathBuf};

use clap::{Parser, ValueEnum};
use image::{RgbaImage, imageops};
use nalgebra::Point3;
use understudy::{
    assets::Assets,
    capture::{self, Frame, FrameRate},
    pipeline::{
        HeadMode, Motion, Networks, Performance, SolveOptions, Stage, Stopwatch, Target, TargetOptions,
        read_canonical_face,
    },
    rig::{Method, Rig},
    tracking::{Landmarks, ShapeScores, TrackerOptions, index},
    view::{Gpu, Look, Smoothing, contact_sheet, save_png},
};

#[derive(Parser)]
struct Arguments {
    /// Clips of performers
    #[arg(long = "clip", value_name = "CLIP", required = true)]
    clips: Vec<PathBuf>,
    /// Scans to be driven
    #[arg(long = "scan", value_name = "SCAN", required = true)]
    scans: Vec<PathBuf>,
    /// The sheet
    #[arg(short, long, value_name = "FILE.png")]
    output: PathBuf,
    /// What to look at
    #[arg(long, value_enum, default_value_t = View::Face)]
    view: View,
    /// Pixels of each picture's sides
    #[arg(long, default_value_t = 360)]
    side: u32,
    /// Only these expressions, such as "jaw open"
    #[arg(long)]
    only: Vec<String>,
    /// Degrees to the subject's left
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    yaw: f64,
}

#[derive(Clone, Copy, ValueEnum)]
enum View {
    Face,
    Mouth,
    Eyes,
}

/// An expression: its name, and how well a frame's scores show it.
type Moment = (&'static str, fn(&ShapeScores) -> f64);

// Places in the network's list of 52 shapes.
const BROW_INNER_UP: usize = 3;
const BROW_OUTER_UP: [usize; 2] = [4, 5];
const BLINK: [usize; 2] = [9, 10];
const LOOK_RIGHT_EYE_IN: usize = 14;
const LOOK_LEFT_EYE_OUT: usize = 15;
const JAW_OPEN: usize = 25;
const PUCKER: usize = 38;
const SMILE: [usize; 2] = [44, 45];

const WINK: &str = "wink";
/// What a take without a good neutral is held back by.
const DOUBTFUL: f64 = 0.3;

fn least(scores: &ShapeScores, shapes: [usize; 2]) -> f64 {
    scores.score(shapes[0]).min(scores.score(shapes[1]))
}

const MOMENTS: [Moment; 7] = [
    ("jaw open", |s| s.score(JAW_OPEN)),
    ("smile", |s| least(s, SMILE) - 0.3 * s.score(JAW_OPEN)),
    ("brows up", |s| s.score(BROW_INNER_UP) + least(s, BROW_OUTER_UP)),
    ("blink", |s| least(s, BLINK)),
    // No clip shows one: the blink's frame again, its right eye held open.
    (WINK, |s| least(s, BLINK)),
    ("gaze left", |s| s.score(LOOK_RIGHT_EYE_IN).min(s.score(LOOK_LEFT_EYE_OUT)) - least(s, BLINK)),
    ("pucker", |s| s.score(PUCKER) - 0.5 * s.score(JAW_OPEN)),
];

/// A solved clip.
struct Take {
    path: PathBuf,
    performance: Performance,
    motion: Motion,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let assets = Assets::locate()?;
    let gpu = Gpu::headless()?;
    let mut networks = Networks::load(&assets, TrackerOptions::default())?;
    let average = read_canonical_face(&assets.verified("canonical_face")?)?;
    let mut takes = Vec::new();
    for path in &arguments.clips {
        let source = capture::open(path, FrameRate { numerator: 25, denominator: 1 })?;
        let mut watch = Stopwatch::default();
        let performance = Performance::track(source, &mut networks.tracker, 2, &mut watch, |_| {})?;
        let motion =
            Motion::solve(&performance, &average, &mut networks.blendshapes, &SolveOptions::default())?;
        println!("{}: {} frames", path.display(), motion.frames.len());
        takes.push(Take { path: path.clone(), performance, motion });
    }
    let mut moments = choose(&takes, &mut networks)?;
    moments.retain(|moment| arguments.only.is_empty() || arguments.only.iter().any(|name| name == moment.0));
    let mut cells: Vec<(RgbaImage, String)> = Vec::new();
    for &(name, take, frame) in &moments {
        let seconds = takes[take].motion.frames[frame].timestamp.seconds();
        let clip = takes[take].path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        println!("{name}: {clip} at {seconds:.2} s");
        cells.push((
            performer(&takes[take], frame, arguments.view, arguments.side)?,
            format!("{name} - {clip} {seconds:.2} s"),
        ));
    }
    for scan in &arguments.scans {
        let mut target = Target::load(scan, &TargetOptions::default(), &gpu, &mut networks.tracker)?;
        target.prepare(&gpu)?;
        for omission in &target.anatomy.omissions {
            println!("{}: {omission}", target.scan.name);
        }
        let mut drawn: Vec<Option<RgbaImage>> = moments.iter().map(|_| None).collect();
        for (number, take) in takes.iter().enumerate() {
            if !moments.iter().any(|moment| moment.1 == number) {
                continue;
            }
            let (face, _) =
                target.level_with(take.motion.performer.rest_landmarks(), &mut networks.tracker)?;
            let rig =
                Rig::new(&take.motion.performer, &face, &target.anatomy, &target.surface, Method::default())?;
            let smoothing = Smoothing::Samples4;
            let size = [arguments.side; 2];
            let mut stage =
                Stage::new(&gpu, &target, &face.level, size, Look::default(), HeadMode::Still, smoothing)?;
            let (centre, radius) = frame_of(&target, arguments.view);
            stage.look_at(centre, radius, arguments.yaw.to_radians());
            let mut frame = rig.new_frame();
            for (slot, moment) in drawn.iter_mut().zip(&moments) {
                if moment.1 == number {
                    let mut expression = take.motion.frames[moment.2].expression.clone();
                    if moment.0 == WINK {
                        expression.eyes.right.closure = 0.0;
                    }
                    rig.pose(&expression, &mut frame)?;
                    *slot = Some(stage.picture(&frame)?);
                }
            }
        }
        for picture in drawn {
            cells.push((picture.ok_or("a picture came back in another size")?, target.scan.name.clone()));
        }
    }
    let cells: Vec<_> = cells.iter().map(|(picture, caption)| (picture, caption.as_str())).collect();
    save_png(&arguments.output, &contact_sheet(&cells, moments.len() as u32))?;
    println!("wrote {}", arguments.output.display());
    Ok(())
}

/// An expression's name, the take and the frame that shows it.
type Shown = (&'static str, usize, usize);

/// The neutral, and where every expression is shown best.
fn choose(takes: &[Take], networks: &mut Networks) -> Result<Vec<Shown>, Box<dyn Error>> {
    let neutral = takes[0].motion.frames.iter().position(|f| f.timestamp >= takes[0].motion.neutral.0);
    let mut best = vec![f64::NEG_INFINITY; MOMENTS.len()];
    let mut chosen = vec![("neutral", 0, neutral.unwrap_or(0))];
    chosen.extend(MOMENTS.iter().map(|moment| (moment.0, 0, 0)));
    for (number, take) in takes.iter().enumerate() {
        for (index, frame) in take.performance.frames.iter().enumerate() {
            let Some(landmarks) = &frame.landmarks else { continue };
            let scores = networks.blendshapes.run(landmarks)?;
            for (k, (_, measure)) in MOMENTS.iter().enumerate() {
                let is_sure = take.motion.objections.is_empty() || MOMENTS[k].0.starts_with("gaze");
                let doubt = if is_sure { 0.0 } else { DOUBTFUL };
                let value = measure(&scores) - doubt;
                if value > best[k] {
                    best[k] = value;
                    chosen[k + 1] = (MOMENTS[k].0, number, index);
                }
            }
        }
    }
    Ok(chosen)
}

/// The performer's face, cut from the clip's frame.
fn performer(take: &Take, frame: usize, view: View, size: u32) -> Result<RgbaImage, Box<dyn Error>> {
    let mut source = capture::open(&take.path, FrameRate { numerator: 25, denominator: 1 })?;
    let mut picture = Frame::default();
    for _ in 0..=frame {
        source.read(&mut picture)?;
    }
    let (width, height) = (take.motion.info.width as u32, take.motion.info.height as u32);
    let image =
        RgbaImage::from_raw(width, height, picture.image.to_rgba()?).ok_or("the frame has another size")?;
    let landmarks = take.performance.frames[frame].landmarks.as_ref().ok_or("no face in the frame")?;
    let middle = |indices: &[usize]| {
        indices.iter().map(|&i| landmarks.pixel(i)).sum::<nalgebra::Vector2<f64>>() / indices.len() as f64
    };
    let eyes = middle(&[index::RIGHT_EYE_OUTER, index::LEFT_EYE_OUTER]);
    let mouth = middle(&[index::MOUTH_RIGHT, index::MOUTH_LEFT]);
    let measure = Landmarks::outer_canthal_distance(landmarks);
    let (centre, radius) = match view {
        View::Face => ((eyes + mouth) / 2.0, 1.15 * measure),
        View::Mouth => (mouth, 0.5 * measure),
        View::Eyes => (eyes, 0.62 * measure),
    };
    let left = (centre.x - radius).clamp(0.0, f64::from(width) - 2.0) as u32;
    let top = (centre.y - radius).clamp(0.0, f64::from(height) - 2.0) as u32;
    let side = (2.0 * radius) as u32;
    let cut =
        imageops::crop_imm(&image, left, top, side.min(width - left), side.min(height - top)).to_image();
    Ok(imageops::resize(
        &cut,
        size,
        size * cut.height() / cut.width().max(1),
        imageops::FilterType::CatmullRom,
    ))
}

/// What the camera looks at on a target: scan frame, millimetres.
fn frame_of(target: &Target, view: View) -> (Point3<f64>, f64) {
    let at = |i: usize| target.landmarks[i].unwrap_or_else(Point3::origin);
    let (centre, eyes) = target.centre_and_eyes();
    match view {
        View::Face => (centre, 1.15 * eyes),
        View::Mouth => (nalgebra::center(&at(index::MOUTH_RIGHT), &at(index::MOUTH_LEFT)), 0.45 * eyes),
        View::Eyes => {
            (nalgebra::center(&at(index::RIGHT_EYE_OUTER), &at(index::LEFT_EYE_OUTER)), 0.62 * eyes)
        }
    }
}
