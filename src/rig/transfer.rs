//! How a displacement on the performer becomes one on the target.
//!
//! 000 §5.6.2 copies control point vectors, those of the lower face scaled by the ratio of mouth widths (eq. 5.8–5.10):
//! [`TransferRule::Thesis`]. The default instead bends vectors with the face: v' = f(P + v) − f(P), where f is the
//! landmark spline from performer to target, regularised so that it follows the two faces' proportions and not their
//! every landmark. f is smooth on the scale of any expression, so its Jacobian at P stands for the difference and the
//! rule is one fixed 3 × 3 matrix for each landmark.

use nalgebra::{Matrix3, Point3, Vector3};

use super::{RigError, TargetFace};
use crate::{
    lift::{Displacements, Performer},
    spline::{Kernel, Options, Regularisation, Spline},
    tracking::{Region, SKIN_LANDMARK_COUNT, index, landmark_table},
};

/// λ of the landmark spline over the squared outer canthal distance: measured best over identities and warps.
const LAMBDA: f64 = 0.4;

/// The rule for vectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TransferRule {
    /// Bent by the regularised landmark spline.
    #[default]
    Spline,
    /// 000 eq. 5.8 below the tip of the nose, eq. 5.10 above, and a warp for each of the two regions.
    Thesis,
}

/// Fixed linear maps, one for each skin landmark, from the performer's scan frame to the target's.
#[derive(Debug, Clone)]
pub struct Transfer {
    maps: Vec<Matrix3<f64>>,
    /// Where the landmark spline puts each of the performer's landmarks on the target, scan frame, millimetres.
    places: Vec<Point3<f64>>,
}

impl Transfer {
    /// Builds the maps for one performer and one target.
    pub fn new(performer: &Performer, target: &TargetFace, rule: TransferRule) -> Result<Self, RigError> {
        let (from, to) = (performer.level(), target.level);
        let spline = landmark_spline(performer, target)?;
        let levelled: Vec<_> = performer.neutral()[..SKIN_LANDMARK_COUNT].iter().map(|p| from * p).collect();
        let places = levelled.iter().map(|p| Point3::from(to.inverse() * spline.evaluate(p))).collect();
        let maps = match rule {
            TransferRule::Spline => {
                let level = |p| along_sight(spline.jacobian(p));
                levelled.iter().map(|p| to.inverse().matrix() * level(p) * from.matrix()).collect()
            }
            TransferRule::Thesis => {
                let turn = (to.inverse() * from).into_inner();
                let ratio = mouth_ratio(performer, target);
                let nose = performer.neutral()[index::NOSE_TIP].y;
                let is_lower = |p: &Point3<f64>| p.y < nose;
                performer.neutral()[..SKIN_LANDMARK_COUNT]
                    .iter()
                    .map(|p| if is_lower(p) { turn * ratio } else { turn })
                    .collect()
            }
        };
        Ok(Self { maps, places })
    }

    /// The target's displacement at a skin landmark, scan frame, millimetres.
    pub fn displacement(&self, landmark: usize, displacements: &Displacements) -> Vector3<f64> {
        self.maps[landmark] * displacements.vectors[landmark]
    }

    /// Where the landmark spline puts the performer's landmark on the target; the surface may lie elsewhere.
    pub fn place(&self, landmark: usize) -> Point3<f64> {
        self.places[landmark]
    }
}

/// What moves along the line of sight is inferred, and stays on it: two faces whose depths differ from side to side
/// would otherwise turn it into a shift that nobody saw, and a dropping jaw into one that swings.
fn along_sight(mut jacobian: Matrix3<f64>) -> Matrix3<f64> {
    jacobian[(0, 2)] = 0.0;
    jacobian[(1, 2)] = 0.0;
    jacobian
}

/// f, from the performer's level frame to the target's, fitted on points that both networks place alike.
fn landmark_spline(performer: &Performer, target: &TargetFace) -> Result<Spline<3>, RigError> {
    let table = landmark_table();
    let (centres, values): (Vec<_>, Vec<_>) = (0..SKIN_LANDMARK_COUNT)
        .filter(|&i| table[i].region != Region::Oval)
        .filter_map(|i| {
            let place = target.landmarks[i]?;
            Some((performer.level() * performer.neutral()[i], (target.level * place).coords))
        })
        .unzip();
    let scale = performer.outer_canthal_distance();
    let options =
        Options { regularisation: Regularisation::Absolute(LAMBDA * scale * scale), ..Options::default() };
    Spline::fit(Kernel::ThinPlate, &centres, &values, options)
        .map_err(|source| RigError::Spline { what: "the landmarks of performer and target", source })
}

/// 000's s_t / s_s.
fn mouth_ratio(performer: &Performer, target: &TargetFace) -> f64 {
    let source = (performer.neutral()[index::MOUTH_LEFT] - performer.neutral()[index::MOUTH_RIGHT]).norm();
    target.distance(index::MOUTH_LEFT, index::MOUTH_RIGHT) / source.max(f64::MIN_POSITIVE)
}
