//! `understudy animate`: a clip of a person in, a moving scan out.

use std::{error::Error, path::PathBuf, sync::Arc};

use clap::{Args, ValueEnum};
use understudy::{
    actions::ActionLibrary,
    appearance::AppearanceStates,
    assets::Assets,
    lift::FaceState,
    muscle::CurveEdits,
    pipeline::{
        Animation, HeadMode, Motion, PipelineError, SkinCurves, Stage, Target, VideoPlan, muscle_motor,
        preview_sheet, write_motion,
    },
    rig::{DriveMode, Rig, TargetFace, WarpKind},
    view::{Gpu, Look, Smoothing, save_png},
};

use super::{
    Outcome,
    animate_outputs::{AvatarFile, Outputs, PerformerFile},
    clip::{ClipArgs, Take},
    curve_files::{self, EditArgs},
    method::{MethodArgs, library},
    progress,
    skin::{SkinArgs, WornSkin, classify},
    target::{ScanArgs, parse_size},
    volume::VolumeArgs,
};

const EXAMPLES: &str = "\
Examples:
  understudy animate clip.mp4 --target scan.obj -o avatar.mp4
  understudy animate clip.mp4 --target scan.obj -o avatar.glb -o avatar.pc2 -o motion.csv
  understudy animate clip.mp4 --target scan.ply --compare -o both.mp4 -o preview.png
  understudy animate clip.mp4 --target bust.glb --head still --preset thesis -o avatar.mp4
  understudy animate clip.mp4 --target scan.obj --drive muscles --edit edits.toml -o avatar.mp4
  understudy animate clip.mp4 --target scan.obj --drive volume -o avatar.mp4
  understudy animate clip.mp4 --target scan.obj --drive volume --points 68 --lambda 0.001 -o avatar.glb
  understudy animate clip.mp4 --target scan.obj -o take.muscles.csv -o take.livelink.csv
  understudy animate clip.mp4 --target scan.obj --skin anna.skin -o avatar.mp4
  understudy animate clip.mp4 --target a.obj --target b.ply -o avatar.mp4     avatar.a.mp4, avatar.b.mp4

Outputs:
  .mp4  the avatar as a film, with the clip's sound
  .glb  the scan with morph targets and head motion: Blender, Unreal, three.js
  .pc2  every vertex of every frame: Blender's Mesh Cache modifier
  .csv  head pose and landmarks in OpenFace's columns
  .png  a sheet of the take's most different moments
  .muscles.csv   the contraction of every muscle of --basis: `express --play`, `plot`
  .livelink.csv  ARKit's 52 shapes as Live Link Face records them: any ARKit-ready character
With several targets the names of what shows them get the target's: avatar.NAME.mp4.

Edits, in TOML; mirror comes first, then scale, offset, clamp:
  mirror = true          # left and right change places
  [jawOpen]
  scale = 0.8
  offset = 0.05
  clamp = [0.0, 1.0]
  [cheekPuff]
  mute = true";

/// Animate a scan with the performance in a clip
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Animate {
    #[command(flatten)]
    clip: ClipArgs,
    /// The scan to animate: .obj, .ply, .stl, .glb, .gltf or .bnt; may be given several times
    #[arg(short, long, value_name = "SCAN", required = true)]
    target: Vec<PathBuf>,
    #[command(flatten)]
    scan: ScanArgs,
    /// What to write, by extension: .mp4, .glb, .pc2, .csv, .png, .muscles.csv, .livelink.csv; may be given several times
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// Whether the avatar's head moves with the performer's
    #[arg(long, value_enum, default_value_t = HeadArg::Follow)]
    head: HeadArg,
    /// What of the performer drives the target
    #[arg(long, value_enum, default_value_t = DriveArg::Landmarks)]
    drive: DriveArg,
    #[command(flatten)]
    volume: VolumeArgs,
    #[command(flatten)]
    edits: EditArgs,
    /// A library of action units, written by `author`, in place of the built-in one
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
    #[command(flatten)]
    skin: SkinArgs,
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
    /// A few landmarks and thirteen points around the face that stay, through space (Fidaleo et al.)
    Volume,
}

impl Animate {
    pub fn run(&self, quiet: bool) -> Outcome {
        let edits = self.edits.read()?;
        let by_muscles = matches!(self.drive, DriveArg::Muscles);
        let by_volume = matches!(self.drive, DriveArg::Volume);
        if edits.is_some() && !by_muscles {
            return Err("--edit changes contractions, which move nothing here. Add --drive muscles".into());
        }
        self.check_volume()?;
        if self.target.len() > 1 && self.scan.landmarks().is_some() {
            return Err("--landmarks belongs to one scan. Animate one --target at a time with it".into());
        }
        let outputs = self.outputs()?;
        let assets = Assets::locate()?;
        // Opened twice on purpose: a clip that cannot be read is refused before the scan is worked on.
        drop(self.clip.open()?);
        let gpu = Gpu::headless()?;
        let mut networks = ClipArgs::networks(&assets)?;
        let lift = self.clip.lift(&mut networks)?;
        curve_files::check(&lift, by_muscles, &outputs.curve_files(), &self.edits, edits.as_ref())?;
        let library = library(self.from.as_deref())?;
        let mut targets = Vec::new();
        for path in &self.target {
            let opens = by_volume || self.method.method().warp != WarpKind::Regions;
            targets.push(self.scan.open(path, opens, &gpu, &mut networks.tracker, quiet)?);
        }
        let skin = self.skin.read(&assets)?;
        let mut take = self.clip.solve(&assets, networks, lift, quiet)?;
        let classified =
            skin.as_ref().map(|worn| classify(&self.clip, &mut take, &worn.skin, worn.face.frame(), quiet));
        let states: Option<Vec<AppearanceStates>> =
            classified.transpose()?.map(|frames| frames.iter().map(|frame| frame.states).collect());
        let skin = skin.as_ref().zip(states.as_deref());
        self.write_performer(&outputs, edits.as_ref(), &library, &mut take, quiet)?;
        for (target, files) in targets.iter_mut().zip(&outputs.avatars) {
            self.write_avatar(target, files, &gpu, &library, skin, &mut take, quiet)?;
        }
        warn_of_gaps(&take.motion);
        if self.clip.timings {
            say!("{}", take.watch);
        }
        Ok(())
    }

    /// Writes what does not depend on a target, and lets edited contractions show.
    fn write_performer(
        &self,
        outputs: &Outputs,
        edits: Option<&CurveEdits>,
        library: &ActionLibrary,
        take: &mut Take,
        quiet: bool,
    ) -> Outcome {
        let motion = &mut take.motion;
        let of_motion = outputs.performer.iter().filter(|(kind, _)| *kind == PerformerFile::Motion);
        for (_, path) in of_motion {
            take.watch.time("write csv", || write_motion(path, motion, library, None))?;
        }
        let by_muscles = matches!(self.drive, DriveArg::Muscles);
        if by_muscles || !outputs.curve_files().is_empty() {
            let curves = if by_muscles { self.edits.follow(edits, motion)? } else { motion.curves()? };
            for (kind, path) in &outputs.performer {
                if let PerformerFile::Curves(file) = kind {
                    take.watch.time("write csv", || file.write(path, motion, &curves))?;
                }
            }
        }
        if !quiet {
            for (_, path) in &outputs.performer {
                say!("wrote {}", path.display());
            }
        }
        Ok(())
    }

    /// Writes what shows one target.
    #[expect(clippy::too_many_arguments, reason = "a target, its files, and all that it takes to fill them")]
    fn write_avatar(
        &self,
        target: &mut Target,
        files: &[(AvatarFile, PathBuf)],
        gpu: &Gpu,
        library: &ActionLibrary,
        skin: Option<(&WornSkin, &[AppearanceStates])>,
        take: &mut Take,
        quiet: bool,
    ) -> Outcome {
        if files.is_empty() {
            return Ok(());
        }
        let (face, angles) = take.watch.time("level the target", || {
            target.level_with(take.motion.performer.rest_landmarks(), &mut take.networks.tracker)
        })?;
        tracing::info!("levelled in steps of {angles:.3?} rad");
        let target = &*target;
        let head = match self.head {
            HeadArg::Follow => HeadMode::Follow,
            HeadArg::Still => HeadMode::Still,
        };
        let rig = take.watch.time("build the rig", || self.rig(&take.motion, target, &face, library))?;
        let relief = skin.map(|(worn, _)| worn.relief(target)).transpose()?.unwrap_or_default();
        let animation = Animation {
            motion: &take.motion,
            target,
            rig: &rig,
            head,
            skin: skin.map(|(_, states)| SkinCurves { states, relief: &relief }),
        };
        let ticks = animation.ticks().len() as u64;
        for (kind, path) in files {
            let watch = &mut take.watch;
            let mut note = String::new();
            let stage = |size, smoothing| -> Result<Stage, PipelineError> {
                let stage = Stage::new(gpu, target, &face.level, size, Look::default(), head, smoothing)?;
                Ok(stage.wearing(skin.map(|(worn, _)| worn.on(gpu, target, &relief)).transpose()?))
            };
            match kind {
                AvatarFile::Pc2 => {
                    let bar = progress::bar("caching", Some(ticks), quiet);
                    animation.write_pc2(path, watch, |done| bar.set_position(done))?;
                    bar.finish_and_clear();
                }
                AvatarFile::Glb => {
                    let bar = progress::spinner("compressing to morph targets", quiet);
                    let report = animation.write_glb(path, watch)?;
                    bar.finish_and_clear();
                    note = format!(
                        " ({} morph targets, {:.3} mm RMS, {:.3} mm in the worst frame)",
                        report.morphs, report.rms, report.worst_frame_rms
                    );
                }
                AvatarFile::Png => {
                    let mut stage = stage([720, 720], Smoothing::Samples4)?;
                    save_png(path, &preview_sheet(&animation, &mut stage, self.clip.open()?)?)?;
                }
                AvatarFile::Mp4 => {
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
            (DriveArg::Actions, _) => driven(DriveMode::Actions)?,
            (DriveArg::Volume, _) => driven(DriveMode::Volume(self.volume.morph()))?,
            // Contractions are nobody's: they mean the same whoever the performer was.
            (DriveArg::Muscles, Some(basis)) => {
                let (motor, _) = muscle_motor(basis, target, method)?;
                Rig::moved_by(Arc::new(motor), library, performer, face)?
            }
            (DriveArg::Landmarks, _) | (DriveArg::Muscles, None) => driven(DriveMode::Landmarks)?,
        })
    }

    /// The volume's options belong to it, and it is a warp of its own.
    fn check_volume(&self) -> Outcome {
        let by_volume = matches!(self.drive, DriveArg::Volume);
        match (by_volume, self.volume.given(), self.method.names_warp()) {
            (false, Some(option), _) => {
                Err(format!("{option} is the volume's and moves nothing here. Add --drive volume").into())
            }
            (true, _, true) => {
                Err("--drive volume spreads motion in its own way. Leave out --warp and --preset, or \
                                    choose another drive"
                    .into())
            }
            _ => Ok(()),
        }
    }

    fn outputs(&self) -> Result<Outputs, Box<dyn Error>> {
        let read = [Some(&self.clip.clip), self.edits.edit.as_ref(), self.from.as_ref()];
        let read = read.into_iter().flatten().chain(&self.target).map(PathBuf::as_path);
        let read = read.chain(self.skin.path());
        Outputs::plan(&self.output, &self.target, &read.collect::<Vec<_>>())
    }
}

fn warn_of_gaps(motion: &Motion) {
    let lost = motion.frames.iter().filter(|f| f.state != FaceState::Tracking).count();
    if lost > 0 {
        tracing::warn!(
            "the face was not seen in {lost} of {} frames; there the avatar holds, eases to neutral and blends back \
             (column `state` of the .csv)",
            motion.frames.len()
        );
    }
}
