//! glTF 2.0, as `.glb` or `.gltf`, through the `gltf` crate.
//!
//! Every triangle primitive of the default scene becomes part of one mesh, node transforms applied, in metres and
//! glTF's frame (+Y up, asset facing +Z). Primitives of one node that share their vertices keep sharing them.
//! Skins are passed over with a warning, and so are morph targets unless they are asked for: what is read is the mesh as
//! stored. Image files are kept
//! as they are; the crate's own importer would decode them.

use std::path::Path;

use gltf::json;
use gltf::mesh::{Mode, Semantic};
use nalgebra::{Matrix4, Point3, Vector3};

use super::error::Fault;
use super::glb_buffers::Buffers;
use super::mesh::{Material, Mesh};
use super::validate::{MAX_TRIANGLES, MAX_VERTICES, check_count};

/// One morph target: how far each vertex of the mesh goes at weight 1, metres.
#[derive(Debug, Clone, PartialEq)]
pub struct Morph {
    /// As in `extras.targetNames`, or its number where the file has none.
    pub name: String,
    /// One for each vertex of the mesh; zero outside the target's own primitives.
    pub deltas: Vec<Vector3<f64>>,
}

/// Reads a `.glb` or `.gltf`; `path` leads to buffers and images beside it.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<Mesh, Fault> {
    read_scene(bytes, path, false).map(|(mesh, _)| mesh)
}

/// The same with its morph targets.
pub(super) fn read_with_morphs(bytes: &[u8], path: &Path) -> Result<(Mesh, Vec<Morph>), Fault> {
    read_scene(bytes, path, true)
}

fn read_scene(bytes: &[u8], path: &Path, wants_morphs: bool) -> Result<(Mesh, Vec<Morph>), Fault> {
    if bytes.starts_with(b"glTF") {
        check_glb_length(bytes)?;
    }
    let gltf = gltf::Gltf::from_slice_without_validation(bytes).map_err(|error| parse_fault(&error))?;
    let root = gltf.document.into_json();
    check_attributes(&root)?;
    let document = gltf::Document::from_json(root).map_err(|error| parse_fault(&error))?;
    let mut reader = SceneReader {
        buffers: Buffers::load(&document, gltf.blob, path)?,
        document: &document,
        mesh: Mesh::default(),
        material_places: vec![None; document.materials().len() + 1],
        has_uvs: false,
        passed_over: [0; 3],
        morphs: wants_morphs.then(Vec::new),
    };
    reader.walk()?;
    let mut morphs = reader.morphs.take().unwrap_or_default();
    let mesh = reader.finish(path);
    for morph in &mut morphs {
        morph.deltas.resize(mesh.positions.len(), Vector3::zeros());
    }
    Ok((mesh, morphs))
}

/// The crate subtracts the header from the announced length unasked.
fn check_glb_length(bytes: &[u8]) -> Result<(), Fault> {
    let announced = bytes.get(8..12).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    match announced {
        Some(length) if length >= 12 && length as usize <= bytes.len() => Ok(()),
        Some(length) => Err(Fault::corrupt(format!("it announces {length} bytes and has {}", bytes.len()))),
        None => Err(Fault::corrupt(format!("{} bytes are too few for a GLB header", bytes.len()))),
    }
}

/// The crate's validation follows a primitive's POSITION before it has checked that it leads anywhere.
fn check_attributes(root: &json::Root) -> Result<(), Fault> {
    let count = root.accessors.len();
    let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    match primitives.flat_map(|p| p.attributes.values()).find(|index| index.value() >= count) {
        Some(index) => Err(Fault::corrupt(format!(
            "a primitive refers to accessor {}, but there are only {count}",
            index.value()
        ))),
        None => Ok(()),
    }
}

fn parse_fault(error: &gltf::Error) -> Fault {
    if let gltf::Error::Validation(errors) = error {
        let listed: Vec<String> =
            errors.iter().take(3).map(|(p, e)| format!("{}: {e}", p.as_str())).collect();
        let unsupported = errors.iter().any(|(_, e)| *e == json::validation::Error::Unsupported);
        let remedy = if unsupported {
            "Export it again without compression or other required extensions"
        } else {
            Fault::EXPORT_AGAIN
        };
        return Fault::new(listed.join("; "), remedy);
    }
    Fault::corrupt(error.to_string())
}

struct SceneReader<'a> {
    document: &'a gltf::Document,
    buffers: Buffers,
    mesh: Mesh,
    /// For each of the file's materials, and last for glTF's default, its place in `mesh.materials` once used.
    material_places: Vec<Option<u32>>,
    has_uvs: bool,
    /// Primitives without triangles, skins, primitives with morph targets.
    passed_over: [usize; 3],
    /// Morph targets, where they are wanted.
    morphs: Option<Vec<Morph>>,
}

/// Vertices already taken for the node at hand: the accessors they came from and where they begin.
type Shared = ([Option<usize>; 3], u32, usize);

impl SceneReader<'_> {
    /// Visits the default scene's nodes, parents first, each once.
    fn walk(&mut self) -> Result<(), Fault> {
        let Some(scene) = self.document.default_scene().or_else(|| self.document.scenes().next()) else {
            return Err(Fault::corrupt("it has no scene"));
        };
        let mut seen = vec![false; self.document.nodes().len()];
        let mut open: Vec<_> = scene.nodes().map(|node| (node, Matrix4::identity())).collect();
        open.reverse();
        while let Some((node, parent)) = open.pop() {
            if std::mem::replace(&mut seen[node.index()], true) {
                return Err(Fault::corrupt(format!("node {} is reached twice", node.index())));
            }
            let local = Matrix4::from(node.transform().matrix()).map(f64::from);
            let world = parent * local;
            self.passed_over[1] += usize::from(node.skin().is_some());
            if let Some(mesh) = node.mesh() {
                let mut shared: Vec<Shared> = Vec::new();
                let names = target_names(&mesh);
                for primitive in mesh.primitives() {
                    let before = self.mesh.positions.len();
                    self.primitive(&primitive, &world, &mut shared)?;
                    if self.mesh.positions.len() > before {
                        self.morph_targets(&primitive, &names, &world, before)?;
                    }
                }
            }
            let from = open.len();
            open.extend(node.children().map(|child| (child, world)));
            open[from..].reverse();
        }
        Ok(())
    }

    fn primitive(
        &mut self,
        primitive: &gltf::Primitive,
        world: &Matrix4<f64>,
        shared: &mut Vec<Shared>,
    ) -> Result<(), Fault> {
        if !matches!(primitive.mode(), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            self.passed_over[0] += 1;
            return Ok(());
        }
        let has_morphs = primitive.morph_targets().next().is_some();
        self.passed_over[2] += usize::from(has_morphs && self.morphs.is_none());
        let material = primitive.material();
        let uv_set =
            material.pbr_metallic_roughness().base_color_texture().map_or(0, |info| info.tex_coord());
        let accessors = [Semantic::Positions, Semantic::TexCoords(uv_set), Semantic::Colors(0)]
            .map(|semantic| primitive.get(&semantic));
        let key = accessors.clone().map(|a| a.map(|a| a.index()));
        let known = shared.iter().find(|(k, ..)| *k == key).map(|(_, first, count)| (*first, *count));
        let (first, count) = if let Some(known) = known {
            known
        } else {
            let [positions, uvs, colours] = accessors;
            let positions = positions.ok_or_else(|| Fault::corrupt("a primitive has no POSITION"))?;
            let taken = self.vertices(&positions, uvs.as_ref(), colours.as_ref(), world)?;
            shared.push((key, taken.0, taken.1));
            taken
        };
        let corners = match primitive.indices() {
            Some(accessor) => self.buffers.indices(&accessor)?,
            None => (0..count as u32).collect(),
        };
        if let Some(wrong) = corners.iter().find(|i| **i as usize >= count) {
            return Err(Fault::corrupt(format!(
                "primitive {} refers to vertex {wrong}, but there are only {count}",
                primitive.index()
            )));
        }
        let mirrored = world.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        let place = self.material(&material);
        let before = self.mesh.triangles.len();
        check_count("triangles", before + triangle_count(primitive.mode(), corners.len()), MAX_TRIANGLES)?;
        push_triangles(primitive.mode(), &corners, |[a, b, c]| {
            let [b, c] = if mirrored { [c, b] } else { [b, c] };
            self.mesh.triangles.push([first + a, first + b, first + c]);
        });
        self.mesh.triangle_materials.resize(self.mesh.triangles.len(), place);
        Ok(())
    }

    /// Appends the morph targets of a primitive whose vertices begin at `first`; those of one name are one.
    fn morph_targets(
        &mut self,
        primitive: &gltf::Primitive,
        names: &[String],
        world: &Matrix4<f64>,
        first: usize,
    ) -> Result<(), Fault> {
        let Some(morphs) = &mut self.morphs else { return Ok(()) };
        let count = self.mesh.positions.len() - first;
        for (k, target) in primitive.morph_targets().enumerate() {
            let Some(positions) = target.positions() else { continue };
            if positions.count() != count {
                let found = positions.count();
                return Err(Fault::corrupt(format!(
                    "morph target {k} has {found} entries against {count} positions"
                )));
            }
            let name = names.get(k).cloned().unwrap_or_else(|| format!("target{k}"));
            let at = morphs.iter().position(|morph| morph.name == name).unwrap_or_else(|| {
                morphs.push(Morph { name, deltas: Vec::new() });
                morphs.len() - 1
            });
            let deltas = &mut morphs[at].deltas;
            deltas.resize(first, Vector3::zeros());
            let moved = self.buffers.floats::<3>(&positions)?;
            deltas.extend(moved.iter().map(|d| world.transform_vector(&Vector3::from(d.map(f64::from)))));
            check_count("morph targets' vertices", morphs.len() * (first + count), MAX_VERTICES * 4)?;
        }
        Ok(())
    }

    /// Appends a primitive's vertices and returns where they begin and how many they are.
    fn vertices(
        &mut self,
        positions: &gltf::Accessor,
        uvs: Option<&gltf::Accessor>,
        colours: Option<&gltf::Accessor>,
        world: &Matrix4<f64>,
    ) -> Result<(u32, usize), Fault> {
        let first = self.mesh.positions.len();
        let end = first.saturating_add(positions.count());
        check_count("vertices", end, MAX_VERTICES)?;
        let placed = self.buffers.floats::<3>(positions)?;
        self.mesh.positions.extend(placed.iter().map(|p| {
            let p = p.map(f64::from);
            world.transform_point(&Point3::from(p))
        }));
        self.mesh.uvs.resize(first, [0.0; 2]);
        if let Some(accessor) = uvs {
            self.has_uvs = true;
            same_count("TEXCOORD", accessor, positions)?;
            self.mesh.uvs.extend(self.buffers.floats::<2>(accessor)?.iter().map(|[u, v]| [*u, 1.0 - v]));
        }
        self.mesh.uvs.resize(end, [0.0; 2]);
        if let Some(accessor) = colours {
            same_count("COLOR", accessor, positions)?;
            self.mesh.colours.resize(first, [1.0; 3]);
            let values = self.buffers.colours(accessor)?;
            self.mesh.colours.extend(values.iter().map(|c| c.map(srgb_from_linear)));
        } else if !self.mesh.colours.is_empty() {
            self.mesh.colours.resize(end, [1.0; 3]);
        }
        Ok((first as u32, placed.len()))
    }

    fn material(&mut self, material: &gltf::Material) -> u32 {
        let slot = material.index().unwrap_or(self.material_places.len() - 1);
        if let Some(place) = self.material_places[slot] {
            return place;
        }
        let pbr = material.pbr_metallic_roughness();
        let texture = pbr
            .base_color_texture()
            .and_then(|info| self.document.as_json().textures.get(info.texture().index()))
            .and_then(|texture| self.buffers.image(self.document, texture.source.value()));
        let place = self.mesh.materials.len() as u32;
        self.material_places[slot] = Some(place);
        self.mesh.materials.push(Material {
            name: material.name().unwrap_or("default").to_owned(),
            base_colour: pbr.base_color_factor(),
            texture,
            gloss: 0.0,
        });
        place
    }

    fn finish(self, path: &Path) -> Mesh {
        let path = path.display();
        for (count, what) in self.passed_over.into_iter().zip([
            "primitives of points or lines",
            "skins; the mesh is read as stored, unposed",
            "primitives' morph targets",
        ]) {
            if count > 0 {
                tracing::warn!(%path, count, "passed over {what}");
            }
        }
        let mut mesh = self.mesh;
        if self.has_uvs {
            mesh.uv_triangles.clone_from(&mesh.triangles);
        } else {
            mesh.uvs.clear();
        }
        if mesh.materials.len() <= 1 {
            mesh.triangle_materials.clear();
        }
        mesh
    }
}

/// The names of a mesh's morph targets, where it has them.
fn target_names(mesh: &gltf::Mesh) -> Vec<String> {
    #[derive(serde::Deserialize)]
    struct Extras {
        #[serde(rename = "targetNames", default)]
        names: Vec<String>,
    }
    let extras = mesh.extras().as_ref().and_then(|raw| serde_json::from_str::<Extras>(raw.get()).ok());
    extras.map_or_else(Vec::new, |extras| extras.names)
}

fn same_count(what: &str, accessor: &gltf::Accessor, positions: &gltf::Accessor) -> Result<(), Fault> {
    let (found, wanted) = (accessor.count(), positions.count());
    if found == wanted {
        return Ok(());
    }
    Err(Fault::corrupt(format!("{found} {what} entries stand against {wanted} positions")))
}

fn triangle_count(mode: Mode, corners: usize) -> usize {
    if mode == Mode::Triangles { corners / 3 } else { corners.saturating_sub(2) }
}

/// Turns a list, strip or fan into triangles of the same facing.
fn push_triangles(mode: Mode, corners: &[u32], mut push: impl FnMut([u32; 3])) {
    match mode {
        Mode::TriangleStrip => {
            for (k, w) in corners.windows(3).enumerate() {
                push(if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] });
            }
        }
        Mode::TriangleFan => {
            for w in corners.get(1..).unwrap_or_default().windows(2) {
                push([corners[0], w[0], w[1]]);
            }
        }
        _ => {
            for w in corners.chunks_exact(3) {
                push([w[0], w[1], w[2]]);
            }
        }
    }
}

/// glTF's vertex colours are linear, a [`Mesh`]'s are sRGB.
fn srgb_from_linear(c: f32) -> f32 {
    let c = c.clamp(0.0, 1.0);
    if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values pass through unchanged")]
mod tests {
    use super::*;

    #[test]
    fn lists_strips_and_fans_face_the_same_way() {
        let collect = |mode, corners: &[u32]| {
            let mut out = Vec::new();
            push_triangles(mode, corners, |t| out.push(t));
            out
        };
        assert_eq!(collect(Mode::Triangles, &[0, 1, 2, 3, 4]), [[0, 1, 2]]);
        assert_eq!(collect(Mode::TriangleStrip, &[0, 1, 2, 3]), [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(collect(Mode::TriangleFan, &[0, 1, 2, 3]), [[0, 1, 2], [0, 2, 3]]);
        assert!(collect(Mode::TriangleFan, &[]).is_empty());
    }

    #[test]
    fn announced_length_is_checked() {
        for length in [0_u32, 11, 4000] {
            let mut bytes = b"glTF\x02\0\0\0".to_vec();
            bytes.extend(length.to_le_bytes());
            assert!(read(&bytes, Path::new("x.glb")).unwrap_err().reason.contains("announces"));
        }
    }

    #[test]
    fn srgb_ends_meet() {
        assert_eq!(srgb_from_linear(0.0), 0.0);
        assert!((srgb_from_linear(1.0) - 1.0).abs() < 1e-6);
        assert!((srgb_from_linear(0.5) - 0.735_36).abs() < 1e-4);
    }
}
