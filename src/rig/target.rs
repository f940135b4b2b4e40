//! The face that is driven: landmarks on a neutral scan.

use nalgebra::{Isometry3, Point3, Rotation3, UnitQuaternion, Vector3, center};

use super::{RigError, SourceFace};
use crate::tracking::{LANDMARK_COUNT, SKIN_LANDMARK_COUNT, index};

/// Landmarks that a target cannot do without: eyes, nose and mouth.
const FEWEST: usize = 40;
/// The head turns about a point this many outer canthal distances behind the eyes.
pub(crate) const PIVOT_DEPTH: f64 = 0.9;

/// A target's landmarks and how it must be turned to be seen as the performer is.
#[derive(Debug, Clone)]
pub struct TargetFace {
    /// 478 points on the target's surface; `None` where none was found. Scan frame, millimetres.
    pub landmarks: Vec<Option<Point3<f64>>>,
    /// From the scan frame to the frame in which the network sees the target as it sees the performer's neutral
    /// (x right in the picture, y up, z towards the camera). Without it a face scanned with the chin up would turn a
    /// dropping jaw into depth.
    pub level: Rotation3<f64>,
}

impl TargetFace {
    /// Checks that enough landmarks are there.
    pub fn new(landmarks: Vec<Option<Point3<f64>>>, level: Rotation3<f64>) -> Result<Self, RigError> {
        let found = landmarks.iter().flatten().count();
        let eyes = [index::RIGHT_EYE_OUTER, index::LEFT_EYE_OUTER, index::MOUTH_LEFT, index::MOUTH_RIGHT];
        let has_eyes = eyes.iter().all(|&i| landmarks.get(i).is_some_and(Option::is_some));
        if landmarks.len() != LANDMARK_COUNT || found < FEWEST || !has_eyes {
            return Err(RigError::TooFewLandmarks { found, wanted: FEWEST });
        }
        Ok(Self { landmarks, level })
    }

    /// The landmarks of a face from which motion comes, as a face to which it is carried.
    pub fn of_source(face: &SourceFace) -> Result<Self, RigError> {
        let mut landmarks: Vec<_> = face.points[..SKIN_LANDMARK_COUNT].iter().copied().map(Some).collect();
        landmarks.resize(LANDMARK_COUNT, None);
        Self::new(landmarks, face.level)
    }

    /// Distance between two landmarks, millimetres; 0 where one is missing.
    pub fn distance(&self, a: usize, b: usize) -> f64 {
        match (self.landmarks[a], self.landmarks[b]) {
            (Some(a), Some(b)) => (a - b).norm(),
            _ => 0.0,
        }
    }

    /// Millimetres between the outer eye corners.
    pub fn outer_canthal_distance(&self) -> f64 {
        self.distance(index::RIGHT_EYE_OUTER, index::LEFT_EYE_OUTER)
    }

    /// Midway between the outer eye corners. Scan frame, millimetres.
    pub fn eyes(&self) -> Point3<f64> {
        let corner = |landmark: usize| self.landmarks[landmark].unwrap_or_else(Point3::origin);
        center(&corner(index::RIGHT_EYE_OUTER), &corner(index::LEFT_EYE_OUTER))
    }

    /// The point about which the head turns. Scan frame, millimetres.
    pub fn pivot(&self) -> Point3<f64> {
        let back = Vector3::new(0.0, 0.0, -PIVOT_DEPTH * self.outer_canthal_distance());
        self.eyes() + self.level.inverse() * back
    }

    /// The head's motion, in the scan frame, when it turns by `turn` in the level frame.
    pub fn turned(&self, turn: &Rotation3<f64>) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_rotation_matrix(&(self.level.inverse() * turn * self.level));
        let pivot = self.pivot().coords;
        Isometry3::from_parts((pivot - turn * pivot).into(), turn)
    }
}
