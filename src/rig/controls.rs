//! Control points on the target: its landmarks, the rims of its lips, and anchors that do not move.

use nalgebra::Point3;

use super::TargetFace;
use crate::{
    actions::Catalogue,
    anatomy::{Anatomy, INNER_CORNERS, LOWER_INNER, Lip, RimNode, UPPER_INNER, eye_landmarks},
    lift::Side,
    scan::{Mesh, Surface},
    tracking::{Region, SKIN_LANDMARK_COUNT, index, landmark_table},
};

/// Vertices farther than this many outer canthal distances from every control are skull, neck or clothes.
const STILL: f64 = 0.28;
/// Anchors taken from them.
const ANCHORS: usize = 120;
/// Vertices looked at for anchors; more only cost time.
const ANCHOR_CANDIDATES: usize = 4000;
/// Controls closer than this are one point, millimetres.
const COINCIDENT: f64 = 0.02;

/// What moves a control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Driver {
    /// A landmark of the performer.
    Landmark(usize),
    /// A muscle or wrinkle control point of the catalogue.
    Point(usize),
    /// A rim of the lips at one of the mouth's nodes.
    Rim {
        /// Which node.
        node: usize,
        /// Whether on the lower lip.
        lower: bool,
    },
    /// Nothing: the corners and rims of the eyes, which ligaments hold to the skull. How the lids close is not the
    /// spline's business.
    Skull,
}

/// The warp's centres.
#[derive(Debug, Clone)]
pub struct Controls {
    /// What moves each control.
    pub drivers: Vec<Driver>,
    /// Where each control rests on the target, scan frame, millimetres.
    pub rest: Vec<Point3<f64>>,
    /// The lip each lies on.
    pub lips: Vec<Lip>,
    /// Points held still.
    pub anchors: Vec<Point3<f64>>,
}

impl Controls {
    /// Landmarks found on the target serve as they are; those not found are carried over from the performer by the
    /// landmark spline and snapped to the nearest point of the surface (000 §5.6.1). On an opened target the lips' inner
    /// rims are driven at the cut, and lids are left to their own shapes. `points` are the catalogue's control points on
    /// the target, `taken` says which landmarks are to be controls.
    pub fn new(
        target: &TargetFace,
        carried: &dyn Fn(usize) -> Option<Point3<f64>>,
        points: &[Option<Point3<f64>>],
        anatomy: &Anatomy,
        surface: &Surface,
        taken: &dyn Fn(usize) -> bool,
    ) -> Self {
        let mut controls =
            Self { drivers: Vec::new(), rest: Vec::new(), lips: Vec::new(), anchors: Vec::new() };
        let height = |place: &Point3<f64>| (target.level * place).y;
        let mouth_height = target.landmarks[index::MOUTH_LEFT].map_or(0.0, |place| height(&place));
        let is_prepared = anatomy.jaw.is_some();
        if let Some(mouth) = &anatomy.mouth {
            for (node, rim) in mouth.nodes.iter().enumerate().filter(|(_, rim)| is_between(rim, taken)) {
                controls.push(Driver::Rim { node, lower: false }, rim.rest[0], Lip::Upper);
                controls.push(Driver::Rim { node, lower: true }, rim.rest[1], Lip::Lower);
            }
        }
        for landmark in (0..SKIN_LANDMARK_COUNT).filter(|&landmark| taken(landmark)) {
            let mut place =
                target.landmarks[landmark].or_else(|| Some(surface.nearest(carried(landmark)?)?.position));
            let mut driver = Driver::Landmark(landmark);
            if let Some(mouth) = &anatomy.mouth {
                if UPPER_INNER.contains(&landmark) || LOWER_INNER.contains(&landmark) {
                    continue;
                }
                if let Some(end) = INNER_CORNERS.iter().position(|&corner| corner == landmark) {
                    place = mouth.corners[end].or(place);
                }
            }
            let region = landmark_table()[landmark].region;
            if is_prepared && region == Region::Lids {
                if !is_on_eye_rim(landmark) {
                    continue;
                }
                driver = Driver::Skull;
            }
            let Some(place) = place else { continue };
            // Above the mouth the outline is silhouette, which slides over the skin as the head turns.
            let slides = region == Region::Oval && height(&place) > mouth_height;
            if !slides {
                controls.push(driver, place, Lip::of(landmark));
            }
        }
        for (point, place) in points.iter().enumerate() {
            // As of the landmarks: what lies on prepared lids moves as they close, and not with the skin.
            let facts = Catalogue::get().points.get(point);
            let on_lids = facts.is_some_and(|facts| {
                facts.at.iter().any(|&(landmark, _)| landmark_table()[landmark].region == Region::Lids)
            });
            if let Some(place) = place.filter(|_| !(is_prepared && on_lids)) {
                controls.push(Driver::Point(point), place, Lip::Neither);
            }
        }
        let reach = STILL * target.outer_canthal_distance();
        controls.anchors = anchors(&controls.rest, &anatomy.mesh, anatomy.scan_vertices, reach);
        controls
    }

    /// The control that a landmark drives.
    pub fn of_landmark(&self, landmark: usize) -> Option<usize> {
        self.drivers.iter().position(|driver| *driver == Driver::Landmark(landmark))
    }

    /// Adds a control unless another of the same lip lies there.
    fn push(&mut self, driver: Driver, place: Point3<f64>, lip: Lip) {
        let meets = |other: Lip| !matches!((lip, other), (Lip::Upper, Lip::Lower) | (Lip::Lower, Lip::Upper));
        let taken = self
            .rest
            .iter()
            .zip(&self.lips)
            .any(|(rest, other)| meets(*other) && (rest - place).norm() < COINCIDENT);
        if !taken {
            self.drivers.push(driver);
            self.rest.push(place);
            self.lips.push(lip);
        }
    }
}

/// Whether the landmarks by which a rim's node is driven are all `taken`.
fn is_between(node: &RimNode, taken: &dyn Fn(usize) -> bool) -> bool {
    let is_taken = |station: usize| match station.checked_sub(1) {
        None => taken(INNER_CORNERS[0]),
        Some(pair) if pair < UPPER_INNER.len() => taken(UPPER_INNER[pair]) && taken(LOWER_INNER[pair]),
        Some(_) => taken(INNER_CORNERS[1]),
    };
    is_taken(node.station) && (node.share <= 0.0 || is_taken(node.station + 1))
}

/// Whether a landmark lies on an eye's corner or on the rim of its lids, and not in the folds around them.
fn is_on_eye_rim(landmark: usize) -> bool {
    Side::BOTH.into_iter().any(|side| {
        let eye = eye_landmarks(side);
        landmark == eye.outer
            || landmark == eye.inner
            || eye.upper.contains(&landmark)
            || eye.lower.contains(&landmark)
    })
}

/// Vertices of the scan beyond `reach` of all controls, spread evenly: each next one is the farthest from all before it.
fn anchors(controls: &[Point3<f64>], mesh: &Mesh, vertices: usize, reach: f64) -> Vec<Point3<f64>> {
    let step = vertices.div_ceil(ANCHOR_CANDIDATES).max(1);
    let nearest = |p: &Point3<f64>, points: &[Point3<f64>]| {
        points.iter().map(|q| (p - q).norm_squared()).fold(f64::INFINITY, f64::min)
    };
    let mut candidates: Vec<(Point3<f64>, f64)> = mesh.positions[..vertices]
        .iter()
        .step_by(step)
        .map(|p| (*p, nearest(p, controls)))
        .filter(|(_, distance)| *distance > reach * reach)
        .collect();
    let mut chosen = Vec::new();
    while chosen.len() < ANCHORS {
        let Some(farthest) = candidates.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map(|c| c.0) else { break };
        chosen.push(farthest);
        for (point, distance) in &mut candidates {
            *distance = distance.min((*point - farthest).norm_squared());
        }
        candidates.retain(|(_, distance)| *distance > COINCIDENT * COINCIDENT);
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn anchors_keep_their_distance_and_spread() {
        let positions: Vec<_> = (0..100).map(|i| Point3::new(f64::from(i), 0.0, 0.0)).collect();
        let mesh = Mesh { positions, ..Mesh::default() };
        let found = anchors(&[Point3::origin()], &mesh, 100, 49.5);
        assert_eq!(found.len(), 50);
        assert!(found.iter().all(|p| p.x > 49.0));
        assert!((found[0].x - 99.0).abs() < 1e-12 && (found[1].x - 50.0).abs() < 1e-12);
    }

    #[test]
    fn lids_rims_are_known_and_folds_are_not() {
        assert!([33, 133, 159, 145, 263, 362, 386, 374].into_iter().all(is_on_eye_rim));
        assert!(![27, 23, 257, 253, 168].into_iter().any(is_on_eye_rim));
    }
}
