//! `understudy refine`: a basis of muscles learns a performer's takes.

use std::{
    error::Error,
    path::{Path, PathBuf},
};

use clap::Args;
use understudy::{
    assets::Assets,
    capture::{FrameRate, read_markers},
    export::{Draft, write_basis},
    muscle::{
        Alignment, EXERCISED, MarkerMap, MuscleBasis, RefineOptions, Refinement, Round, SeatedTake,
        TakeError, join_takes, refine,
    },
    pipeline::{canonical_skin, motion_markers},
    view::Gpu,
};

use super::{Outcome, basis::BasisArgs, clip::ClipArgs, inputs, progress};

const EXAMPLES: &str = "\
Examples:
  understudy refine jaw.csv brows.csv --basis sixteen -o mine.json
  understudy refine takes/*.c3d --basis arkit --map markers.toml -o mine.json
  understudy refine clip.mp4 -o mine.json       the picture's plane is learned; depth stays the muscles'
  understudy animate clip.mp4 --target scan.obj --basis mine.json -o avatar.mp4

Let the performer contract each muscle fully, then make ordinary faces. A take of markers opens with half a second of
neutral face. Where markers sit is guessed from their names and places; --map says it (docs/markers.md).";

/// Refine the shapes of muscles by takes of one performer
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Refine {
    /// Takes of markers (.csv, .c3d) or clips
    #[arg(required = true, value_name = "TAKE")]
    takes: Vec<PathBuf>,
    #[command(flatten)]
    basis: BasisArgs,
    /// Where to write the refined muscles
    #[arg(short, long, value_name = "FILE.json")]
    output: PathBuf,
    /// Which landmark each marker sits at
    #[arg(long, value_name = "FILE.toml")]
    map: Option<PathBuf>,
    /// Let contractions exceed 1
    #[arg(long)]
    exaggerate: bool,
    /// Solve all muscles with all markers, and not upper and lower face apart
    #[arg(long)]
    undivided: bool,
    /// Frames per second of tables without times, and of folders of pictures
    #[arg(long, value_name = "RATE", default_value = "30")]
    fps: FrameRate,
    /// Share of the frames that is kept from learning, to tell when it goes too far
    #[arg(long, value_name = "SHARE", default_value_t = 0.2, value_parser = parse_share)]
    hold_out: f64,
}

impl Refine {
    pub fn run(&self, quiet: bool) -> Outcome {
        let extension = self.output.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        if extension.as_deref() != Some("json") {
            return Err(format!("cannot write {}: name it .json", self.output.display()).into());
        }
        let given = self.takes.iter().chain(&self.map).chain(&self.basis.basis);
        inputs::spare(&self.output, &given.map(PathBuf::as_path).collect::<Vec<_>>())?;
        drop(Draft::create(&self.output)?);
        let map = self.map.as_deref().map(MarkerMap::read).transpose()?.unwrap_or_default();
        let assets = Assets::locate()?;
        let basis = if let Some(basis) = self.basis.stated(MuscleBasis::arkit())? {
            basis
        } else {
            let mut networks = ClipArgs::networks(&assets)?;
            self.basis.read(MuscleBasis::arkit(), &Gpu::headless()?, &mut networks.tracker)?
        };
        let takes: Vec<SeatedTake> = self
            .takes
            .iter()
            .map(|path| self.seat(path, &map, &basis, &assets, quiet))
            .collect::<Result<_, _>>()?;
        if let Some(name) = map.places.keys().find(|name| takes.iter().all(|take| !take.names.contains(name)))
        {
            return Err(format!("{}: no take has a marker called {name}", self.takes[0].display()).into());
        }
        let options = RefineOptions {
            exaggerate: self.exaggerate,
            divided: !self.undivided,
            hold_out: self.hold_out,
            ..RefineOptions::default()
        };
        let (seats, takes) = join_takes(takes);
        let bar = progress::count("refining", "rounds", options.rounds as u64 + 1, quiet);
        let refined = refine(&basis, &seats, &takes, &options, |_| bar.inc(1))?;
        bar.finish_and_clear();
        if !quiet {
            report(&refined, self.exaggerate, options.divided);
        }
        if refined.best == 0 {
            return Err(format!(
                "nothing is written: {}, so that the draft is the best. Give more takes, or a basis of fewer muscles",
                refined.stop
            )
            .into());
        }
        if let Err(error) = refined.basis.check() {
            tracing::warn!("{error}");
        }
        write_basis(&self.output, &refined.basis)?;
        if !quiet {
            say!("wrote {} ({} muscles)", self.output.display(), refined.basis.elements.len());
        }
        Ok(())
    }

    /// One take on the basis' face.
    fn seat(
        &self,
        path: &Path,
        map: &MarkerMap,
        basis: &MuscleBasis,
        assets: &Assets,
        quiet: bool,
    ) -> Result<SeatedTake, Box<dyn Error>> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        if !matches!(extension.as_deref(), Some("csv" | "c3d")) {
            let clip = ClipArgs::plain(path, self.fps);
            drop(clip.open()?);
            let mut networks = ClipArgs::networks(assets)?;
            let lift = clip.lift(&mut networks)?;
            let take = clip.solve(assets, networks, lift, quiet)?;
            return Ok(motion_markers(&take.motion, basis)?);
        }
        let take = read_markers(path, self.fps)?;
        let skin = canonical_skin(&assets.verified("canonical_face")?, &basis.face)?;
        let seated = SeatedTake::of(&take, map, &basis.face, &skin)?;
        if !take.never_seen.is_empty() {
            tracing::warn!("{}: no frame shows {}", path.display(), take.never_seen.join(", "));
        }
        let off = seated.names.iter().zip(&seated.seats).filter(|(_, seat)| seat.is_none());
        let off: Vec<&str> = off.map(|(name, _)| name.as_str()).collect();
        if !off.is_empty() {
            tracing::warn!("{}: not on the face or not in its neutral: {}", path.display(), off.join(", "));
        }
        if !seated.stilled {
            tracing::warn!(
                "{}: too few markers on the skull to take the head's motion out; it must be still",
                path.display()
            );
        }
        if !quiet {
            let cells = || seated.training.frames.iter().flat_map(|f| f.iter().zip(&seated.seats));
            let wanted = cells().filter(|(_, seat)| seat.is_some()).count();
            let missing = cells().filter(|(d, seat)| seat.is_some() && d.is_none()).count();
            say!(
                "{}: {} frames, {} of {} markers on the face, {:.1} % of their places missing, aligned to {:.1} mm",
                path.display(),
                take.frames.len(),
                seated.placed(),
                seated.names.len(),
                100.0 * missing as f64 / wanted.max(1) as f64,
                seated.alignment.as_ref().map_or(0.0, Alignment::error_after)
            );
        }
        Ok(seated)
    }
}

fn report(refined: &Refinement, exaggerate: bool, divided: bool) {
    let [learned, held] = refined.frames;
    say!("errors of markers, mm, on {learned} frames learned from and {held} held out");
    let parts = if divided { format!("{:>9}{:>9}", "upper", "lower") } else { format!("{:>9}", "mean") };
    say!("{:<8}{:>9}{parts}{:>11}{parts}", "round", "learned", "held out");
    let means = |error: &TakeError| {
        let upper = if divided { format!("{:>9.3}", error.upper) } else { String::new() };
        format!("{upper}{:>9.3}", error.lower)
    };
    for (round, Round { learned, held_out }) in refined.rounds.iter().enumerate() {
        let name = if round == 0 { "draft".to_owned() } else { round.to_string() };
        let (own, other) = (means(learned), means(held_out));
        say!("{name:<8}{:>9.3}{own}{:>11.3}{other}", learned.rms, held_out.rms);
    }
    say!("round {} is kept: {}", refined.best, refined.stop);
    if !refined.idle.is_empty() {
        say!("not exercised, as in the draft: {}", refined.idle.join(", "));
    }
    if !refined.slight.is_empty() {
        say!("never contracted by {EXERCISED}, so not scaled: {}", refined.slight.join(", "));
    }
    if exaggerate {
        let beyond: Vec<String> = (refined.basis.names().zip(&refined.reach))
            .filter(|(_, reach)| **reach > 1.0)
            .map(|(name, reach)| format!("{name} {reach:.2}"))
            .collect();
        say!(
            "contracted beyond the draft's full: {}",
            if beyond.is_empty() { "none".into() } else { beyond.join(", ") }
        );
    }
}

fn parse_share(text: &str) -> Result<f64, String> {
    let share = text.parse::<f64>().ok().filter(|share| (0.05..=0.5).contains(share));
    share.ok_or_else(|| "write a share from 0.05 to 0.5".to_owned())
}
