//! The one animation of a GLB: morph weights, the head's motion and that of rigid parts, over shared times.

use gltf_json as json;
use gltf_json::accessor::Type;
use gltf_json::animation::{Channel, Interpolation, Property, Sampler, Target};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Index, Node};

use super::glb::{GlbAvatar, NodeKey};
use super::glb_buffer::GlbBuffer;

/// None when nothing moves: no frames, or neither morphs nor head nor parts. `parts` are the nodes of the avatar's.
pub(super) fn push_motion(
    avatar: &GlbAvatar,
    seconds: &[f32],
    head: Index<Node>,
    parts: &[Index<Node>],
    buffer: &mut GlbBuffer,
) -> Option<json::Animation> {
    let morphing = || avatar.parts.iter().zip(parts).filter(|(part, _)| !part.morphs.is_empty());
    let moving = || avatar.parts.iter().zip(parts).filter_map(|(part, node)| Some((part, part.keys?, node)));
    let still = morphing().next().is_none() && avatar.head.is_none() && moving().next().is_none();
    if seconds.is_empty() || still {
        return None;
    }
    let times = buffer.push_keys(seconds, Type::Scalar, true);
    let mut motion = Motion { times, buffer, samplers: Vec::new(), channels: Vec::new() };
    if morphing().next().is_some() {
        let weights: Vec<f32> = avatar.weights.iter().flatten().copied().collect();
        let sampler = motion.sampler(&weights, Type::Scalar);
        for (_, &node) in morphing() {
            motion.channel(node, Property::MorphTargetWeights, sampler);
        }
    }
    if let Some(keys) = avatar.head {
        motion.pose(head, keys);
    }
    for (part, keys, &node) in moving() {
        motion.pose(node, &keys.iter().map(|key| part.placed(key)).collect::<Vec<_>>());
    }
    Some(json::Animation {
        extensions: None,
        extras: None,
        channels: motion.channels,
        name: Some("performance".into()),
        samplers: motion.samplers,
    })
}

/// The animation as it grows.
struct Motion<'a> {
    times: Index<json::Accessor>,
    buffer: &'a mut GlbBuffer,
    samplers: Vec<Sampler>,
    channels: Vec<Channel>,
}

impl Motion<'_> {
    fn sampler(&mut self, values: &[f32], kind: Type) -> Index<Sampler> {
        let sampler = Sampler {
            extensions: None,
            extras: None,
            input: self.times,
            interpolation: Valid(Interpolation::Linear),
            output: self.buffer.push_keys(values, kind, false),
        };
        Index::push(&mut self.samplers, sampler)
    }

    fn channel(&mut self, node: Index<Node>, path: Property, sampler: Index<Sampler>) {
        let target = Target { extensions: None, extras: None, node, path: Valid(path) };
        self.channels.push(Channel { sampler, target, extensions: None, extras: None });
    }

    /// Where `node` is below its parent in every frame.
    fn pose(&mut self, node: Index<Node>, keys: &[NodeKey]) {
        let places: Vec<f32> = keys.iter().flat_map(|key| key.translation).collect();
        let places = self.sampler(&places, Type::Vec3);
        self.channel(node, Property::Translation, places);
        let turns = continuous_rotations(keys.iter().map(|key| key.rotation));
        let turns = self.sampler(turns.as_flattened(), Type::Vec4);
        self.channel(node, Property::Rotation, turns);
    }
}

/// Unit quaternions, each on its predecessor's side: players that interpolate without choosing the shorter way would
/// otherwise spin the node.
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
