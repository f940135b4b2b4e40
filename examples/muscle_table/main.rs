//! Prints the tables of `docs/benchmarks/muscles.md`.
//!
//! `benches/peers/muscle_takes.py --ict DIR --mocap DIR --landmark-table CSV -o TAKES` writes performances whose
//! contractions are known; then `cargo run --release --example muscle_table -- TAKES --scan james.obj`.

#![allow(clippy::print_stdout, reason = "an example says what it finds")]

mod camera;
mod refinement;
mod rendered;
mod steady;
mod takes;

use std::{error::Error, path::PathBuf};

use clap::Parser;

#[derive(Parser)]
struct Arguments {
    /// What `benches/peers/muscle_takes.py` wrote
    takes: PathBuf,
    /// A scan that acts before a camera, may be given several times; the first is the benchmark's
    #[arg(long = "scan", value_name = "SCAN")]
    scans: Vec<PathBuf>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let entries = takes::index(&arguments.takes)?;
    println!("## From exact landmarks and markers\n\n{}", camera::section(&arguments.takes, &entries)?);
    println!("{}", refinement::report(&arguments.takes)?);
    println!("## Jitter and lag\n\n{}", steady::section(&arguments.takes, &entries)?);
    if !arguments.scans.is_empty() {
        let section = rendered::section(&arguments.takes, &entries, &arguments.scans)?;
        println!("## Through the landmark network\n\n{section}");
    }
    Ok(())
}
