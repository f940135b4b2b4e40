//! `understudy track`: the performer's motion alone.

use std::path::PathBuf;

use clap::Args;
use understudy::{assets::Assets, pipeline::write_motion};

use super::{Outcome, clip::ClipArgs, inputs};

const EXAMPLES: &str = "\
Examples:
  understudy track clip.mp4 -o motion.csv
  understudy track clip.mp4 -o raw.csv --raw
  understudy track frames/ --fps 30000/1001 --neutral 0.5..1.5 -o motion.csv";

/// Track a performer: head pose and 478 landmarks of every frame as a table
///
/// The columns are OpenFace's. Landmarks are in pixels of the clip, head pose in millimetres and radians of the
/// camera's frame. docs/formats.md describes them.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Track {
    #[command(flatten)]
    clip: ClipArgs,
    /// Where to write the table
    #[arg(short, long, value_name = "FILE.csv")]
    output: PathBuf,
    /// Write the landmarks as the network gives them: nothing repaired, nothing smoothed
    #[arg(long)]
    raw: bool,
}

impl Track {
    pub fn run(&self, quiet: bool) -> Outcome {
        inputs::spare(&self.output, &[&self.clip.clip])?;
        drop(self.clip.open()?);
        let assets = Assets::locate()?;
        let networks = ClipArgs::networks(&assets)?;
        let mut take = self.clip.solve(&assets, networks, quiet)?;
        let raw = self.raw.then_some(&take.performance);
        take.watch.time("write", || write_motion(&self.output, &take.motion, raw))?;
        if !quiet {
            say!("wrote {}", self.output.display());
        }
        if self.clip.timings {
            say!("{}", take.watch);
        }
        Ok(())
    }
}
