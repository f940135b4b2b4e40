//! The part of the command line that edits a take's curves, and the performer's own files that come of them.

use std::{
    error::Error,
    path::{Path, PathBuf},
};

use clap::Args;
use understudy::{
    capture::{FrameRate, Timestamp},
    export::write_muscle_csv,
    lift::FaceState,
    muscle::{
        CurveEdits, CurveFrame, CurveMap, CurveTake, MuscleBasis, MuscleCurves, MuscleError, MuscleLift,
    },
    pipeline::{LiftMode, Motion},
};

use super::Outcome;

const NO_MUSCLES: &str =
    "--lift plane finds no contractions. Leave it out, or ask for nothing that is made of them";

/// How contractions are edited.
#[derive(Args)]
pub struct EditArgs {
    /// Edits of the contractions, in TOML: mirror, and scale, offset, clamp, mute of each muscle
    #[arg(long, value_name = "FILE")]
    pub edit: Option<PathBuf>,
}

impl EditArgs {
    /// The edits, if any are asked for.
    pub fn read(&self) -> Result<Option<CurveEdits>, Box<dyn Error>> {
        Ok(self.edit.as_deref().map(CurveEdits::read).transpose()?)
    }

    /// An edited take.
    pub fn of_take(&self, edits: &CurveEdits, take: CurveTake) -> Result<CurveTake, Box<dyn Error>> {
        Ok(take.edited(edits).map_err(|error| self.named(&error))?)
    }

    fn named(&self, error: &MuscleError) -> String {
        format!("{}: {error}", self.edit.as_deref().unwrap_or(Path::new("the edits")).display())
    }

    /// Edited curves.
    pub fn apply(&self, edits: &CurveEdits, curves: MuscleCurves) -> Result<MuscleCurves, Box<dyn Error>> {
        Ok(edits.apply(curves).map_err(|error| self.named(&error))?)
    }

    /// Curves of a take and what it shows then, edited.
    pub fn follow(
        &self,
        edits: Option<&CurveEdits>,
        motion: &mut Motion,
    ) -> Result<MuscleCurves, Box<dyn Error>> {
        let mut curves = motion.curves()?;
        if let Some(edits) = edits {
            curves = self.apply(edits, curves)?;
        }
        motion.follow(&curves, edits.is_some_and(|edits| edits.mirror))?;
        Ok(curves)
    }
}

/// A file of contractions, by its double extension.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum CurveFile {
    /// `.muscles.csv`
    Muscles,
    /// `.livelink.csv`
    LiveLink,
}

impl CurveFile {
    /// What a path asks for; `None` of any other file.
    pub fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        let ends = [(".muscles.csv", Self::Muscles), (".livelink.csv", Self::LiveLink)];
        ends.into_iter().find(|(end, _)| name.ends_with(end)).map(|(_, kind)| kind)
    }

    /// Writes curves of a take.
    pub fn write(self, path: &Path, motion: &Motion, curves: &MuscleCurves) -> Outcome {
        match self {
            Self::Muscles => write_muscle_csv(path, curves)?,
            Self::LiveLink => motion.write_live_link(path, curves)?,
        }
        Ok(())
    }
}

/// Refuses files, edits and drives that a way of lifting cannot give, before any work is done.
pub fn check(
    lift: &LiftMode,
    wanted: bool,
    files: &[CurveFile],
    args: &EditArgs,
    edits: Option<&CurveEdits>,
) -> Outcome {
    if !wanted && files.is_empty() && edits.is_none() {
        return Ok(());
    }
    let LiftMode::Muscles(basis) = lift else { return Err(NO_MUSCLES.into()) };
    let basis = MuscleLift::lifting(basis);
    if files.contains(&CurveFile::LiveLink) && !CurveMap::is_arkit(&basis) {
        return Err(format!(
            ".livelink.csv holds ARKit's 52 shapes, and the basis {} has other muscles. Take --basis arkit, or write \
             .muscles.csv",
            basis.name
        )
        .into());
    }
    if let Some(edits) = edits {
        args.apply(edits, still_curves(&basis)?)?;
    }
    Ok(())
}

/// One frame in which nothing is contracted.
fn still_curves(basis: &MuscleBasis) -> Result<MuscleCurves, Box<dyn Error>> {
    let (muscles, channels) = CurveMap::columns(basis);
    let frame = CurveFrame {
        time: Timestamp(0),
        state: FaceState::Tracking,
        contractions: vec![0.0; muscles.len()],
        error: None,
    };
    Ok(MuscleCurves::new(muscles, channels, FrameRate::nearest(25.0), vec![frame])?)
}
