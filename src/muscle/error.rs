//! What can go wrong with muscles.

use std::path::PathBuf;

use thiserror::Error;

use crate::rig::RigError;

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
    /// A basis cannot be carried to a face.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// A muscle that moves nothing.
    #[error("{basis}: {muscle} moves nothing; leave it out, or sculpt its full contraction")]
    Idle {
        /// Of which basis.
        basis: String,
        /// Which.
        muscle: String,
    },
    /// A muscle whose shape is a mixture of others.
    #[error(
        "{basis}: the shape of {muscle} is a mixture of {of}, so that its contraction cannot be told; leave one out"
    )]
    Dependent {
        /// Of which basis.
        basis: String,
        /// Which.
        muscle: String,
        /// Those that make it up.
        of: String,
    },
}
