//! The triangle mesh every reader produces and every later stage shares.

use std::sync::Arc;

use nalgebra::Point3;

/// An encoded texture image, kept as its file's bytes so that exports carry it unchanged.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Texture {
    /// File name without folders, for messages and exports.
    pub name: String,
    /// How `bytes` is encoded.
    pub format: TextureFormat,
    /// The encoded image, sRGB.
    pub bytes: Vec<u8>,
}

/// The image encodings a scan's texture may have; both are embedded in GLB as they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextureFormat {
    /// PNG.
    Png,
    /// JPEG.
    Jpeg,
}

/// A surface's look.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// The material's name in its file.
    pub name: String,
    /// Linear RGBA factor, 0..=1.
    pub base_colour: [f32; 4],
    /// Multiplied by `base_colour` where present.
    pub texture: Option<Arc<Texture>>,
    /// How wet it shines, 0..=1: 0 is skin, 1 the eye's cornea.
    pub gloss: f32,
}

/// A triangle mesh, vertices in the order of its file.
///
/// Positions are in the frame and unit that the owner states: the file's own straight from a reader, the scan frame
/// in millimetres inside the program.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// V × 3.
    pub positions: Vec<Point3<f64>>,
    /// T × 3 indices into `positions`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// U × 2 texture coordinates, origin at the image's bottom left (OBJ's convention).
    pub uvs: Vec<[f32; 2]>,
    /// T × 3 indices into `uvs`; empty when the mesh has no texture coordinates.
    pub uv_triangles: Vec<[u32; 3]>,
    /// V × 3 sRGB colours in 0..=1; empty when the mesh has none.
    pub colours: Vec<[f32; 3]>,
    /// Empty means one default grey material.
    pub materials: Vec<Material>,
    /// T indices into `materials`; empty when there is at most one material.
    pub triangle_materials: Vec<u32>,
}

impl Mesh {
    /// V × 3 positions in single precision, as renderers and warps take them.
    pub fn positions_f32(&self) -> Vec<[f32; 3]> {
        self.positions.iter().map(|p| p.coords.map(|v| v as f32).into()).collect()
    }

    /// Centre of the axis-aligned bounding box, and half its diagonal. The mesh has at least one vertex.
    pub fn bounding_ball(&self) -> (Point3<f64>, f64) {
        let first = self.positions.first().copied().unwrap_or_else(Point3::origin);
        let (low, high) =
            self.positions.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
        (nalgebra::center(&low, &high), (high - low).norm() / 2.0)
    }
}
