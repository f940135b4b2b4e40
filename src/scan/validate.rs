//! Which meshes the rest of the program may rely on.
//!
//! Multi-part and non-manifold meshes pass: a scan is what it is. Nothing here renumbers vertices, since point
//! caches and landmark files refer to them by their place in the file.

use super::mesh::Mesh;

/// More vertices than this are refused.
pub const MAX_VERTICES: usize = 4_000_000;
/// More triangles than this are refused.
pub const MAX_TRIANGLES: usize = 16_000_000;
/// Coordinates beyond this, in any unit, are refused: products of four of them must stay finite.
pub const MAX_COORDINATE: f64 = 1e9;

/// The first thing found wrong with a [`Mesh`]. Vertices and triangles count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshFault {
    /// A surface needs three vertices.
    #[error("it has {found} vertices, and a surface needs at least 3")]
    TooFewVertices {
        /// How many there are.
        found: usize,
    },
    /// A point cloud, or nothing but degenerate triangles.
    #[error("it has {vertices} vertices but no triangle")]
    NoTriangles {
        /// How many vertices there are.
        vertices: usize,
    },
    /// Beyond [`MAX_VERTICES`] or [`MAX_TRIANGLES`].
    #[error("it has {found} {what}, and at most {limit} are read")]
    TooMany {
        /// Vertices or triangles.
        what: &'static str,
        /// How many there are, at least.
        found: usize,
        /// How many there may be.
        limit: usize,
    },
    /// A coordinate is not finite or beyond [`MAX_COORDINATE`].
    #[error("vertex {vertex} (counted from 0) lies at {position:?}, which is not a finite place within ±1e9")]
    BadPosition {
        /// The first such vertex.
        vertex: usize,
        /// Where it lies.
        position: [f64; 3],
    },
    /// A texture coordinate or colour is not finite.
    #[error("{what} {index} (counted from 0) is not a finite number")]
    BadAttribute {
        /// Which attribute.
        what: &'static str,
        /// The first such entry.
        index: usize,
    },
    /// A triangle refers to something that is not there.
    #[error("triangle {triangle} (counted from 0) refers to {what} {index}, but there are only {count}")]
    OutOfRange {
        /// The first such triangle.
        triangle: usize,
        /// What it refers to.
        what: &'static str,
        /// The index it uses.
        index: u32,
        /// How many there are.
        count: usize,
    },
    /// An attribute array has neither the right length nor none.
    #[error("it has {found} {what} where {wanted} are needed")]
    WrongLength {
        /// Which attribute.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length it should have.
        wanted: usize,
    },
    /// Every triangle has shrunk to one and the same point.
    #[error("all its triangles lie in the one point {position:?}")]
    NoExtent {
        /// That point.
        position: [f64; 3],
    },
}

impl MeshFault {
    /// What the user can do about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::TooFewVertices { .. } | Self::NoTriangles { .. } => {
                "Export the scan as a surface with faces; a point cloud must be meshed first, for instance in MeshLab"
            }
            Self::TooMany { .. } => super::error::Fault::DECIMATE,
            Self::BadPosition { .. } | Self::BadAttribute { .. } => {
                "Remove broken vertices in MeshLab or Blender and export the scan again"
            }
            Self::OutOfRange { .. } | Self::WrongLength { .. } => super::error::Fault::EXPORT_AGAIN,
            Self::NoExtent { .. } => "Check the export's scale and precision",
        }
    }
}

impl Mesh {
    /// Checks everything later stages rely on: sizes within the limits, at least three vertices and one triangle,
    /// finite positions and attributes, indices in range, attribute lengths that fit, more than one point covered.
    ///
    /// Triangles without area, edges shared by more than two triangles, several parts and vertices that no triangle
    /// uses are all accepted.
    pub fn validate(&self) -> Result<(), MeshFault> {
        let (v, t) = (self.positions.len(), self.triangles.len());
        check_count("vertices", v, MAX_VERTICES)?;
        check_count("triangles", t, MAX_TRIANGLES)?;
        if v < 3 {
            return Err(MeshFault::TooFewVertices { found: v });
        }
        if t == 0 {
            return Err(MeshFault::NoTriangles { vertices: v });
        }
        let sound = |c: &f64| c.abs() <= MAX_COORDINATE;
        if let Some(vertex) = self.positions.iter().position(|p| !p.iter().all(sound)) {
            return Err(MeshFault::BadPosition { vertex, position: self.positions[vertex].into() });
        }
        check_finite("texture coordinate", &self.uvs)?;
        check_finite("vertex colour", &self.colours)?;
        check_indices("vertex", &self.triangles, v)?;
        check_indices("texture coordinate", &self.uv_triangles, self.uvs.len())?;
        for (what, found, wanted) in [
            ("texture coordinate triangles", self.uv_triangles.len(), t),
            ("vertex colours", self.colours.len(), v),
            ("material numbers", self.triangle_materials.len(), t),
        ] {
            if found != 0 && found != wanted {
                return Err(MeshFault::WrongLength { what, found, wanted });
            }
        }
        let m = self.materials.len();
        if let Some((triangle, &index)) =
            self.triangle_materials.iter().enumerate().find(|(_, i)| **i as usize >= m.max(1))
        {
            return Err(MeshFault::OutOfRange { triangle, what: "material", index, count: m });
        }
        let first = self.positions[self.triangles[0][0] as usize];
        if self.triangles.iter().flatten().all(|i| self.positions[*i as usize] == first) {
            return Err(MeshFault::NoExtent { position: first.into() });
        }
        Ok(())
    }

    /// Drops the triangles that name a vertex twice, with their texture coordinates and materials, and returns how
    /// many there were. The vertices keep their order and number.
    pub fn drop_degenerate_triangles(&mut self) -> usize {
        let keep: Vec<bool> = self.triangles.iter().map(|[a, b, c]| a != b && b != c && c != a).collect();
        let dropped = keep.iter().filter(|k| !**k).count();
        if dropped > 0 {
            retain(&mut self.triangles, &keep);
            retain(&mut self.uv_triangles, &keep);
            retain(&mut self.triangle_materials, &keep);
        }
        dropped
    }
}

/// Refuses `found` beyond `limit`; readers call it before they build anything of that size.
pub(super) fn check_count(what: &'static str, found: usize, limit: usize) -> Result<(), MeshFault> {
    if found > limit { Err(MeshFault::TooMany { what, found, limit }) } else { Ok(()) }
}

fn check_finite<const N: usize>(what: &'static str, values: &[[f32; N]]) -> Result<(), MeshFault> {
    match values.iter().position(|v| !v.iter().all(|c| c.is_finite())) {
        Some(index) => Err(MeshFault::BadAttribute { what, index }),
        None => Ok(()),
    }
}

fn check_indices(what: &'static str, triangles: &[[u32; 3]], count: usize) -> Result<(), MeshFault> {
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|i| **i as usize >= count) {
            return Err(MeshFault::OutOfRange { triangle, what, index, count });
        }
    }
    Ok(())
}

/// Keeps the entries marked in `keep`; an attribute the mesh does not have stays empty.
fn retain<T>(values: &mut Vec<T>, keep: &[bool]) {
    let mut marks = keep.iter().copied();
    values.retain(|_| marks.next().unwrap_or(true));
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    fn quad() -> Mesh {
        Mesh {
            positions: vec![
                Point3::new(0.0, 0.0, 0.0),
                Point3::new(1.0, 0.0, 0.0),
                Point3::new(1.0, 1.0, 0.0),
                Point3::new(0.0, 1.0, 0.0),
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        }
    }

    #[test]
    fn names_the_first_offender() {
        assert_eq!(quad().validate(), Ok(()));
        let mut mesh = quad();
        mesh.positions[2].y = f64::NAN;
        assert!(matches!(mesh.validate(), Err(MeshFault::BadPosition { vertex: 2, .. })));
        let mut mesh = quad();
        mesh.triangles[1][1] = 9;
        let wanted = MeshFault::OutOfRange { triangle: 1, what: "vertex", index: 9, count: 4 };
        assert_eq!(mesh.validate(), Err(wanted));
        let mut mesh = quad();
        mesh.colours = vec![[0.0; 3]; 3];
        assert!(matches!(mesh.validate(), Err(MeshFault::WrongLength { found: 3, wanted: 4, .. })));
        let mut mesh = quad();
        mesh.positions.fill(Point3::new(2.0, 2.0, 2.0));
        assert!(matches!(mesh.validate(), Err(MeshFault::NoExtent { .. })));
        assert!(matches!(Mesh::default().validate(), Err(MeshFault::TooFewVertices { found: 0 })));
        let cloud = Mesh { triangles: vec![], ..quad() };
        assert_eq!(cloud.validate(), Err(MeshFault::NoTriangles { vertices: 4 }));
    }

    #[test]
    fn degenerate_triangles_go_and_vertices_stay() {
        let mut mesh = quad();
        mesh.triangles.insert(1, [3, 3, 0]);
        mesh.triangle_materials = vec![0, 1, 2];
        assert_eq!(mesh.drop_degenerate_triangles(), 1);
        assert_eq!(mesh.triangles, quad().triangles);
        assert_eq!(mesh.triangle_materials, [0, 2]);
        assert_eq!(mesh.positions, quad().positions);
    }
}
