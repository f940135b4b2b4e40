//! Animated glTF 2.0 in one binary file: the scan, its morph targets and the performance.
//!
//! Nodes: root, named as the scan → `head`, moved by the head pose → the mesh, whose `weights` are animated. Units are
//! glTF's, metres and seconds; the axes are the caller's, glTF expects +Y up and a face towards +Z.

use std::path::Path;

use gltf_json as json;
use gltf_json::Index;
use gltf_json::extras::RawValue;

use super::glb_buffer::GlbBuffer;
use super::glb_motion::push_motion;
use super::glb_surface::{Surface, push_surface};
use super::{Draft, ExportError};
use crate::capture::Timestamp;
use crate::scan::Mesh;

const FIX_THE_CALL: &str = "Give arrays of matching lengths";
const FIX_THE_SCAN: &str = "Read the scan again, or repair it in a mesh editor";
const FIX_THE_MOTION: &str = "Leave out frames that could not be solved, or hold the last good one";

/// One way in which the face moves.
#[derive(Debug, Clone, PartialEq)]
pub struct MorphTarget {
    /// Shown by Blender and engines.
    pub name: String,
    /// V × 3 displacements at weight 1, metres, the mesh's axes.
    pub deltas: Vec<[f32; 3]>,
}

/// Where the head is in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadKey {
    /// Metres.
    pub translation: [f32; 3],
    /// Quaternion x, y, z, w; any length but zero.
    pub rotation: [f32; 4],
}

/// Everything that goes into a GLB.
#[derive(Debug, Clone, Copy)]
pub struct GlbAvatar<'a> {
    /// The scan's name.
    pub name: &'a str,
    /// The neutral face, positions in metres.
    pub mesh: &'a Mesh,
    /// V × 3 smooth normals of the neutral face, any length; empty: viewers shade flat.
    pub normals: &'a [[f32; 3]],
    /// K morph targets.
    pub morphs: &'a [MorphTarget],
    /// T × K weights.
    pub weights: &'a [Vec<f32>],
    /// T strictly increasing times, none negative; empty: no animation.
    pub times: &'a [Timestamp],
    /// T head poses; None: the head stays.
    pub head: Option<&'a [HeadKey]>,
}

/// Writes `avatar` to `path`.
///
/// Vertices on texture seams are split, textures are embedded as their files' bytes or, with other sides than powers of two, resized, vertex colours become linear
/// `COLOR_0` where there is no texture, and morph names stand in `mesh.extras.targetNames`. Left out: vertices of no
/// triangle, triangles that use a vertex twice, materials of no triangle, texture coordinates without a texture.
/// Refuses arrays of the wrong length, indices out of range, numbers that are not finite, times that do not increase
/// in glTF's 32-bit seconds, and files beyond GLB's 4 GiB.
pub fn write_glb(path: &Path, avatar: &GlbAvatar) -> Result<(), ExportError> {
    check_scan(avatar)
        .map_err(|reason| ExportError::refused(path, reason, FIX_THE_SCAN))
        .and_then(|()| {
            check_lengths(avatar).map_err(|reason| ExportError::refused(path, reason, FIX_THE_CALL))
        })
        .and_then(|()| {
            check_motion(avatar).map_err(|reason| ExportError::refused(path, reason, FIX_THE_MOTION))
        })?;
    let seconds = increasing_seconds(avatar.times)
        .map_err(|reason| ExportError::refused(path, reason, FIX_THE_MOTION))?;
    let mut draft = Draft::create(path)?;
    let surface = Surface::split(avatar.mesh);
    if surface.is_empty() {
        return Err(ExportError::refused(path, "the scan has no triangles", FIX_THE_SCAN));
    }
    let (root, bytes) = assemble(avatar, &surface, &seconds);
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

fn assemble(avatar: &GlbAvatar, surface: &Surface, seconds: &[f32]) -> (json::Root, Vec<u8>) {
    let mut buffer = GlbBuffer::default();
    let mut root = json::Root::default();
    root.asset.generator = Some(concat!("understudy ", env!("CARGO_PKG_VERSION")).into());
    let primitives = push_surface(avatar, surface, &mut root, &mut buffer);
    let names: Vec<&str> = avatar.morphs.iter().map(|morph| morph.name.as_str()).collect();
    let mesh = Index::push(
        &mut root.meshes,
        json::Mesh {
            extensions: None,
            // Not part of glTF, but Blender, three.js and Babylon all read the names here.
            extras: (!names.is_empty())
                .then(|| RawValue::from_string(serde_json::json!({ "targetNames": names }).to_string()).ok())
                .flatten(),
            name: Some(avatar.name.into()),
            primitives,
            weights: (!names.is_empty()).then(|| vec![0.0; names.len()]),
        },
    );
    let node = |name: &str| json::Node { name: Some(name.into()), ..json::Node::default() };
    let face = Index::push(&mut root.nodes, json::Node { mesh: Some(mesh), ..node("face") });
    let head = Index::push(&mut root.nodes, json::Node { children: Some(vec![face]), ..node("head") });
    let top = Index::push(&mut root.nodes, json::Node { children: Some(vec![head]), ..node(avatar.name) });
    let scene = json::Scene { extensions: None, extras: None, name: None, nodes: vec![top] };
    root.scene = Some(Index::push(&mut root.scenes, scene));
    root.animations = push_motion(avatar, seconds, head, face, &mut buffer).into_iter().collect();
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

fn check_lengths(avatar: &GlbAvatar) -> Result<(), String> {
    let (vertices, frames, morphs) = (avatar.mesh.positions.len(), avatar.times.len(), avatar.morphs.len());
    if !avatar.normals.is_empty() && avatar.normals.len() != vertices {
        return Err(format!("there are {} normals for {vertices} vertices", avatar.normals.len()));
    }
    if let Some(morph) = avatar.morphs.iter().find(|morph| morph.deltas.len() != vertices) {
        let count = morph.deltas.len();
        return Err(format!("morph {:?} has {count} displacements for {vertices} vertices", morph.name));
    }
    if avatar.weights.len() != frames {
        return Err(format!("there are {} rows of weights for {frames} frames", avatar.weights.len()));
    }
    if let Some(frame) = avatar.weights.iter().position(|row| row.len() != morphs) {
        return Err(format!("frame {frame} has {} weights for {morphs} morphs", avatar.weights[frame].len()));
    }
    match avatar.head.map(<[HeadKey]>::len) {
        Some(keys) if keys != frames => Err(format!("there are {keys} head poses for {frames} frames")),
        _ => Ok(()),
    }
}

fn check_scan(avatar: &GlbAvatar) -> Result<(), String> {
    let mesh = avatar.mesh;
    let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
    let within = |index: u32, count: usize| (index as usize) < count;
    if mesh.triangles.as_flattened().iter().any(|&vertex| !within(vertex, vertices)) {
        return Err(format!("a triangle names a vertex beyond the {vertices}"));
    }
    if !mesh.uv_triangles.is_empty()
        && (mesh.uv_triangles.len() != triangles
            || mesh.uv_triangles.as_flattened().iter().any(|&uv| !within(uv, mesh.uvs.len())))
    {
        return Err("the texture coordinates do not belong to the triangles".into());
    }
    if !mesh.colours.is_empty() && mesh.colours.len() != vertices {
        return Err(format!("there are {} colours for {vertices} vertices", mesh.colours.len()));
    }
    let materials = mesh.materials.len().max(1);
    if !mesh.triangle_materials.is_empty()
        && (mesh.triangle_materials.len() != triangles
            || mesh.triangle_materials.iter().any(|&material| !within(material, materials)))
    {
        return Err("the materials do not belong to the triangles".into());
    }
    let finite_position =
        |point: &nalgebra::Point3<f64>| point.iter().all(|value| (*value as f32).is_finite());
    if let Some(vertex) = mesh.positions.iter().position(|point| !finite_position(point)) {
        return Err(format!("vertex {vertex} is not finite"));
    }
    let numbers = mesh.uvs.as_flattened().iter().chain(mesh.colours.as_flattened());
    let factors = mesh.materials.iter().flat_map(|material| &material.base_colour);
    if !numbers.chain(avatar.normals.as_flattened()).chain(factors).all(|value| value.is_finite()) {
        return Err("a texture coordinate, colour or normal is not finite".into());
    }
    Ok(())
}

fn check_motion(avatar: &GlbAvatar) -> Result<(), String> {
    let bad = |values: &[f32]| values.iter().any(|value| !value.is_finite());
    if let Some(morph) = avatar.morphs.iter().find(|morph| bad(morph.deltas.as_flattened())) {
        return Err(format!("morph {:?} holds a displacement that is not finite", morph.name));
    }
    if let Some(frame) = avatar.weights.iter().position(|row| bad(row)) {
        return Err(format!("frame {frame} has a weight that is not finite"));
    }
    let unusable = |key: &HeadKey| {
        let length: f32 = key.rotation.iter().map(|value| value * value).sum();
        bad(&key.translation) || !length.is_finite() || length < 1e-12
    };
    match avatar.head.and_then(|keys| keys.iter().position(unusable)) {
        Some(frame) => Err(format!("frame {frame} has a head pose that is not finite, or no rotation")),
        None => Ok(()),
    }
}

fn increasing_seconds(times: &[Timestamp]) -> Result<Vec<f32>, String> {
    let seconds: Vec<f32> = times.iter().map(|time| time.seconds() as f32).collect();
    if let Some(frame) = seconds.windows(2).position(|pair| pair[0] >= pair[1]) {
        return Err(format!("frame {} is not later than the one before it", frame + 1));
    }
    match seconds.first() {
        Some(first) if *first < 0.0 => Err("the first frame lies before time 0".into()),
        _ => Ok(seconds),
    }
}
