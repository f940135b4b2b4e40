//! Prints the section "Ratio transfer" of `docs/benchmarks/appearance.md`.
//!
//! `cargo run --release --example ratio_table -- PHOTOS --tuned 001,018,037,070 --picture ratio.jpg`, where PHOTOS holds
//! `<person>_neutral.jpg` and `<person>_smiling.jpg`, such as the Face Research Lab London Set.

#![allow(clippy::print_stdout, reason = "an example says what it finds")]

mod people;
mod picture;
mod score;

use std::{error::Error, path::PathBuf};

use clap::Parser;
use people::Person;
use score::Scale;
use understudy::{
    appearance::{FaceFrame, RatioFilter, RatioOptions},
    assets::Assets,
    pipeline::{Networks, canonical_skin, read_canonical_face},
    tracking::TrackerOptions,
};

#[derive(Parser)]
struct Arguments {
    /// Folder of photographs, two for each person
    photos: PathBuf,
    /// People on whom the settings were chosen; the others are reported apart
    #[arg(long, value_delimiter = ',')]
    tuned: Vec<String>,
    /// A sheet of three pairs, a .jpg
    #[arg(long, value_name = "FILE.jpg")]
    picture: Option<PathBuf>,
    /// Who gives and who takes in the sheet
    #[arg(long, value_delimiter = ',', default_value = "009:027,070:001,037:070")]
    pairs: Vec<String>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let assets = Assets::locate()?;
    let canonical = assets.verified("canonical_face")?;
    let face = read_canonical_face(&canonical)?;
    let frame = FaceFrame::new(&face, canonical_skin(&canonical, &face)?.triangles())
        .ok_or("the canonical face is no face; run `make setup`")?;
    let mut networks = Networks::load(&assets, TrackerOptions::default())?;
    let people = people::read(&arguments.photos, &mut networks, &frame)?;
    let filter = RatioFilter::new(&frame, RatioOptions::default());
    if let Some(path) = &arguments.picture {
        picture::write(path, &arguments.pairs, &people, &frame, &filter)?;
    }
    let (tuned, others): (Vec<&Person>, Vec<&Person>) =
        people.iter().partition(|person| arguments.tuned.contains(&person.name));
    let all: Vec<&Person> = people.iter().collect();
    let scale = Scale::new(&frame, &filter);
    print!(
        "{}",
        score::report(&scale, &frame, &[("held out", &others), ("tuned on", &tuned), ("all", &all)])
    );
    Ok(())
}
