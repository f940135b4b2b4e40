//! The 478 landmarks of the network, and how sure each is.

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Number of landmarks: 468 on the skin, then five for each iris (right eye first).
pub const LANDMARK_COUNT: usize = 478;

/// Number of landmarks on the skin; the canonical face has one vertex for each.
pub const SKIN_LANDMARK_COUNT: usize = 468;

/// Indices of landmarks that the code names. Left and right are the subject's.
pub mod index {
    /// Outer corner of the right eye.
    pub const RIGHT_EYE_OUTER: usize = 33;
    /// Inner corner of the right eye.
    pub const RIGHT_EYE_INNER: usize = 133;
    /// Outer corner of the left eye.
    pub const LEFT_EYE_OUTER: usize = 263;
    /// Inner corner of the left eye.
    pub const LEFT_EYE_INNER: usize = 362;
    /// Middle of the upper lid, right eye.
    pub const RIGHT_LID_UPPER: usize = 159;
    /// Middle of the lower lid, right eye.
    pub const RIGHT_LID_LOWER: usize = 145;
    /// Middle of the upper lid, left eye.
    pub const LEFT_LID_UPPER: usize = 386;
    /// Middle of the lower lid, left eye.
    pub const LEFT_LID_LOWER: usize = 374;
    /// Middle of the upper lip's inner rim.
    pub const UPPER_LIP_INNER: usize = 13;
    /// Middle of the lower lip's inner rim.
    pub const LOWER_LIP_INNER: usize = 14;
    /// Inner rim of the upper lip between the corners, from the subject's right to the left.
    pub const UPPER_INNER: [usize; 9] = [191, 80, 81, 82, 13, 312, 311, 310, 415];
    /// Inner rim of the lower lip; each stands below its partner in [`UPPER_INNER`].
    pub const LOWER_INNER: [usize; 9] = [95, 88, 178, 87, 14, 317, 402, 318, 324];
    /// Right corner of the mouth.
    pub const MOUTH_RIGHT: usize = 61;
    /// Left corner of the mouth.
    pub const MOUTH_LEFT: usize = 291;
    /// Lowest point of the chin.
    pub const CHIN: usize = 152;
    /// Bridge of the nose, between the eyes.
    pub const NOSE_BRIDGE: usize = 168;
    /// Tip of the nose.
    pub const NOSE_TIP: usize = 4;
    /// Middle of the right brow.
    pub const RIGHT_BROW: usize = 105;
    /// Middle of the left brow.
    pub const LEFT_BROW: usize = 334;
    /// Centre of the right iris.
    pub const RIGHT_IRIS: usize = 468;
    /// Centre of the left iris.
    pub const LEFT_IRIS: usize = 473;
}

/// Where a landmark's position comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LandmarkState {
    /// Seen in this frame, or placed by hand.
    #[default]
    Observed,
    /// Not seen; carried over from its mirror image, from earlier frames, or from the neutral.
    Inferred,
    /// Neither seen nor inferred.
    Absent,
}

/// One face in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Landmarks {
    /// 478 × (x right, y down, depth hint away from the camera), all in image pixels; pixel centres are integers.
    pub points: Vec<Vector3<f64>>,
    /// 478 states.
    pub states: Vec<LandmarkState>,
    /// The network's own probability that a face is there, 0..=1.
    pub presence: f64,
}

impl Landmarks {
    /// A landmark's place in the picture.
    pub fn pixel(&self, landmark: usize) -> Vector2<f64> {
        self.points[landmark].xy()
    }

    /// Pixels between two landmarks.
    pub fn distance(&self, a: usize, b: usize) -> f64 {
        (self.pixel(a) - self.pixel(b)).norm()
    }

    /// Pixels between the outer eye corners: the face's own measure.
    pub fn outer_canthal_distance(&self) -> f64 {
        self.distance(index::RIGHT_EYE_OUTER, index::LEFT_EYE_OUTER)
    }
}
