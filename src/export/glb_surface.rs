//! A mesh as glTF wants it: one index per corner, so vertices on texture seams are split.

use std::collections::BTreeMap;
use std::sync::Arc;

use gltf_json as json;
use gltf_json::Index;
use gltf_json::material::{
    AlphaMode, EmissiveFactor, Material, PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor,
};
use gltf_json::validation::Checked::Valid;

use super::glb::{GlbPart, MorphTarget};
use super::glb_buffer::GlbBuffer;
use super::glb_image::power_of_two;
use crate::scan::{Mesh, Texture, TextureFormat};

/// Of skin, and of the wettest surface: a little above 0, because viewers' highlights vanish there.
const ROUGHNESS: [f32; 2] = [0.8, 0.08];
/// Linear; what a scan without any colour is shown in.
const DEFAULT_GREY: [f32; 4] = [0.6, 0.6, 0.6, 1.0];

/// Split vertices and the triangles between them, by material.
#[derive(Debug)]
pub(super) struct Surface {
    /// G mesh vertices, ascending: where each GPU vertex takes its position, normal, colour and morphs.
    pub sources: Vec<u32>,
    /// G texture coordinates, origin top left as in glTF; empty without.
    uvs: Vec<[f32; 2]>,
    /// Corners by material, materials without triangles left out.
    groups: BTreeMap<u32, Vec<u32>>,
}

impl Surface {
    /// Splits what differs in texture coordinates. Triangles that use a vertex twice and vertices of no triangle are
    /// left out; without seams and such vertices the order is the mesh's own.
    ///
    /// The mesh's indices must have been checked.
    pub fn split(mesh: &Mesh) -> Self {
        let has_uvs = !mesh.uv_triangles.is_empty();
        let corner_uvs = |triangle: usize| mesh.uv_triangles.get(triangle).copied().unwrap_or_default();
        let kept = |corners: &[u32; 3]| {
            corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0]
        };
        let triangles = || mesh.triangles.iter().enumerate().filter(move |(_, corners)| kept(corners));
        let mut pairs: Vec<(u32, u32)> = triangles()
            .flat_map(|(triangle, corners)| {
                let uvs = corner_uvs(triangle);
                [0, 1, 2].map(|corner| (corners[corner], uvs[corner]))
            })
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut groups: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (triangle, corners) in triangles() {
            let material = mesh.triangle_materials.get(triangle).copied().unwrap_or(0);
            let uvs = corner_uvs(triangle);
            let group = groups.entry(material).or_default();
            for corner in 0..3 {
                let place = pairs.partition_point(|pair| *pair < (corners[corner], uvs[corner]));
                group.push(place as u32);
            }
        }
        let uvs = if has_uvs {
            pairs.iter().map(|&(_, uv)| mesh.uvs[uv as usize]).map(|[u, v]| [u, 1.0 - v]).collect()
        } else {
            Vec::new()
        };
        Self { sources: pairs.into_iter().map(|(vertex, _)| vertex).collect(), uvs, groups }
    }

    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Values per mesh vertex as values per GPU vertex.
    fn spread<T: Copy>(&self, values: &[T]) -> Vec<T> {
        self.sources.iter().map(|&vertex| values[vertex as usize]).collect()
    }
}

/// Adds the vertices once and a primitive for each material; returns the primitives.
pub(super) fn push_surface(
    part: &GlbPart,
    surface: &Surface,
    looks: &mut Looks,
    root: &mut json::Root,
    buffer: &mut GlbBuffer,
) -> Vec<json::mesh::Primitive> {
    use json::mesh::Semantic;
    let mesh = part.mesh;
    let positions: Vec<[f32; 3]> = part.positions().collect();
    let positions = buffer.push_vertices(&surface.spread(&positions), true);
    let normals = (!part.normals.is_empty()).then(|| {
        let unit: Vec<_> = part.normals.iter().copied().map(unit_normal).collect();
        buffer.push_vertices(&surface.spread(&unit), false)
    });
    // Morphs that move nothing share their zeros.
    let mut still = None;
    let mut deltas = |morph: &MorphTarget| {
        if morph.deltas.is_empty() {
            let zeros = || vec![[0.0; 3]; surface.sources.len()];
            *still.get_or_insert_with(|| buffer.push_vertices(&zeros(), true))
        } else {
            buffer.push_vertices(&surface.spread(&morph.deltas), true)
        }
    };
    let targets: Vec<_> = part
        .morphs
        .iter()
        .map(|morph| json::mesh::MorphTarget {
            positions: Some(deltas(morph)),
            normals: None,
            tangents: None,
        })
        .collect();
    // Attributes that no material of the scan uses are not stored.
    let (mut uvs, mut colours) = (None, None);
    let mut primitives = Vec::with_capacity(surface.groups.len());
    for (&material, corners) in &surface.groups {
        let found = mesh.materials.get(material as usize);
        let texture = found.and_then(|found| found.texture.as_ref()).filter(|_| !surface.uvs.is_empty());
        let mut attributes = BTreeMap::from([(Valid(Semantic::Positions), positions)]);
        attributes.extend(normals.map(|normals| (Valid(Semantic::Normals), normals)));
        if texture.is_some() {
            let uvs = *uvs.get_or_insert_with(|| buffer.push_vertices(&surface.uvs, false));
            attributes.insert(Valid(Semantic::TexCoords(0)), uvs);
        } else if !mesh.colours.is_empty() {
            // Not beside a texture: glTF multiplies the two, and a scan's file has the same skin in both.
            let colours = *colours.get_or_insert_with(|| {
                let linear: Vec<_> = mesh.colours.iter().map(|colour| colour.map(linear_from_srgb)).collect();
                buffer.push_vertices(&surface.spread(&linear), false)
            });
            attributes.insert(Valid(Semantic::Colors(0)), colours);
        }
        let indices = buffer.push_indices(corners);
        let texture = texture.map(|texture| looks.texture(texture, root, buffer));
        let bare = if mesh.colours.is_empty() { DEFAULT_GREY } else { [1.0; 4] };
        // A factor of one on nothing is no colour but a missing one.
        let is_missing = |colour: &[f32; 4]| texture.is_none() && colour[..3].iter().all(|c| *c >= 1.0);
        let colour = found.map(|found| found.base_colour).filter(|c| !is_missing(c)).unwrap_or(bare);
        let name = found.map_or(part.name, |found| &found.name);
        let roughness = roughness(found.map_or(0.0, |found| found.gloss));
        primitives.push(json::mesh::Primitive {
            attributes,
            extensions: None,
            extras: None,
            indices: Some(indices),
            material: Some(Index::push(&mut root.materials, look(name, colour, roughness, texture))),
            mode: Valid(json::mesh::Mode::Triangles),
            targets: (!targets.is_empty()).then(|| targets.clone()),
        });
    }
    primitives
}

/// Textures already embedded, so that materials and parts that share one do not double it.
#[derive(Default)]
pub(super) struct Looks {
    textures: Vec<(Arc<Texture>, Index<json::Texture>)>,
}

impl Looks {
    fn texture(
        &mut self,
        texture: &Arc<Texture>,
        root: &mut json::Root,
        buffer: &mut GlbBuffer,
    ) -> Index<json::Texture> {
        if let Some((_, known)) = self.textures.iter().find(|(known, _)| known == texture) {
            return *known;
        }
        let mime = match texture.format {
            TextureFormat::Png => "image/png",
            TextureFormat::Jpeg => "image/jpeg",
        };
        let source = Index::push(
            &mut root.images,
            json::Image {
                buffer_view: Some(buffer.push_bytes(&power_of_two(texture))),
                mime_type: Some(json::image::MimeType(mime.into())),
                name: Some(texture.name.clone()),
                uri: None,
                extensions: None,
                extras: None,
            },
        );
        let index = Index::push(
            &mut root.textures,
            json::Texture { name: None, sampler: None, source, extensions: None, extras: None },
        );
        self.textures.push((Arc::clone(texture), index));
        index
    }
}

fn look(name: &str, colour: [f32; 4], roughness: f32, texture: Option<Index<json::Texture>>) -> Material {
    let colour = colour.map(|value| value.clamp(0.0, 1.0));
    let alpha_mode = if colour[3] < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque };
    Material {
        alpha_cutoff: None,
        alpha_mode: Valid(alpha_mode),
        // Scans are open shells, and some are turned inside out.
        double_sided: true,
        name: Some(name.into()),
        pbr_metallic_roughness: PbrMetallicRoughness {
            base_color_factor: PbrBaseColorFactor(colour),
            base_color_texture: texture.map(|index| json::texture::Info {
                index,
                tex_coord: 0,
                extensions: None,
                extras: None,
            }),
            metallic_factor: StrengthFactor(0.0),
            roughness_factor: StrengthFactor(roughness),
            metallic_roughness_texture: None,
            extensions: None,
            extras: None,
        },
        normal_texture: None,
        occlusion_texture: None,
        emissive_texture: None,
        emissive_factor: EmissiveFactor([0.0; 3]),
        extensions: None,
        extras: None,
    }
}

fn roughness(gloss: f32) -> f32 {
    let [skin, wet] = ROUGHNESS;
    let gloss = gloss.clamp(0.0, 1.0);
    skin * (1.0 - gloss) + wet * gloss
}

/// glTF wants unit length; a vertex whose triangles have no area points along +Z, out of the face.
fn unit_normal(normal: [f32; 3]) -> [f32; 3] {
    let length = normal.iter().map(|value| f64::from(*value).powi(2)).sum::<f64>().sqrt();
    if length > 1e-20 { normal.map(|value| (f64::from(value) / length) as f32) } else { [0.0, 0.0, 1.0] }
}

/// IEC 61966-2-1, both ends 0..=1.
fn linear_from_srgb(value: f32) -> f32 {
    let value = value.clamp(0.0, 1.0);
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn seams_split_and_the_rest_keeps_its_order() {
        let mut mesh = Mesh {
            positions: (0..5).map(|x| Point3::new(f64::from(x), 0.0, 0.0)).collect(),
            triangles: vec![[0, 1, 2], [2, 1, 3], [3, 3, 1]],
            ..Mesh::default()
        };
        let plain = Surface::split(&mesh);
        assert_eq!(plain.sources, [0, 1, 2, 3], "vertex 4 belongs to no triangle");
        assert_eq!(plain.groups[&0], [0, 1, 2, 2, 1, 3], "the degenerate triangle is left out");
        mesh.uvs = vec![[0.0, 0.25]; 5];
        mesh.uv_triangles = vec![[0, 1, 2], [2, 4, 3], [0, 0, 0]];
        let seamed = Surface::split(&mesh);
        assert_eq!(seamed.sources, [0, 1, 1, 2, 3], "vertex 1 has two texture coordinates");
        assert_eq!(seamed.groups[&0], [0, 1, 3, 3, 2, 4]);
        assert_eq!(seamed.uvs, [[0.0, 0.75]; 5]);
    }

    #[test]
    fn srgb_ends_and_middle() {
        for (value, linear) in [(0.0, 0.0), (0.04, 0.003_095_98), (0.5, 0.214_041), (1.0, 1.0)] {
            assert!((linear_from_srgb(value) - linear).abs() < 1e-6);
        }
    }
}
