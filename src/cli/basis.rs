//! The part of the command line that names a basis of muscles.

use std::{
    error::Error,
    path::{Path, PathBuf},
};

use clap::Args;
use understudy::{
    muscle::MuscleBasis,
    pipeline::{TargetOptions, read_sculpts},
    tracking::Tracker,
    view::Gpu,
};

/// Which muscles there are.
#[derive(Clone, Args)]
pub struct BasisArgs {
    /// The muscles: `arkit` (ARKit's 52 names), `sixteen` (Choe and Ko's), a .json written by `muscles` or `refine`, or
    /// sculpts: a folder of neutral.obj and one .obj a muscle, or a .glb with morph targets
    #[arg(long, value_name = "BASIS")]
    pub basis: Option<PathBuf>,
}

impl BasisArgs {
    /// The basis that is named, or one of the built-in ones.
    pub fn read(
        &self,
        default: &'static MuscleBasis,
        gpu: &Gpu,
        tracker: &mut Tracker,
    ) -> Result<MuscleBasis, Box<dyn Error>> {
        if let Some(basis) = self.stated(default)? {
            return Ok(basis);
        }
        let path = self.basis.as_deref().unwrap_or(Path::new(""));
        Ok(read_sculpts(path, &TargetOptions::default(), gpu, tracker)?)
    }

    /// The same where that needs no networks; `None` for sculpts.
    pub fn stated(&self, default: &'static MuscleBasis) -> Result<Option<MuscleBasis>, Box<dyn Error>> {
        let Some(path) = &self.basis else { return Ok(Some(default.clone())) };
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        Ok(match (path.to_str(), extension.as_deref()) {
            (Some("arkit"), _) => Some(MuscleBasis::arkit().clone()),
            (Some("sixteen"), _) => Some(MuscleBasis::sixteen().clone()),
            (_, Some("json")) => {
                let basis = MuscleBasis::read(path)?;
                basis.check()?;
                Some(basis)
            }
            _ => None,
        })
    }
}
