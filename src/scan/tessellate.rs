//! A finer mesh through the vertices of a coarse one.

use std::collections::BTreeMap;

use nalgebra::{Point3, center};

use super::{Mesh, vertex_normals};

/// How far a new vertex leaves the straight edge for the curve between its ends: three quarters look round (Boubekeur and
/// Alexa, Phong Tessellation, 2008).
const ROUNDNESS: f64 = 0.75;

/// Every triangle as four. The vertices there are stay, first and in their order; those new on the edges stand where the
/// tangent planes of both ends expect them. Texture coordinates follow in straight lines; colours and materials are left out.
#[must_use]
pub fn tessellate(mesh: &Mesh) -> Mesh {
    let normals = vertex_normals(mesh);
    let mut positions = mesh.positions.clone();
    let on_edge = |a: usize, b: usize| -> Point3<f64> {
        let (a, b) = ((mesh.positions[a], normals[a]), (mesh.positions[b], normals[b]));
        let middle = center(&a.0, &b.0);
        let onto = |(point, normal): (Point3<f64>, nalgebra::Vector3<f64>)| {
            middle - normal * (middle - point).dot(&normal)
        };
        middle + (center(&onto(a), &onto(b)) - middle) * ROUNDNESS
    };
    let triangles = split(&mesh.triangles, |a, b| {
        positions.push(on_edge(a, b));
        positions.len() - 1
    });
    let mut uvs = mesh.uvs.clone();
    let uv_triangles = split(&mesh.uv_triangles, |a, b| {
        uvs.push(std::array::from_fn(|axis| f32::midpoint(mesh.uvs[a][axis], mesh.uvs[b][axis])));
        uvs.len() - 1
    });
    Mesh { positions, triangles, uvs, uv_triangles, ..Mesh::default() }
}

/// Four triangles for each; `middle` makes what stands on an edge and says its index.
fn split(triangles: &[[u32; 3]], mut middle: impl FnMut(usize, usize) -> usize) -> Vec<[u32; 3]> {
    let mut known = BTreeMap::new();
    let mut on_edge = |a: u32, b: u32| -> u32 {
        let (low, high) = (a.min(b), a.max(b));
        *known.entry((low, high)).or_insert_with(|| middle(low as usize, high as usize) as u32)
    };
    let four = |&[a, b, c]: &[u32; 3]| {
        let (ab, bc, ca) = (on_edge(a, b), on_edge(b, c), on_edge(c, a));
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    };
    triangles.iter().flat_map(four).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::Surface;

    /// An octahedron with its corners on the unit sphere.
    fn octahedron() -> Mesh {
        let corners = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
        let positions = corners.map(|c| Point3::from(c.map(f64::from))).to_vec();
        let around = [[0, 1], [1, 2], [2, 3], [3, 0]];
        let triangles = around.into_iter().flat_map(|[a, b]| [[a, b, 4], [b, a, 5]]).collect();
        Mesh {
            positions,
            triangles,
            uvs: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
            uv_triangles: vec![[0, 1, 2]; 8],
            ..Mesh::default()
        }
    }

    #[test]
    fn a_sphere_gets_rounder_and_keeps_its_vertices() {
        let coarse = octahedron();
        let mut fine = coarse.clone();
        let mut roughest = vec![];
        for round in 1..=3 {
            fine = tessellate(&fine);
            assert_eq!(fine.triangles.len(), 8 << (2 * round));
            assert_eq!(fine.positions[..6], coarse.positions[..]);
            let radius = |p: &Point3<f64>| p.coords.norm();
            roughest.push(fine.positions.iter().map(radius).fold(f64::INFINITY, f64::min));
        }
        // Straight edges would leave 0.707.
        assert!(roughest[0] > 0.85, "{roughest:?}");
        // No edge was given two vertices: the sphere is whole.
        assert_eq!(fine.positions.len(), 2 + fine.triangles.len() / 2);
        assert!(fine.uvs.iter().all(|uv| uv[0] + uv[1] <= 1.0 + 1e-6));
        assert!(Surface::new(&fine).is_ok());
    }

    #[test]
    fn a_flat_sheet_stays_flat() {
        let sheet = Mesh {
            positions: vec![[0.0, 0.0, 2.0].into(), [4.0, 0.0, 2.0].into(), [0.0, 4.0, 2.0].into()],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let fine = tessellate(&tessellate(&sheet));
        assert_eq!(fine.positions.len(), 15);
        assert!(fine.positions.iter().all(|p| (p.z - 2.0).abs() < 1e-12));
        assert!(fine.uv_triangles.is_empty());
    }
}
