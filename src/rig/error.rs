//! What can go wrong while a performer is tied to a target.

use crate::spline::SplineError;

/// Every variant says what was found and what to do.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// The target has too few landmarks.
    #[error(
        "only {found} of the target's landmarks are known; at least {wanted} are needed. Give a landmark file with --landmarks, or a scan that shows the whole face"
    )]
    TooFewLandmarks {
        /// Landmarks found.
        found: usize,
        /// Landmarks wanted.
        wanted: usize,
    },
    /// The vertex × control matrix would not fit into memory.
    #[error(
        "the scan has {vertices} vertices, at most {most} can be animated. Decimate it, for instance with Blender's Decimate modifier or MeshLab"
    )]
    TooManyVertices {
        /// Vertices found.
        vertices: usize,
        /// Vertices that can be animated.
        most: usize,
    },
    /// A spline could not be fitted.
    #[error("the spline for {what} cannot be fitted: {source}")]
    Spline {
        /// Which spline.
        what: &'static str,
        /// Why.
        source: SplineError,
    },
}
