//! Putting added parts and their pictures into the scan's mesh.

use image::RgbImage;

use super::{
    FaceFrame, interior,
    model::{Part, PartKind},
    part::PartMesh,
};
use crate::scan::{Material, Mesh, Texture, TextureFormat};

/// A picture as a texture.
pub(super) fn encoded(name: &str, picture: &RgbImage) -> Texture {
    let mut bytes = std::io::Cursor::new(Vec::new());
    // Writing into memory does not fail; without bytes the material is plain.
    let _ = picture.write_to(&mut bytes, image::ImageFormat::Png);
    Texture { name: format!("{name}.png"), format: TextureFormat::Png, bytes: bytes.into_inner() }
}

/// Gives the scan's own cavity the flesh of the mouth's picture: a scanner has painted it, if at all, like skin.
pub(super) fn paint_bag(mesh: &mut Mesh, bag: &[u32], flesh: &Material) {
    if bag.is_empty() {
        return;
    }
    complete(mesh);
    let number = mesh.materials.len() as u32;
    mesh.materials.push(Material { name: "mouth".into(), ..flesh.clone() });
    let uv = mesh.uvs.len() as u32;
    mesh.uvs.push(interior::DEEP);
    for &triangle in bag {
        mesh.triangle_materials[triangle as usize] = number;
        mesh.uv_triangles[triangle as usize] = [uv; 3];
    }
}

/// Gives every triangle a material and texture coordinates.
fn complete(mesh: &mut Mesh) {
    if mesh.materials.is_empty() {
        mesh.materials.push(Material {
            name: "skin".into(),
            base_colour: [1.0; 4],
            texture: None,
            gloss: 0.0,
        });
    }
    if mesh.triangle_materials.is_empty() {
        mesh.triangle_materials = vec![0; mesh.triangles.len()];
    }
    if mesh.uv_triangles.is_empty() {
        mesh.uvs = vec![[0.0; 2]];
        mesh.uv_triangles = vec![[0; 3]; mesh.triangles.len()];
    }
}

/// Appends a part to the mesh, which gains what it lacks to hold it.
pub(super) fn join(
    mesh: &mut Mesh,
    frame: &FaceFrame,
    kind: PartKind,
    part: &PartMesh,
    material: Material,
) -> Part {
    complete(mesh);
    let (vertex, uv, triangle) = (mesh.positions.len(), mesh.uvs.len(), mesh.triangles.len());
    let number = mesh.materials.len() as u32;
    mesh.materials.push(material);
    mesh.positions.extend(part.positions.iter().map(|p| frame.leave(p)));
    if !mesh.colours.is_empty() {
        mesh.colours.resize(mesh.positions.len(), [1.0; 3]);
    }
    mesh.uvs.extend(&part.uvs);
    let from = |offset: usize| move |t: &[u32; 3]| t.map(|i| i + offset as u32);
    mesh.uv_triangles.extend(part.triangles.iter().map(from(uv)));
    mesh.triangle_materials.resize(triangle + part.triangles.len(), number);
    mesh.triangles.extend(part.triangles.iter().map(from(vertex)));
    Part { kind, vertices: vertex..mesh.positions.len(), triangles: triangle..mesh.triangles.len() }
}
