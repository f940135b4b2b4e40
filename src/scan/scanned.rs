//! A face that was scanned: its mesh in the scan frame, and the way back to its file.

use std::path::{Path, PathBuf};

use nalgebra::Point3;

use super::error::ScanError;
use super::mesh::Mesh;
use super::placement::Placement;
use super::read::read_mesh;
use super::validate::MeshFault;

/// A scanned face.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// What messages and exports call it: the file's stem, unless the user says otherwise.
    pub name: String,
    /// The file it was read from, if any.
    pub path: Option<PathBuf>,
    /// V vertices in the file's order, **scan frame, millimetres**.
    pub mesh: Mesh,
    /// From the file's own frame and unit to the scan frame.
    pub placement: Placement,
}

impl Scan {
    /// Reads the mesh at `path` and places it.
    pub fn read(path: &Path, placement: Placement) -> Result<Self, ScanError> {
        let mesh = read_mesh(path)?;
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        Ok(Self { path: Some(path.to_owned()), ..Self::place(name, mesh, placement) })
    }

    /// Places a mesh that is in its own frame and unit, after checking it.
    pub fn new(name: impl Into<String>, own_mesh: Mesh, placement: Placement) -> Result<Self, MeshFault> {
        own_mesh.validate()?;
        Ok(Self::place(name.into(), own_mesh, placement))
    }

    fn place(name: String, mut mesh: Mesh, placement: Placement) -> Self {
        for p in &mut mesh.positions {
            *p = placement.to_scan(*p);
        }
        Self { name, path: None, mesh, placement }
    }

    /// The same scan under another placement, for instance once landmarks have shown where the face looks.
    #[must_use]
    pub fn replaced(mut self, placement: Placement) -> Self {
        for p in &mut self.mesh.positions {
            *p = placement.to_scan(self.placement.to_own(*p));
        }
        self.placement = placement;
        self
    }

    /// The V positions in the file's own frame and unit: the file's, to rounding (about 1e-13 of their size).
    pub fn own_positions(&self) -> Vec<Point3<f64>> {
        self.mesh.positions.iter().map(|p| self.placement.to_own(*p)).collect()
    }

    /// Brings moved vertices (scan frame, millimetres) to the file's own frame and unit, as exports want them.
    ///
    /// Goes as far as the shorter of the two slices; allocates nothing.
    pub fn to_own(&self, scan: &[[f32; 3]], own: &mut [[f32; 3]]) {
        for (to, from) in own.iter_mut().zip(scan) {
            let p = self.placement.to_own(Point3::from(from.map(f64::from)));
            *to = [p.x as f32, p.y as f32, p.z as f32];
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};

    use super::*;

    fn mesh() -> Mesh {
        Mesh {
            positions: vec![
                Point3::new(0.01, 0.1, 0.2),
                Point3::new(-0.05, 0.12, 0.19),
                Point3::new(0.03, -0.1, 0.3),
            ],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        }
    }

    #[test]
    fn the_file_comes_back() {
        let turn = Rotation3::new(Vector3::new(0.3, -1.2, 0.4));
        let placement = Placement::new(turn, Vector3::new(5.0, -1600.0, 2.0), 1000.0).unwrap();
        let scan = Scan::new("test", mesh(), placement).unwrap();
        for (p, q) in scan.own_positions().iter().zip(&mesh().positions) {
            assert!((p - q).norm() < 1e-12);
        }
        let moved: Vec<[f32; 3]> =
            scan.mesh.positions.iter().map(|p| [p.x as f32, p.y as f32, p.z as f32]).collect();
        let mut own = vec![[0.0; 3]; 3];
        scan.to_own(&moved, &mut own);
        assert!((f64::from(own[2][2]) - 0.3).abs() < 1e-6);
        let again = scan.clone().replaced(Placement::identity());
        assert!((again.mesh.positions[1] - mesh().positions[1]).norm() < 1e-12);
    }

    #[test]
    fn refuses_a_broken_mesh() {
        assert!(Scan::new("none", Mesh::default(), Placement::identity()).is_err());
    }
}
