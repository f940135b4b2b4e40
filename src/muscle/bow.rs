//! The jaw between shut and fully open: a rotation, and not a straight line.
//!
//! 001 calls its sixteenth element "Jaw rotation" and mixes it in a straight line as all others. Half way the chin of a
//! wide open mouth is then 1.5 mm too far back. Here a point moves on the arc of the rotation that explains its own motion
//! best, and what the rotation does not explain goes in a straight line.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use crate::{
    anatomy::{CHIN, FaceFrame, Jaw, JawPose},
    tracking::SKIN_LANDMARK_COUNT,
};

/// The difference between arc and straight line for one face and one full opening.
#[derive(Debug, Clone)]
pub struct JawBow {
    jaw: Jaw,
    open: JawPose,
    /// How much of the jaw's turn each point follows, 0..=1.
    shares: Vec<f64>,
    points: Vec<Point3<f64>>,
}

impl JawBow {
    /// `points` and how far each goes when the jaw is fully open, scan frame, millimetres; the first 468 are the network's
    /// landmarks. `None` where no rotation explains the chin.
    pub fn new(points: &[Point3<f64>], vectors: &[Vector3<f64>]) -> Option<Self> {
        let landmarks: Vec<_> = points.iter().take(SKIN_LANDMARK_COUNT).copied().map(Some).collect();
        let jaw = Jaw::of(&FaceFrame::of(&landmarks)?);
        let open = jaw.solve(CHIN.into_iter().map(|i| (points[i], vectors[i])), None);
        let motion = jaw.motion(&open, 1.0);
        let share = |(p, v): (&Point3<f64>, &Vector3<f64>)| {
            let turned = motion * p - p;
            let own = turned.norm_squared();
            if own < 1e-6 { 0.0 } else { (turned.dot(v) / own).clamp(0.0, 1.0) }
        };
        let shares = points.iter().zip(vectors).map(share).collect();
        (open.opening > 0.0).then(|| Self { jaw, open, shares, points: points.to_vec() })
    }

    /// What a contraction adds to the straight line; nothing at 0 and at 1. Call the result for each point.
    pub fn at(&self, contraction: f64) -> impl Fn(usize) -> Vector3<f64> + '_ {
        let part = self.motion(contraction);
        let whole = self.motion(1.0);
        move |point| {
            let share = self.shares[point];
            if share == 0.0 {
                return Vector3::zeros();
            }
            let p = self.points[point];
            ((part * p - p) - (whole * p - p) * contraction) * share
        }
    }

    /// A and b of A·p + b, which a point p that follows the jaw whole gets from [`JawBow::at`].
    pub(super) fn affine(&self, contraction: f64) -> (Matrix3<f64>, Vector3<f64>) {
        let (part, whole) = (self.motion(contraction), self.motion(1.0));
        let turn =
            |motion: &Isometry3<f64>| *motion.rotation.to_rotation_matrix().matrix() - Matrix3::identity();
        (
            turn(&part) - turn(&whole) * contraction,
            part.translation.vector - whole.translation.vector * contraction,
        )
    }

    /// How much of the jaw's turn a point follows, and the point.
    pub(super) fn follower(&self, point: usize) -> (f64, Point3<f64>) {
        (self.shares[point], self.points[point])
    }

    fn motion(&self, contraction: f64) -> Isometry3<f64> {
        let JawPose { opening, swing, protrusion } = self.open;
        let pose = JawPose {
            opening: opening * contraction,
            swing: swing * contraction,
            protrusion: protrusion * contraction,
        };
        self.jaw.motion(&pose, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{muscle::MuscleBasis, tracking::index};

    #[test]
    fn the_chin_keeps_its_distance_from_the_condyles() {
        let basis = MuscleBasis::sixteen();
        let element = &basis.elements[basis.index("jaw_rotation").unwrap()];
        let bow = JawBow::new(&basis.face, &element.vectors).unwrap();
        for end in [0.0, 1.0] {
            assert!(bow.at(end)(index::CHIN).norm() < 1e-9);
        }
        // Rigid, all of it: a point that follows the jaw whole stays on its circle, a straight line falls inside.
        let chin = basis.face[index::CHIN];
        let full = bow.motion(1.0) * chin - chin;
        let arm = |p: Point3<f64>| (p - bow.jaw.pivot).norm();
        let slide = bow.open.protrusion;
        let half = chin + full * 0.5 + bow.at(0.5)(index::CHIN) / bow.shares[index::CHIN];
        assert!((arm(half) - arm(chin)).abs() < 0.2 + slide.abs(), "{} {}", arm(half), arm(chin));
        assert!(arm(chin) - arm(chin + full * 0.5) > 1.0);
        assert!(bow.at(0.5)(index::NOSE_BRIDGE).norm() < 0.1);
    }
}
