//! How volume morphing does from 18 points (002 §IV), measured and pictured:
//! `cargo run --release --example volume_table -- -o volume.jpg`.
//!
//! A scan is driven by clips. At landmarks that are no centres of the morph, what the skin does is compared with what the
//! performer's landmark asks of it, in the picture's plane. `docs/benchmarks/volume.md` holds the tables.

#![allow(clippy::print_stdout, reason = "an example says what it finds")]

mod measure;
mod picture;
#[path = "../shared/stand.rs"]
mod stand;

use std::{error::Error, path::PathBuf};

use clap::Parser;
use measure::{Figures, HeldOut, PARTS, edge, noise};
use stand::{Stand, Take};
use understudy::{
    actions::ActionLibrary,
    pipeline::{SolveOptions, Target},
    rig::{DriveMode, Method, Rig, TargetFace, VolumeMorph, VolumePoints},
    spline::Kernel,
};

/// The set-up's clips.
const CLIPS: [&str; 3] = ["cap13", "cap12", "carphone"];
/// One frame in so many is measured.
const EVERY: usize = 3;

#[derive(Parser)]
struct Arguments {
    /// A clip of a performer, may be given several times; the set-up's clips if not given. The first is pictured
    #[arg(long = "clip", value_name = "CLIP")]
    clips: Vec<PathBuf>,
    /// The scan to be driven; the set-up's if not given
    #[arg(long, value_name = "SCAN")]
    scan: Option<PathBuf>,
    /// Seconds of the first clip to picture, may be given several times
    #[arg(long = "at", value_name = "SECONDS", default_values_t = [0.5, 2.88, 18.6, 11.84])]
    moments: Vec<f64>,
    /// Degrees from which the scan is seen, from the subject's left if positive
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    yaw: f64,
    /// A picture of the performer, Hardy, Gaussian and the default drive
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// A way to drive the scan, by its name in the table.
type Way = (&'static str, DriveMode);

fn ways() -> Vec<Way> {
    let published = VolumeMorph::default();
    let hardy =
        |lambda: f64, stiffness: f64| DriveMode::Volume(VolumeMorph { lambda, stiffness, ..published });
    let gaussian = |lambda: f64, stiffness: f64| {
        DriveMode::Volume(VolumeMorph { kernel: Kernel::Gaussian, lambda, stiffness, ..published })
    };
    let all =
        |points: VolumePoints, lambda: f64| DriveMode::Volume(VolumeMorph { points, lambda, ..published });
    vec![
        ("Hardy, 18, λ 0.01, as published", hardy(0.01, 1.0)),
        ("Hardy, 18, λ 0", hardy(0.0, 1.0)),
        ("Hardy, 18, λ 0.001", hardy(0.001, 1.0)),
        ("Hardy, 18, λ 0.1", hardy(0.1, 1.0)),
        ("Hardy, 18, λ 0.01, stiffness × 0.25", hardy(0.01, 0.25)),
        ("Hardy, 18, λ 0.01, stiffness × 2", hardy(0.01, 2.0)),
        ("Gaussian, 18, λ 0.01", gaussian(0.01, 1.0)),
        ("Gaussian, 18, λ 0.1", gaussian(0.1, 1.0)),
        ("Gaussian, 18, λ 0.01, stiffness × 2", gaussian(0.01, 2.0)),
        ("Gaussian, 18, λ 0.1, stiffness × 2", gaussian(0.1, 2.0)),
        ("Gaussian, 18, λ 0.01, stiffness × 3", gaussian(0.01, 3.0)),
        ("Hardy, 68, λ 0.01", all(VolumePoints::Ibug, 0.01)),
        ("Hardy, 68, λ 0.001", all(VolumePoints::Ibug, 0.001)),
        ("Hardy, 468*, λ 0.01", all(VolumePoints::All, 0.01)),
        ("Hardy, 468*, λ 0", all(VolumePoints::All, 0.0)),
        ("--drive landmarks*", DriveMode::Landmarks),
    ]
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let mut stand = Stand::new(arguments.scan)?;
    let clips = stand.clips(arguments.clips, &CLIPS)?;
    for (number, clip) in clips.iter().enumerate() {
        let take = stand.solve(clip, &SolveOptions::default())?;
        let Stand { gpu, networks, target, .. } = &mut stand;
        let (face, _) = target.level_with(take.motion.performer.rest_landmarks(), &mut networks.tracker)?;
        report(&take, target, &face)?;
        if let (0, Some(output)) = (number, &arguments.output) {
            let modes = [
                ("Hardy, 18 points", ways()[0].1),
                ("Gaussian, 18 points", ways()[6].1),
                ("Gaussian, stiffness x 3", ways()[10].1),
                ("--drive landmarks", DriveMode::Landmarks),
            ];
            picture::draw(output, gpu, &take, target, &face, &modes, (&arguments.moments, arguments.yaw))?;
            println!("wrote {}\n", output.display());
        }
    }
    Ok(())
}

/// Ties performer and target in one way.
fn rig(take: &Take, target: &Target, face: &TargetFace, mode: DriveMode) -> Result<Rig, Box<dyn Error>> {
    let (library, performer) = (ActionLibrary::built_in(), &take.motion.performer);
    let (anatomy, surface) = (&target.anatomy, &target.surface);
    Ok(Rig::driven_by(mode, library, performer, face, anatomy, surface, Method::default())?)
}

fn report(take: &Take, target: &Target, face: &TargetFace) -> Result<(), Box<dyn Error>> {
    let held_out = HeldOut::new(take, target, face)?;
    let parts = PARTS.map(|part| part.0).join(" | ");
    println!("{} on {}, {} landmarks that are no centres:\n", take.name, target.scan.name, held_out.count());
    println!("| | error, mm | {parts} | kept at centres | kept | of subtle motion | noise | edge, mm |");
    println!("|---|{}", "---:|".repeat(PARTS.len() + 6));
    let still = Figures::of(&held_out, take, None)?;
    println!("| nothing moves | {} | 0.00 | 0.00 | 0.00 | | |", still.errors());
    for (name, mode) in ways() {
        let rig = rig(take, target, face, mode)?;
        let figures = Figures::of(&held_out, take, Some(&rig))?;
        let noise = match mode {
            DriveMode::Volume(_) => format!("{:.2}", noise(&held_out, &rig)),
            _ => String::new(),
        };
        println!(
            "| {name} | {} | {:.2} | {:.2} | {:.2} | {noise} | {:.2} |",
            figures.errors(),
            figures.kept_at_centres(),
            figures.kept(),
            figures.kept_of_subtle(),
            edge(take, target, face, &rig)?
        );
    }
    println!();
    Ok(())
}
