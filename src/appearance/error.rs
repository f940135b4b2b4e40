//! What can go wrong with skins and their states.

use std::path::PathBuf;

use crate::rows::Fault;

/// Every variant says what was found and what to do.
#[derive(Debug, thiserror::Error)]
pub enum AppearanceError {
    /// A file that cannot be used.
    #[error("{} cannot be used: {reason}. {remedy}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What was found.
        reason: String,
        /// What to do.
        remedy: &'static str,
    },
    /// Frames that were named as exemplars and cannot be.
    #[error("the frames of {region} cannot be used: {reason}. Look at the sheet, and name other frames")]
    Exemplars {
        /// Name of the region.
        region: &'static str,
        /// Why.
        reason: String,
    },
    /// A take that shows nothing that can be learnt.
    #[error("nothing could be learnt:\n{reasons}")]
    NothingLearnt {
        /// A line for each region, which says why and what to perform.
        reasons: String,
    },
}

impl From<Fault> for AppearanceError {
    fn from(fault: Fault) -> Self {
        Self::File { path: fault.path, reason: fault.reason, remedy: fault.remedy }
    }
}
