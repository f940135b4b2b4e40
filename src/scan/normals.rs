//! Smooth vertex normals, weighted by area.

use nalgebra::{Point3, Vector3};

use super::mesh::Mesh;

/// What a vertex without any area around it gets, since renderers and glTF want unit vectors: out of the face.
const OUTWARD: [f32; 3] = [0.0, 0.0, 1.0];

/// Vertex normals of `mesh`, V unit vectors in its frame: the mean of the triangles around a vertex, weighted by
/// their area. A vertex that no triangle with area uses gets +Z.
///
/// For one use; [`NormalSolver`] is for many. Vertices are taken as they are: where a file splits them along a seam
/// of texture coordinates, the two sides keep their own normals.
pub fn vertex_normals(mesh: &Mesh) -> Vec<Vector3<f64>> {
    let mut sums = vec![Vector3::zeros(); mesh.positions.len()];
    for corners in &mesh.triangles {
        let [Some(a), Some(b), Some(c)] = corners.map(|i| mesh.positions.get(i as usize)) else { continue };
        let normal = doubled_area_normal(a, b, c);
        for i in corners {
            sums[*i as usize] += normal;
        }
    }
    for sum in &mut sums {
        *sum = sum.try_normalize(0.0).filter(|n| n.iter().all(|c| c.is_finite())).unwrap_or_else(Vector3::z);
    }
    sums
}

/// Normal of a triangle, as long as twice its area; zero where it has none.
pub(super) fn doubled_area_normal(a: &Point3<f64>, b: &Point3<f64>, c: &Point3<f64>) -> Vector3<f64> {
    (b - a).cross(&(c - a))
}

/// Computes the normals of [`vertex_normals`] for one mesh over and over, in single precision and without allocating.
#[derive(Debug, Clone)]
pub struct NormalSolver {
    vertices: usize,
    /// T × 3, every index below `vertices`, no vertex twice.
    triangles: Vec<[u32; 3]>,
}

impl NormalSolver {
    /// The normals of one set of positions, for those who need them once: V × 3, unit length.
    pub fn once(triangles: &[[u32; 3]], positions: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let mut normals = vec![[0.0; 3]; positions.len()];
        Self::new(triangles, positions.len()).update(positions, &mut normals);
        normals
    }

    /// For a mesh of `vertices` vertices; triangles that name a vertex twice or one out of range are left out.
    pub fn new(triangles: &[[u32; 3]], vertices: usize) -> Self {
        let usable = |t: &&[u32; 3]| {
            let [a, b, c] = **t;
            a != b && b != c && c != a && t.iter().all(|i| (*i as usize) < vertices)
        };
        Self { vertices, triangles: triangles.iter().filter(usable).copied().collect() }
    }

    /// How many vertices it is for.
    pub fn vertices(&self) -> usize {
        self.vertices
    }

    /// Writes the V unit normals of the V `positions` to `out`; +Z where there is no area or a place is not finite.
    ///
    /// When either slice is not V long, `out` becomes +Z throughout: a wrong length is the caller's mistake, and a
    /// frame drawn flat shows it.
    pub fn update(&self, positions: &[[f32; 3]], out: &mut [[f32; 3]]) {
        if positions.len() != self.vertices || out.len() != self.vertices {
            out.fill(OUTWARD);
            return;
        }
        out.fill([0.0; 3]);
        for &[a, b, c] in &self.triangles {
            let [a, b, c] = [a as usize, b as usize, c as usize];
            let (p, q, r) = (positions[a], positions[b], positions[c]);
            let (u, v) = ([q[0] - p[0], q[1] - p[1], q[2] - p[2]], [r[0] - p[0], r[1] - p[1], r[2] - p[2]]);
            let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            for i in [a, b, c] {
                let sum = &mut out[i];
                sum[0] += n[0];
                sum[1] += n[1];
                sum[2] += n[2];
            }
        }
        for n in out {
            let squared = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
            *n = if squared.is_normal() {
                let inverse = squared.sqrt().recip();
                [n[0] * inverse, n[1] * inverse, n[2] * inverse]
            } else {
                rescued(*n)
            };
        }
    }
}

/// A sum whose square leaves single precision, or that is no direction at all.
#[cold]
fn rescued(n: [f32; 3]) -> [f32; 3] {
    let wide = Vector3::from(n.map(f64::from));
    match wide.try_normalize(0.0) {
        Some(unit) if unit.iter().all(|c| c.is_finite()) => [unit.x as f32, unit.y as f32, unit.z as f32],
        _ => OUTWARD,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sphere of `n` × 2`n` quads about the origin.
    fn sphere(n: u32, radius: f64) -> Mesh {
        let mut mesh = Mesh::default();
        for i in 0..=n {
            for j in 0..2 * n {
                let (theta, phi) = (
                    std::f64::consts::PI * (f64::from(i) + 0.5) / (f64::from(n) + 1.0),
                    std::f64::consts::PI * f64::from(j) / f64::from(n),
                );
                mesh.positions.push(Point3::new(
                    radius * theta.sin() * phi.sin(),
                    radius * theta.cos(),
                    radius * theta.sin() * phi.cos(),
                ));
            }
        }
        for i in 0..n {
            for j in 0..2 * n {
                let (a, b) = (i * 2 * n + j, i * 2 * n + (j + 1) % (2 * n));
                let (c, d) = (a + 2 * n, b + 2 * n);
                mesh.triangles.extend([[a, c, d], [a, d, b]]);
            }
        }
        mesh
    }

    #[test]
    fn a_sphere_points_outward_ever_better_with_finer_steps() {
        let mut last = f64::INFINITY;
        for n in [8, 32, 128] {
            let mesh = sphere(n, 90.0);
            let normals = vertex_normals(&mesh);
            let inner = 2 * n as usize..mesh.positions.len() - 2 * n as usize;
            let worst = inner.map(|i| normals[i].angle(&mesh.positions[i].coords)).fold(0.0, f64::max);
            assert!(worst < last / 3.0, "{worst} after {last}");
            last = worst;
        }
        assert!(last < 0.02, "{last}");
    }

    #[test]
    fn the_solver_agrees_with_the_function() {
        let mesh = sphere(20, 1.0);
        for scale in [1e-9, 1e-3, 1.0, 1e3, 1e9] {
            let positions: Vec<[f32; 3]> =
                mesh.positions.iter().map(|p| [p.x, p.y, p.z].map(|c| (c * scale) as f32)).collect();
            let mut out = vec![[0.0; 3]; positions.len()];
            NormalSolver::new(&mesh.triangles, positions.len()).update(&positions, &mut out);
            for (a, b) in out.iter().zip(vertex_normals(&mesh)) {
                assert!((Vector3::from(a.map(f64::from)) - b).norm() < 1e-4, "{a:?} {b} at {scale}");
            }
        }
    }

    #[test]
    fn no_area_no_nan() {
        let solver = NormalSolver::new(&[[0, 1, 2], [0, 0, 1], [1, 2, 9]], 4);
        let mut out = vec![[0.0; 3]; 4];
        solver.update(&[[1.0, 1.0, 1.0]; 4], &mut out);
        assert_eq!(out, [OUTWARD; 4]);
        solver.update(&[[f32::NAN; 3]; 4], &mut out);
        assert_eq!(out, [OUTWARD; 4]);
        solver.update(&[[0.0; 3]; 3], &mut out);
        assert_eq!(out, [OUTWARD; 4]);
        let empty =
            Mesh { positions: vec![Point3::origin(); 2], triangles: vec![[0, 1, 7]], ..Mesh::default() };
        assert_eq!(vertex_normals(&empty), [Vector3::z(); 2]);
    }
}
