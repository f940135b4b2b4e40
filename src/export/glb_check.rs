//! What must hold of an avatar before it is written as a GLB.

use super::glb::{GlbAvatar, GlbPart, NodeKey};
use crate::capture::Timestamp;

const FIX_THE_CALL: &str = "Give arrays of matching lengths";
pub(super) const FIX_THE_SCAN: &str = "Read the scan again, or repair it in a mesh editor";
pub(super) const FIX_THE_MOTION: &str =
    "Leave out frames that could not be solved, or hold the last good one";

/// The first fault found, and what to do about it. Whether there are triangles shows only once they are split.
pub(super) fn check(avatar: &GlbAvatar) -> Result<(), (String, &'static str)> {
    let each = |check: &dyn Fn(&GlbPart) -> Result<(), String>| {
        avatar
            .parts
            .iter()
            .try_for_each(|part| check(part).map_err(|reason| format!("part {:?}: {reason}", part.name)))
    };
    let lengths =
        || each(&|part| check_part_lengths(part, avatar.times.len())).and_then(|()| check_lengths(avatar));
    let motion = || each(&check_part_motion).and_then(|()| check_motion(avatar));
    each(&check_mesh).map_err(|reason| (reason, FIX_THE_SCAN))?;
    lengths().map_err(|reason| (reason, FIX_THE_CALL))?;
    motion().map_err(|reason| (reason, FIX_THE_MOTION))
}

fn check_mesh(part: &GlbPart) -> Result<(), String> {
    let mesh = part.mesh;
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
    if bad(&part.pivot) {
        return Err("the pivot is not finite".into());
    }
    if let Some(vertex) = part.positions().position(|position| bad(&position)) {
        return Err(format!("vertex {vertex} is not finite"));
    }
    let numbers = mesh.uvs.as_flattened().iter().chain(mesh.colours.as_flattened());
    let factors =
        mesh.materials.iter().flat_map(|material| material.base_colour.iter().chain([&material.gloss]));
    if !numbers.chain(part.normals.as_flattened()).chain(factors).all(|value| value.is_finite()) {
        return Err("a texture coordinate, colour, gloss or normal is not finite".into());
    }
    Ok(())
}

fn check_part_lengths(part: &GlbPart, frames: usize) -> Result<(), String> {
    let vertices = part.mesh.positions.len();
    if !part.normals.is_empty() && part.normals.len() != vertices {
        return Err(format!("there are {} normals for {vertices} vertices", part.normals.len()));
    }
    if let Some(morph) = part.morphs.iter().find(|morph| ![0, vertices].contains(&morph.deltas.len())) {
        let count = morph.deltas.len();
        return Err(format!("morph {:?} has {count} displacements for {vertices} vertices", morph.name));
    }
    match part.keys.map(<[NodeKey]>::len) {
        Some(keys) if keys != frames => Err(format!("there are {keys} poses for {frames} frames")),
        _ => Ok(()),
    }
}

fn check_lengths(avatar: &GlbAvatar) -> Result<(), String> {
    if avatar.parts.is_empty() {
        return Err("there are no parts".into());
    }
    let frames = avatar.times.len();
    let mut morphing = avatar.parts.iter().filter(|part| !part.morphs.is_empty());
    let morphs = morphing.next().map_or(0, |first| first.morphs.len());
    if let Some(other) = morphing.find(|part| part.morphs.len() != morphs) {
        let count = other.morphs.len();
        return Err(format!("part {:?} has {count} morphs, and one before it has {morphs}", other.name));
    }
    if avatar.weights.len() != frames {
        return Err(format!("there are {} rows of weights for {frames} frames", avatar.weights.len()));
    }
    if let Some(frame) = avatar.weights.iter().position(|row| row.len() != morphs) {
        return Err(format!("frame {frame} has {} weights for {morphs} morphs", avatar.weights[frame].len()));
    }
    match avatar.head.map(<[NodeKey]>::len) {
        Some(keys) if keys != frames => Err(format!("there are {keys} head poses for {frames} frames")),
        _ => Ok(()),
    }
}

fn check_part_motion(part: &GlbPart) -> Result<(), String> {
    if let Some(morph) = part.morphs.iter().find(|morph| bad(morph.deltas.as_flattened())) {
        return Err(format!("morph {:?} holds a displacement that is not finite", morph.name));
    }
    match part.keys.and_then(|keys| keys.iter().position(|key| unusable(&part.placed(key)))) {
        Some(frame) => Err(format!("frame {frame} has a pose that is not finite, or no rotation")),
        None => Ok(()),
    }
}

fn check_motion(avatar: &GlbAvatar) -> Result<(), String> {
    if let Some(frame) = avatar.weights.iter().position(|row| bad(row)) {
        return Err(format!("frame {frame} has a weight that is not finite"));
    }
    match avatar.head.and_then(|keys| keys.iter().position(unusable)) {
        Some(frame) => Err(format!("frame {frame} has a head pose that is not finite, or no rotation")),
        None => Ok(()),
    }
}

fn bad(values: &[f32]) -> bool {
    values.iter().any(|value| !value.is_finite())
}

fn unusable(key: &NodeKey) -> bool {
    let length: f32 = key.rotation.iter().map(|value| value * value).sum();
    bad(&key.translation) || !length.is_finite() || length < 1e-12
}

/// glTF's seconds, which must increase and not be negative.
pub(super) fn increasing_seconds(times: &[Timestamp]) -> Result<Vec<f32>, String> {
    let seconds: Vec<f32> = times.iter().map(|time| time.seconds() as f32).collect();
    if let Some(frame) = seconds.windows(2).position(|pair| pair[0] >= pair[1]) {
        return Err(format!("frame {} is not later than the one before it", frame + 1));
    }
    match seconds.first() {
        Some(first) if *first < 0.0 => Err("the first frame lies before time 0".into()),
        _ => Ok(seconds),
    }
}
