//! A piece of the avatar that the scan did not have: geometry for the program to add.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

/// A mesh of its own, in the axes of the face, millimetres.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PartMesh {
    /// V × 3.
    pub positions: Vec<Point3<f64>>,
    /// V × 2 texture coordinates, origin at the image's bottom left.
    pub uvs: Vec<[f32; 2]>,
    /// T × 3, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl PartMesh {
    /// Adds a grid of rows of equally many vertices, given with their texture coordinates. Seen with the rows going
    /// down and the columns to the right, its outside faces the viewer.
    pub fn push_grid(&mut self, rows: &[Vec<(Point3<f64>, [f32; 2])>]) {
        let first = self.positions.len() as u32;
        let columns = rows.first().map_or(0, Vec::len) as u32;
        for (position, uv) in rows.iter().flatten() {
            self.positions.push(*position);
            self.uvs.push(*uv);
        }
        for row in 0..(rows.len() as u32).saturating_sub(1) {
            for column in 0..columns.saturating_sub(1) {
                let a = first + row * columns + column;
                let (b, c, d) = (a + 1, a + columns, a + columns + 1);
                self.triangles.extend([[a, c, b], [b, c, d]]);
            }
        }
    }

    /// A cap of a sphere around +Z, `rings` from the pole to `reach` radians from it and `spokes` around. Texture
    /// coordinates keep the distance from the pole: the pole is the image's middle, the last ring its inscribed circle.
    pub fn cap(centre: &Point3<f64>, radius: f64, reach: f64, rings: usize, spokes: usize) -> Self {
        let mut part = Self::default();
        part.positions.push(centre + Vector3::z() * radius);
        part.uvs.push([0.5, 0.5]);
        for ring in 1..=rings {
            let share = ring as f64 / rings as f64;
            let (sin, cos) = (share * reach).sin_cos();
            for spoke in 0..spokes {
                let (up, right) = (spoke as f64 / spokes as f64 * TAU).sin_cos();
                part.positions.push(centre + Vector3::new(right * sin, up * sin, cos) * radius);
                part.uvs.push([(0.5 + 0.5 * share * right) as f32, (0.5 + 0.5 * share * up) as f32]);
            }
        }
        let at = |ring: usize, spoke: usize| (1 + (ring - 1) * spokes + spoke % spokes) as u32;
        for spoke in 0..spokes {
            part.triangles.push([0, at(1, spoke), at(1, spoke + 1)]);
            for ring in 1..rings {
                let (a, b) = (at(ring, spoke), at(ring, spoke + 1));
                let (c, d) = (at(ring + 1, spoke), at(ring + 1, spoke + 1));
                part.triangles.extend([[a, c, b], [b, c, d]]);
            }
        }
        part
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cap_lies_on_its_sphere_and_faces_outwards() {
        let centre = Point3::new(1.0, 2.0, 3.0);
        let part = PartMesh::cap(&centre, 12.0, 1.3, 6, 16);
        assert!(part.positions.iter().all(|p| ((p - centre).norm() - 12.0).abs() < 1e-9));
        assert_eq!(part.positions.len(), part.uvs.len());
        for t in &part.triangles {
            let [a, b, c] = t.map(|i| part.positions[i as usize]);
            assert!((b - a).cross(&(c - a)).dot(&(a - centre)) > 0.0);
        }
    }

    #[test]
    fn a_grid_faces_the_viewer() {
        let row = |y: f64| (0..3).map(|x| (Point3::new(f64::from(x), y, 0.0), [0.0; 2])).collect::<Vec<_>>();
        let mut part = PartMesh::default();
        part.push_grid(&[row(1.0), row(0.0)]);
        assert_eq!(part.triangles.len(), 4);
        for t in &part.triangles {
            let [a, b, c] = t.map(|i| part.positions[i as usize]);
            assert!((b - a).cross(&(c - a)).z > 0.0);
        }
    }
}
