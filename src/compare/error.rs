//! What can go wrong with a comparison.

use crate::scan::MeshFault;

/// Every variant names the file, what was found, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// The predicted face is not the neutral moved.
    #[error(
        "{predicted} has {found} vertices, but the neutral {neutral} has {wanted}: a prediction is the neutral with its \
         vertices moved. Export it from the same file, as OBJ or PLY without merging or splitting vertices"
    )]
    OtherVertices {
        /// The prediction's file or name.
        predicted: String,
        /// The neutral's file or name.
        neutral: String,
        /// Vertices of the prediction.
        found: usize,
        /// Vertices of the neutral.
        wanted: usize,
    },
    /// As many vertices, joined otherwise.
    #[error(
        "{predicted} has as many vertices as the neutral {neutral}, but other triangles: it is another mesh, or its \
         faces were sorted anew. Export it from the same file with its faces as they are"
    )]
    OtherTriangles {
        /// The prediction's file or name.
        predicted: String,
        /// The neutral's file or name.
        neutral: String,
    },
    /// Nothing to measure.
    #[error(
        "no vertex of {neutral} lies within {reach} mm of its landmarks, so that there is no face to measure. Check the \
         landmarks and the unit (--unit), or measure every vertex with --all"
    )]
    NoFace {
        /// The neutral's file or name.
        neutral: String,
        /// Millimetres.
        reach: f64,
    },
    /// The truth has no surface that distances could be measured to.
    #[error("{truth}: {source}")]
    Truth {
        /// The truth's file or name.
        truth: String,
        /// What is wrong with it.
        source: MeshFault,
    },
    /// A vertex from which no distance could be measured.
    #[error(
        "vertex {vertex} of {file} is too far away to be measured. Check that all three files are in one frame and unit"
    )]
    OutOfReach {
        /// The file or name.
        file: String,
        /// Counted from 0.
        vertex: usize,
    },
}
