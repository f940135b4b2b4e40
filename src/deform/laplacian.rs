//! The cotangent Laplacian of a triangle mesh and the area that belongs to each vertex.

use nalgebra::Point3;

/// Cotangent weights stay within these: slivers have none that mean anything, and positive ones keep αL definite.
const WEIGHTS: std::ops::RangeInclusive<f64> = 1e-3..=5.0;
/// No vertex counts for less than this share of the mean area.
const LEAST_AREA: f64 = 1e-3;

/// L and M of one mesh.
#[derive(Debug, Clone)]
pub struct SurfaceLaplacian {
    /// Of each vertex its neighbours, in order, with the weight of the edge: ½(cot α + cot β).
    rows: Vec<Vec<(u32, f64)>>,
    /// A third of the area of the triangles at each vertex.
    areas: Vec<f64>,
}

impl SurfaceLaplacian {
    /// Of V positions and T × 3 indices, each below V. Triangles without area count for nothing.
    pub fn new(positions: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let mut rows: Vec<Vec<(u32, f64)>> = vec![Vec::new(); positions.len()];
        let mut areas = vec![0.0; positions.len()];
        for triangle in triangles {
            let at = |k: usize| positions[triangle[k % 3] as usize];
            let doubled = (at(1) - at(0)).cross(&(at(2) - at(0))).norm();
            for k in 0..3 {
                let (u, v) = (at(k + 1) - at(k), at(k + 2) - at(k));
                let cotangent = u.dot(&v) / u.cross(&v).norm();
                if cotangent.is_finite() {
                    let (a, b) = (triangle[(k + 1) % 3], triangle[(k + 2) % 3]);
                    rows[a as usize].push((b, cotangent / 2.0));
                    rows[b as usize].push((a, cotangent / 2.0));
                }
                areas[triangle[k] as usize] += doubled / 6.0;
            }
        }
        for row in &mut rows {
            row.sort_by_key(|entry| entry.0);
            row.dedup_by(|next, kept| {
                let same = next.0 == kept.0;
                if same {
                    kept.1 += next.1;
                }
                same
            });
            for entry in row {
                entry.1 = entry.1.clamp(*WEIGHTS.start(), *WEIGHTS.end());
            }
        }
        let mean = areas.iter().sum::<f64>() / areas.len().max(1) as f64;
        for area in &mut areas {
            *area = area.max(LEAST_AREA * mean).max(f64::MIN_POSITIVE);
        }
        Self { rows, areas }
    }

    /// A vertex's neighbours with the weights of the edges to them.
    pub fn neighbours(&self, vertex: usize) -> &[(u32, f64)] {
        &self.rows[vertex]
    }

    /// The area that belongs to a vertex, unit².
    pub fn area(&self, vertex: usize) -> f64 {
        self.areas[vertex]
    }

    /// Row of L: its diagonal, the sum of the edges' weights, and the negative weights.
    pub fn row(&self, vertex: usize) -> impl Iterator<Item = (usize, f64)> + Clone {
        let sum: f64 = self.rows[vertex].iter().map(|entry| entry.1).sum();
        std::iter::once((vertex, sum)).chain(self.rows[vertex].iter().map(|&(n, w)| (n as usize, -w)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat square of n × n vertices.
    fn square(n: u32) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let positions = (0..n * n).map(|i| Point3::new(f64::from(i % n), f64::from(i / n), 0.0)).collect();
        let cells = (0..n - 1).flat_map(|y| (0..n - 1).map(move |x| y * n + x));
        (positions, cells.flat_map(|i| [[i, i + 1, i + n + 1], [i, i + n + 1, i + n]]).collect())
    }

    #[test]
    fn linear_functions_are_harmonic_inside_and_areas_add_up() {
        let (positions, triangles) = square(6);
        let l = SurfaceLaplacian::new(&positions, &triangles);
        for v in [7, 8, 14, 21] {
            let value: f64 = l.row(v).map(|(j, w)| w * (3.0 * positions[j].x - 2.0 * positions[j].y)).sum();
            // The diagonals' cotangents are none; clamping leaves a thousandth, which is odd and so cancels.
            assert!(value.abs() < 1e-12, "{v}: {value}");
        }
        let area: f64 = (0..36).map(|v| l.area(v)).sum();
        assert!((area - 25.0).abs() < 1e-9);
    }

    #[test]
    fn slivers_leave_finite_weights() {
        let positions = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 1e-200]];
        let positions: Vec<_> = positions.iter().map(|p| Point3::new(p[0], p[1], 0.0)).collect();
        let l = SurfaceLaplacian::new(&positions, &[[0, 1, 2], [0, 2, 3], [0, 0, 1]]);
        for v in 0..4 {
            assert!(l.area(v) > 0.0 && l.row(v).all(|(_, w)| w.is_finite()));
        }
    }
}
