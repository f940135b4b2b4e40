//! `understudy express`: action units in, an expression of the scan out.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use understudy::{
    actions::{ActionWeights, Merge, Score},
    assets::Assets,
    capture::FrameRate,
    export::Draft,
    pipeline::{ActionTake, HeadMode, Networks, Playing, Stage, Target},
    rig::{ActionRig, TargetFace, WarpKind, facing},
    tracking::TrackerOptions,
    view::{Gpu, Look, Smoothing, save_png},
};

use super::{
    Outcome, inputs,
    method::{MethodArgs, library},
    progress,
    target::{ScanArgs, parse_size, report, report_anatomy},
};

const EXAMPLES: &str = "\
Examples:
  understudy express --target scan.obj --au 12=0.8 --au 4L=0.5 -o smirk.png -o smirk.obj
  understudy express --target scan.obj --emotion happiness -o happy.mp4 -o happy.glb
  understudy express --target scan.obj --play keys.csv -o scene.mp4
  understudy express --target scan.obj --play openface.csv --from mine.json -o scene.mp4
  understudy express --target scan.obj --au 4 --preset thesis -o as-published.png

Magnitudes go from 0, the neutral, to 1. 12L and 12R are the subject's left and right side, 12 is both.
Emotions: anger, disgust, fear, happiness, sadness, surprise; sadness=0.5 is half of it.
Keys are rows of `time,au,magnitude` in seconds; tables are OpenFace's, with `timestamp` and AU01_r … from 0 to 5.

Outputs:
  .png  a picture; of keys, a sheet of moments
  .obj  the expression, the scan's own vertices first and in their order; of keys, their last moment
  .mp4  a film: an expression comes, stays and goes; keys play once
  .glb  the same as morph targets: Blender, Unreal, three.js
  .pc2  every vertex of every frame: Blender's Mesh Cache modifier";

/// Show facial action units on a scan
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Express {
    /// The scan: .obj, .ply, .stl, .glb or .gltf
    #[arg(short, long, value_name = "SCAN")]
    target: PathBuf,
    #[command(flatten)]
    scan: ScanArgs,
    /// An action unit and its magnitude; may be given several times
    #[arg(long, value_name = "UNIT=MAGNITUDE")]
    au: Vec<String>,
    /// An emotion as its set of action units; may be given several times
    #[arg(long, value_name = "NAME[=MAGNITUDE]")]
    emotion: Vec<String>,
    /// Keys or a table of action units over time
    #[arg(long, value_name = "FILE", conflicts_with_all = ["au", "emotion"])]
    play: Option<PathBuf>,
    /// A library of action units, written by `author`, in place of the built-in one
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
    /// What to write, by extension: .png, .obj, .mp4, .glb, .pc2; may be given several times
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// How several action units act on the same skin
    #[arg(long, value_enum, default_value_t = MergeArg::Parallel)]
    merge: MergeArg,
    #[command(flatten)]
    method: MethodArgs,
    /// Leave lips and eyes as they were scanned; outputs then have the scan's own mesh
    #[arg(long)]
    as_scanned: bool,
    /// Frames a second of films and motions
    #[arg(long, default_value_t = 30.0, value_parser = parse_rate)]
    fps: f64,
    /// Width and height of pictures, even numbers
    #[arg(long, value_name = "WxH", default_value = "720x720", value_parser = parse_size)]
    size: [u32; 2],
}

#[derive(Clone, Copy, ValueEnum)]
enum MergeArg {
    /// As muscles in parallel: two that pull one way do not pull twice as far
    Parallel,
    /// Added up, as blend shapes are
    Sum,
}

#[derive(Clone, Copy)]
enum Kind {
    Png,
    Obj,
    Mp4,
    Glb,
    Pc2,
}

fn parse_rate(text: &str) -> Result<f64, String> {
    let rate: Option<f64> = text.parse().ok().filter(|rate| (1.0..=240.0).contains(rate));
    rate.ok_or_else(|| "write a number from 1 to 240".to_owned())
}

impl Kind {
    fn of(path: &Path) -> Result<Self, String> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("obj") => Ok(Self::Obj),
            Some("mp4") => Ok(Self::Mp4),
            Some("glb") => Ok(Self::Glb),
            Some("pc2") => Ok(Self::Pc2),
            _ => Err(format!("cannot write {}: name it .png, .obj, .mp4, .glb or .pc2", path.display())),
        }
    }
}

impl Express {
    pub fn run(&self, quiet: bool) -> Outcome {
        let outputs = self.outputs()?;
        let playing = self.playing()?;
        let library = library(self.from.as_deref())?;
        for key in playing.actions() {
            library.get(key)?;
        }
        let method = self.method.method();
        let assets = Assets::locate()?;
        let gpu = Gpu::headless()?;
        let mut networks = Networks::load(&assets, TrackerOptions::default())?;
        let mut target = Target::load(&self.target, &self.scan.options(), &gpu, &mut networks.tracker)?;
        if !self.as_scanned && method.warp != WarpKind::Regions {
            target.prepare(&gpu)?;
            report_anatomy(&target);
        }
        if !quiet {
            report(&target);
        }
        let face = TargetFace::new(target.landmarks.clone(), facing(&library.face, &target.landmarks))?;
        let merge = match self.merge {
            MergeArg::Parallel => Merge::Parallel,
            MergeArg::Sum => Merge::Sum,
        };
        let rig = ActionRig::new(&library, &face, &target.anatomy, &target.surface, method, merge)?;
        let last = match &playing {
            Playing::Expression(weights) => weights.clone(),
            Playing::Score(score) => score.at(score.end()),
        };
        let rate = FrameRate::nearest(self.fps);
        let take = ActionTake { target: &target, rig: &rig, playing: &playing, rate };
        let frames = playing.times(rate).len() as u64;
        let stage = |smoothing| {
            Stage::new(&gpu, &target, &face.level, self.size, Look::default(), HeadMode::Still, smoothing)
        };
        for (kind, path) in outputs {
            let mut note = String::new();
            match kind {
                Kind::Png => save_png(path, &take.picture(&mut stage(Smoothing::Samples4)?)?)?,
                Kind::Obj => take.write_obj(path, &last)?,
                Kind::Glb => {
                    let report = take.write_glb(path)?;
                    note = format!(" ({} morph targets, {:.3} mm RMS)", report.morphs, report.rms);
                }
                Kind::Pc2 => {
                    let bar = progress::bar("caching", Some(frames), quiet);
                    take.write_pc2(path, |done| bar.set_position(done))?;
                    bar.finish_and_clear();
                }
                Kind::Mp4 => {
                    let bar = progress::bar("drawing", Some(frames), quiet);
                    take.write_mp4(path, &mut stage(Smoothing::Edges)?, |done| bar.set_position(done))?;
                    bar.finish_and_clear();
                }
            }
            if !quiet {
                say!("wrote {}{note}", path.display());
            }
        }
        Ok(())
    }

    /// What is to be shown; without anything, the neutral.
    fn playing(&self) -> Result<Playing, Box<dyn std::error::Error>> {
        if let Some(path) = &self.play {
            let score = Score::read(path)?;
            if !score.ignored().is_empty() {
                tracing::warn!(
                    "{}: {} cannot be shown by a surface and are left out",
                    path.display(),
                    score.ignored().join(", ")
                );
            }
            return Ok(Playing::Score(score));
        }
        let mut weights = ActionWeights::default();
        for text in &self.emotion {
            weights.set_emotion(text)?;
        }
        for text in &self.au {
            weights.set_text(text)?;
        }
        Ok(Playing::Expression(weights))
    }

    /// What to write where; places that cannot be written to are refused before any work is done.
    fn outputs(&self) -> Result<Vec<(Kind, &PathBuf)>, Box<dyn std::error::Error>> {
        let mut outputs = Vec::new();
        let read: Vec<&PathBuf> =
            [Some(&self.target), self.play.as_ref(), self.from.as_ref()].into_iter().flatten().collect();
        for path in &self.output {
            outputs.push((Kind::of(path)?, path));
            let read: Vec<&Path> = read.iter().map(|path| path.as_path()).collect();
            inputs::spare(path, &read)?;
            drop(Draft::create(path)?);
        }
        Ok(outputs)
    }
}
