//! A mesh on the graphics device.

use std::{ops::Range, sync::Arc};

use bytemuck::{Pod, Zeroable};
use nalgebra::Vector4;

use super::{Gpu, ViewError, facing::facing_first, texture};
use crate::scan::{Material, Mesh};

/// The colour of a surface that has neither texture nor vertex colours: a warm grey, linear.
pub(super) const CLAY: [f32; 4] = [0.44, 0.40, 0.365, 1.0];

/// What of a vertex stays the same while the face moves.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(super) struct FixedVertex {
    /// Origin at the image's upper left, as the device samples.
    uv: [f32; 2],
    /// sRGB.
    colour: [u8; 4],
}

/// What of a vertex is written for every picture.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(super) struct MovingVertex {
    pub(super) position: [f32; 3],
    normal: [f32; 3],
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct MaterialUniform {
    base: [f32; 4],
    /// What multiplies sRGB as `base` multiplies light.
    encoded: [f32; 4],
    /// Whether the vertex colours are used: 1 or 0.
    coloured: f32,
    gloss: f32,
    padding: [f32; 2],
}

/// The triangles of one material.
#[derive(Debug)]
pub(super) struct Part {
    pub indices: Range<u32>,
    pub textured: bool,
    /// Whether it shines wet.
    pub glossy: bool,
    pub material: wgpu::BindGroup,
}

/// A mesh on the graphics device. Its vertices' positions and normals come with every picture; all else stays.
#[derive(Debug)]
pub struct Model {
    /// GPU vertex to mesh vertex.
    source: Vec<u32>,
    mesh_vertices: usize,
    /// Whether the scan brought any colours of its own. Eyes and teeth that were added to it do not say so.
    pub(super) coloured: bool,
    pub(super) parts: Vec<Part>,
    pub(super) fixed: wgpu::Buffer,
    pub(super) moving: wgpu::Buffer,
    pub(super) indices: wgpu::Buffer,
    /// What `indices` holds, sorted by material only.
    triangles: Vec<[u32; 3]>,
}

impl Model {
    /// Puts a mesh on the device, except its positions.
    ///
    /// A vertex with several texture coordinates is split into as many GPU vertices. A material's texture is used
    /// where the mesh has texture coordinates, otherwise the vertex colours, otherwise warm grey. A material with gloss
    /// is lit as wet, and does not make a bare scan a coloured one. Alpha is ignored.
    /// Textures above 16,384 pixels a side are refused; those above the device's own limit are reduced.
    pub fn upload(gpu: &Gpu, mesh: &Mesh) -> Result<Self, ViewError> {
        check(mesh)?;
        let Split { source, uvs, corners } = split(mesh);
        let fixed: Vec<FixedVertex> = source
            .iter()
            .zip(&uvs)
            .map(|(&vertex, &uv)| {
                let uv = mesh.uvs.get(uv as usize).map_or([0.0; 2], |&[u, v]| [u, 1.0 - v]);
                let [r, g, b] = mesh
                    .colours
                    .get(vertex as usize)
                    .map_or([255; 3], |c| c.map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round() as u8));
                FixedVertex { uv, colour: [r, g, b, 255] }
            })
            .collect();

        let (order, ranges) = by_material(mesh);
        let triangles: Vec<[u32; 3]> = order.iter().map(|&t| corners[t as usize]).collect();
        let parts = parts(gpu, mesh, ranges)?;

        let usage = wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST;
        let moving = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("moving vertices"),
            size: (source.len() * size_of::<MovingVertex>()) as u64,
            usage,
            mapped_at_creation: false,
        });
        let model = Self {
            mesh_vertices: mesh.positions.len(),
            coloured: !mesh.colours.is_empty() || parts.iter().any(|part| part.textured && !part.glossy),
            parts,
            fixed: filled(gpu, "fixed vertices", usage, bytemuck::cast_slice(&fixed)),
            moving,
            indices: filled(
                gpu,
                "indices",
                wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST,
                bytemuck::cast_slice(&triangles),
            ),
            source,
            triangles,
        };
        gpu.check()?;
        Ok(model)
    }

    /// The number of the mesh's vertices: as many positions and normals as every picture needs.
    pub fn vertices(&self) -> usize {
        self.mesh_vertices
    }

    /// The number of triangles.
    pub fn triangles(&self) -> usize {
        self.triangles.len()
    }

    /// For every vertex on the device the mesh vertex it came from; longer than the mesh where the texture has seams.
    pub fn source(&self) -> &[u32] {
        &self.source
    }

    /// Checks positions and normals (V × 3 each) and lays them out as the device wants them, reusing `out`.
    pub(super) fn expand(
        &self,
        positions: &[[f32; 3]],
        normals: &[[f32; 3]],
        out: &mut Vec<MovingVertex>,
    ) -> Result<(), ViewError> {
        for (what, found) in [("positions", positions.len()), ("normals", normals.len())] {
            if found != self.mesh_vertices {
                return Err(ViewError::Vertices { what, wanted: self.mesh_vertices, found });
            }
        }
        out.clear();
        out.extend(self.source.iter().map(|&vertex| MovingVertex {
            position: positions[vertex as usize],
            normal: normals[vertex as usize],
        }));
        Ok(())
    }

    /// The triangles, within each material those first that turn their outside to the eye, reusing `out`.
    ///
    /// What they hide is then never shaded, which is half of a closed head. `eye` is in the model's frame,
    /// homogeneous: a point or, for parallel rays, the direction towards the viewer.
    pub(super) fn facing_first(&self, vertices: &[MovingVertex], eye: Vector4<f32>, out: &mut Vec<[u32; 3]>) {
        facing_first(&self.triangles, self.parts.iter().map(|part| &part.indices), vertices, eye, out);
    }

    /// The triangles of a range of indices.
    pub(super) fn triangles_of(&self, indices: &Range<u32>) -> &[[u32; 3]] {
        &self.triangles[indices.start as usize / 3..indices.end as usize / 3]
    }
}

/// GPU vertices as pairs of a mesh vertex and a texture coordinate, and the triangles over them.
struct Split {
    source: Vec<u32>,
    uvs: Vec<u32>,
    corners: Vec<[u32; 3]>,
}

/// Splits vertices where a seam gives them several texture coordinates, in order of first use.
fn split(mesh: &Mesh) -> Split {
    const NONE: u32 = u32::MAX;
    let (mut source, mut uvs, mut next) = (Vec::new(), Vec::new(), Vec::new());
    // Each mesh vertex heads a chain of its GPU vertices; nearly all chains have one link.
    let mut first = vec![NONE; mesh.positions.len()];
    let mut corner = |vertex: u32, uv: u32| {
        let (mut link, mut last) = (first[vertex as usize], NONE);
        while link != NONE {
            if uvs[link as usize] == uv {
                return link;
            }
            last = link;
            link = next[link as usize];
        }
        let new = source.len() as u32;
        source.push(vertex);
        uvs.push(uv);
        next.push(NONE);
        match last {
            NONE => first[vertex as usize] = new,
            last => next[last as usize] = new,
        }
        new
    };
    let corners = mesh
        .triangles
        .iter()
        .enumerate()
        .map(|(t, vertices)| {
            let uv = mesh.uv_triangles.get(t).copied().unwrap_or([NONE; 3]);
            std::array::from_fn(|k| corner(vertices[k], uv[k]))
        })
        .collect();
    Split { source, uvs, corners }
}

/// The triangles sorted by material, otherwise in their order, and for every material in use its range of indices.
fn by_material(mesh: &Mesh) -> (Vec<u32>, Vec<(usize, Range<u32>)>) {
    let material = |t: &u32| mesh.triangle_materials.get(*t as usize).copied().unwrap_or(0);
    let mut order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    order.sort_by_key(material);
    let mut start = 0;
    let ranges = order
        .chunk_by(|a, b| material(a) == material(b))
        .map(|run| {
            let end = start + 3 * run.len() as u32;
            let range = (material(&run[0]) as usize, start..end);
            start = end;
            range
        })
        .collect();
    (order, ranges)
}

/// Binds every material in use; a texture that several share is decoded once.
fn parts(gpu: &Gpu, mesh: &Mesh, ranges: Vec<(usize, Range<u32>)>) -> Result<Vec<Part>, ViewError> {
    let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("scan texture"),
        address_mode_u: wgpu::AddressMode::Repeat,
        address_mode_v: wgpu::AddressMode::Repeat,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        // Drawing on the CPU, four anisotropic samples double the time of the whole picture.
        anisotropy_clamp: if gpu.is_cpu() { 1 } else { 8 },
        ..wgpu::SamplerDescriptor::default()
    });
    let white = texture::white(gpu);
    let mut seen: Vec<(&Arc<crate::scan::Texture>, wgpu::TextureView)> = Vec::new();
    let mut parts = Vec::with_capacity(ranges.len());
    for (index, indices) in ranges {
        let material = mesh.materials.get(index);
        let texture = material.and_then(|m| m.texture.as_ref()).filter(|_| !mesh.uv_triangles.is_empty());
        let known = texture.and_then(|wanted| seen.iter().find(|(known, _)| Arc::ptr_eq(known, wanted)));
        let view = match (texture, known) {
            (None, _) => white.clone(),
            (Some(_), Some((_, view))) => view.clone(),
            (Some(wanted), None) => {
                let view = texture::upload(gpu, wanted)?;
                seen.push((wanted, view.clone()));
                view
            }
        };
        let uniform = uniform(material, texture.is_some(), !mesh.colours.is_empty());
        let buffer = filled(
            gpu,
            "material",
            wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            bytemuck::bytes_of(&uniform),
        );
        let material = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("material"),
            layout: &gpu.material_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&view) },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Sampler(&sampler) },
            ],
        });
        parts.push(Part { indices, textured: texture.is_some(), glossy: uniform.gloss > 0.0, material });
    }
    Ok(parts)
}

fn uniform(material: Option<&Material>, textured: bool, coloured: bool) -> MaterialUniform {
    // A scan with both usually says the same thing twice; the texture says it in more detail.
    let coloured = coloured && !textured;
    // A factor of one on nothing is no colour but a missing one.
    let tinted = |m: &Material| m.base_colour[..3].iter().any(|factor| (factor - 1.0).abs() > 1e-6);
    let base = match material {
        Some(m) if textured || coloured || tinted(m) => m.base_colour,
        _ if coloured => [1.0; 4],
        _ => CLAY,
    };
    let encoded = base.map(|factor| factor.max(0.0).powf(1.0 / 2.2));
    let gloss = material.map_or(0.0, |m| m.gloss.clamp(0.0, 1.0));
    MaterialUniform { base, encoded, coloured: f32::from(u8::from(coloured)), gloss, padding: [0.0; 2] }
}

/// A buffer with the given bytes in it, a multiple of four.
pub(super) fn filled(gpu: &Gpu, label: &str, usage: wgpu::BufferUsages, bytes: &[u8]) -> wgpu::Buffer {
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.len() as u64,
        usage,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

/// Refuses a mesh whose lists do not fit together, so that nothing below can index out of them.
fn check(mesh: &Mesh) -> Result<(), ViewError> {
    let wrong = |reason: String| Err(ViewError::Mesh { reason });
    let optional = |name: &str, found: usize, wanted: usize| {
        if found == 0 || found == wanted {
            Ok(())
        } else {
            wrong(format!("it has {found} {name}, where {wanted} were expected"))
        }
    };
    let triangles = mesh.triangles.len();
    if triangles == 0 {
        return wrong("it has no triangles".to_owned());
    }
    // Index ranges and GPU vertices, at most three a triangle, are counted in 32 bits.
    if triangles > (u32::MAX / 3) as usize {
        return wrong(format!("it has {triangles} triangles, too many for 32-bit indices"));
    }
    optional("texture triangles", mesh.uv_triangles.len(), triangles)?;
    optional("triangle materials", mesh.triangle_materials.len(), triangles)?;
    optional("vertex colours", mesh.colours.len(), mesh.positions.len())?;
    let highest = |list: &[[u32; 3]]| list.iter().flatten().copied().max();
    for (name, highest, length) in [
        ("vertex", highest(&mesh.triangles), mesh.positions.len()),
        ("texture coordinate", highest(&mesh.uv_triangles), mesh.uvs.len()),
        ("material", mesh.triangle_materials.iter().copied().max(), mesh.materials.len()),
    ] {
        if let Some(highest) = highest.filter(|&highest| highest as usize >= length) {
            return wrong(format!("a triangle uses {name} {highest} of {length}"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    fn quad() -> Mesh {
        Mesh {
            positions: vec![Point3::origin(); 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            uvs: vec![[0.0, 0.0]; 5],
            uv_triangles: vec![[0, 1, 2], [4, 2, 3]],
            ..Mesh::default()
        }
    }

    #[test]
    fn only_seams_split_vertices() {
        let Split { source, corners, .. } = split(&quad());
        assert_eq!(source, [0, 1, 2, 0, 3]);
        assert_eq!(corners, [[0, 1, 2], [3, 2, 4]]);
        let plain = Mesh { uv_triangles: vec![], ..quad() };
        assert_eq!(split(&plain).source, [0, 1, 2, 3]);
    }

    #[test]
    fn triangles_are_grouped_by_material_in_order() {
        let mesh = Mesh { triangles: vec![[0, 1, 2]; 5], triangle_materials: vec![2, 0, 2, 0, 5], ..quad() };
        let (order, ranges) = by_material(&mesh);
        assert_eq!(order, [1, 3, 0, 2, 4]);
        assert_eq!(ranges, [(0, 0..6), (2, 6..12), (5, 12..15)]);
    }

    #[test]
    fn lists_that_do_not_fit_are_named() {
        let message = |mesh: Mesh| check(&mesh).unwrap_err().to_string();
        assert!(check(&quad()).is_ok());
        assert!(message(Mesh::default()).contains("no triangles"));
        assert!(message(Mesh { triangles: vec![[0, 1, 4]; 2], ..quad() }).contains("vertex 4 of 4"));
        assert!(message(Mesh { uvs: vec![], ..quad() }).contains("texture coordinate 4 of 0"));
        assert!(message(Mesh { triangle_materials: vec![0, 1], ..quad() }).contains("material 1 of 0"));
        assert!(message(Mesh { colours: vec![[0.0; 3]; 3], ..quad() }).contains("3 vertex colours"));
    }
}
