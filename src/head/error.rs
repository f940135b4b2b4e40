//! What can go wrong while the head's pose is sought.

/// Every variant says what was found and what to do.
#[derive(Debug, thiserror::Error)]
pub enum HeadError {
    /// A field of view no camera has.
    #[error("a field of view of {degrees}° is not possible; give one between 10 and 150 degrees")]
    FieldOfView {
        /// Degrees.
        degrees: f64,
    },
    /// No pose explains the landmarks.
    #[error("no head pose fits the landmarks of this frame")]
    NoPose,
    /// The image library failed.
    #[error("the pose solver failed: {0}")]
    Library(#[from] opencv::Error),
}
