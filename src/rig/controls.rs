//! Control points on the target: its landmarks, and anchors that do not move.

use nalgebra::Point3;

use super::{TargetFace, Transfer};
use crate::{
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

/// The warp's centres.
#[derive(Debug, Clone)]
pub struct Controls {
    /// The landmark that drives each control.
    pub landmarks: Vec<usize>,
    /// Where each control rests on the target, scan frame, millimetres.
    pub rest: Vec<Point3<f64>>,
    /// Points held still.
    pub anchors: Vec<Point3<f64>>,
}

impl Controls {
    /// Landmarks found on the target serve as they are; those not found are carried over from the performer by the
    /// landmark spline and snapped to the nearest point of the surface (000 §5.6.1).
    pub fn new(target: &TargetFace, transfer: &Transfer, mesh: &Mesh, surface: &Surface) -> Self {
        let mut controls = Self { landmarks: Vec::new(), rest: Vec::new(), anchors: Vec::new() };
        let mouth = target.landmarks[index::MOUTH_LEFT].map_or(0.0, |p| p.y);
        for landmark in 0..SKIN_LANDMARK_COUNT {
            let place = target.landmarks[landmark]
                .or_else(|| surface.nearest(transfer.place(landmark)).map(|found| found.position));
            let Some(place) = place else { continue };
            // Above the mouth the outline is silhouette, which slides over the skin as the head turns.
            let slides = landmark_table()[landmark].region == Region::Oval && place.y > mouth;
            let taken = controls.rest.iter().any(|other| (other - place).norm() < COINCIDENT);
            if !slides && !taken {
                controls.landmarks.push(landmark);
                controls.rest.push(place);
            }
        }
        controls.anchors = anchors(&controls.rest, mesh, STILL * target.outer_canthal_distance());
        controls
    }
}

/// Vertices beyond `reach` of all controls, spread evenly: each next one is the farthest from all before it.
fn anchors(controls: &[Point3<f64>], mesh: &Mesh, reach: f64) -> Vec<Point3<f64>> {
    let step = mesh.positions.len().div_ceil(ANCHOR_CANDIDATES).max(1);
    let nearest = |p: &Point3<f64>, points: &[Point3<f64>]| {
        points.iter().map(|q| (p - q).norm_squared()).fold(f64::INFINITY, f64::min)
    };
    let mut candidates: Vec<(Point3<f64>, f64)> = mesh
        .positions
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
        let found = anchors(&[Point3::origin()], &mesh, 49.5);
        assert_eq!(found.len(), 50);
        assert!(found.iter().all(|p| p.x > 49.0));
        assert!((found[0].x - 99.0).abs() < 1e-12 && (found[1].x - 50.0).abs() < 1e-12);
    }
}
