//! Animated glTF 2.0 in one binary file: an avatar's parts, their morph targets and the performance.
//!
//! Nodes: root, named as the scan → `head`, moved by the head pose → the parts: the skin, whose `weights` are animated,
//! and what was added to it. Units are glTF's, metres and seconds; the axes are the caller's, glTF expects +Y up and a
//! face towards +Z.

use std::path::Path;

use gltf_json as json;
use gltf_json::Index;
use gltf_json::extras::RawValue;
use nalgebra::Vector3;

use super::glb_buffer::GlbBuffer;
use super::glb_check::{FIX_THE_MOTION, FIX_THE_SCAN, check, increasing_seconds};
use super::glb_motion::push_motion;
use super::glb_surface::{Looks, Surface, push_surface};
use super::{Draft, ExportError};
use crate::capture::Timestamp;
use crate::scan::Mesh;

/// One way in which a part changes its shape.
#[derive(Debug, Clone, PartialEq)]
pub struct MorphTarget {
    /// Shown by Blender and engines.
    pub name: String,
    /// V × 3 displacements at weight 1, metres, the mesh's axes; empty: nothing moves, and only the weight is of use.
    pub deltas: Vec<[f32; 3]>,
}

/// How a node has moved from its rest in one frame; no motion is zero and the identity quaternion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodeKey {
    /// Metres, the parent's axes.
    pub translation: [f32; 3],
    /// Quaternion x, y, z, w; any length but zero.
    pub rotation: [f32; 4],
}

/// Everything that goes into a GLB.
#[derive(Debug, Clone, Copy)]
pub struct GlbAvatar<'a> {
    /// The scan's name.
    pub name: &'a str,
    /// At least one, the skin first; each a node below the head.
    pub parts: &'a [GlbPart<'a>],
    /// T × K weights, shared by all parts that have morphs.
    pub weights: &'a [Vec<f32>],
    /// T strictly increasing times, none negative; empty: no animation.
    pub times: &'a [Timestamp],
    /// T head poses, the root's axes, about the origin; None: the head stays.
    pub head: Option<&'a [NodeKey]>,
}

/// One mesh below the head.
#[derive(Debug, Clone, Copy)]
pub struct GlbPart<'a> {
    /// The node's name, and the mesh's but for the first part, whose mesh is named as the avatar.
    pub name: &'a str,
    /// At rest, positions in metres in the head's frame, wherever the pivot lies.
    pub mesh: &'a Mesh,
    /// V × 3 smooth normals at rest, any length; empty: viewers shade flat.
    pub normals: &'a [[f32; 3]],
    /// K morph targets, as many as every other part that has any; none for a rigid part.
    pub morphs: &'a [MorphTarget],
    /// The node's origin, about which it turns: metres in the head's frame.
    pub pivot: [f32; 3],
    /// T turns about the pivot and translations of the pivot from its rest; None: the part stays.
    pub keys: Option<&'a [NodeKey]>,
}

impl GlbPart<'_> {
    /// V × 3 metres from the pivot.
    pub(super) fn positions(&self) -> impl Iterator<Item = [f32; 3]> {
        let pivot = Vector3::from(self.pivot.map(f64::from));
        self.mesh.positions.iter().map(move |point| (point.coords - pivot).map(|value| value as f32).into())
    }

    /// Where the node is when it has moved by `key`: its place below the head instead of its way from the rest.
    pub(super) fn placed(&self, key: &NodeKey) -> NodeKey {
        let [x, y, z] = self.pivot;
        let [dx, dy, dz] = key.translation;
        NodeKey { translation: [x + dx, y + dy, z + dz], rotation: key.rotation }
    }
}

/// Writes `avatar` to `path`.
///
/// Vertices are stored relative to their part's pivot and split on texture seams. Textures are embedded once each, as
/// their files' bytes or, with other sides than powers of two, resized; vertex colours become linear `COLOR_0` where
/// there is no texture, a material's gloss its smoothness, and morph names stand in `mesh.extras.targetNames`. Left
/// out: vertices of no triangle, triangles that use a vertex twice, materials of no triangle, texture coordinates
/// without a texture.
/// Refuses parts without triangles, arrays of the wrong length, indices out of range, numbers that are not finite,
/// times that do not increase in glTF's 32-bit seconds, and files beyond GLB's 4 GiB.
pub fn write_glb(path: &Path, avatar: &GlbAvatar) -> Result<(), ExportError> {
    check(avatar).map_err(|(reason, remedy)| ExportError::refused(path, reason, remedy))?;
    let seconds = increasing_seconds(avatar.times)
        .map_err(|reason| ExportError::refused(path, reason, FIX_THE_MOTION))?;
    let mut draft = Draft::create(path)?;
    let surfaces: Vec<Surface> = avatar.parts.iter().map(|part| Surface::split(part.mesh)).collect();
    if let Some(empty) = surfaces.iter().position(Surface::is_empty) {
        let reason = format!("part {:?} has no triangles", avatar.parts[empty].name);
        return Err(ExportError::refused(path, reason, FIX_THE_SCAN));
    }
    let (root, bytes) = assemble(avatar, &surfaces, &seconds);
    let mut text = json::serialize::to_vec(&root)
        .map_err(|error| ExportError::refused(path, error.to_string(), FIX_THE_SCAN))?;
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() + 8 + bytes.len();
    let Ok(total) = u32::try_from(total) else {
        return Err(ExportError::refused(
            path,
            format!("it would have {total} bytes, and GLB ends at 4 GiB"),
            "Use fewer morph targets or a shorter clip",
        ));
    };
    draft.append(b"glTF")?;
    draft.append(&2_u32.to_le_bytes())?;
    draft.append(&total.to_le_bytes())?;
    for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &bytes)] {
        draft.append(&(chunk.len() as u32).to_le_bytes())?;
        draft.append(kind)?;
        draft.append(chunk)?;
    }
    draft.commit()
}

fn assemble(avatar: &GlbAvatar, surfaces: &[Surface], seconds: &[f32]) -> (json::Root, Vec<u8>) {
    let mut buffer = GlbBuffer::default();
    let mut root = json::Root::default();
    root.asset.generator = Some(concat!("understudy ", env!("CARGO_PKG_VERSION")).into());
    let mut looks = Looks::default();
    let mut parts = Vec::with_capacity(avatar.parts.len());
    for (i, (part, surface)) in avatar.parts.iter().zip(surfaces).enumerate() {
        let name = if i == 0 { avatar.name } else { part.name };
        parts.push(push_part(name, part, surface, &mut looks, &mut root, &mut buffer));
    }
    let node = |name: &str| json::Node { name: Some(name.into()), ..json::Node::default() };
    let head = json::Node { children: Some(parts.clone()), ..node("head") };
    let head = Index::push(&mut root.nodes, head);
    let top = Index::push(&mut root.nodes, json::Node { children: Some(vec![head]), ..node(avatar.name) });
    let scene = json::Scene { extensions: None, extras: None, name: None, nodes: vec![top] };
    root.scene = Some(Index::push(&mut root.scenes, scene));
    root.animations = push_motion(avatar, seconds, head, &parts, &mut buffer).into_iter().collect();
    root.buffers = vec![json::Buffer {
        byte_length: buffer.bytes.len().into(),
        name: None,
        uri: None,
        extensions: None,
        extras: None,
    }];
    root.buffer_views = buffer.views;
    root.accessors = buffer.accessors;
    (root, buffer.bytes)
}

/// Adds a part's mesh, named `name`, and the node that shows it.
fn push_part(
    name: &str,
    part: &GlbPart,
    surface: &Surface,
    looks: &mut Looks,
    root: &mut json::Root,
    buffer: &mut GlbBuffer,
) -> Index<json::Node> {
    let primitives = push_surface(part, surface, looks, root, buffer);
    let names: Vec<&str> = part.morphs.iter().map(|morph| morph.name.as_str()).collect();
    let mesh = Index::push(
        &mut root.meshes,
        json::Mesh {
            extensions: None,
            // Not part of glTF, but Blender, three.js and Babylon all read the names here.
            extras: (!names.is_empty())
                .then(|| RawValue::from_string(serde_json::json!({ "targetNames": names }).to_string()).ok())
                .flatten(),
            name: Some(name.into()),
            primitives,
            weights: (!names.is_empty()).then(|| vec![0.0; names.len()]),
        },
    );
    let node = json::Node {
        mesh: Some(mesh),
        name: Some(part.name.into()),
        translation: part.pivot.iter().any(|value| *value != 0.0).then_some(part.pivot),
        ..json::Node::default()
    };
    Index::push(&mut root.nodes, node)
}
