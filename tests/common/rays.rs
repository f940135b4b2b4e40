//! What is seen of a posed avatar, ray by ray.

use std::collections::BTreeSet;

use nalgebra::{Point2, Point3, Rotation3, Vector3};
use understudy::{
    anatomy::PartKind,
    rig::AvatarFrame,
    scan::{Mesh, Surface},
};

use super::opened::{Opened, points};

/// The avatar in one pose, ready to be looked at.
pub struct Seen<'a> {
    opened: &'a Opened,
    surface: Surface,
    pub positions: Vec<Point3<f64>>,
}

impl<'a> Seen<'a> {
    pub fn new(opened: &'a Opened, frame: &AvatarFrame) -> Self {
        let positions = points(&frame.positions);
        let triangles = opened.anatomy.mesh.triangles.clone();
        let surface =
            Surface::new(&Mesh { positions: positions.clone(), triangles, ..Mesh::default() }).unwrap();
        Self { opened, surface, positions }
    }

    /// What a ray that ends at a place of the face's plane meets first: what it is, on which triangle, and where.
    pub fn from(&self, view: &View, place: &Point2<f64>) -> Option<(PartKind, u32, Point3<f64>)> {
        let (origin, direction) = view.ray(place);
        let hit = self.surface.cast(origin, direction)?;
        Some((self.opened.kind_of(hit.triangle), hit.triangle, hit.position))
    }
}

/// Parallel rays: their direction and the plane on which places are told apart.
pub struct View {
    /// From the scan frame to axes of the view: x right, y up, z towards the viewer.
    turn: Rotation3<f64>,
    /// Between all rays.
    centre: Point3<f64>,
}

impl View {
    /// From before a place, turned to the subject's left and up, radians.
    pub fn of(opened: &Opened, centre: Point3<f64>, yaw: f64, pitch: f64) -> Self {
        let face = opened.anatomy.frame.unwrap().rotation();
        let aside = Rotation3::from_axis_angle(&Vector3::y_axis(), -yaw);
        let upwards = Rotation3::from_axis_angle(&Vector3::x_axis(), pitch);
        Self { turn: upwards * aside * face, centre }
    }

    /// Where a place is seen.
    pub fn project(&self, place: &Point3<f64>) -> Point2<f64> {
        (self.turn * (place - self.centre)).xy().into()
    }

    fn ray(&self, place: &Point2<f64>) -> (Point3<f64>, Vector3<f64>) {
        let back = self.turn.inverse();
        (self.centre + back * Vector3::new(place.x, place.y, 500.0), back * -Vector3::z())
    }
}

/// Places `step` apart within a half width and a half height.
pub fn grid(half: [f64; 2], step: f64) -> impl Iterator<Item = Point2<f64>> {
    let count = half.map(|half| (half / step) as i32);
    (-count[1]..=count[1]).flat_map(move |j| {
        // Off the axes by an irrational share, so that no ray meets an edge of a regular mesh.
        let off = 0.381_966 * step;
        (-count[0]..=count[0]).map(move |i| Point2::new(f64::from(i) * step + off, f64::from(j) * step + off))
    })
}

/// How far a place lies inside a closed curve, counting an area that is run round twice as inside; negative outside.
pub fn inside(curve: &[Point2<f64>], place: &Point2<f64>) -> f64 {
    let (mut winding, mut nearest) = (0, f64::INFINITY);
    for (i, a) in curve.iter().enumerate() {
        let b = &curve[(i + 1) % curve.len()];
        let (edge, to) = (b - a, place - a);
        let t = (to.dot(&edge) / edge.norm_squared().max(1e-30)).clamp(0.0, 1.0);
        nearest = nearest.min((to - edge * t).norm());
        let side = edge.x * to.y - edge.y * to.x;
        if a.y <= place.y && b.y > place.y && side > 0.0 {
            winding += 1;
        } else if a.y > place.y && b.y <= place.y && side < 0.0 {
            winding -= 1;
        }
    }
    if winding == 0 { -nearest } else { nearest }
}

/// The triangles all of whose vertices are among some.
pub fn triangles_of(mesh: &Mesh, vertices: &BTreeSet<u32>) -> BTreeSet<u32> {
    let whole = |corners: &[u32; 3]| corners.iter().all(|v| vertices.contains(v));
    (0_u32..).zip(&mesh.triangles).filter(|(_, corners)| whole(corners)).map(|(t, _)| t).collect()
}
