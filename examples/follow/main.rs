//! How well the avatar's geometry follows the performer: `cargo run --release --example follow -- -o plots`.
//!
//! A scan is driven by clips, and what its vertices do is compared with what the performer's landmarks did: once with
//! the landmarks as the network gave them, once as they were steadied for the avatar. Prints correlations and gains (the
//! slope of the avatar's curve over the performer's), and draws the curves. With `--film` the avatar's film is tracked
//! again, as `tests/e2e_animate.rs` does.

#![allow(clippy::print_stdout, reason = "an example says what it finds")]

mod avatar;
#[path = "../../tests/common/curves.rs"]
#[allow(dead_code, missing_docs, reason = "the tests' own")]
mod curves;
mod film;
mod plot;
mod readings;
#[path = "../shared/stand.rs"]
mod stand;

use std::{error::Error, fmt::Write as _, path::PathBuf};

use avatar::Follower;
use clap::Parser;
use curves::{Following, following};
use readings::{MEASURES, Reader, Reading, seen};
use stand::{Stand, Take};
use understudy::{
    actions::ActionLibrary,
    pipeline::{Animation, HeadMode, LiftMode, SolveOptions},
    rig::{DriveMode, Method, Rig, VolumeMorph},
};

/// The set-up's clips.
const CLIPS: [&str; 3] = ["cap13", "cap12", "carphone"];

#[derive(Parser)]
struct Arguments {
    /// A clip of a performer, may be given several times; the set-up's clips if not given
    #[arg(long = "clip", value_name = "CLIP")]
    clips: Vec<PathBuf>,
    /// The scan to be driven; the set-up's if not given
    #[arg(long, value_name = "SCAN")]
    scan: Option<PathBuf>,
    /// A folder for pictures of the curves
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Film the avatar and track it again
    #[arg(long)]
    film: bool,
    /// Lift by the picture's plane in place of the muscles
    #[arg(long)]
    plane: bool,
    /// Drive by volume morphing from 18 points in place of all landmarks, with this λ
    #[arg(long, value_name = "LAMBDA", num_args = 0..=1, default_missing_value = "0.01")]
    volume: Option<f64>,
}

/// A curve of fewer values says nothing.
const FEWEST: usize = 10;

/// Which of the performer's curves lead.
type Leader = fn(&Curves) -> &[Reading];

/// What both faces do in every frame.
struct Curves {
    seconds: Vec<f64>,
    tracked: Vec<Reading>,
    told: Vec<Reading>,
    avatar: Vec<Reading>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let mut stand = Stand::new(arguments.scan)?;
    let clips = stand.clips(arguments.clips, &CLIPS)?;
    for omission in &stand.target.anatomy.omissions {
        println!("{}: {omission}\n", stand.target.scan.name);
    }
    let lift = if arguments.plane { LiftMode::Plane } else { LiftMode::default() };
    let solving = SolveOptions { lift, ..SolveOptions::default() };
    let mut compared = Vec::new();
    let mut films = Vec::new();
    for clip in &clips {
        let take = stand.solve(clip, &solving)?;
        let Stand { assets, gpu, networks, target } = &mut stand;
        let (face, _) = target.level_with(take.motion.performer.rest_landmarks(), &mut networks.tracker)?;
        let mode = arguments.volume.map_or(DriveMode::Landmarks, |lambda| {
            DriveMode::Volume(VolumeMorph { lambda, ..VolumeMorph::default() })
        });
        let (library, performer) = (ActionLibrary::built_in(), &take.motion.performer);
        let (anatomy, surface) = (&target.anatomy, &target.surface);
        let rig = Rig::driven_by(mode, library, performer, &face, anatomy, surface, Method::default())?;
        let follower = Follower::new(&face, &target.anatomy)?;
        let curves = compare(&take, &rig, &follower)?;
        if let Some(folder) = &arguments.output {
            std::fs::create_dir_all(folder)?;
            plot::draw(
                &folder.join(format!("follow-{}.svg", take.name)),
                &take.name,
                &target.scan.name,
                &curves,
            )?;
        }
        if arguments.film {
            let animation =
                Animation { motion: &take.motion, target, rig: &rig, head: HeadMode::Follow, skin: None };
            films.push(film::track_again(&take, &animation, &face.level, gpu, assets, networks)?);
        }
        compared.push((take.name, curves));
    }
    report(&stand.target.scan.name, &compared);
    if !films.is_empty() {
        println!("The avatar's film, tracked again, against the clip:\n");
        let names = compared.iter().map(|(name, _)| name.as_str());
        let measures = curves::MEASURES.map(|measure| measure.name);
        println!("{}", table(names, &measures, |row, clip| Some(films[clip][row])));
    }
    Ok(())
}

fn report(scan: &str, compared: &[(String, Curves)]) {
    println!("Correlation and gain of {scan}'s vertices against the performer's landmarks.\n");
    let leaders: [(&str, Leader); 2] = [
        ("as tracked", |curves| &curves.tracked),
        ("steadied, as the rig is given them", |curves| &curves.told),
    ];
    for (what, leader) in leaders {
        let cell = |row: usize, clip: usize| {
            let curves = &compared[clip].1;
            let curve =
                |readings: &[Reading]| readings.iter().map(|reading| reading[row]).collect::<Vec<_>>();
            let (leader, avatar) = (curve(leader(curves)), curve(&curves.avatar));
            let known = leader.iter().zip(&avatar).filter(|(a, b)| a.is_finite() && b.is_finite()).count();
            (known > FEWEST).then(|| following(&leader, &avatar))
        };
        let names = compared.iter().map(|(name, _)| name.as_str());
        println!("Landmarks {what}:\n\n{}", table(names, &MEASURES.map(|measure| measure.name), cell));
    }
}

/// Poses the avatar in every frame and reads both faces.
fn compare(take: &Take, rig: &Rig, follower: &Follower) -> Result<Curves, Box<dyn Error>> {
    let frames = seen(&take.motion, &take.performance)?;
    let reader = Reader::new(&take.motion, &frames, follower.proportions().mouth);
    let mut posed = rig.new_frame();
    let mut curves =
        Curves { seconds: Vec::new(), tracked: Vec::new(), told: Vec::new(), avatar: Vec::new() };
    for (frame, seen) in take.motion.frames.iter().zip(&frames) {
        rig.pose(&frame.expression, &mut posed)?;
        curves.seconds.push(frame.timestamp.seconds());
        curves.tracked.push(seen.as_ref().map_or([f64::NAN; MEASURES.len()], |seen| reader.as_tracked(seen)));
        curves.told.push(reader.as_told(&frame.expression));
        // Lids and gaze are read in the head's own frame; for the rest the camera moves about it as about the performer.
        let scale = follower.proportions().eyes / reader.eyes();
        curves.avatar.push(follower.read(&posed, &reader.lens(&frame.expression.pose).scaled(scale)));
    }
    Ok(curves)
}

/// Measures by clips.
fn table<'a>(
    clips: impl Iterator<Item = &'a str>,
    measures: &[&str],
    cell: impl Fn(usize, usize) -> Option<Following>,
) -> String {
    let clips: Vec<&str> = clips.collect();
    let mut text = format!("| | {} |\n|---|{}\n", clips.join(" | "), "---:|".repeat(clips.len()));
    for (row, measure) in measures.iter().enumerate() {
        let cells = (0..clips.len()).map(|clip| {
            let found = cell(row, clip);
            found.map_or_else(String::new, |found| format!("{:.3}, {:.2}", found.correlation, found.gain))
        });
        let _ = writeln!(text, "| {measure} | {} |", cells.collect::<Vec<_>>().join(" | "));
    }
    text
}
