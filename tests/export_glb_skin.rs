//! Curves of living skin in a GLB: morph targets that move nothing, whose weights an engine reads by name.

#![allow(
    clippy::float_cmp,
    clippy::panic,
    clippy::unwrap_used,
    reason = "what was written comes back exactly"
)]

#[path = "common/gltf_validator.rs"]
mod gltf_validator;
#[path = "common/grid.rs"]
mod grid;

use gltf::animation::util::ReadOutputs;
use gltf_validator::{validate, validator};
use grid::{grid, morphs, part, seamed, times};
use understudy::export::{GlbAvatar, GlbPart, MorphTarget, write_glb};

const FRAMES: usize = 4;

fn rows() -> Vec<Vec<f32>> {
    (0..FRAMES).map(|frame| vec![0.5, 0.25 * frame as f32, 1.0 - 0.25 * frame as f32]).collect()
}

fn write(path: &std::path::Path) {
    let (skin, bare) = (seamed(), grid());
    let curves = ["wrinkle_forehead", "lid_left"]
        .map(|name| MorphTarget { name: name.to_owned(), deltas: Vec::new() });
    let with = |mesh| morphs(mesh, 1).into_iter().chain(curves.clone()).collect::<Vec<_>>();
    let (skin_morphs, bare_morphs) = (with(&skin), with(&bare));
    let parts = [
        GlbPart { morphs: &skin_morphs, ..part("face", &skin) },
        GlbPart { morphs: &bare_morphs, ..part("mouth", &bare) },
    ];
    let (rows, times) = (rows(), times(FRAMES));
    write_glb(path, &GlbAvatar { name: "someone", parts: &parts, weights: &rows, times: &times, head: None })
        .unwrap();
}

#[test]
fn names_and_weights_come_back_and_nothing_moves() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin.glb");
    write(&path);
    let (document, buffers, _) = gltf::import(&path).unwrap();
    for mesh in document.meshes() {
        let extras: serde_json::Value = serde_json::from_str(mesh.extras().as_ref().unwrap().get()).unwrap();
        assert_eq!(extras["targetNames"][1], "wrinkle_forehead");
        assert_eq!(extras["targetNames"][2], "lid_left");
        let primitive = mesh.primitives().next().unwrap();
        let reader = primitive.reader(|buffer| Some(&buffers[buffer.index()]));
        let moved = reader
            .read_morph_targets()
            .map(|(positions, _, _)| positions.unwrap().flatten().any(|value| value != 0.0));
        assert_eq!(moved.collect::<Vec<_>>(), [true, false, false]);
        // The zeros are stored once.
        let places: Vec<_> = primitive.morph_targets().map(|m| m.positions().unwrap().index()).collect();
        assert!(places[1] == places[2] && places[0] != places[1]);
    }
    let animation = document.animations().next().unwrap();
    let channel = animation.channels().next().unwrap();
    let outputs = channel.reader(|buffer| Some(&buffers[buffer.index()])).read_outputs().unwrap();
    let ReadOutputs::MorphTargetWeights(weights) = outputs else { panic!("no weights") };
    assert_eq!(weights.into_f32().collect::<Vec<_>>(), rows().concat());
}

#[test]
fn khronos_validator_finds_nothing() {
    let Some(validator) = validator() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin.glb");
    write(&path);
    validate(&validator, &[path]);
}
