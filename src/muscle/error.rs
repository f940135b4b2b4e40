//! What can go wrong with muscles.

use std::path::PathBuf;

use thiserror::Error;

/// Errors of muscle bases, their analysis and their curves.
#[derive(Debug, Error)]
pub enum MuscleError {
    /// A file that cannot be used.
    #[error("{}: {reason}. {remedy}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        reason: String,
        /// What to do.
        remedy: &'static str,
    },
}
