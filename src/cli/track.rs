//! `understudy track`: the performer's motion alone.

use std::path::{Path, PathBuf};

use clap::Args;
use understudy::{
    actions::ActionLibrary,
    appearance::Skin,
    assets::Assets,
    export::{Draft, write_appearance_csv},
    pipeline::{read_face_frame, write_motion},
};

use super::{
    Outcome,
    clip::ClipArgs,
    curve_files::{self, CurveFile, EditArgs},
    inputs,
    skin::classify,
};

const EXAMPLES: &str = "\
Examples:
  understudy track clip.mp4 -o motion.csv
  understudy track clip.mp4 -o raw.csv --raw
  understudy track clip.mp4 -o motion.csv -o take.muscles.csv -o take.livelink.csv
  understudy track clip.mp4 --skin me.skin -o take.appearance.csv
  understudy track frames/ --fps 30000/1001 --neutral 0.5..1.5 -o motion.csv

Outputs:
  .muscles.csv   the contraction of every muscle of --basis: `express --play`, `plot`
  .appearance.csv  wrinkles and lids as --skin knows them, 0 neutral to 1; empty where they cannot be told
  .livelink.csv  ARKit's 52 shapes as Live Link Face records them: any ARKit-ready character
  .csv           head pose, landmarks and action units in OpenFace's columns";

/// Track a performer: head pose, 478 landmarks and contractions of muscles in every frame as tables
///
/// The columns of motion are OpenFace's. Landmarks are in pixels of the clip, head pose in millimetres and radians of the
/// camera's frame. docs/formats.md describes them.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Track {
    #[command(flatten)]
    clip: ClipArgs,
    /// The performer's skin, from `learn-appearance`: tells the state of wrinkles and lids
    #[arg(long, value_name = "FILE.skin")]
    skin: Option<PathBuf>,
    /// What to write, by extension: .csv, .muscles.csv, .livelink.csv, .appearance.csv; may be given several times
    #[arg(short, long, value_name = "FILE.csv", required = true)]
    output: Vec<PathBuf>,
    /// Write the landmarks as the network gives them: nothing repaired, nothing smoothed
    #[arg(long)]
    raw: bool,
    #[command(flatten)]
    edits: EditArgs,
}

impl Track {
    pub fn run(&self, quiet: bool) -> Outcome {
        let edits = self.edits.read()?;
        let mut outputs: Vec<(Option<CurveFile>, &PathBuf)> = Vec::new();
        let read = [Some(self.clip.clip.as_path()), self.edits.edit.as_deref(), self.skin.as_deref()];
        let read: Vec<&Path> = read.into_iter().flatten().collect();
        let (states, others): (Vec<&PathBuf>, Vec<&PathBuf>) =
            self.output.iter().partition(|path| path.to_string_lossy().ends_with(".appearance.csv"));
        let skin = match &self.skin {
            Some(path) if states.is_empty() => {
                let path = path.display();
                return Err(format!("{path} tells of wrinkles: write .appearance.csv with --skin").into());
            }
            Some(path) => Some(Skin::read(path)?),
            None if states.is_empty() => None,
            None => return Err("--skin names the skin by which .appearance.csv is told".into()),
        };
        for path in &others {
            outputs.push((CurveFile::of(path), path));
        }
        for path in &self.output {
            inputs::spare(path, &read)?;
            drop(Draft::create(path)?);
        }
        let files: Vec<CurveFile> = outputs.iter().filter_map(|(file, _)| *file).collect();
        if files.is_empty() && edits.is_some() {
            return Err("--edit changes contractions: write .muscles.csv or .livelink.csv with it".into());
        }
        drop(self.clip.open()?);
        let assets = Assets::locate()?;
        let mut networks = ClipArgs::networks(&assets)?;
        let lift = self.clip.lift(&mut networks)?;
        curve_files::check(&lift, false, &files, &self.edits, edits.as_ref())?;
        let mut take = self.clip.solve(&assets, networks, lift, quiet)?;
        // The performer's own motion comes first: edited curves change what the take shows.
        outputs.sort_by_key(|(file, _)| file.is_some());
        if let Some(skin) = &skin {
            let frame = read_face_frame(&assets.verified("canonical_face")?)?;
            let frames = classify(&self.clip, &mut take, skin, &frame, quiet)?;
            for path in states {
                write_appearance_csv(path, &frames)?;
            }
        }
        let mut curves = None;
        for (file, path) in outputs {
            let motion = &mut take.motion;
            let Some(file) = file else {
                let raw = self.raw.then_some(&take.performance);
                take.watch.time("write", || write_motion(path, motion, ActionLibrary::built_in(), raw))?;
                continue;
            };
            let curves = match &mut curves {
                Some(curves) => &*curves,
                unset @ None => unset.insert(self.edits.follow(edits.as_ref(), motion)?),
            };
            take.watch.time("write", || file.write(path, motion, curves))?;
        }
        if !quiet {
            for path in &self.output {
                say!("wrote {}", path.display());
            }
        }
        if self.clip.timings {
            say!("{}", take.watch);
        }
        Ok(())
    }
}
