//! The jaw: a rigid bone that turns about the condyles, slides sideways and forward.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Unit, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::FaceFrame;

/// Middle between the condyles from the middle of the outer eye corners, outer canthal distances, in the face's axes.
const CONDYLES: [f64; 3] = [0.0, -0.30, -0.62];
/// Radians: farther than this no jaw opens, nor shuts past its teeth.
const OPENING: std::ops::RangeInclusive<f64> = -0.04..=0.6;
/// Radians about the upright axis, and millimetres forward.
const SWING: std::ops::RangeInclusive<f64> = -0.12..=0.12;
const PROTRUSION: std::ops::RangeInclusive<f64> = -3.0..=8.0;
/// How much of the chin's motion along the line of sight is believed: it is the network's hint. What is across is seen.
const TRUST: f64 = 0.15;
/// Pulls the forward slide to none where nothing speaks for it, in millimetres² of the chin's points.
const STAY: f64 = 0.6;

/// Where one face's jaw turns. Scan frame, millimetres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Jaw {
    /// The middle between the condyles.
    pub pivot: Point3<f64>,
    /// From the scan frame to the face's axes.
    to_face: Rotation3<f64>,
}

/// One position of the jaw.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JawPose {
    /// Radians about the line through the condyles; positive opens.
    pub opening: f64,
    /// Radians about the upright axis; positive brings the chin to the subject's left.
    pub swing: f64,
    /// Millimetres forward.
    pub protrusion: f64,
}

impl Jaw {
    /// By the proportions of a face.
    pub fn of(frame: &FaceFrame) -> Self {
        let pivot = Point3::from(Vector3::from(CONDYLES) * frame.eyes);
        Self { pivot: frame.leave(&pivot), to_face: frame.rotation() }
    }

    /// The bone's motion from rest, scan frame, millimetres. `share` < 1 is what rests on it and lags, as the tongue.
    pub fn motion(&self, pose: &JawPose, share: f64) -> Isometry3<f64> {
        let turn = self.to_face.inverse() * turn(pose, share) * self.to_face;
        let slide = self.to_face.inverse() * Vector3::z() * (pose.protrusion * share);
        let turn = UnitQuaternion::from_rotation_matrix(&turn);
        let pivot = self.pivot.coords;
        Isometry3::from_parts((pivot - turn * pivot + slide).into(), turn)
    }

    /// The pose that moves the chin's points as they were seen to move: `points` with their displacements, and the camera
    /// that saw them, if it was one, scan frame, millimetres. Gauss–Newton from rest; the same input gives the same output.
    pub fn solve(
        &self,
        points: impl Iterator<Item = (Point3<f64>, Vector3<f64>)> + Clone,
        camera: Option<&Point3<f64>>,
    ) -> JawPose {
        const ROUNDS: usize = 6;
        let mut pose = JawPose::default();
        let seen = points.map(|(p, d)| {
            let sight = camera.and_then(|camera| (p - camera).try_normalize(0.0)).unwrap_or_default();
            (self.to_face * (p - self.pivot), self.to_face * d, self.to_face * sight)
        });
        let count = seen.clone().count() as f64;
        if count < 1.0 {
            return pose;
        }
        for _ in 0..ROUNDS {
            let rotation = turn(&pose, 1.0);
            let mut normal = Matrix3::zeros();
            let mut gradient = Vector3::zeros();
            for (arm, wanted, sight) in seen.clone() {
                let moved: Vector3<f64> = rotation * arm;
                let believed = |v: Vector3<f64>| v - sight * ((1.0 - TRUST) * sight.dot(&v));
                let residual = believed(wanted - (moved + Vector3::z() * pose.protrusion - arm));
                // Opening turns about +x, swing about +y, both applied to what has been turned already.
                let columns = [Vector3::x().cross(&moved), Vector3::y().cross(&moved), Vector3::z()];
                let jacobian = Matrix3::from_columns(&columns.map(believed));
                normal += jacobian.transpose() * jacobian;
                gradient += jacobian.transpose() * residual;
            }
            normal[(2, 2)] += STAY * count;
            gradient[2] -= STAY * count * pose.protrusion;
            normal += Matrix3::from_diagonal(&normal.diagonal()) * 1e-6;
            let Some(step) = normal.cholesky().map(|c| c.solve(&gradient)) else { break };
            pose.opening = clamp(pose.opening + step.x, &OPENING);
            pose.swing = clamp(pose.swing + step.y, &SWING);
            pose.protrusion = clamp(pose.protrusion + step.z, &PROTRUSION);
        }
        pose
    }
}

/// About the condyles in the face's axes: with the chin before and below them, a positive turn about +x drops it.
fn turn(pose: &JawPose, share: f64) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Unit::new_unchecked(Vector3::y()), pose.swing * share)
        * Rotation3::from_axis_angle(&Unit::new_unchecked(Vector3::x()), pose.opening * share)
}

fn clamp(value: f64, range: &std::ops::RangeInclusive<f64>) -> f64 {
    value.clamp(*range.start(), *range.end())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracking::{LANDMARK_COUNT, index};

    fn jaw() -> Jaw {
        let mut landmarks = vec![None; LANDMARK_COUNT];
        let turn = Rotation3::from_euler_angles(0.2, 0.1, -0.1);
        for (i, p) in [
            (index::RIGHT_EYE_OUTER, [-45.0, 0.0, 0.0]),
            (index::LEFT_EYE_OUTER, [45.0, 0.0, 0.0]),
            (index::MOUTH_RIGHT, [-25.0, -70.0, 11.0]),
            (index::MOUTH_LEFT, [25.0, -70.0, 11.0]),
        ] {
            landmarks[i] = Some(turn * Point3::from(p));
        }
        Jaw::of(&FaceFrame::of(&landmarks).unwrap())
    }

    fn chin(jaw: &Jaw) -> Vec<Point3<f64>> {
        let local = |x: f64, y: f64, z: f64| jaw.pivot + jaw.to_face.inverse() * Vector3::new(x, y, z);
        (-3..=3).map(|k| local(7.0 * f64::from(k), -80.0 - f64::from(k * k), 60.0)).collect()
    }

    /// Before the face, a little above it.
    fn camera(jaw: &Jaw) -> Point3<f64> {
        jaw.pivot + jaw.to_face.inverse() * Vector3::new(20.0, 60.0, 500.0)
    }

    #[test]
    fn known_poses_come_back() {
        let jaw = jaw();
        for (opening, swing) in [(0.0, 0.0), (0.25, 0.0), (0.4, 0.05), (0.1, -0.08)] {
            let pose = JawPose { opening, swing, protrusion: 0.0 };
            let motion = jaw.motion(&pose, 1.0);
            let seen: Vec<_> = chin(&jaw).into_iter().map(|p| (p, motion * p - p)).collect();
            let found = jaw.solve(seen.into_iter(), Some(&camera(&jaw)));
            assert!((found.opening - opening).abs() < 1e-3, "{found:?}");
            assert!((found.swing - swing).abs() < 1e-3, "{found:?}");
            assert!(found.protrusion.abs() < 0.2, "{found:?}");
        }
    }

    #[test]
    fn opening_lowers_the_chin_and_takes_it_back() {
        let jaw = jaw();
        let motion = jaw.motion(&JawPose { opening: 0.3, ..JawPose::default() }, 1.0);
        let chin = chin(&jaw)[3];
        let moved = jaw.to_face * (motion * chin - chin);
        assert!(moved.y < -10.0 && moved.z < -5.0, "{moved}");
        let pivot = motion * jaw.pivot;
        assert!((pivot - jaw.pivot).norm() < 1e-9);
    }

    #[test]
    fn nothing_seen_is_rest() {
        assert_eq!(jaw().solve(std::iter::empty(), None), JawPose::default());
        let still: Vec<_> = chin(&jaw()).into_iter().map(|p| (p, Vector3::zeros())).collect();
        let found = jaw().solve(still.into_iter(), Some(&camera(&jaw())));
        assert!(found.opening.abs() < 1e-12 && found.swing.abs() < 1e-12 && found.protrusion.abs() < 1e-12);
    }
}
