//! `understudy express`: action units or contraction curves in, expressions of the scan out.

use std::{
    error::Error,
    path::{Path, PathBuf},
};

use clap::{Args, ValueEnum};
use nalgebra::Rotation3;
use understudy::{
    actions::{ActionLibrary, ActionWeights, Merge, Score},
    assets::Assets,
    capture::FrameRate,
    export::Draft,
    muscle::{CurveMap, CurveTake, MuscleBasis},
    pipeline::{ActionTake, CurvePlay, Networks, PipelineError, Play, PlayedTake, Playing, SkinPlay, Stage},
    rig::{ActionRig, TargetFace, WarpKind, facing},
    tracking::{Tracker, TrackerOptions},
    view::{Gpu, Look, Smoothing, save_png},
};

use super::{
    Outcome,
    basis::BasisArgs,
    curve_files::EditArgs,
    inputs,
    method::{MethodArgs, library},
    progress,
    skin::{SkinArgs, WornSkin},
    target::{ScanArgs, parse_size},
};

const EXAMPLES: &str = "\
Examples:
  understudy express --target scan.obj --au 12=0.8 --au 4L=0.5 -o smirk.png -o smirk.obj
  understudy express --target scan.obj --emotion happiness -o happy.mp4 -o happy.glb
  understudy express --target scan.obj --play keys.csv -o scene.mp4
  understudy express --target scan.obj --play openface.csv --from mine.json -o scene.mp4
  understudy express --target scan.obj --play take.muscles.csv --edit edits.toml -o scene.mp4
  understudy express --target scan.obj --play iphone.csv -o scene.mp4
  understudy express --target scan.obj --au 1 --skin anna.skin --wrinkle forehead=0.8 -o worried.png
  understudy express --target scan.obj --skin anna.skin --wrinkle nasolabial --bake maps -o fold.glb
  understudy express --target scan.obj --au 4 --preset thesis -o as-published.png

Magnitudes go from 0, the neutral, to 1. 12L and 12R are the subject's left and right side, 12 is both.
Emotions: anger, disgust, fear, happiness, sadness, surprise; sadness=0.5 is half of it.
Keys are rows of `time,au,magnitude` in seconds; tables are OpenFace's, with `timestamp` and AU01_r … from 0 to 5.
Contraction curves are those of `animate -o take.muscles.csv`, or a recording of Live Link Face, by whose angles the
head turns.

Outputs:
  .png  a picture; of keys and curves, a sheet of moments
  .obj  the expression, the scan's own vertices first and in their order; of keys and curves, their last moment
  .mp4  a film: an expression comes, stays and goes; keys and curves play once
  .glb  the same as morph targets: Blender, Unreal, three.js
  .pc2  every vertex of every frame: Blender's Mesh Cache modifier
Wrinkles are seen in .png and .mp4; in .glb their curves are morph targets that move nothing, named wrinkle_forehead and
so on, by which an engine blends the maps of --bake.";

/// Frames a second of action units.
const ACTIONS_RATE: f64 = 30.0;

/// Show facial action units or contractions of muscles on a scan
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
    /// Keys or a table of action units over time, or contraction curves; the header tells which
    #[arg(long, value_name = "FILE", conflicts_with_all = ["au", "emotion"])]
    play: Option<PathBuf>,
    #[command(flatten)]
    basis: BasisArgs,
    #[command(flatten)]
    edits: EditArgs,
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
    skin: SkinArgs,
    /// A region of --skin and its state from 0 to 1: forehead, glabella, crows_feet, nasolabial, mouth_corner, chin, eye;
    /// one side of a pair with _left or _right; may be given several times
    #[arg(long, value_name = "REGION=STATE", requires = "skin")]
    wrinkle: Vec<String>,
    /// Write the skin as wrinkle maps of the scan's texture into this folder
    #[arg(long, value_name = "DIR", requires = "skin")]
    bake: Option<PathBuf>,
    #[command(flatten)]
    method: MethodArgs,
    /// Leave lips and eyes as they were scanned; outputs then have the scan's own mesh
    #[arg(long)]
    as_scanned: bool,
    /// Frames a second of films and motions: the curves' own, or 30 of action units, if not given
    #[arg(long, value_parser = parse_rate)]
    fps: Option<f64>,
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

impl MergeArg {
    fn merge(self) -> Merge {
        match self {
            Self::Parallel => Merge::Parallel,
            Self::Sum => Merge::Sum,
        }
    }
}

/// What is shown.
enum Source {
    Actions(Playing),
    Curves(CurveTake, Box<MuscleBasis>),
}

/// A file that shows what is played.
#[derive(Clone, Copy)]
pub enum Kind {
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
    /// By its extension.
    pub fn of(path: &Path) -> Result<Self, String> {
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
        let library = library(self.from.as_deref())?;
        let method = self.method.method();
        let assets = Assets::locate()?;
        let gpu = Gpu::headless()?;
        let mut networks = Networks::load(&assets, TrackerOptions::default())?;
        let skin = self.skin.read(&assets)?;
        let states = skin.as_ref().map(|skin| skin.states(&self.wrinkle)).transpose()?;
        let source = self.source(&library, &gpu, &mut networks.tracker)?;
        let opens = !self.as_scanned && method.warp != WarpKind::Regions;
        let target = self.scan.open(&self.target, opens, &gpu, &mut networks.tracker, quiet)?;
        let comes_and_goes = matches!(source, Source::Actions(Playing::Expression(_)));
        let (mut play, level, rate): (Box<dyn Play>, _, _) = match source {
            Source::Curves(take, basis) => {
                let play = CurvePlay::new(take, &basis, &target, method)?;
                let (level, rate) = (*play.level(), play.rate());
                (Box::new(play), level, rate)
            }
            Source::Actions(playing) => {
                let level = facing(&library.face, &target.landmarks);
                let face = TargetFace::new(target.landmarks.clone(), level)?;
                let (anatomy, surface) = (&target.anatomy, &target.surface);
                let rig = ActionRig::new(&library, &face, anatomy, surface, method, self.merge.merge())?;
                (Box::new(ActionTake { rig, playing }), level, FrameRate::nearest(ACTIONS_RATE))
            }
        };
        if let Some(states) = states {
            play = Box::new(SkinPlay { play, states, comes_and_goes });
        }
        let rate = self.fps.map_or(rate, FrameRate::nearest);
        let relief = skin.as_ref().map(|skin| skin.relief(&target)).transpose()?.unwrap_or_default();
        let take = PlayedTake { target: &target, play: play.as_ref(), rate, relief: &relief };
        if let (Some(folder), Some(skin)) = (&self.bake, &skin) {
            let files = skin.bake(folder, &target)?;
            if !quiet {
                say!("wrote {} maps to {}", files.len(), folder.display());
            }
        }
        write_take(&take, &level, self.size, &gpu, skin.as_ref(), &outputs, quiet)
    }

    /// What is to be shown; without anything, the neutral. Refuses muscles and action units that nobody knows.
    fn source(
        &self,
        library: &ActionLibrary,
        gpu: &Gpu,
        tracker: &mut Tracker,
    ) -> Result<Source, Box<dyn Error>> {
        if let Some(path) = self.play.as_deref().filter(|path| CurveTake::is_in(path).unwrap_or(false)) {
            if self.from.is_some() {
                return Err(format!("{} holds contractions, and --from action units", path.display()).into());
            }
            let mut take = CurveTake::read(path)?;
            if let Some(edits) = self.edits.read()? {
                take = self.edits.of_take(&edits, take)?;
            }
            let curves = &take.curves;
            let basis = self.basis.read(CurveMap::built_in_basis(curves.muscles()), gpu, tracker)?;
            CurveMap::new(curves.muscles(), curves.channels(), &basis)
                .map_err(|error| format!("{}: {error}", path.display()))?;
            return Ok(Source::Curves(take, Box::new(basis)));
        }
        if self.basis.basis.is_some() || self.edits.edit.is_some() {
            return Err("--basis and --edit go with contraction curves: name them with --play".into());
        }
        if let Some(path) = &self.play {
            let score = Score::read(path)?;
            if !score.ignored().is_empty() {
                tracing::warn!(
                    "{}: {} cannot be shown by a surface and are left out",
                    path.display(),
                    score.ignored().join(", ")
                );
            }
            for key in score.actions() {
                library.get(key)?;
            }
            return Ok(Source::Actions(Playing::Score(score)));
        }
        let mut weights = ActionWeights::default();
        for text in &self.emotion {
            weights.set_emotion(text)?;
        }
        for text in &self.au {
            weights.set_text(text)?;
        }
        for (key, _) in weights.iter() {
            library.get(key)?;
        }
        Ok(Source::Actions(Playing::Expression(weights)))
    }

    /// What to write where; places that cannot be written to are refused before any work is done.
    fn outputs(&self) -> Result<Vec<(Kind, &PathBuf)>, Box<dyn std::error::Error>> {
        let mut outputs = Vec::new();
        let files = [Some(&self.target), self.play.as_ref(), self.from.as_ref(), self.edits.edit.as_ref()];
        let read: Vec<&Path> =
            files.into_iter().flatten().map(PathBuf::as_path).chain(self.skin.path()).collect();
        for path in &self.output {
            outputs.push((Kind::of(path)?, path));
            inputs::spare(path, &read)?;
            drop(Draft::create(path)?);
        }
        Ok(outputs)
    }
}

/// Writes what is played on a target into every output.
pub fn write_take(
    take: &PlayedTake,
    level: &Rotation3<f64>,
    size: [u32; 2],
    gpu: &Gpu,
    skin: Option<&WornSkin>,
    outputs: &[(Kind, &PathBuf)],
    quiet: bool,
) -> Outcome {
    let frames = take.times().len() as u64;
    let head = take.play.head();
    let stage = |smoothing| -> Result<Stage, PipelineError> {
        let stage = Stage::new(gpu, take.target, level, size, Look::default(), head, smoothing)?;
        Ok(stage.wearing(skin.map(|skin| skin.on(gpu, take.target, take.relief)).transpose()?))
    };
    for (kind, path) in outputs {
        let mut note = String::new();
        match kind {
            Kind::Png => save_png(path, &take.picture(&mut stage(Smoothing::Samples4)?)?)?,
            Kind::Obj => take.write_obj(path)?,
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
