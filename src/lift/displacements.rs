//! What the face does, once the head is held still.

use nalgebra::Vector3;

use crate::tracking::{LANDMARK_COUNT, LandmarkState};

/// How each landmark of the performer's neutral scan is displaced in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Displacements {
    /// 478 vectors in the performer's scan frame, millimetres.
    pub vectors: Vec<Vector3<f64>>,
    /// 478 states. The component along the camera's axis is inferred even where the landmark is observed.
    pub states: Vec<LandmarkState>,
}

impl Displacements {
    /// The neutral face.
    pub fn neutral() -> Self {
        Self {
            vectors: vec![Vector3::zeros(); LANDMARK_COUNT],
            states: vec![LandmarkState::Inferred; LANDMARK_COUNT],
        }
    }
}
