//! Prints the section "Classification" of `docs/benchmarks/appearance.md`.
//!
//! `cargo run --release --example appearance_table -- clip.mp4 other.mp4 --labels tests/reference/appearance_labels.csv
//! --edits DIR`; `DIR/clip.toml`, where there is one, names exemplars as `learn-appearance --edit` takes them.

#![allow(clippy::print_stdout, reason = "an example says what it finds")]

mod score;

use std::{
    collections::BTreeMap,
    error::Error,
    path::{Path, PathBuf},
};

use clap::Parser;
use score::{Labels, Row, Truth};
use understudy::{
    appearance::{CLOSED_LID, FaceFrame, Region, Skin, lid_state},
    assets::Assets,
    capture::{self, FrameRate},
    lift::Side,
    pipeline::{
        Motion, Networks, Performance, SolveOptions, Stopwatch, TakeLooks, learn_skin, observe,
        read_canonical_face, read_choices, read_face_frame,
    },
    tracking::TrackerOptions,
};

#[derive(Parser)]
struct Arguments {
    /// Clips with labels
    clips: Vec<PathBuf>,
    /// clip,frame,region,state: 0, 0.5, 1, or x where it cannot be seen
    #[arg(long)]
    labels: PathBuf,
    /// Exemplars chosen by hand
    #[arg(long)]
    edits: Option<PathBuf>,
}

/// Closure from which the aperture alone says that an eye is shut.
const SHUT: f32 = 0.8;
/// State from which the look alone says so; the open eye is often like the template between.
const SHUT_LOOK: f32 = 0.6;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let labels = score::read(&arguments.labels)?;
    let assets = Assets::locate()?;
    let frame = read_face_frame(&assets.verified("canonical_face")?)?;
    let mut networks = Networks::load(&assets, TrackerOptions::default())?;
    let mut lids: BTreeMap<&str, Row> = BTreeMap::new();
    let mut wrinkles = Vec::new();
    println!("| clip | region | layers | shown | told | precision | recall | F1 | absent |");
    println!("|---|---|---:|---:|---:|---:|---:|---:|---:|");
    for clip in &arguments.clips {
        let name = clip.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let motion = solve(clip, &assets, &mut networks)?;
        let (skin, missing) = learn(clip, &motion, &frame, arguments.edits.as_deref())?;
        report(&name, clip, &motion, &frame, &skin, &labels, (&mut lids, &mut wrinkles))?;
        for missing in missing {
            println!("| {name} | not {missing} | | | | | | | |");
        }
    }
    println!("\n| witness | precision | recall | F1 |\n|---|---:|---:|---:|");
    for (witness, row) in &lids {
        println!("| {witness} | {:.2} | {:.2} | {:.3} |", row.precision(), row.recall(), row.f1());
    }
    let total = wrinkles.iter().fold(Row::default(), Row::with);
    println!("\nAll wrinkles together: F1 {:.2}.", total.f1());
    Ok(())
}

fn rate() -> FrameRate {
    FrameRate { numerator: 25, denominator: 1 }
}

fn solve(clip: &Path, assets: &Assets, networks: &mut Networks) -> Result<Motion, Box<dyn Error>> {
    let mut watch = Stopwatch::default();
    let source = capture::open(clip, rate())?;
    let performance = Performance::track(source, &mut networks.tracker, 2, &mut watch, |_| {})?;
    let face = read_canonical_face(&assets.verified("canonical_face")?)?;
    Ok(Motion::solve(&performance, &face, &mut networks.blendshapes, &SolveOptions::default())?)
}

fn learn(
    clip: &Path,
    motion: &Motion,
    frame: &FaceFrame,
    edits: Option<&Path>,
) -> Result<(Skin, Vec<String>), Box<dyn Error>> {
    let looks = TakeLooks::gather(0, capture::open(clip, rate())?, motion.clone(), frame, |_| {})?;
    let edit = edits.map(|folder| folder.join(clip.with_extension("toml").file_name().unwrap_or_default()));
    let choices =
        edit.filter(|path| path.is_file()).map(|path| read_choices(&path)).transpose()?.unwrap_or_default();
    let open = |_: usize| capture::open(clip, rate());
    let learnt = learn_skin(String::new(), &[looks], frame, &choices, open, |_| {})?;
    Ok((learnt.skin, learnt.missing.iter().map(ToString::to_string).collect()))
}

/// Scores every labelled region; frames around those that were learnt are left out.
fn report(
    name: &str,
    clip: &Path,
    motion: &Motion,
    frame: &FaceFrame,
    skin: &Skin,
    labels: &Labels,
    (lids, wrinkles): (&mut BTreeMap<&'static str, Row>, &mut Vec<Row>),
) -> Result<(), Box<dyn Error>> {
    let shown = observe(capture::open(clip, rate())?, motion, frame, true, |observed| {
        let eyes = observed.motion.expression.eyes;
        (skin.classify(&observed.samples), [Side::Right, Side::Left].map(|side| eyes.of(side).closure as f32))
    })?;
    for learnt in skin.regions() {
        let region = learnt.volume.region();
        let near = |number: u64| {
            learnt.exemplars.iter().any(|e| e.frames.iter().any(|&frame| frame.abs_diff(number) <= 1))
        };
        let (mut row, mut absent) = (Row::default(), 0);
        for (number, (states, closures)) in (0..).zip(&shown) {
            let Some(truth) = labels.get(&(name.to_owned(), number, region)) else { continue };
            if near(number) {
                continue;
            }
            let closed = match truth {
                Truth::Unseen | Truth::Between => continue,
                Truth::Rest => false,
                Truth::Shown => true,
            };
            let Some(state) = states.get(region) else {
                absent += 1;
                continue;
            };
            if region.is_eye() {
                let aperture = closures[usize::from(region == Region::EyeLeft)];
                let both = lid_state(aperture, state);
                lids.entry("aperture alone").or_default().count(aperture > SHUT, closed);
                lids.entry("look alone").or_default().count(state > SHUT_LOOK, closed);
                lids.entry("together").or_default().count(both >= CLOSED_LID, closed);
                row.count(both >= CLOSED_LID, closed);
            } else {
                row.count(state > 0.5, closed);
            }
        }
        if row.positives() == 0 {
            continue;
        }
        if !region.is_eye() {
            wrinkles.push(row);
        }
        println!(
            "| {name} | {} | {} | {} of {} | {} | {:.2} | {:.2} | {:.2} | {absent} |",
            region.name(),
            learnt.volume.layers().len(),
            row.positives(),
            row.total(),
            row.told(),
            row.precision(),
            row.recall(),
            row.f1()
        );
    }
    Ok(())
}
