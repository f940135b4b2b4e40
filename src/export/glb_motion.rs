//! The one animation of a GLB: morph weights and the head's motion over shared times.

use gltf_json as json;
use gltf_json::accessor::Type;
use gltf_json::animation::{Channel, Interpolation, Property, Sampler, Target};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Index, Node};

use super::glb::GlbAvatar;
use super::glb_buffer::GlbBuffer;

/// None when nothing moves: no frames, or neither morphs nor head.
pub(super) fn push_motion(
    avatar: &GlbAvatar,
    seconds: &[f32],
    head: Index<Node>,
    face: Index<Node>,
    buffer: &mut GlbBuffer,
) -> Option<json::Animation> {
    if seconds.is_empty() || (avatar.morphs.is_empty() && avatar.head.is_none()) {
        return None;
    }
    let times = buffer.push_keys(seconds, Type::Scalar, true);
    let (mut channels, mut samplers) = (Vec::new(), Vec::new());
    let mut push = |node, path, output| {
        let sampler = Index::push(
            &mut samplers,
            Sampler {
                extensions: None,
                extras: None,
                input: times,
                interpolation: Valid(Interpolation::Linear),
                output,
            },
        );
        let target = Target { extensions: None, extras: None, node, path: Valid(path) };
        channels.push(Channel { sampler, target, extensions: None, extras: None });
    };
    if !avatar.morphs.is_empty() {
        let weights: Vec<f32> = avatar.weights.iter().flatten().copied().collect();
        push(face, Property::MorphTargetWeights, buffer.push_keys(&weights, Type::Scalar, false));
    }
    if let Some(keys) = avatar.head {
        let places: Vec<f32> = keys.iter().flat_map(|key| key.translation).collect();
        let turns = continuous_rotations(keys.iter().map(|key| key.rotation));
        push(head, Property::Translation, buffer.push_keys(&places, Type::Vec3, false));
        push(head, Property::Rotation, buffer.push_keys(turns.as_flattened(), Type::Vec4, false));
    }
    Some(json::Animation {
        extensions: None,
        extras: None,
        channels,
        name: Some("performance".into()),
        samplers,
    })
}

/// Unit quaternions, each on its predecessor's side: players that interpolate without choosing the shorter way would
/// otherwise spin the head.
fn continuous_rotations(rotations: impl Iterator<Item = [f32; 4]>) -> Vec<[f32; 4]> {
    let mut last = [0.0; 4];
    rotations
        .map(|rotation| {
            let wide = rotation.map(f64::from);
            let length = wide.iter().map(|value| value * value).sum::<f64>().sqrt();
            let side: f64 = wide.iter().zip(&last).map(|(a, b)| a * b).sum();
            let scale = if side < 0.0 { -1.0 } else { 1.0 } / length;
            last = wide.map(|value| value * scale);
            last.map(|value| value as f32)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_stay_on_one_side_and_have_unit_length() {
        let given = [[0.0, 0.0, 0.0, 2.0], [0.1, 0.0, 0.0, -1.0], [0.2, 0.0, 0.0, -1.0]];
        let got = continuous_rotations(given.into_iter());
        assert_eq!(got[0].map(f32::to_bits), [0.0, 0.0, 0.0, 1.0_f32].map(f32::to_bits));
        for pair in got.windows(2) {
            assert!(pair[0].iter().zip(&pair[1]).map(|(a, b)| a * b).sum::<f32>() > 0.9);
        }
    }
}
