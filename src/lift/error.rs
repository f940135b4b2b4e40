//! What can go wrong between landmarks and motion.

use crate::head::HeadError;

/// Every variant says what was found and what to do.
#[derive(Debug, thiserror::Error)]
pub enum LiftError {
    /// No frame of the clip shows a face.
    #[error(
        "no face was found in any of the {frames} frames. Check that the face is upright, lit and at least about 60 pixels wide"
    )]
    NoFace {
        /// Frames looked at.
        frames: usize,
    },
    /// The stretch named by the user shows no neutral face.
    #[error(
        "the stretch {start:.2}–{end:.2} s cannot serve as the neutral: {reasons}. Name another with --neutral START..END, leave it out to have one chosen, or use it all the same with --accept-neutral"
    )]
    NotNeutral {
        /// Seconds.
        start: f64,
        /// Seconds.
        end: f64,
        /// Every reason, in words.
        reasons: String,
    },
    /// The stretch named by the user has no tracked frame.
    #[error(
        "no tracked frame lies between {start:.2} and {end:.2} s; the last one is at {duration:.2} s. Name another stretch with --neutral START..END or leave it out"
    )]
    EmptyNeutral {
        /// Seconds.
        start: f64,
        /// Seconds.
        end: f64,
        /// Seconds.
        duration: f64,
    },
    /// The average face does not fit the program.
    #[error("the average face has {found} points, not {wanted}. Run `make setup`")]
    AverageFace {
        /// Points found.
        found: usize,
        /// Points wanted.
        wanted: usize,
    },
    /// Head pose failed.
    #[error(transparent)]
    Head(#[from] HeadError),
}
