//! Nearest points and ray casts on a mesh.
//!
//! One tree of boxes over the triangles (`parry3d-f64`) answers both, exactly to rounding; `parry`'s own vector type
//! stays behind this border. Anchors (a triangle and barycentric coordinates) can be evaluated again once the mesh
//! has moved.

use nalgebra::{Point3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::query::{PointQueryWithLocation, Ray, RayCast};
use parry3d_f64::shape::{TriMesh, TrianglePointLocation};

use super::mesh::Mesh;
use super::normals::doubled_area_normal;
use super::validate::{MAX_COORDINATE, MeshFault};

/// A place on a mesh that survives the mesh's movement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anchor {
    /// Which triangle.
    pub triangle: u32,
    /// Weights of its three corners, each in 0..=1, together 1.
    pub barycentric: [f64; 3],
}

/// A place found on a [`Surface`], in the mesh's own frame and unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Which triangle.
    pub triangle: u32,
    /// Weights of its three corners, each in 0..=1, together 1.
    pub barycentric: [f64; 3],
    /// Where it lies: the corners under these weights.
    pub position: Point3<f64>,
    /// The triangle's unit normal, by its corners' order whatever side was hit; zero where it has no area.
    pub normal: Vector3<f64>,
}

impl SurfacePoint {
    /// The part that survives movement.
    pub fn anchor(&self) -> Anchor {
        Anchor { triangle: self.triangle, barycentric: self.barycentric }
    }
}

/// A mesh prepared for nearest points and ray casts. Immutable; queries allocate nothing.
#[derive(Debug, Clone)]
pub struct Surface {
    tree: TriMesh,
    positions: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// Builds the tree, after [`Mesh::validate`].
    pub fn new(mesh: &Mesh) -> Result<Self, MeshFault> {
        mesh.validate()?;
        let vertices = mesh.positions.iter().map(|p| Vector::new(p.x, p.y, p.z)).collect();
        let tree = TriMesh::new(vertices, mesh.triangles.clone())
            .map_err(|_| MeshFault::NoTriangles { vertices: mesh.positions.len() })?;
        Ok(Self { tree, positions: mesh.positions.clone(), triangles: mesh.triangles.clone() })
    }

    /// The triangles, T × 3, as anchors count them.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The point of the surface nearest to `point`; `None` only when `point` is not finite or beyond
    /// [`MAX_COORDINATE`].
    pub fn nearest(&self, point: Point3<f64>) -> Option<SurfacePoint> {
        let (projection, (triangle, location)) =
            self.tree.project_local_point_and_get_location(usable(&point.coords)?, false);
        let weights = match location {
            TrianglePointLocation::OnVertex(i) => corner(i as usize),
            _ => location.barycentric_coordinates().unwrap_or_else(|| corner(0)),
        };
        let found = Point3::new(projection.point.x, projection.point.y, projection.point.z);
        self.point(triangle, weights, found)
    }

    /// The first point of the surface that a ray from `origin` along `direction` (of any length but zero) meets,
    /// from either side; `None` when there is none or an argument is not finite.
    pub fn cast(&self, origin: Point3<f64>, direction: Vector3<f64>) -> Option<SurfacePoint> {
        let unit = direction.try_normalize(0.0)?;
        let ray = Ray::new(usable(&origin.coords)?, usable(&unit)?);
        let hit = self.tree.cast_local_ray_and_get_normal(&ray, f64::MAX, false)?;
        let found = origin + unit * hit.time_of_impact;
        let corners = self.corners(&self.positions, hit.subshape)?;
        self.point(hit.subshape, barycentric(&corners, &found), found)
    }

    /// Where `anchor` lies on moved `positions` (V, in any frame); `None` when it names a triangle or vertex that is
    /// not there.
    pub fn at(&self, anchor: &Anchor, positions: &[Point3<f64>]) -> Option<Point3<f64>> {
        Some(weighted(&self.corners(positions, anchor.triangle)?, &anchor.barycentric))
    }

    /// The vertex nearest to `point` among those that triangles use, and how far it is; `None` only when `point` is
    /// not finite or beyond [`MAX_COORDINATE`].
    ///
    /// This is the snapping of the thesis; it looks at every vertex, [`Surface::nearest`] is faster and closer. Of
    /// vertices equally near the first counts.
    pub fn nearest_vertex(&self, point: Point3<f64>) -> Option<(u32, f64)> {
        usable(&point.coords)?;
        let squared = |i: u32| (self.positions[i as usize] - point).norm_squared();
        let nearest = self
            .triangles
            .iter()
            .flatten()
            .map(|i| (*i, squared(*i)))
            .min_by(|(i, a), (j, b)| a.total_cmp(b).then(i.cmp(j)))?;
        Some((nearest.0, nearest.1.sqrt()))
    }

    fn corners(&self, positions: &[Point3<f64>], triangle: u32) -> Option<[Point3<f64>; 3]> {
        let [a, b, c] = *self.triangles.get(triangle as usize)?;
        Some([*positions.get(a as usize)?, *positions.get(b as usize)?, *positions.get(c as usize)?])
    }

    /// Makes weights and position agree. Slivers can give weights out of range; then `found` is expressed anew.
    fn point(&self, triangle: u32, weights: [f64; 3], found: Point3<f64>) -> Option<SurfacePoint> {
        let corners = self.corners(&self.positions, triangle)?;
        let mut weights = tidied(weights);
        let size = (corners[1] - corners[0]).norm() + (corners[2] - corners[0]).norm();
        let agrees =
            |w: &[f64; 3]| (weighted(&corners, w) - found).norm() <= 1e-9 * (size + found.coords.norm());
        if !weights.as_ref().is_some_and(agrees) {
            weights = tidied(barycentric(&corners, &found)).filter(agrees).or(weights);
        }
        let barycentric = weights.unwrap_or_else(|| corner(0));
        let [a, b, c] = &corners;
        let normal = doubled_area_normal(a, b, c).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        let position = weighted(&corners, &barycentric);
        Some(SurfacePoint { triangle, barycentric, position, normal })
    }
}

/// `parry`'s vector, when every coordinate is finite and within the limit.
fn usable(v: &Vector3<f64>) -> Option<Vector> {
    v.iter().all(|c| c.abs() <= MAX_COORDINATE).then(|| Vector::new(v.x, v.y, v.z))
}

fn corner(i: usize) -> [f64; 3] {
    std::array::from_fn(|k| if k == i { 1.0 } else { 0.0 })
}

fn weighted([a, b, c]: &[Point3<f64>; 3], [u, v, w]: &[f64; 3]) -> Point3<f64> {
    Point3::from(a.coords * *u + b.coords * *v + c.coords * *w)
}

/// Weights moved into 0..=1 with sum 1; `None` when they are not finite or all zero.
fn tidied(weights: [f64; 3]) -> Option<[f64; 3]> {
    let clamped = weights.map(|w| w.clamp(0.0, 1.0));
    let sum: f64 = clamped.iter().sum();
    (sum.is_finite() && sum > 0.0).then(|| clamped.map(|w| w / sum))
}

/// Barycentric coordinates of a point that lies in the triangle's plane; on its longest edge where it has no area.
fn barycentric(corners: &[Point3<f64>; 3], p: &Point3<f64>) -> [f64; 3] {
    let [a, b, c] = corners;
    let normal = doubled_area_normal(a, b, c);
    let squared = normal.norm_squared();
    if squared > 0.0 {
        let v = (p - a).cross(&(c - a)).dot(&normal) / squared;
        let w = (b - a).cross(&(p - a)).dot(&normal) / squared;
        if v.is_finite() && w.is_finite() {
            return [1.0 - v - w, v, w];
        }
    }
    let lengths = [(b - a).norm_squared(), (c - b).norm_squared(), (a - c).norm_squared()];
    let longest = (0..3).max_by(|i, j| lengths[*i].total_cmp(&lengths[*j])).unwrap_or(0);
    let (from, to) = (longest, (longest + 1) % 3);
    let edge = corners[to] - corners[from];
    let t = (p - corners[from]).dot(&edge) / lengths[longest];
    let t = if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 };
    std::array::from_fn(|k| {
        if k == from {
            1.0 - t
        } else if k == to {
            t
        } else {
            0.0
        }
    })
}
