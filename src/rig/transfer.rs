//! How a displacement on the source becomes one on the target.
//!
//! 000 §5.6.2 copies control point vectors, those of the lower face scaled by the ratio of mouth widths (eq. 5.8–5.10):
//! [`TransferRule::Mouth`]. The default instead bends vectors with the face: v' = f(P + v) − f(P), where f is the
//! landmark spline from source to target, regularised so that it follows the two faces' proportions and not their
//! every landmark. f is smooth on the scale of any expression, so its Jacobian at P stands for the difference and every
//! rule is one fixed 3 × 3 matrix for each handle.

use nalgebra::{Matrix3, Point3, Vector3};

use super::{RigError, SourceFace, TargetFace, TransferRule};
use crate::{
    anatomy::{alike_pairs, face_spline},
    tracking::index,
};

/// Fixed linear maps, one for each handle, from the source's scan frame to the target's.
#[derive(Debug, Clone)]
pub struct Transfer {
    maps: Vec<Matrix3<f64>>,
    /// Where the landmark spline puts each of the source's handles on the target, scan frame, millimetres.
    places: Vec<Point3<f64>>,
}

impl Transfer {
    /// Builds the maps for one source and one target.
    pub fn new(source: &SourceFace, target: &TargetFace, rule: TransferRule) -> Result<Self, RigError> {
        let (from, to) = (source.level, target.level);
        let pairs = level_pairs(source, target);
        let spline = face_spline(&pairs, source.outer_canthal_distance())
            .map_err(|source| RigError::Spline { what: "the landmarks of source and target", source })?;
        let levelled: Vec<_> = source.points.iter().map(|p| from * p).collect();
        let places = levelled.iter().map(|p| Point3::from(to.inverse() * spline.evaluate(p))).collect();
        let nose = levelled[index::NOSE_TIP].y;
        let mouth = ratio(source, target, index::MOUTH_LEFT, index::MOUTH_RIGHT);
        let eyes = ratio(source, target, index::LEFT_EYE_OUTER, index::RIGHT_EYE_OUTER);
        let axes = extents(&pairs);
        let level = |p: &Point3<f64>| match rule {
            TransferRule::Spline if source.has_depth => spline.jacobian(p),
            TransferRule::Spline => along_sight(spline.jacobian(p)),
            TransferRule::Mouth if p.y < nose => Matrix3::from_diagonal_element(mouth),
            TransferRule::Copy | TransferRule::Mouth => Matrix3::identity(),
            TransferRule::Eyes => Matrix3::from_diagonal_element(eyes),
            TransferRule::Axes => Matrix3::from_diagonal(&axes),
        };
        let maps = levelled.iter().map(|p| to.inverse().matrix() * level(p) * from.matrix()).collect();
        Ok(Self { maps, places })
    }

    /// A displacement of one of the source's handles, on the target.
    pub fn vector(&self, handle: usize, vector: &Vector3<f64>) -> Vector3<f64> {
        self.maps[handle] * vector
    }

    /// Where the landmark spline puts one of the source's handles on the target; the surface may lie elsewhere.
    pub fn place(&self, handle: usize) -> Point3<f64> {
        self.places[handle]
    }
}

/// What moves along the line of sight is inferred, and stays on it: two faces whose depths differ from side to side
/// would otherwise turn it into a shift that nobody saw, and a dropping jaw into one that swings.
fn along_sight(mut jacobian: Matrix3<f64>) -> Matrix3<f64> {
    jacobian[(0, 2)] = 0.0;
    jacobian[(1, 2)] = 0.0;
    jacobian
}

/// The landmarks of both, in their level frames.
fn level_pairs(source: &SourceFace, target: &TargetFace) -> Vec<(Point3<f64>, Point3<f64>)> {
    alike_pairs(|i| Some(source.level * source.points[i]), |i| Some(target.level * target.landmarks[i]?))
}

/// 000's s_t / s_s for one pair of landmarks.
fn ratio(source: &SourceFace, target: &TargetFace, a: usize, b: usize) -> f64 {
    target.distance(a, b) / source.distance(a, b).max(f64::MIN_POSITIVE)
}

/// Ratios of the two faces' root mean square extents along the level axes, over the landmarks that both have.
fn extents(pairs: &[(Point3<f64>, Point3<f64>)]) -> Vector3<f64> {
    let (from, to): (Vec<_>, Vec<_>) = pairs.iter().map(|(from, to)| (from.coords, to.coords)).unzip();
    spread(&to).component_div(&spread(&from))
}

/// Root mean square distance from the mean along each axis.
fn spread(points: &[Vector3<f64>]) -> Vector3<f64> {
    let count = points.len().max(1) as f64;
    let mean = points.iter().sum::<Vector3<f64>>() / count;
    let squares: Vector3<f64> = points.iter().map(|point| (point - mean).map(|c| c * c)).sum();
    squares.map(|s| (s / count).sqrt().max(f64::MIN_POSITIVE))
}
