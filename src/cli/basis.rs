//! The part of the command line that names a basis of muscles.

use std::{error::Error, path::PathBuf};

use clap::Args;
use understudy::{
    muscle::MuscleBasis,
    pipeline::{TargetOptions, read_sculpts},
    tracking::Tracker,
    view::Gpu,
};

/// Which muscles there are.
#[derive(Args)]
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
        let Some(path) = &self.basis else { return Ok(default.clone()) };
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        Ok(match (path.to_str(), extension.as_deref()) {
            (Some("arkit"), _) => MuscleBasis::arkit().clone(),
            (Some("sixteen"), _) => MuscleBasis::sixteen().clone(),
            (_, Some("json")) => {
                let basis = MuscleBasis::read(path)?;
                basis.check()?;
                basis
            }
            _ => read_sculpts(path, &TargetOptions::default(), gpu, tracker)?,
        })
    }
}
