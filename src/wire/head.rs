//! A head's motion free of whose head it is.

use nalgebra::{Isometry3, Point3, Translation3, Vector3, center};

use crate::{
    head::{HeadPose, true_turn},
    lift::{Performer, upright},
    muscle::FaceAngles,
    rig::{PIVOT_DEPTH, TargetFace},
    tracking::index,
};

/// How a head has turned and moved since the neutral.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HeadMove {
    /// Yaw, pitch and roll as in [`FaceAngles::head`], radians.
    pub angles: [f64; 3],
    /// How far its pivot went in the level frame (x right in the picture, y up, z towards the camera), in outer canthal
    /// distances.
    pub shift: [f64; 3],
}

impl HeadMove {
    /// The motion of a target's head, in its scan frame, millimetres.
    pub fn on(&self, target: &TargetFace) -> Isometry3<f64> {
        let turn = FaceAngles { head: self.angles, ..FaceAngles::default() }.head_turn();
        let shift = Vector3::from(self.shift) * target.outer_canthal_distance();
        let turned = target.turned(&turn);
        Isometry3::from_parts(
            Translation3::from(turned.translation.vector + target.level.inverse() * shift),
            turned.rotation,
        )
    }

    /// `share` of the way from `self` to `other`.
    #[must_use]
    pub fn towards(&self, other: &Self, share: f64) -> Self {
        let mix = |from: [f64; 3], to: [f64; 3]| std::array::from_fn(|k| from[k] + (to[k] - from[k]) * share);
        Self { angles: mix(self.angles, other.angles), shift: mix(self.shift, other.shift) }
    }
}

/// Measures a performer's head.
#[derive(Debug, Clone)]
pub struct HeadMeter {
    rest: HeadPose,
    pivot: Point3<f64>,
    eyes: f64,
}

impl HeadMeter {
    /// Since the performer's neutral.
    pub fn new(performer: &Performer) -> Self {
        let eyes = performer.outer_canthal_distance();
        let neutral = performer.neutral();
        let middle = center(&neutral[index::RIGHT_EYE_OUTER], &neutral[index::LEFT_EYE_OUTER]);
        Self { rest: *performer.rest(), pivot: middle - Vector3::z() * (PIVOT_DEPTH * eyes), eyes }
    }

    /// How the head has moved.
    pub fn measure(&self, pose: &HeadPose) -> HeadMove {
        let turn = true_turn(&(upright() * pose.rotation * self.rest.rotation.inverse() * upright()));
        let shift = upright() * (pose.to_camera(&self.pivot) - self.rest.to_camera(&self.pivot));
        HeadMove {
            angles: FaceAngles::of_turn(&turn),
            shift: (shift / self.eyes.max(f64::MIN_POSITIVE)).into(),
        }
    }
}
