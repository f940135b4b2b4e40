//! `understudy animate`: a clip of a person in, a moving scan out.

use std::{
    error::Error,
    path::{Path, PathBuf},
    sync::Arc,
};

use clap::{Args, ValueEnum};
use understudy::{
    actions::ActionLibrary,
    assets::Assets,
    export::Draft,
    lift::FaceState,
    muscle::MuscleMotor,
    pipeline::{Animation, HeadMode, Motion, Stage, Target, VideoPlan, preview_sheet},
    rig::{DriveMode, Rig, TargetFace, WarpKind},
    view::{Gpu, Look, Smoothing, save_png},
};

use super::{
    Outcome,
    clip::ClipArgs,
    inputs,
    method::{MethodArgs, library},
    progress,
    target::{ScanArgs, parse_size, report, report_anatomy},
};

const EXAMPLES: &str = "\
Examples:
  understudy animate clip.mp4 --target scan.obj -o avatar.mp4
  understudy animate clip.mp4 --target scan.obj -o avatar.glb -o avatar.pc2 -o motion.csv
  understudy animate clip.mp4 --target scan.ply --compare -o both.mp4 -o preview.png
  understudy animate clip.mp4 --target bust.glb --head still --preset thesis -o avatar.mp4

Outputs:
  .mp4  the avatar as a film, with the clip's sound
  .glb  the scan with morph targets and head motion: Blender, Unreal, three.js
  .pc2  every vertex of every frame: Blender's Mesh Cache modifier
  .csv  head pose and landmarks in OpenFace's columns
  .png  a sheet of the take's most different moments";

const NO_MUSCLES: &str = "--lift plane finds no contractions. Leave it out, or drive by landmarks or actions";

/// Animate a scan with the performance in a clip
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Animate {
    #[command(flatten)]
    clip: ClipArgs,
    /// The scan to animate: .obj, .ply, .stl, .glb, .gltf or .bnt
    #[arg(short, long, value_name = "SCAN")]
    target: PathBuf,
    #[command(flatten)]
    scan: ScanArgs,
    /// What to write, by extension: .mp4, .glb, .pc2, .csv, .png; may be given several times
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// Whether the avatar's head moves with the performer's
    #[arg(long, value_enum, default_value_t = HeadArg::Follow)]
    head: HeadArg,
    /// What of the performer drives the target
    #[arg(long, value_enum, default_value_t = DriveArg::Landmarks)]
    drive: DriveArg,
    /// A library of action units, written by `author`, in place of the built-in one
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
    #[command(flatten)]
    method: MethodArgs,
    /// Show the performer beside the avatar in the film
    #[arg(long)]
    compare: bool,
    /// Width and height of the avatar's picture, even numbers
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    size: [u32; 2],
}

#[derive(Clone, Copy, ValueEnum)]
enum HeadArg {
    /// The head turns and moves
    Follow,
    /// The head stays, the face moves
    Still,
}

#[derive(Clone, Copy, ValueEnum)]
enum DriveArg {
    /// The performer's landmarks themselves
    Landmarks,
    /// Action units measured from them, through the library
    Actions,
    /// The contractions of the muscles of --basis
    Muscles,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Mp4,
    Glb,
    Pc2,
    Csv,
    Png,
}

impl Kind {
    fn of(path: &Path) -> Result<Self, String> {
        let extension =
            path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        match extension.as_str() {
            "mp4" => Ok(Self::Mp4),
            "glb" => Ok(Self::Glb),
            "pc2" => Ok(Self::Pc2),
            "csv" => Ok(Self::Csv),
            "png" => Ok(Self::Png),
            _ => Err(format!("cannot write {}: name it .mp4, .glb, .pc2, .csv or .png", path.display())),
        }
    }
}

impl Animate {
    pub fn run(&self, quiet: bool) -> Outcome {
        let outputs = self.outputs()?;
        if matches!(self.drive, DriveArg::Muscles) && !self.clip.solves_muscles() {
            return Err(NO_MUSCLES.into());
        }
        let assets = Assets::locate()?;
        // Opened twice on purpose: a clip that cannot be read is refused before the scan is worked on.
        drop(self.clip.open()?);
        let gpu = Gpu::headless()?;
        let mut networks = ClipArgs::networks(&assets)?;
        let mut target = Target::load(&self.target, &self.scan.options(), &gpu, &mut networks.tracker)?;
        let method = self.method.method();
        let library = library(self.from.as_deref())?;
        if method.warp != WarpKind::Regions {
            target.prepare(&gpu)?;
            report_anatomy(&target);
        }
        if !quiet {
            report(&target);
        }
        let mut take = self.clip.solve(&assets, networks, quiet)?;
        let (face, angles) = take.watch.time("level the target", || {
            target.level_with(take.motion.performer.rest_landmarks(), &mut take.networks.tracker)
        })?;
        tracing::info!("levelled in steps of {angles:.3?} rad");
        let head = match self.head {
            HeadArg::Follow => HeadMode::Follow,
            HeadArg::Still => HeadMode::Still,
        };
        let rig = take.watch.time("build the rig", || self.rig(&take.motion, &target, &face, &library))?;
        let animation = Animation { motion: &take.motion, target: &target, rig: &rig, head };
        let ticks = animation.ticks().len() as u64;
        for (kind, path) in outputs {
            let watch = &mut take.watch;
            let mut note = String::new();
            let stage = |size, smoothing| {
                Stage::new(&gpu, &target, &face.level, size, Look::default(), head, smoothing)
            };
            match kind {
                Kind::Pc2 => {
                    let bar = progress::bar("caching", Some(ticks), quiet);
                    animation.write_pc2(path, watch, |done| bar.set_position(done))?;
                    bar.finish_and_clear();
                }
                Kind::Csv => animation.write_csv(path, &library, watch)?,
                Kind::Glb => {
                    let bar = progress::spinner("compressing to morph targets", quiet);
                    let report = animation.write_glb(path, watch)?;
                    bar.finish_and_clear();
                    note = format!(
                        " ({} morph targets, {:.3} mm RMS, {:.3} mm in the worst frame)",
                        report.morphs, report.rms, report.worst_frame_rms
                    );
                }
                Kind::Png => {
                    let mut stage = stage([720, 720], Smoothing::Samples4)?;
                    save_png(path, &preview_sheet(&animation, &mut stage, self.clip.open()?)?)?;
                }
                Kind::Mp4 => {
                    let [width, height] = self.size;
                    let size = if self.compare { [height, height] } else { [width, height] };
                    let plan = VideoPlan {
                        path: path.clone(),
                        stage: stage(size, Smoothing::Edges)?,
                        beside: if self.compare { Some(self.clip.open()?) } else { None },
                        sound_from: self.clip.clip.is_file().then(|| self.clip.clip.clone()),
                    };
                    let bar = progress::bar("drawing", Some(ticks), quiet);
                    animation.write_mp4(plan, watch, |done| bar.set_position(done))?;
                    bar.finish_and_clear();
                }
            }
            if !quiet {
                say!("wrote {}{note}", path.display());
            }
        }
        warn_of_gaps(&animation);
        if self.clip.timings {
            say!("{}", take.watch);
        }
        Ok(())
    }

    /// Ties performer and target.
    fn rig(
        &self,
        motion: &Motion,
        target: &Target,
        face: &TargetFace,
        library: &ActionLibrary,
    ) -> Result<Rig, Box<dyn Error>> {
        let (anatomy, surface, method) = (&target.anatomy, &target.surface, self.method.method());
        let performer = &motion.performer;
        let driven = |mode| Rig::driven_by(mode, library, performer, face, anatomy, surface, method);
        Ok(match (self.drive, &motion.basis) {
            (DriveArg::Landmarks, _) => driven(DriveMode::Landmarks)?,
            (DriveArg::Actions, _) => driven(DriveMode::Actions)?,
            (DriveArg::Muscles, Some(basis)) => {
                let motor = MuscleMotor::new(basis, face, anatomy, surface, method)?;
                Rig::moved_by(Arc::new(motor), library, performer, face)?
            }
            (DriveArg::Muscles, None) => return Err(NO_MUSCLES.into()),
        })
    }

    /// What to write where; places that cannot be written to are refused before any work is done.
    fn outputs(&self) -> Result<Vec<(Kind, &PathBuf)>, Box<dyn std::error::Error>> {
        let mut outputs = Vec::new();
        for path in &self.output {
            outputs.push((Kind::of(path)?, path));
            inputs::spare(path, &[&self.clip.clip, &self.target])?;
            drop(Draft::create(path)?);
        }
        Ok(outputs)
    }
}

fn warn_of_gaps(animation: &Animation) {
    let lost = animation.motion.frames.iter().filter(|f| f.state != FaceState::Tracking).count();
    if lost > 0 {
        tracing::warn!(
            "the face was not seen in {lost} of {} frames; there the avatar holds, eases to neutral and blends back \
             (column `state` of the .csv)",
            animation.motion.frames.len()
        );
    }
}
