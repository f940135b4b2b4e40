//! What can go wrong between a scan and its grid.

use crate::spline::SplineError;

/// Every variant says what was found and what to do; the file is named by who knows it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GridError {
    /// A grid's sides or extent cannot be used.
    #[error("a grid of {columns}x{rows} points over {width} x {height} mm cannot be laid: {remedy}")]
    Raster {
        /// Points across.
        columns: usize,
        /// Points down.
        rows: usize,
        /// Extent across, millimetres.
        width: f64,
        /// Extent down, millimetres.
        height: f64,
        /// What to change.
        remedy: &'static str,
    },
    /// The landmarks do not tell where the face looks.
    #[error(
        "its landmarks do not show where the face looks: outer eye corners and mouth corners are needed. Give a \
         landmark file that has them with --landmarks"
    )]
    NoAxes,
    /// No grid point met the face.
    #[error(
        "no grid cell lies on its face with all four corners. Look at its landmarks with `understudy landmark SCAN -o \
         picture.png`, or ask for a finer grid"
    )]
    NoFace,
    /// A landmark that a method needs is missing.
    #[error("the {whose} has no landmark {name}, which --normalise affine needs. Use --normalise similarity")]
    MissingLandmark {
        /// Which face.
        whose: &'static str,
        /// Which landmark.
        name: &'static str,
    },
    /// Four points that do not span space.
    #[error(
        "the outer eye corners, chin and nose tip of the {whose} lie nearly in one plane (condition number \
         {condition:.3e}, at most {limit} is used), so no affine map follows from them. Use --normalise similarity, or \
         correct the landmarks"
    )]
    Singular {
        /// Which face.
        whose: &'static str,
        /// Ratio of the largest to the smallest singular value.
        condition: f64,
        /// The largest that is accepted.
        limit: f64,
    },
    /// Too few landmarks that several faces share.
    #[error("the faces share {found} landmarks, and {wanted} are needed: {remedy}")]
    TooFewCommon {
        /// How many there are.
        found: usize,
        /// How many there must be.
        wanted: usize,
        /// What to do.
        remedy: &'static str,
    },
    /// Landmarks that lie in one place or are not finite.
    #[error(
        "the landmarks of face {face} (counted from 0) lie in one place or are not finite. Place them again"
    )]
    NoExtent {
        /// Which of the faces.
        face: usize,
    },
    /// The iteration did not come to rest.
    #[error(
        "the consensus still moved by {change:.1e} of its size after {rounds} rounds. Leave out scans whose landmarks \
         are not where they should be"
    )]
    NotSettled {
        /// Rounds made.
        rounds: usize,
        /// Last change over the consensus' size.
        change: f64,
    },
    /// No place of the grid is covered by enough faces.
    #[error(
        "no grid cell is covered by {share:.0} % of the scans. Lower --share, or look at the scans' landmarks"
    )]
    NothingCovered {
        /// The share asked for, percent.
        share: f64,
    },
    /// The morph to the consensus.
    #[error(transparent)]
    Spline(#[from] SplineError),
    /// A stored transform is not one.
    #[error(
        "it is no transform that this program has stored: {reason}. Name the .transform.json that `preprocess` wrote"
    )]
    Record {
        /// What is wrong.
        reason: String,
    },
}
