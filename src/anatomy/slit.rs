//! Cutting a surface open along a path of its edges.

use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;

use super::disjoint::DisjointSets;
use super::edit::{Edge, EditMesh, ordered, triangle_edges};

/// The two rims of a cut, place by place from one end to the other. They share both ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Slit {
    /// Places above.
    pub upper: Vec<u32>,
    /// Places below.
    pub lower: Vec<u32>,
}

/// Why a path cannot be cut open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error, Serialize, Deserialize)]
pub enum SlitFault {
    /// Fewer than three places.
    #[error("the line is too short")]
    Short,
    /// The triangles along the path do not fall into two sides.
    #[error("the surface around the line has {0} sides instead of two")]
    Sides(usize),
    /// The rim did not come out as two edges for each of the path's.
    #[error("the surface around the line is not one sheet")]
    Sheets,
}

/// Opens the surface along `path`. `patch` holds every triangle around it; `level` is positive above the path, and the
/// side where it is lower gets new vertices. On a fault the mesh may have been changed: keep a copy.
pub fn cut(
    mesh: &mut EditMesh,
    patch: &[u32],
    path: &[u32],
    level: impl Fn(&Point3<f64>) -> f64,
) -> Result<Slit, SlitFault> {
    if path.len() < 3 {
        return Err(SlitFault::Short);
    }
    let inner: BTreeSet<u32> = path[1..path.len() - 1].iter().copied().collect();
    let along: BTreeSet<Edge> = path.windows(2).map(|pair| ordered(pair[0], pair[1])).collect();
    let around: Vec<u32> =
        patch.iter().copied().filter(|&t| mesh.corners(t).iter().any(|c| inner.contains(c))).collect();
    let sides = sides(mesh, &around, &inner, &along);
    if sides.len() != 2 {
        return Err(SlitFault::Sides(sides.len()));
    }
    let height = |side: &Vec<u32>| {
        let corners = || side.iter().flat_map(|&t| mesh.corners(t));
        corners().map(|place| level(mesh.at(place))).sum::<f64>() / corners().count().max(1) as f64
    };
    let lower = if height(&sides[0]) < height(&sides[1]) { &sides[0] } else { &sides[1] };
    let before = boundary(mesh, patch);
    let copies = mesh.detach(lower, &inner);
    let after = boundary(mesh, patch);
    if copies.len() != inner.len() || after != before + 2 * along.len() {
        return Err(SlitFault::Sheets);
    }
    let below = path.iter().map(|place| copies.get(place).copied().unwrap_or(*place)).collect();
    Ok(Slit { upper: path.to_vec(), lower: below })
}

/// Triangles joined across edges that touch `inner` and are not `along` the path.
fn sides(mesh: &EditMesh, around: &[u32], inner: &BTreeSet<u32>, along: &BTreeSet<Edge>) -> Vec<Vec<u32>> {
    let mut sets = DisjointSets::new(around.len());
    let mut first: BTreeMap<Edge, u32> = BTreeMap::new();
    for (i, &triangle) in (0_u32..).zip(around) {
        for edge in triangle_edges(mesh.corners(triangle)) {
            if along.contains(&edge) || !(inner.contains(&edge.0) || inner.contains(&edge.1)) {
                continue;
            }
            if let Some(&other) = first.get(&edge) {
                sets.join(i, other);
            } else {
                first.insert(edge, i);
            }
        }
    }
    let mut sides: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (i, &triangle) in (0_u32..).zip(around) {
        sides.entry(sets.least(i)).or_default().push(triangle);
    }
    sides.into_values().collect()
}

/// How many edges belong to one triangle alone.
fn boundary(mesh: &EditMesh, patch: &[u32]) -> usize {
    mesh.edges(patch).values().filter(|triangles| triangles.len() == 1).count()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::anatomy::distances::Distances;
    use crate::scan::Mesh;

    /// A sheet of n × n quads over −1..=1, each vertex moved by up to `jitter` of a quad.
    fn sheet(n: u32, jitter: &[f64]) -> Mesh {
        let mut mesh = Mesh::default();
        let step = 2.0 / f64::from(n);
        for j in 0..=n {
            for i in 0..=n {
                let k = (j * (n + 1) + i) as usize;
                let off = |at: usize| jitter.get(at % jitter.len().max(1)).copied().unwrap_or(0.0) * step;
                let (x, y) =
                    (f64::from(i) * step - 1.0 + off(2 * k), f64::from(j) * step - 1.0 + off(2 * k + 1));
                mesh.positions.push(Point3::new(x, y, 0.2 * (x * x)));
                mesh.uvs.push([x as f32, y as f32]);
            }
        }
        for j in 0..n {
            for i in 0..n {
                let a = j * (n + 1) + i;
                let (b, c, d) = (a + 1, a + n + 1, a + n + 2);
                mesh.triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        mesh.uv_triangles = mesh.triangles.clone();
        mesh
    }

    fn area(mesh: &Mesh, t: usize) -> f64 {
        let [a, b, c] = mesh.triangles[t].map(|v| mesh.positions[v as usize]);
        (b - a).cross(&(c - a)).z / 2.0
    }

    fn opened(mesh: Mesh) -> (EditMesh, Result<Slit, SlitFault>) {
        let line = |p: &Point3<f64>| p.y - 0.13 * (3.0 * p.x).sin();
        let mut edit = EditMesh::new(mesh);
        let mut patch = edit.patch(&Point3::new(-2.0, -2.0, -2.0), &Point3::new(2.0, 2.0, 2.0));
        edit.refine(&mut patch, |p| 0.08 + 0.4 * p.y.abs());
        let on = edit.embed(&mut patch, line, |p| p.x.abs() <= 0.6);
        let end = |x: f64| {
            let off = |p: u32| (edit.at(p).x - x).abs();
            *on.iter().min_by(|&&a, &&b| off(a).total_cmp(&off(b))).unwrap()
        };
        let price =
            |a: u32, b: u32| (on.contains(&a) && on.contains(&b)).then(|| (edit.at(a) - edit.at(b)).norm());
        let (path, _) = Distances::from(&edit, &patch, &[end(-0.6)], price).way_to(end(0.6)).unwrap();
        let slit = cut(&mut edit, &patch, &path, line);
        (edit, slit)
    }

    #[test]
    fn a_sheet_opens_along_a_curve_and_keeps_its_texture() {
        let (edit, slit) = opened(sheet(10, &[]));
        let slit = slit.unwrap();
        assert!(slit.upper.len() > 12);
        assert_eq!((slit.upper[0], slit.upper.last()), (slit.lower[0], slit.lower.last()));
        let mesh = edit.mesh();
        mesh.validate().unwrap();
        let total: f64 = (0..mesh.triangles.len()).map(|t| area(mesh, t)).sum();
        assert!((total - 4.0).abs() < 1e-9, "{total}");
        // Texture coordinates are the places, wherever a vertex is new.
        for (corners, uvs) in mesh.triangles.iter().zip(&mesh.uv_triangles) {
            for (v, uv) in corners.iter().zip(uvs) {
                let (p, uv) = (mesh.positions[*v as usize], mesh.uvs[*uv as usize]);
                assert!((p.x as f32 - uv[0]).abs() < 1e-5 && (p.y as f32 - uv[1]).abs() < 1e-5);
            }
        }
        for (u, l) in slit.upper.iter().zip(&slit.lower) {
            assert_eq!(edit.at(*u), edit.at(*l));
        }
    }

    #[test]
    fn a_sheet_that_its_file_split_in_two_opens_as_one() {
        let mut mesh = sheet(10, &[]);
        // Every triangle right of the middle gets vertices of its own.
        let count = mesh.positions.len() as u32;
        for (corners, uvs) in mesh.triangles.iter_mut().zip(&mesh.uv_triangles) {
            if uvs.iter().all(|&uv| mesh.uvs[uv as usize][0] > -1e-6) {
                for v in corners {
                    *v += count;
                }
            }
        }
        mesh.positions.extend_from_within(..);
        let (edit, slit) = opened(mesh);
        assert!(slit.is_ok(), "{slit:?}");
        edit.mesh().validate().unwrap();
    }

    proptest! {
        /// No triangle of a sheet that is not folded turns over, none is lost, and the old vertices stay where they were.
        #[test]
        fn no_sheet_is_broken(jitter in prop::collection::vec(-0.2..0.2_f64, 40)) {
            let before = sheet(9, &jitter);
            let (edit, slit) = opened(before.clone());
            prop_assert!(slit.is_ok(), "{:?}", slit);
            let mesh = edit.mesh();
            prop_assert_eq!(&mesh.positions[..before.positions.len()], &before.positions[..]);
            let total = |mesh: &Mesh| (0..mesh.triangles.len()).map(|t| area(mesh, t)).sum::<f64>();
            prop_assert!((total(mesh) - total(&before)).abs() < 1e-9);
            prop_assert!((0..mesh.triangles.len()).all(|t| area(mesh, t) > -1e-12));
        }
    }
}
