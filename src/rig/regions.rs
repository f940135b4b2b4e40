//! The thesis's own warp: the face divided into an upper and a lower region, each with a spline of its own.
//!
//! 000 §5.6.2 divides the mesh so that a brow does not move the mouth. The regions share no control, so the surface may
//! break where they meet; §7.2 of the thesis says as much. Kept as published, kernel r² ln r² included, for comparison.

use nalgebra::Point3;

use super::{Controls, RigError, TargetFace};
use crate::{
    spline::{Kernel, Options, Regularisation, Warp},
    tracking::index,
};

/// λ in the unit box: only so much that coinciding controls do no harm.
const LAMBDA: f64 = 1e-6;

/// The vertex × control matrix of two splines side by side.
pub(super) fn split_warp(
    target: &TargetFace,
    controls: &Controls,
    vertices: &[Point3<f64>],
) -> Result<Warp, RigError> {
    let height = |p: &Point3<f64>| (target.level * p).y;
    let border = target.landmarks[index::NOSE_TIP].as_ref().map_or(0.0, height);
    let mut shares = vec![Vec::new(); controls.rest.len()];
    for is_lower in [false, true] {
        let belongs = |p: &Point3<f64>| (height(p) < border) == is_lower;
        let members: Vec<usize> = (0..controls.rest.len()).filter(|&i| belongs(&controls.rest[i])).collect();
        let centres: Vec<_> = members.iter().map(|&i| controls.rest[i]).collect();
        let places: Vec<usize> = (0..vertices.len()).filter(|&v| belongs(&vertices[v])).collect();
        let points: Vec<_> = places.iter().map(|&v| vertices[v]).collect();
        let options = Options { regularisation: Regularisation::UnitBox(LAMBDA), ..Options::default() };
        let warp = Warp::new(Kernel::ThinPlate, &centres, &controls.anchors, &points, options)
            .map_err(|source| RigError::Spline { what: "a region of the target", source })?;
        for (column, &control) in members.iter().enumerate() {
            shares[control] = places.iter().copied().zip(warp.column(column).iter().copied()).collect();
        }
    }
    Warp::from_columns(vertices.len(), controls.rest.len(), |control, column| {
        for &(vertex, share) in &shares[control] {
            column[vertex] = share;
        }
    })
    .map_err(|source| RigError::Spline { what: "the regions of the target", source })
}
