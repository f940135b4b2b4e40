//! Prints the tables of `docs/benchmarks/wire.md`: what clips cost on the wire, and what arrives.
//!
//! `cargo run --release --example wire_table -- clip.mp4 … [--scan james.obj]`; without a scan it is the one that
//! `make setup` brings. Each clip is tracked, brought to 30 frames a second, sent in several ways, and shown on the scan
//! beside the same animation uncoded: distances are those of all the scan's vertices in all frames.

#![allow(clippy::print_stdout, reason = "an example says what it finds")]

mod channel;
mod measure;
#[path = "../shared/stand.rs"]
mod stand;
mod take;

use std::{error::Error, path::PathBuf};

use channel::{Channel, View};
use clap::Parser;
use measure::Measured;
use stand::Stand;

#[derive(Parser)]
struct Arguments {
    /// What is sent
    #[arg(required = true)]
    clips: Vec<PathBuf>,
    /// Where it is shown
    #[arg(long, value_name = "SCAN")]
    scan: Option<PathBuf>,
    /// Steady the clips as a live performer is steadied
    #[arg(long)]
    causal: bool,
    /// Frames that are measured: every n-th
    #[arg(long, default_value_t = 2)]
    every: usize,
}

/// What others take for one face at 30 frames a second, kbit/s of payload.
const OTHERS: [(&str, u32); 3] = [("Live Link Face", 78), ("OpenSeeFace", 428), ("VMC", 628)];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let mut stand = Stand::new(arguments.scan)?;
    let mut takes = Vec::new();
    for clip in &arguments.clips {
        takes.push(take::Take::of(clip, &mut stand, arguments.causal)?);
    }
    let precisions = [30, 60, 100, 200, 300, 500].map(|precision| Channel { precision, ..Channel::DEFAULT });
    let groups = [1, 2, 3, 4, 6].map(|frames| Channel { frames, ..Channel::DEFAULT });
    let losses = [0, 10, 50, 100].map(|loss| Channel { loss, ..Channel::DEFAULT });
    let recorded = losses.map(|channel| Channel { view: View::Recorded, ..channel });
    let channels = [&precisions[..], &groups, &losses, &recorded].concat();
    let mut all: Vec<Vec<Measured>> = Vec::new();
    for take in &takes {
        eprintln!("{}: {} frames", take.name, take.frames.len());
        all.push(measure::measure(take, &stand.target, &channels, arguments.every.max(1))?);
    }
    let names: Vec<&str> = takes.iter().map(|take| take.name.as_str()).collect();
    let section = |from: usize, count: usize| -> Vec<Vec<Measured>> {
        all.iter().map(|rows| rows[from..from + count].to_vec()).collect()
    };
    println!("## Rate and error\n");
    print!(
        "{}",
        measure::table(&names, &section(0, precisions.len()), "precision, mm", |channel| {
            format!("{:.2}", f64::from(channel.precision) / 1000.0)
        })
    );
    println!("\nOthers, payload at 30 frames a second, kbit/s:");
    for (name, rate) in OTHERS {
        println!("{name} {rate}");
    }
    println!("\n## Frames in a packet\n");
    print!(
        "{}",
        measure::table(&names, &section(precisions.len(), groups.len()), "frames", |channel| {
            channel.frames.to_string()
        })
    );
    println!("\n## Loss, shown as it arrives\n");
    let loss = |channel: &Channel| format!("{} %", channel.loss / 10);
    print!(
        "{}",
        measure::table(&names, &section(precisions.len() + groups.len(), losses.len()), "loss", loss)
    );
    println!("\n## Loss, shown when all has arrived\n");
    let from = precisions.len() + groups.len() + losses.len();
    print!("{}", measure::table(&names, &section(from, recorded.len()), "loss", loss));
    Ok(())
}
