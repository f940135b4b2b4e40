//! GLB files of several parts, read back with the `gltf` crate and checked by Khronos' validator.

// What was written comes back exactly, and a helper that cannot go on ends its test.
#![allow(clippy::float_cmp, clippy::panic, clippy::unwrap_used)]

#[path = "common/gltf_validator.rs"]
mod gltf_validator;
#[path = "common/grid.rs"]
mod grid;

use std::fs;
use std::path::Path;

use gltf::animation::{Property, util::ReadOutputs};
use gltf_validator::{validate, validator};
use grid::{grid, head, morphs, normals, part, plain, seamed, textured, times, weights};
use nalgebra::{Isometry3, Matrix4, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use understudy::export::{GlbAvatar, GlbPart, MorphTarget, NodeKey, write_glb};
use understudy::scan::{Material, Mesh, TextureFormat};

const FRAMES: usize = 7;
const PIVOT: [f32; 3] = [0.03, 0.035, -0.012];

fn eye_keys() -> Vec<NodeKey> {
    let key = |frame: usize| {
        let turn = UnitQuaternion::from_euler_angles(0.05 * frame as f32, -0.1 * frame as f32, 0.0);
        NodeKey { translation: [0.0, 0.0, 0.001 * frame as f32], rotation: turn.coords.into() }
    };
    (0..FRAMES).map(key).collect()
}

fn read(path: &Path) -> (gltf::Document, Vec<u8>) {
    let (document, mut buffers, _) = gltf::import(path).unwrap();
    (document, buffers.remove(0).0)
}

fn node<'a>(document: &'a gltf::Document, name: &str) -> gltf::Node<'a> {
    document.nodes().find(|node| node.name() == Some(name)).unwrap()
}

/// A face and a mouth that morph, an eye that turns, and teeth that stay.
fn write_whole(path: &Path) {
    let (skin, bare) = (seamed(), grid());
    let mut mouth = grid();
    mouth.materials = vec![plain("mouth", [0.3, 0.1, 0.1, 1.0])];
    let eye = Mesh { materials: vec![textured("iris", TextureFormat::Png)], ..grid() };
    let normals = normals(&skin);
    let (face_morphs, mut mouth_morphs) = (morphs(&skin, 3), morphs(&mouth, 3));
    mouth_morphs[1].deltas[5] = [0.5, 0.25, 0.125];
    let eye_keys = eye_keys();
    let parts = [
        GlbPart { normals: &normals, morphs: &face_morphs, ..part("face", &skin) },
        GlbPart { normals: &normals, morphs: &mouth_morphs, ..part("mouth", &mouth) },
        part("upper teeth", &bare),
        GlbPart { normals: &normals, pivot: PIVOT, keys: Some(&eye_keys), ..part("right eye", &eye) },
        GlbPart { pivot: PIVOT, ..part("left eye", &eye) },
    ];
    let (weights, times, head) = (weights(FRAMES, 3), times(FRAMES), head(FRAMES));
    let avatar =
        GlbAvatar { name: "someone", parts: &parts, weights: &weights, times: &times, head: Some(&head) };
    write_glb(path, &avatar).unwrap();
}

#[test]
fn parts_lie_below_the_head_and_share_weights_and_textures() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    write_whole(&path);
    let (document, bytes) = read(&path);
    let names: Vec<_> =
        node(&document, "head").children().map(|part| part.name().unwrap().to_owned()).collect();
    assert_eq!(names, ["face", "mouth", "upper teeth", "right eye", "left eye"]);
    let meshes: Vec<_> = document.meshes().map(|mesh| mesh.name().unwrap().to_owned()).collect();
    assert_eq!(meshes, ["someone", "mouth", "upper teeth", "right eye", "left eye"]);
    // One for the face, one for both eyes; a part without materials gets one of its name.
    assert_eq!(document.images().len(), 2);
    let teeth = node(&document, "upper teeth").mesh().unwrap();
    assert_eq!(teeth.primitives().next().unwrap().material().name(), Some("upper teeth"));
    assert!(teeth.weights().is_none() && teeth.extras().is_none());

    let animation = document.animations().next().unwrap();
    let mut weighted = Vec::new();
    let mut outputs = Vec::new();
    for channel in animation.channels().filter(|c| c.target().property() == Property::MorphTargetWeights) {
        weighted.push(channel.target().node().name().unwrap().to_owned());
        outputs.push(channel.sampler().output().index());
        let reader = channel.reader(|_| Some(&bytes));
        let Some(ReadOutputs::MorphTargetWeights(values)) = reader.read_outputs() else { panic!("weights") };
        assert_eq!(values.into_f32().collect::<Vec<_>>(), weights(FRAMES, 3).concat());
    }
    assert_eq!(weighted, ["face", "mouth"]);
    assert_eq!(outputs[0], outputs[1]);
    assert_eq!(animation.channels().count(), 2 + 2 + 2, "weights, the head, one eye");

    let mouth = node(&document, "mouth").mesh().unwrap().primitives().next().unwrap();
    let reader = mouth.reader(|_| Some(&bytes));
    let second: Vec<_> = reader.read_morph_targets().nth(1).unwrap().0.unwrap().collect();
    assert_eq!(second[5], [0.5, 0.25, 0.125]);
}

/// What the animation makes of a node in a frame, below its parent.
fn local(document: &gltf::Document, bytes: &[u8], name: &str, frame: usize) -> Matrix4<f64> {
    let (mut place, mut turn, _) = node(document, name).transform().decomposed();
    for channel in document.animations().flat_map(|animation| animation.channels()) {
        if channel.target().node().name() == Some(name) {
            match channel.reader(|_| Some(bytes)).read_outputs().unwrap() {
                ReadOutputs::Translations(mut values) => place = values.nth(frame).unwrap(),
                ReadOutputs::Rotations(values) => turn = values.into_f32().nth(frame).unwrap(),
                _ => panic!("{name} only moves"),
            }
        }
    }
    pose(place, turn).to_homogeneous()
}

fn pose(place: [f32; 3], turn: [f32; 4]) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_quaternion(Quaternion::from(turn.map(f64::from)));
    Isometry3::from_parts(Translation3::from(place.map(f64::from)), turn)
}

#[test]
fn a_rigid_part_turns_about_its_pivot() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    write_whole(&path);
    let (document, bytes) = read(&path);
    let pivot = Point3::from(PIVOT.map(f64::from));
    let mesh = grid();
    for (name, keys) in [("right eye", Some(eye_keys())), ("left eye", None)] {
        let eye = node(&document, name);
        let (rest, turn, _) = eye.transform().decomposed();
        assert_eq!((rest, turn), (PIVOT, [0.0, 0.0, 0.0, 1.0]));
        let reader_of = eye.mesh().unwrap().primitives().next().unwrap();
        let stored: Vec<_> = reader_of.reader(|_| Some(&bytes)).read_positions().unwrap().collect();
        for frame in 0..FRAMES {
            let below_root = local(&document, &bytes, "head", frame) * local(&document, &bytes, name, frame);
            let head = head(FRAMES)[frame];
            for (stored, given) in stored.iter().zip(&mesh.positions) {
                let drawn = below_root.transform_point(&Point3::from(stored.map(f64::from)));
                let in_head = keys.as_ref().map_or(*given, |keys| {
                    let NodeKey { translation, rotation } = keys[frame];
                    let turned = pose([0.0; 3], rotation) * (given - pivot);
                    pivot + Vector3::from(translation.map(f64::from)) + turned
                });
                let wanted = pose(head.translation, head.rotation) * in_head;
                assert!((drawn - wanted).norm() < 1e-7, "{name} {frame}: {drawn} {wanted}");
            }
        }
    }
}

#[test]
fn gloss_becomes_smoothness() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let with = |gloss: f32| {
        let material = Material { gloss, ..plain("wet", [1.0; 4]) };
        let mesh = Mesh { materials: vec![material], ..grid() };
        let parts = [part("face", &mesh)];
        let avatar = GlbAvatar { name: "x", parts: &parts, weights: &[], times: &[], head: None };
        write_glb(&path, &avatar).map(|()| {
            let (document, _) = read(&path);
            document.materials().next().unwrap().pbr_metallic_roughness().roughness_factor()
        })
    };
    for (gloss, roughness) in [(0.0, 0.8), (0.5, 0.44), (1.0, 0.08), (7.0, 0.08)] {
        assert!((with(gloss).unwrap() - roughness).abs() < 1e-6, "{gloss}");
    }
    assert!(with(f32::NAN).unwrap_err().to_string().contains("part \"face\""));
}

/// What `understudy prepare` writes: shapes that others will animate.
fn write_shapes(path: &Path) {
    let mesh = seamed();
    let named = |(morph, name): (MorphTarget, &str)| MorphTarget { name: name.to_owned(), ..morph };
    let shapes: Vec<_> = morphs(&mesh, 2).into_iter().zip(["blinkLeft", "jawOpen"]).map(named).collect();
    let parts = [GlbPart { morphs: &shapes, ..part("face", &mesh) }, part("tongue", &mesh)];
    let avatar = GlbAvatar { name: "someone", parts: &parts, weights: &[], times: &[], head: None };
    write_glb(path, &avatar).unwrap();
}

#[test]
fn shapes_need_no_animation() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    write_shapes(&path);
    let (document, _) = read(&path);
    assert_eq!(document.animations().len(), 0);
    let face = node(&document, "face").mesh().unwrap();
    let extras: serde_json::Value = serde_json::from_str(face.extras().as_ref().unwrap().get()).unwrap();
    assert_eq!(extras["targetNames"], serde_json::json!(["blinkLeft", "jawOpen"]));
    assert_eq!(face.weights(), Some(&[0.0; 2][..]));
    assert_eq!(document.images().len(), 1, "face and tongue share their texture");
}

#[test]
fn a_refusal_names_the_part() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let mesh = grid();
    let (good_morphs, weights, times, keys) =
        (morphs(&mesh, 2), weights(FRAMES, 2), times(FRAMES), eye_keys());
    let face = GlbPart { morphs: &good_morphs, ..part("face", &mesh) };
    let eye = GlbPart { pivot: PIVOT, keys: Some(&keys), ..part("left eye", &mesh) };
    let write = |parts: &[GlbPart]| {
        write_glb(&path, &GlbAvatar { name: "x", parts, weights: &weights, times: &times, head: None })
    };
    write(&[face, eye]).unwrap();
    fs::write(&path, b"old").unwrap();
    let refused = |eye: GlbPart, words: &str| {
        let error = write(&[face, eye]).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("part \"left eye\""), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    };
    refused(GlbPart { keys: Some(&keys[1..]), ..eye }, "there are 6 poses for 7 frames");
    refused(GlbPart { normals: &[[0.0; 3]; 3], ..eye }, "3 normals for 16");
    refused(GlbPart { pivot: [0.0, f32::NAN, 0.0], ..eye }, "the pivot is not finite");
    refused(GlbPart { morphs: &morphs(&mesh, 3), ..eye }, "has 3 morphs, and one before it has 2");
    let mut long = morphs(&mesh, 2);
    long[1].deltas.push([0.0; 3]);
    refused(GlbPart { morphs: &long, ..eye }, "17 displacements for 16 vertices");
    let mut infinite = morphs(&mesh, 2);
    infinite[0].deltas[3][1] = f32::INFINITY;
    refused(GlbPart { morphs: &infinite, ..eye }, "holds a displacement that is not finite");
    let with = |change: &dyn Fn(&mut NodeKey)| {
        let mut keys = eye_keys();
        change(&mut keys[4]);
        refused(
            GlbPart { keys: Some(&keys), ..eye },
            "frame 4 has a pose that is not finite, or no rotation",
        );
    };
    with(&|key| key.translation[2] = f32::NAN);
    with(&|key| key.rotation = [0.0; 4]);
    let broken = |change: &dyn Fn(&mut Mesh), words: &str| {
        let mut mesh = grid();
        change(&mut mesh);
        refused(GlbPart { mesh: &mesh, ..eye }, words);
    };
    broken(&|mesh| mesh.positions[3].x = f64::NAN, "vertex 3 is not finite");
    broken(&|mesh| mesh.triangles[2][0] = 16, "beyond the 16");
    broken(&|mesh| *mesh = Mesh { positions: vec![Point3::origin(); 16], ..Mesh::default() }, "no triangles");
    assert!(write(&[]).unwrap_err().to_string().contains("there are no parts"));
}

#[test]
fn khronos_validator_finds_nothing() {
    let Some(validator) = validator() else { return };
    let folder = tempfile::tempdir().unwrap();
    let [whole, shapes, rigid] =
        ["whole.glb", "shapes.glb", "rigid.glb"].map(|name| folder.path().join(name));
    write_whole(&whole);
    write_shapes(&shapes);
    // Only an eye moves.
    let (mesh, keys) = (grid(), eye_keys());
    let eye = GlbPart { pivot: PIVOT, keys: Some(&keys), ..part("left eye", &mesh) };
    let rows = vec![Vec::new(); FRAMES];
    let parts = [part("face", &mesh), eye];
    let avatar =
        GlbAvatar { name: "someone", parts: &parts, weights: &rows, times: &times(FRAMES), head: None };
    write_glb(&rigid, &avatar).unwrap();
    validate(&validator, &[whole, shapes, rigid]);
}
