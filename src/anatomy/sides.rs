//! To which lip every vertex belongs.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;

use super::{
    distances::Distances,
    edit::EditMesh,
    lip_line::LipLine,
    lips::Lips,
    regions::{LOWER_LIP, UPPER_LIP},
};

/// Beyond the corners the sides run into each other over this slope.
const WEDGE: f64 = 0.6;
/// How far from the mouth the way over the surface decides, mouth widths.
const NEAR: f64 = 1.2;

/// For every vertex 0 above the lips' line, 1 below it, and between in a wedge beyond the corners.
///
/// Between the corners the way over the surface decides, not the place: a folded lip passes behind the other.
pub fn lower_side(
    edit: &EditMesh,
    line: &LipLine,
    lips: &Lips,
    landmarks: &[Option<Point3<f64>>],
    mouth: f64,
) -> Vec<f32> {
    let middle = line.place(0.5 * (line.ends[0] + line.ends[1]));
    let front = depth(edit, lips, landmarks);
    let reach = NEAR * mouth;
    let patch = edit.patch(
        &Point3::new(middle.x - reach, middle.y - reach, front - reach),
        &Point3::new(middle.x + reach, middle.y + reach, front + reach),
    );
    let (upper, lower) = starts(edit, &patch, lips, landmarks);
    let length = |a: u32, b: u32| Some((edit.at(a) - edit.at(b)).norm());
    let from_upper = Distances::from(edit, &patch, &upper, length);
    let from_lower = Distances::from(edit, &patch, &lower, length);
    // What hangs together with neither lip, as a row of teeth, goes with one of them as a whole.
    let component = edit.components();
    let mut heights: BTreeMap<u32, (f64, f64)> = BTreeMap::new();
    for (p, name) in edit.mesh().positions.iter().zip(&component) {
        let sum = heights.entry(*name).or_default();
        *sum = (sum.0 + line.above(p), sum.1 + 1.0);
    }
    let mut sides: Vec<f32> = (0_u32..)
        .zip(&edit.mesh().positions)
        .map(|(vertex, p)| {
            let (along, above) = (line.along(p), line.above(p));
            let beyond = (line.ends[0] - along).max(along - line.ends[1]);
            if beyond > 0.0 {
                return (0.5 - 0.5 * above / (WEDGE * beyond + 1e-6 * mouth)).clamp(0.0, 1.0) as f32;
            }
            let place = edit.place(vertex);
            let (up, down) = (from_upper.to(place), from_lower.to(place));
            let is_lower = if up.is_finite() || down.is_finite() {
                down < up
            } else {
                heights.get(&component[vertex as usize]).map_or(above, |sum| sum.0 / sum.1) < 0.0
            };
            f32::from(u8::from(is_lower))
        })
        .collect();
    if let Lips::Cut(slit) = lips {
        for (vertex, side) in sides.iter_mut().enumerate() {
            let place = edit.place(vertex as u32);
            if place == slit.upper[0] || place == slit.upper[slit.upper.len() - 1] {
                *side = 0.5;
            }
        }
    }
    sides
}

/// Where each lip surely is.
fn starts(
    edit: &EditMesh,
    patch: &[u32],
    lips: &Lips,
    landmarks: &[Option<Point3<f64>>],
) -> (Vec<u32>, Vec<u32>) {
    if let Lips::Cut(slit) = lips {
        let inner = |rim: &[u32]| rim[1..rim.len() - 1].to_vec();
        return (inner(&slit.upper), inner(&slit.lower));
    }
    // The rows on the outside of each lip, without their ends: the inner ones and those at the corners may have been
    // taken for the other lip's.
    let nearest = |list: &[usize]| {
        let places: BTreeSet<u32> = patch.iter().flat_map(|&t| edit.corners(t)).collect();
        list.iter()
            .filter_map(|&i| landmarks[i])
            .filter_map(|p| {
                let far = |place: &u32| (edit.at(*place) - p).norm_squared();
                places.iter().copied().min_by(|a, b| far(a).total_cmp(&far(b)))
            })
            .collect()
    };
    (nearest(&UPPER_LIP[1..8]), nearest(&LOWER_LIP[1..8]))
}

fn depth(edit: &EditMesh, lips: &Lips, landmarks: &[Option<Point3<f64>>]) -> f64 {
    match lips {
        Lips::Cut(slit) => edit.at(slit.upper[slit.upper.len() / 2]).z,
        Lips::Open => landmarks[0].map_or(0.0, |p| p.z),
    }
}
