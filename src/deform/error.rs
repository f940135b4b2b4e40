//! Why a surface warp could not be built.

/// Every variant says what was found; whoever asked can fall back to a spline.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DeformError {
    /// A position, triangle or weight is not usable.
    #[error("{what} {index} is not usable: not finite, or it names a vertex that is not there")]
    Unusable {
        /// What it is.
        what: &'static str,
        /// Which one.
        index: usize,
    },
    /// Nothing would move.
    #[error("no handle lies on a part of the surface that may move")]
    NoHandles,
    /// The factorisation would be too large.
    #[error("{vertices} vertices would have to be solved for, {most} at most can be")]
    TooLarge {
        /// Vertices that may move.
        vertices: usize,
        /// Vertices that can be solved for.
        most: usize,
    },
    /// The surface's triangles are so broken that the equations have no solution.
    #[error("the surface's equations cannot be solved: {reason}")]
    Broken {
        /// What the solver or the check found.
        reason: String,
    },
}
