//! Triangles that turn their outside to the eye.

use std::ops::Range;

use nalgebra::{Vector3, Vector4};

use super::model::MovingVertex;

/// Within each run of indices those triangles first that turn their outside to `eye`.
pub(super) fn facing_first<'a>(
    triangles: &[[u32; 3]],
    runs: impl Iterator<Item = &'a Range<u32>>,
    vertices: &[MovingVertex],
    eye: Vector4<f32>,
    out: &mut Vec<[u32; 3]>,
) {
    out.clear();
    let at = |index: u32| Vector3::from(vertices[index as usize].position);
    let faces = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(at);
        (b - a).cross(&(c - a)).dot(&(eye.xyz() - a * eye.w)) > 0.0
    };
    for run in runs {
        let run = &triangles[run.start as usize / 3..run.end as usize / 3];
        out.extend(run.iter().filter(|triangle| faces(triangle)));
        out.extend(run.iter().filter(|triangle| !faces(triangle)));
    }
}
