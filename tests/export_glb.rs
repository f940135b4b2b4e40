//! GLB files read back with the `gltf` crate, and checked by Khronos' validator where it is installed.

// What was written comes back exactly, and a helper that cannot go on ends its test.
#![allow(clippy::float_cmp, clippy::panic, clippy::unwrap_used)]

#[path = "common/gltf_validator.rs"]
mod gltf_validator;
#[path = "common/grid.rs"]
mod grid;

use std::fs;
use std::path::Path;

use gltf::animation::util::ReadOutputs;
use gltf_validator::{validate, validator};
use grid::{grid, head, morphs, normals, part, picture, plain, seamed, textured, times, weights};
use nalgebra::Point3;
use understudy::capture::Timestamp;
use understudy::export::{GlbAvatar, GlbPart, MorphTarget, NodeKey, write_glb};
use understudy::scan::{Mesh, TextureFormat};

/// Writes the mesh with motion of that size and returns the parsed document with its buffer.
fn export(path: &Path, mesh: &Mesh, morph_count: usize, frames: usize) -> (gltf::Document, Vec<u8>) {
    let (morphs, weights, times, head) =
        (morphs(mesh, morph_count), weights(frames, morph_count), times(frames), head(frames));
    let normals = normals(mesh);
    let face = GlbPart { normals: &normals, morphs: &morphs, ..part("face", mesh) };
    let avatar =
        GlbAvatar { name: "grid", parts: &[face], weights: &weights, times: &times, head: Some(&head) };
    write_glb(path, &avatar).unwrap();
    let (document, mut buffers, _) = gltf::import(path).unwrap();
    (document, buffers.remove(0).0)
}

#[test]
fn a_textured_scan_with_seams_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = seamed();
    let (document, bytes) = export(&folder.path().join("a.glb"), &mesh, 3, 5);
    let root = document.default_scene().unwrap().nodes().next().unwrap();
    assert_eq!(root.name(), Some("grid"));
    let head = root.children().next().unwrap();
    assert_eq!(head.name(), Some("head"));
    let face = head.children().next().unwrap().mesh().unwrap();
    let extras: serde_json::Value = serde_json::from_str(face.extras().as_ref().unwrap().get()).unwrap();
    assert_eq!(extras["targetNames"][2], "shape \"2\"");
    assert_eq!(face.weights(), Some(&[0.0; 3][..]));

    let primitive = face.primitives().next().unwrap();
    let reader = primitive.reader(|_| Some(&bytes));
    let positions: Vec<_> = reader.read_positions().unwrap().collect();
    let uvs: Vec<_> = reader.read_tex_coords(0).unwrap().into_f32().collect();
    let corners: Vec<_> = reader.read_indices().unwrap().into_u32().collect();
    assert!(positions.len() > 16 && positions.len() < 32);
    assert_eq!(corners.len(), 54);
    let flat = |triangles: &[[u32; 3]]| triangles.as_flattened().to_vec();
    let given = flat(&mesh.triangles).into_iter().zip(flat(&mesh.uv_triangles));
    let targets: Vec<Vec<_>> =
        reader.read_morph_targets().map(|(deltas, _, _)| deltas.unwrap().collect()).collect();
    let wanted = morphs(&mesh, 3);
    for (corner, (vertex, uv)) in corners.iter().map(|&corner| corner as usize).zip(given) {
        let point = mesh.positions[vertex as usize].coords.map(|value| value as f32);
        assert_eq!(positions[corner], <[f32; 3]>::from(point));
        let [u, v] = mesh.uvs[uv as usize];
        assert_eq!(uvs[corner], [u, 1.0 - v]);
        for (target, wanted) in targets.iter().zip(&wanted) {
            assert_eq!(target[corner], wanted.deltas[vertex as usize]);
        }
    }
    assert!(reader.read_normals().unwrap().all(|normal| normal == [0.0, 0.0, 1.0]));

    let gltf::image::Source::View { view, mime_type } = document.images().next().unwrap().source() else {
        panic!("the texture is not embedded");
    };
    assert_eq!(mime_type, "image/png");
    assert_eq!(bytes[view.offset()..view.offset() + view.length()], picture(image::ImageFormat::Png));
}

#[test]
fn the_animation_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let (document, bytes) = export(&folder.path().join("a.glb"), &grid(), 2, 40);
    let animation = document.animations().next().unwrap();
    assert_eq!(animation.channels().count(), 3);
    for channel in animation.channels() {
        let reader = channel.reader(|_| Some(&bytes));
        let seconds: Vec<f32> = reader.read_inputs().unwrap().collect();
        assert_eq!(seconds.len(), 40);
        assert_eq!(seconds[1], 33_366_666e-9_f64 as f32);
        match reader.read_outputs().unwrap() {
            ReadOutputs::MorphTargetWeights(values) => {
                assert_eq!(channel.target().node().name(), Some("face"));
                assert_eq!(values.into_f32().collect::<Vec<_>>(), weights(40, 2).concat());
            }
            ReadOutputs::Translations(values) => {
                assert_eq!(channel.target().node().name(), Some("head"));
                let wanted: Vec<_> = head(40).iter().map(|key| key.translation).collect();
                assert_eq!(values.collect::<Vec<_>>(), wanted);
            }
            ReadOutputs::Rotations(values) => {
                for (value, key) in values.into_f32().zip(head(40)) {
                    for (got, wanted) in value.iter().zip(key.rotation) {
                        assert!((got - wanted).abs() < 1e-6);
                    }
                }
            }
            ReadOutputs::Scales(_) => panic!("nothing scales"),
        }
    }
}

#[test]
fn vertex_colours_become_linear_and_stay_off_textures() {
    let folder = tempfile::tempdir().unwrap();
    let mut mesh = grid();
    mesh.colours = vec![[0.5, 1.0, 0.0]; 16];
    let (document, bytes) = export(&folder.path().join("a.glb"), &mesh, 0, 1);
    let primitive = document.meshes().next().unwrap().primitives().next().unwrap();
    let colours = primitive.reader(|_| Some(&bytes)).read_colors(0).unwrap().into_rgb_f32();
    for [red, green, blue] in colours {
        assert!((red - 0.214_041).abs() < 1e-6 && green == 1.0 && blue == 0.0);
    }
    assert_eq!(primitive.material().pbr_metallic_roughness().base_color_factor(), [1.0; 4]);
    mesh.materials = vec![textured("skin", TextureFormat::Jpeg)];
    let (document, bytes) = export(&folder.path().join("b.glb"), &mesh, 0, 1);
    let primitive = document.meshes().next().unwrap().primitives().next().unwrap();
    assert!(primitive.reader(|_| Some(&bytes)).read_colors(0).is_none());
}

#[test]
fn materials_share_vertices_and_textures() {
    let folder = tempfile::tempdir().unwrap();
    let mut mesh = grid();
    let skin = textured("skin", TextureFormat::Png);
    mesh.materials = vec![skin.clone(), plain("eye", [0.2, 0.3, 0.4, 0.5]), skin, plain("unused", [1.0; 4])];
    mesh.triangle_materials = (0..18).map(|triangle| triangle % 3).collect();
    let (document, _) = export(&folder.path().join("a.glb"), &mesh, 2, 3);
    let face = document.meshes().next().unwrap();
    assert_eq!(face.primitives().len(), 3);
    let positions = |primitive: gltf::Primitive| primitive.get(&gltf::Semantic::Positions).unwrap().index();
    let first = positions(face.primitives().next().unwrap());
    assert!(face.primitives().all(|primitive| positions(primitive) == first));
    assert_eq!((document.images().len(), document.materials().len()), (1, 3));
}

#[test]
fn the_same_avatar_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (folder.path().join("a.glb"), folder.path().join("b.glb"));
    export(&first, &seamed(), 4, 9);
    export(&second, &seamed(), 4, 9);
    assert_eq!(fs::read(first).unwrap(), fs::read(second).unwrap());
}

#[test]
fn what_cannot_be_written_is_refused_and_the_old_file_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    fs::write(&path, b"old").unwrap();
    let mesh = grid();
    let (normals, morphs, weights, times) = (normals(&mesh), morphs(&mesh, 2), weights(3, 2), times(3));
    let face = GlbPart { normals: &normals, morphs: &morphs, ..part("face", &mesh) };
    let good = GlbAvatar { name: "grid", parts: &[face], weights: &weights, times: &times, head: None };
    let refused = |avatar: &GlbAvatar, words: &str| {
        let error = write_glb(&path, avatar).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("a.glb"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    };
    let mut nan = weights.clone();
    nan[1][1] = f32::NAN;
    refused(&GlbAvatar { weights: &nan, ..good }, "frame 1 has a weight that is not finite");
    refused(&GlbAvatar { weights: &weights[..2], ..good }, "2 rows of weights for 3 frames");
    let few = GlbPart { morphs: &morphs[..1], ..face };
    refused(&GlbAvatar { parts: &[few], ..good }, "2 weights for 1 morphs");
    refused(&GlbAvatar { times: &[Timestamp(0); 3], ..good }, "frame 1 is not later");
    refused(&GlbAvatar { times: &[-9, 0, 9].map(Timestamp), ..good }, "before time 0");
    let few = GlbPart { normals: &normals[1..], ..face };
    refused(&GlbAvatar { parts: &[few], ..good }, "part \"face\": there are 15 normals for 16 vertices");
    let still = NodeKey { translation: [0.0; 3], rotation: [0.0; 4] };
    refused(&GlbAvatar { head: Some(&[still; 3]), ..good }, "frame 0 has a head pose");
    refused(&GlbAvatar { head: Some(&[still; 2]), ..good }, "2 head poses for 3 frames");
    let broken = |change: &dyn Fn(&mut Mesh), words: &str| {
        let mut mesh = grid();
        change(&mut mesh);
        refused(&GlbAvatar { parts: &[GlbPart { mesh: &mesh, ..face }], ..good }, words);
    };
    broken(&|mesh| mesh.positions[3].x = f64::NAN, "vertex 3 is not finite");
    broken(&|mesh| mesh.positions[3].x = 1e300, "vertex 3 is not finite");
    broken(&|mesh| mesh.triangles[2][0] = 16, "beyond the 16");
    broken(&|mesh| mesh.uv_triangles[2][0] = 16, "texture coordinates do not belong");
    broken(&|mesh| mesh.triangle_materials = vec![7; 18], "materials do not belong");
    broken(&|mesh| mesh.colours = vec![[0.0; 3]], "1 colours for 16");
    let empty = |mesh: &mut Mesh| {
        mesh.triangles.clear();
        mesh.uv_triangles.clear();
    };
    broken(&empty, "part \"face\" has no triangles");
}

#[test]
fn khronos_validator_finds_nothing() {
    let Some(validator) = validator() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut files = Vec::new();
    let mut add = |name: &str, mesh: &Mesh, morphs: usize, frames: usize| {
        let path = folder.path().join(name);
        export(&path, mesh, morphs, frames);
        files.push(path);
    };
    let bare = Mesh { uvs: Vec::new(), uv_triangles: Vec::new(), ..grid() };
    add("seams.glb", &seamed(), 24, 300);
    add("bare.glb", &bare, 3, 10);
    add("uvs_without_texture.glb", &grid(), 3, 10);
    add("colours.glb", &Mesh { colours: vec![[0.3, 0.6, 1.0]; 16], ..grid() }, 3, 10);
    let texture_without_uvs = Mesh { materials: vec![textured("skin", TextureFormat::Jpeg)], ..bare.clone() };
    add("texture_without_uvs.glb", &texture_without_uvs, 1, 2);
    add("colours_and_texture.glb", &Mesh { colours: vec![[0.3, 0.6, 1.0]; 16], ..seamed() }, 3, 10);
    let mut several = seamed();
    let skin = several.materials[0].clone();
    several.materials.extend([
        plain("eye", [0.2, 0.3, 0.4, 0.5]),
        skin,
        textured("jaw", TextureFormat::Jpeg),
    ]);
    several.materials.push(plain("unused", [1.0; 4]));
    several.triangle_materials = (0..18).map(|triangle| triangle % 4).collect();
    several.colours = vec![[0.1; 3]; 16];
    add("materials.glb", &several, 2, 5);
    add("one_frame.glb", &seamed(), 3, 1);
    add("one_morph.glb", &seamed(), 1, 10);
    add("no_morphs.glb", &seamed(), 0, 10);
    add("no_frames.glb", &seamed(), 2, 0);
    add("nothing_moves.glb", &seamed(), 0, 0);
    let mut odd = seamed();
    odd.positions.extend([Point3::new(9.0, 9.0, 9.0), odd.positions[0], odd.positions[1], odd.positions[5]]);
    odd.triangles.extend([[17, 18, 19], [3, 3, 3], [0, 0, 1]]);
    odd.uv_triangles.extend([[0, 1, 5], [0, 0, 0], [0, 1, 2]]);
    add("unreferenced_duplicated_degenerate.glb", &odd, 2, 5);
    let zero = folder.path().join("zero_normals.glb");
    let (mesh, zeros) = (grid(), vec![[0.0; 3]; 16]);
    let still = MorphTarget { name: "still".into(), deltas: vec![[0.0; 3]; 16] };
    let face = GlbPart { normals: &zeros, morphs: &[still], ..part("face", &mesh) };
    let avatar = GlbAvatar { name: "", parts: &[face], weights: &[vec![1.0]], times: &times(1), head: None };
    write_glb(&zero, &avatar).unwrap();
    files.push(zero);
    let flat = folder.path().join("no_normals.glb");
    write_glb(&flat, &GlbAvatar { parts: &[GlbPart { normals: &[], ..face }], ..avatar }).unwrap();
    files.push(flat);

    validate(&validator, &files);
}
