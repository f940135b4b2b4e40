//! The triangle mesh every reader produces and every later stage shares.

use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, ops::Range, sync::Arc};

use nalgebra::Point3;

/// An encoded texture image, kept as its file's bytes so that exports carry it unchanged.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Texture {
    /// File name without folders, for messages and exports.
    pub name: String,
    /// How `bytes` is encoded.
    pub format: TextureFormat,
    /// The encoded image, sRGB.
    pub bytes: Vec<u8>,
}

/// The image encodings a scan's texture may have; both are embedded in GLB as they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum TextureFormat {
    /// PNG.
    Png,
    /// JPEG.
    Jpeg,
}

/// A surface's look.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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

impl Material {
    /// Dry skin with a texture, of a file that names no materials.
    pub fn textured(texture: Arc<Texture>) -> Self {
        Self { name: "scan".to_owned(), base_colour: [1.0; 4], texture: Some(texture), gloss: 0.0 }
    }
}

/// A triangle mesh, vertices in the order of its file.
///
/// Positions are in the frame and unit that the owner states: the file's own straight from a reader, the scan frame
/// in millimetres inside the program.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
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

    /// A stretch of vertices and of the triangles between them as a mesh of its own, with the texture coordinates and
    /// materials that it uses.
    #[must_use]
    pub fn stretch(&self, vertices: &Range<usize>, triangles: &Range<usize>) -> Self {
        let (mut uvs, mut materials) = (BTreeMap::new(), BTreeMap::new());
        let renumbered = |seen: &mut BTreeMap<u32, u32>, old: u32| {
            let next = seen.len() as u32;
            *seen.entry(old).or_insert(next)
        };
        let slice = |list: &[[u32; 3]]| list.get(triangles.clone()).unwrap_or_default().to_vec();
        let uv_triangles: Vec<[u32; 3]> = slice(&self.uv_triangles)
            .into_iter()
            .map(|corners| corners.map(|uv| renumbered(&mut uvs, uv)))
            .collect();
        let used = self.triangle_materials.get(triangles.clone()).unwrap_or_default();
        let triangle_materials: Vec<u32> =
            used.iter().map(|&material| renumbered(&mut materials, material)).collect();
        let in_order = |seen: BTreeMap<u32, u32>| {
            let mut order: Vec<(u32, u32)> = seen.into_iter().map(|(old, new)| (new, old)).collect();
            order.sort_unstable();
            order.into_iter().map(|(_, old)| old as usize)
        };
        let first = vertices.start as u32;
        Self {
            positions: self.positions[vertices.clone()].to_vec(),
            triangles: slice(&self.triangles).into_iter().map(|t| t.map(|v| v - first)).collect(),
            uvs: in_order(uvs).map(|uv| self.uvs[uv]).collect(),
            uv_triangles,
            colours: self.colours.get(vertices.clone()).unwrap_or_default().to_vec(),
            materials: if self.triangle_materials.is_empty() {
                self.materials.clone()
            } else {
                in_order(materials).map(|material| self.materials[material].clone()).collect()
            },
            triangle_materials,
        }
    }

    /// Centre of the axis-aligned bounding box, and half its diagonal. The mesh has at least one vertex.
    pub fn bounding_ball(&self) -> (Point3<f64>, f64) {
        let first = self.positions.first().copied().unwrap_or_else(Point3::origin);
        let (low, high) =
            self.positions.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
        (nalgebra::center(&low, &high), (high - low).norm() / 2.0)
    }
}
