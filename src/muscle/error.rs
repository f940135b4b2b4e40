//! What can go wrong with muscles.

use std::path::PathBuf;

use thiserror::Error;

use crate::{rig::RigError, rows::Fault};

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
    /// Curves that do not fit together.
    #[error("the contraction curves cannot be used: {reason}")]
    Curves {
        /// What was found, and where.
        reason: String,
    },
    /// No such muscle among those there are.
    #[error("there is no muscle {name:?}; {has}")]
    Unknown {
        /// What was asked for.
        name: String,
        /// Those with similar names, or all.
        has: String,
    },
    /// Curves of muscles that a basis does not have.
    #[error(
        "the muscles {muscles} are none of the basis {basis}. Name the basis that the curves were made with by --basis, or \
         correct their names"
    )]
    Foreign {
        /// What the basis is called.
        basis: String,
        /// Those that it lacks.
        muscles: String,
    },
    /// Curves cannot be mirrored because a muscle's other side is missing.
    #[error(
        "cannot mirror: {name} is there without {other}. Take `mirror` out, or give curves with both sides"
    )]
    OneSided {
        /// The muscle that is there.
        name: String,
        /// The one that is not.
        other: String,
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
    /// Markers of one side lie on the other.
    #[error(
        "{}: {markers}. Left and right are the subject's: rename them, or mirror the take back, and read it again",
        path.display()
    )]
    Sides {
        /// The take.
        path: PathBuf,
        /// Which, and how.
        markers: String,
    },
    /// Nobody knows where markers sit.
    #[error(
        "{}: {known} markers have names that tell where they sit, too few to place {names}. Write a file that says \
         which landmark each is at, or \"off\":\n{example}",
        path.display()
    )]
    Unplaced {
        /// The take.
        path: PathBuf,
        /// How many are known.
        known: usize,
        /// Those that are not.
        names: String,
        /// The file to write, TOML.
        example: String,
    },
    /// Markers that do not tell how the take lies.
    #[error("the markers cannot be aligned with the face: {reason}. {remedy}")]
    Alignment {
        /// Why.
        reason: String,
        /// What to do.
        remedy: &'static str,
    },
    /// Takes from which nothing can be learned.
    #[error("{reason}. {remedy}")]
    Training {
        /// Why.
        reason: String,
        /// What to do.
        remedy: &'static str,
    },
}

impl From<Fault> for MuscleError {
    fn from(fault: Fault) -> Self {
        Self::File { path: fault.path, reason: fault.reason, remedy: fault.remedy }
    }
}
