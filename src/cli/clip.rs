//! The part of the command line that every command on a clip shares, and the work it leads to.

use std::{
    error::Error,
    path::{Path, PathBuf},
    sync::Arc,
};

use clap::{Args, ValueEnum};
use understudy::{
    assets::Assets,
    capture::{self, CaptureError, FrameRate, FrameSource},
    head::Camera,
    lift::Smoothing,
    muscle::MuscleBasis,
    pipeline::{
        LiftMode, Motion, Networks, Performance, PipelineError, SolveOptions, Stopwatch, Target,
        TargetOptions, performer_face, read_canonical_face,
    },
    tracking::TrackerOptions,
    view::Gpu,
};

use super::{basis::BasisArgs, progress};

/// The performer's clip and how it is read.
#[derive(Clone, Args)]
pub struct ClipArgs {
    /// Video file, folder of numbered pictures, or one picture
    pub clip: PathBuf,
    /// Frames per second of a folder of pictures
    #[arg(long, value_name = "RATE", default_value = "25")]
    pub fps: FrameRate,
    /// The camera's field of view along the picture's longer side, degrees
    #[arg(long, value_name = "DEGREES", default_value_t = Camera::DEFAULT_FIELD_OF_VIEW, value_parser = parse_fov)]
    fov: f64,
    /// Seconds between which the performer is neutral, such as 1.2..2.5; found automatically if not given
    #[arg(long, value_name = "START..END", value_parser = parse_stretch)]
    neutral: Option<(f64, f64)>,
    /// Use the stretch named with --neutral even if the mouth is open, the head turned or the face moving
    #[arg(long)]
    accept_neutral: bool,
    /// The performer's own neutral scan; without it an average face is fitted to the neutral frames
    #[arg(long, value_name = "SCAN")]
    performer: Option<PathBuf>,
    /// Where depth comes from, which one camera does not see
    #[arg(long, value_enum, default_value_t = LiftArg::Muscles)]
    lift: LiftArg,
    #[command(flatten)]
    basis: BasisArgs,
    /// How to steady head and face
    #[arg(long, value_enum, default_value_t = SmoothingArg::ZeroPhase)]
    smoothing: SmoothingArg,
    /// 1 works on one thread, more decode and draw ahead; the result is the same
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=64))]
    pub threads: u16,
    /// Print where the time went
    #[arg(long)]
    pub timings: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum SmoothingArg {
    /// Leave the landmarks as the network gives them
    Off,
    /// As a live performer is steadied: no frame waits for later ones
    Causal,
    /// Look at both sides of each frame: steadier, without lag
    ZeroPhase,
}

#[derive(Clone, Copy, ValueEnum)]
enum LiftArg {
    /// Head pose and muscles are solved together
    Muscles,
    /// The picture's plane and the network's own depth
    Plane,
}

/// A solved take with what it was solved from.
pub struct Take {
    pub performance: Performance,
    pub motion: Motion,
    pub networks: Networks,
    pub watch: Stopwatch,
}

impl ClipArgs {
    /// A clip with every choice left as it is.
    pub fn plain(clip: &Path, fps: FrameRate) -> Self {
        Self {
            clip: clip.into(),
            fps,
            fov: Camera::DEFAULT_FIELD_OF_VIEW,
            neutral: None,
            accept_neutral: false,
            performer: None,
            lift: LiftArg::Muscles,
            basis: BasisArgs { basis: None },
            smoothing: SmoothingArg::ZeroPhase,
            threads: 2,
            timings: false,
        }
    }

    /// The same choices for another clip.
    pub fn on(&self, clip: &Path) -> Self {
        Self { clip: clip.into(), ..self.clone() }
    }

    /// Whether a neutral stretch is named.
    pub fn names_neutral(&self) -> bool {
        self.neutral.is_some()
    }

    /// Opens the clip from its start.
    pub fn open(&self) -> Result<Box<dyn FrameSource>, CaptureError> {
        capture::open(&self.clip, self.fps)
    }

    /// Loads the networks.
    pub fn networks(assets: &Assets) -> Result<Networks, PipelineError> {
        Networks::load(assets, TrackerOptions::default())
    }

    /// How landmarks become motion; a basis is read here.
    pub fn lift(&self, networks: &mut Networks) -> Result<LiftMode, Box<dyn Error>> {
        if let LiftArg::Plane = self.lift {
            return Ok(LiftMode::Plane);
        }
        let default = MuscleBasis::arkit();
        let basis = match self.basis.stated(default)? {
            Some(basis) => basis,
            None => self.basis.read(default, &Gpu::headless()?, &mut networks.tracker)?,
        };
        Ok(LiftMode::Muscles(Arc::new(basis)))
    }

    /// Tracks and solves the clip.
    pub fn solve(
        &self,
        assets: &Assets,
        mut networks: Networks,
        lift: LiftMode,
        quiet: bool,
    ) -> Result<Take, Box<dyn Error>> {
        let mut watch = Stopwatch::default();
        let source = self.open()?;
        let mut face = read_canonical_face(&assets.verified("canonical_face")?)?;
        if let Some(path) = &self.performer {
            let scan =
                Target::load(path, &TargetOptions::default(), &Gpu::headless()?, &mut networks.tracker)?;
            face = performer_face(&scan, &face)?;
        }
        let bar = progress::bar("tracking", source.info().announced_frames, quiet);
        let performance = Performance::track(
            source,
            &mut networks.tracker,
            usize::from(self.threads),
            &mut watch,
            |done| bar.set_position(done),
        )?;
        bar.finish_and_clear();
        if performance.faces_seen > 1 {
            tracing::warn!("{} faces were seen at once; the largest is followed", performance.faces_seen);
        }
        let options = SolveOptions {
            field_of_view: self.fov,
            neutral: self.neutral,
            accept_neutral: self.accept_neutral,
            smoothing: match self.smoothing {
                SmoothingArg::Off => Smoothing::Off,
                SmoothingArg::Causal => Smoothing::Causal,
                SmoothingArg::ZeroPhase => Smoothing::ZeroPhase,
            },
            lift,
        };
        let motion = watch
            .time("solve", || Motion::solve(&performance, &face, &mut networks.blendshapes, &options))
            .map_err(|error| format!("{}: {error}", self.clip.display()))?;
        if !quiet {
            report(&performance, &motion);
        }
        Ok(Take { performance, motion, networks, watch })
    }
}

fn report(performance: &Performance, motion: &Motion) {
    let seen = performance.frames.iter().filter(|frame| frame.landmarks.is_some()).count();
    let info = &motion.info;
    say!(
        "{}: {}×{} at {} frames/s, a face in {seen} of {} frames",
        info.name,
        info.width,
        info.height,
        info.rate,
        performance.frames.len()
    );
    let (start, end) = motion.neutral;
    say!("neutral taken from {:.2}..{:.2} s", start.seconds(), end.seconds());
    for objection in &motion.objections {
        tracing::warn!(
            "the neutral is doubtful: {objection}; name a better stretch with --neutral START..END"
        );
    }
}

fn parse_fov(text: &str) -> Result<f64, String> {
    let degrees = text.parse().map_err(|_| "write degrees, such as 60".to_owned())?;
    // Any picture will do: the camera checks the angle.
    Camera::with_field_of_view(2, 2, degrees).map_err(|error| error.to_string())?;
    Ok(degrees)
}

fn parse_stretch(text: &str) -> Result<(f64, f64), String> {
    let wanted = "write two times in seconds, such as 1.2..2.5";
    let (start, end) = text.split_once("..").ok_or(wanted)?;
    let parse = |part: &str| part.trim().parse::<f64>().map_err(|_| wanted.to_owned());
    let (start, end) = (parse(start)?, parse(end)?);
    if start.is_finite() && end.is_finite() && 0.0 <= start && start <= end {
        Ok((start, end))
    } else {
        Err(wanted.into())
    }
}
