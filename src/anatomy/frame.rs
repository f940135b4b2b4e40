//! The face's own axes, in which its anatomy is laid out.

use nalgebra::{Isometry3, Point3, Rotation3, Unit, Vector3};
use serde::{Deserialize, Serialize};

use crate::tracking::index;

/// On an average face (MediaPipe's canonical one) the line from the mouth's corners up to the eyes' leans back by this
/// much, radians.
const LEAN: f64 = 0.16;

/// Axes of one face: x to the subject's left along the eyes, y up, z out of the face; origin amid the outer eye corners.
/// Millimetres, as the scan frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FaceFrame {
    /// From the scan frame to the face's axes.
    to_face: Isometry3<f64>,
    /// Outer canthal distance, millimetres.
    pub eyes: f64,
    /// Distance of the mouth's corners, millimetres.
    pub mouth: f64,
}

impl FaceFrame {
    /// From 478 landmarks in the scan frame; `None` where eyes or mouth are missing or coincide.
    pub fn of(landmarks: &[Option<Point3<f64>>]) -> Option<Self> {
        let at = |i: usize| landmarks.get(i).copied().flatten();
        let (right, left) = (at(index::RIGHT_EYE_OUTER)?, at(index::LEFT_EYE_OUTER)?);
        let (mouth_right, mouth_left) = (at(index::MOUTH_RIGHT)?, at(index::MOUTH_LEFT)?);
        let middle = nalgebra::center(&right, &left);
        let x = Unit::try_new(left - right, 1e-9)?;
        let up = middle - nalgebra::center(&mouth_right, &mouth_left);
        let z = Unit::try_new(x.cross(&up), 1e-9)?;
        let upright = Rotation3::face_towards(&z, &up).inverse();
        let lean = Rotation3::from_axis_angle(&Vector3::x_axis(), -LEAN);
        let turn = lean * upright;
        let to_face = Isometry3::from_parts((-(turn * middle.coords)).into(), turn.into());
        Some(Self { to_face, eyes: (left - right).norm(), mouth: (mouth_left - mouth_right).norm() })
    }

    /// A place of the scan frame in the face's axes.
    pub fn enter(&self, point: &Point3<f64>) -> Point3<f64> {
        self.to_face * point
    }

    /// A place in the face's axes in the scan frame.
    pub fn leave(&self, point: &Point3<f64>) -> Point3<f64> {
        self.to_face.inverse() * point
    }

    /// A direction in the face's axes in the scan frame.
    pub fn leave_vector(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        self.to_face.rotation.inverse() * vector
    }

    /// From the scan frame to the face's axes, without the shift.
    pub fn rotation(&self) -> Rotation3<f64> {
        self.to_face.rotation.to_rotation_matrix()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracking::LANDMARK_COUNT;

    #[test]
    fn a_turned_face_is_brought_upright_and_back() {
        let turn = Rotation3::from_euler_angles(0.3, -0.5, 0.2);
        let mut landmarks = vec![None; LANDMARK_COUNT];
        // An upright face whose mouth stands forward as the average one's does.
        let depth = 70.0 * LEAN.tan();
        for (i, p) in [
            (index::RIGHT_EYE_OUTER, [-45.0, 0.0, 0.0]),
            (index::LEFT_EYE_OUTER, [45.0, 0.0, 0.0]),
            (index::MOUTH_RIGHT, [-25.0, -70.0, depth]),
            (index::MOUTH_LEFT, [25.0, -70.0, depth]),
        ] {
            landmarks[i] = Some(turn * Point3::from(p) + Vector3::new(3.0, 4.0, 5.0));
        }
        let frame = FaceFrame::of(&landmarks).unwrap();
        assert!((frame.eyes - 90.0).abs() < 1e-9 && (frame.mouth - 50.0).abs() < 1e-9);
        assert!((frame.rotation().matrix() - turn.inverse().matrix()).norm() < 1e-9);
        let mouth = frame.enter(&landmarks[index::MOUTH_LEFT].unwrap());
        assert!((mouth - Point3::new(25.0, -70.0, depth)).norm() < 1e-9, "{mouth}");
        let back = frame.leave(&mouth);
        assert!((back - landmarks[index::MOUTH_LEFT].unwrap()).norm() < 1e-9);
        landmarks[index::MOUTH_LEFT] = None;
        assert!(FaceFrame::of(&landmarks).is_none());
    }
}
