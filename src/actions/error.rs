//! What can go wrong with action units and their libraries.

use std::path::PathBuf;

/// Every variant says what was found and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ActionError {
    /// No such action unit.
    #[error(
        "{text:?} is no action unit that a surface can show. Known: {known}; write a side as in 12L or 4R"
    )]
    Unknown {
        /// What was written.
        text: String,
        /// What could have been.
        known: String,
    },
    /// A side was asked of an action that has none.
    #[error("AU{au} ({name}) acts on the middle of the face and has no sides: write {au} alone")]
    NoSides {
        /// Its number.
        au: u8,
        /// Its name.
        name: String,
    },
    /// No such emotion.
    #[error("{text:?} is no emotion of the table. Known: {known}")]
    UnknownEmotion {
        /// What was written.
        text: String,
        /// What could have been.
        known: String,
    },
    /// A magnitude is not in 0..=1.
    #[error(
        "a magnitude of {value} for AU{unit} is outside 0 to 1: 0 is the neutral face, 1 the full expression"
    )]
    Magnitude {
        /// Which.
        unit: String,
        /// How much.
        value: f64,
    },
    /// A library has not got an action that was asked for.
    #[error("the library {library} has no AU{unit}; it has {has}")]
    NotInLibrary {
        /// Which library.
        library: String,
        /// Which action.
        unit: String,
        /// What it has.
        has: String,
    },
    /// A library, a keyframe file or a table cannot be read.
    #[error("{path}: {reason}. {remedy}")]
    File {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
        /// What to do.
        remedy: &'static str,
    },
    /// Too few landmarks are common to two faces.
    #[error(
        "only {found} landmarks are known on both {what}; at least {wanted} are needed. Give landmark files with \
         --landmarks and --expressive-landmarks, or scans that show the whole face"
    )]
    TooFewLandmarks {
        /// Landmarks found.
        found: usize,
        /// Landmarks needed.
        wanted: usize,
        /// Which faces.
        what: String,
    },
    /// A spline between two faces cannot be fitted.
    #[error("the spline between {what} cannot be fitted: {source}")]
    Spline {
        /// Which faces.
        what: String,
        /// Why.
        source: crate::spline::SplineError,
    },
}

impl From<crate::rows::Fault> for ActionError {
    fn from(fault: crate::rows::Fault) -> Self {
        Self::File { path: fault.path, reason: fault.reason, remedy: fault.remedy }
    }
}
