//! The surface on either side of the lips: what belongs to the upper lip is not looked for on the lower one.

use nalgebra::Point3;

use super::{Anatomy, LOWER_INNER, LOWER_LIP, UPPER_INNER, UPPER_LIP};
use crate::scan::{Mesh, Surface};

/// On which side of the lips' line something lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lip {
    /// It moves only what lies above.
    Upper,
    /// It moves only what lies below.
    Lower,
    /// It moves both.
    Neither,
}

impl Lip {
    /// The side of a landmark.
    pub fn of(landmark: usize) -> Self {
        if UPPER_LIP.contains(&landmark) || UPPER_INNER.contains(&landmark) {
            Self::Upper
        } else if LOWER_LIP.contains(&landmark) || LOWER_INNER.contains(&landmark) {
            Self::Lower
        } else {
            Self::Neither
        }
    }
}

/// A place on a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkinPlace {
    /// Vertices of its triangle.
    pub vertices: [u32; 3],
    /// Their weights, together 1.
    pub weights: [f64; 3],
    /// Where it rests.
    pub position: Point3<f64>,
}

impl SkinPlace {
    /// Where it lies on moved `positions`.
    pub fn on(&self, positions: &[Point3<f64>]) -> Option<Point3<f64>> {
        let mut sum = nalgebra::Vector3::zeros();
        for (&vertex, weight) in self.vertices.iter().zip(self.weights) {
            sum += positions.get(vertex as usize)?.coords * weight;
        }
        Some(Point3::from(sum))
    }
}

/// A skin whose lips' sides are known.
#[derive(Debug, Clone)]
pub struct SidedSkin {
    whole: Surface,
    /// The upper and the lower side by themselves; `None` where there is no such side.
    sides: [Option<Surface>; 2],
}

impl SidedSkin {
    /// `lower_side` has for each vertex 0 on the upper lip's side and 1 on the lower one's; empty: nothing is known, and
    /// all of it is on both. `None` where the mesh is no surface.
    pub fn new(positions: &[Point3<f64>], triangles: &[[u32; 3]], lower_side: &[f32]) -> Option<Self> {
        let part = |belongs: &dyn Fn(u32) -> bool| {
            let triangles = triangles.iter().copied().filter(|t| t.iter().all(|&v| belongs(v))).collect();
            Surface::new(&Mesh { positions: positions.to_vec(), triangles, ..Mesh::default() }).ok()
        };
        let is_lower = |v: u32| lower_side.get(v as usize).is_some_and(|side| *side >= 0.5);
        let divided = lower_side.iter().any(|side| *side >= 0.5);
        let sides = if divided { [part(&|v| !is_lower(v)), part(&|v| is_lower(v))] } else { [None, None] };
        Some(Self { whole: part(&|_| true)?, sides })
    }

    /// Of a scan whose lips are parted, if only by their mesh; where they are one skin, all of it is on both sides. `mesh`
    /// and `landmarks` in one frame, millimetres. `None` where the mesh is no surface.
    pub fn of_scan(mesh: &Mesh, surface: &Surface, landmarks: &[Option<Point3<f64>>]) -> Option<Self> {
        let anatomy = Anatomy::prepare(mesh, surface, landmarks, None);
        let parted = anatomy.mouth.as_ref().is_some_and(|mouth| !mouth.is_cut);
        let sides = if parted { &anatomy.lower_side[..mesh.positions.len()] } else { &[] };
        Self::new(&mesh.positions, &mesh.triangles, sides)
    }

    /// The nearest point that belongs to a lip.
    pub fn nearest(&self, lip: Lip, point: Point3<f64>) -> Option<SkinPlace> {
        let own = match lip {
            Lip::Upper => self.sides[0].as_ref(),
            Lip::Lower => self.sides[1].as_ref(),
            Lip::Neither => None,
        };
        let surface = own.unwrap_or(&self.whole);
        let found = surface.nearest(point)?;
        Some(SkinPlace {
            vertices: surface.triangles()[found.triangle as usize],
            weights: found.barycentric,
            position: found.position,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_nearer_to_the_other_lip_is_found_on_its_own() {
        let square = |y: f64| [[0.0, y], [1.0, y], [1.0, y + 1.0], [0.0, y + 1.0]];
        let positions: Vec<_> =
            square(0.1).into_iter().chain(square(-1.0)).map(|[x, y]| Point3::new(x, y, 0.0)).collect();
        let triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let sides = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
        let skin = SidedSkin::new(&positions, &triangles, &sides).unwrap();
        let point = Point3::new(0.5, 0.02, 0.3);
        let y = |lip| skin.nearest(lip, point).unwrap().position.y;
        assert!((y(Lip::Upper) - 0.1).abs() < 1e-12 && y(Lip::Lower).abs() < 1e-12);
        assert!(y(Lip::Neither).abs() < 1e-12);
        let place = skin.nearest(Lip::Upper, point).unwrap();
        assert!((place.on(&positions).unwrap() - place.position).norm() < 1e-12);
        let unknown = SidedSkin::new(&positions, &triangles, &[]).unwrap();
        assert!(unknown.nearest(Lip::Upper, point).unwrap().position.y.abs() < 1e-12);
    }
}
