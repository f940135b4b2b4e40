//! Textures and material files beside a mesh: found, missing, or not what they should be.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]
#![allow(clippy::float_cmp, reason = "values pass through unchanged")]

use std::path::Path;

use understudy::scan::{Mesh, TextureFormat, read_mesh};

const JPEG: &[u8] = &[0xff, 0xd8, 0xff, 0xe0, 1, 2, 3];
const PNG: &[u8] = b"\x89PNG\r\n\x1a\nrest";
const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n";

fn read(files: &[(&str, &[u8])], obj: &str) -> Mesh {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    let path = folder.path().join("face.obj");
    std::fs::write(&path, obj).unwrap();
    read_mesh(&path).unwrap()
}

fn textured(extra: &str) -> String {
    format!("{extra}\n{TRIANGLE}f 1/1 2/2 3/3\n")
}

fn texture_name(mesh: &Mesh) -> Option<&str> {
    Some(mesh.materials.first()?.texture.as_ref()?.name.as_str())
}

#[test]
fn options_spaces_folders_and_foreign_paths() {
    for (map, file) in [
        ("my face.jpg", "my face.jpg"),
        ("-s 1 1 1 -bm 0.5 my face.jpg", "my face.jpg"),
        ("maps/skin.jpg", "maps/skin.jpg"),
        ("maps\\skin.jpg", "maps/skin.jpg"),
        ("C:\\Users\\me\\skin.jpg", "skin.jpg"),
        ("/home/me/skin.jpg", "skin.jpg"),
    ] {
        let mtl = format!("newmtl skin\nKd 1 1 1\nmap_Kd {map}\n");
        let obj = textured("mtllib my face.mtl\nusemtl skin");
        let mesh = read(&[("my face.mtl", mtl.as_bytes()), (file, JPEG)], &obj);
        let texture = mesh.materials[0].texture.as_ref().unwrap_or_else(|| panic!("{map}"));
        assert_eq!(texture.format, TextureFormat::Jpeg);
        assert_eq!(texture.bytes, JPEG);
        assert_eq!(texture.name, Path::new(file).file_name().unwrap().to_str().unwrap());
    }
}

#[test]
fn missing_or_odd_files_are_no_errors() {
    let mtl: (&str, &[u8]) = ("a.mtl", b"newmtl skin\nKd 0.2 0.3 0.4\nmap_Kd gone.jpg\n");
    let mesh = read(&[mtl], &textured("mtllib a.mtl\nusemtl skin"));
    assert_eq!(texture_name(&mesh), None);
    assert_eq!(mesh.materials[0].base_colour, [0.2, 0.3, 0.4, 1.0]);
    let mesh = read(&[mtl, ("gone.jpg", b"BM no jpeg")], &textured("mtllib a.mtl\nusemtl skin"));
    assert_eq!(texture_name(&mesh), None);
    let mesh = read(&[], &textured("mtllib none.mtl\nusemtl skin"));
    assert_eq!(mesh.materials[0].name, "skin");
}

#[test]
fn an_image_of_the_same_name_is_the_texture() {
    for extra in ["", "mtllib face.mtl", "mtllib face.mtl\nusemtl skin"] {
        let mesh = read(&[("face.png", PNG)], &textured(extra));
        assert_eq!(texture_name(&mesh), Some("face.png"), "{extra:?}");
        assert_eq!(mesh.materials[0].base_colour, [1.0; 4]);
    }
    let mesh = read(&[("face.png", PNG)], "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    assert_eq!(texture_name(&mesh), None, "without texture coordinates it is just a picture");
    let mtl: (&str, &[u8]) = ("face.mtl", b"newmtl skin\nmap_Kd other.jpg\n");
    let mesh = read(&[mtl, ("face.png", PNG), ("other.jpg", JPEG)], &textured("mtllib face.mtl"));
    assert_eq!(texture_name(&mesh), Some("other.jpg"), "the material file goes first");
}

#[test]
fn several_materials_and_a_factor_beside_a_texture() {
    let mtl: (&str, &[u8]) =
        ("m.mtl", b"newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 0 0\nmap_Kd t.png\nnewmtl unused\n");
    let obj = format!("mtllib m.mtl\n{TRIANGLE}usemtl b\nf 1/1 2/2 3/3\nusemtl a\nf 3/3 2/2 1/1\n");
    let mesh = read(&[mtl, ("t.png", PNG)], &obj);
    assert_eq!(mesh.triangle_materials, [1, 0]);
    assert_eq!(mesh.materials[1].base_colour, [1.0; 4], "the texture is not darkened");
    assert_eq!(mesh.materials.len(), 3);
}

#[test]
fn ply_names_its_texture_in_a_comment() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("my skin.jpg"), JPEG).unwrap();
    let path = folder.path().join("a.ply");
    let text = "ply\nformat ascii 1.0\ncomment TextureFile my skin.jpg\nelement vertex 3\nproperty float x\n\
                property float y\nproperty float z\nproperty float texture_u\nproperty float texture_v\n\
                element face 1\nproperty list uchar uint vertex_indices\nend_header\n\
                0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n";
    std::fs::write(&path, text).unwrap();
    let mesh = read_mesh(&path).unwrap();
    assert_eq!(texture_name(&mesh), Some("my skin.jpg"));
    assert_eq!(mesh.uvs[1], [1.0, 0.0]);
}

#[test]
fn gltf_keeps_image_bytes_and_flips_v() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("t.png"), PNG).unwrap();
    let floats = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.25, 0.0, 1.0, 0.0, 0.0, 1.0];
    let mut bin: Vec<u8> = floats.iter().flat_map(|f| f.to_le_bytes()).collect();
    bin.extend([255, 0, 0, 255, 0, 0, 0, 255, 128, 128, 128, 255]);
    std::fs::write(folder.path().join("a.bin"), &bin).unwrap();
    let json = "{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],\
        \"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1,\"COLOR_0\":2},\
        \"material\":0}]}],\
        \"materials\":[{\"name\":\"skin\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.5,1,1,1],\
        \"baseColorTexture\":{\"index\":0}}}],\
        \"textures\":[{\"source\":0}],\"images\":[{\"uri\":\"t.png\"}],\
        \"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\",\"min\":[0,0,0],\
        \"max\":[1,1,0]},{\"bufferView\":0,\"byteOffset\":36,\"componentType\":5126,\"count\":3,\"type\":\"VEC2\"},\
        {\"bufferView\":0,\"byteOffset\":60,\"componentType\":5121,\"normalized\":true,\"count\":3,\
        \"type\":\"VEC4\"}],\
        \"bufferViews\":[{\"buffer\":0,\"byteLength\":72}],\"buffers\":[{\"byteLength\":72,\"uri\":\"a.bin\"}]}";
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, json).unwrap();
    let mesh = read_mesh(&path).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2]], "three vertices without indices");
    assert_eq!(mesh.uvs, [[0.25, 1.0], [1.0, 1.0], [0.0, 0.0]]);
    assert_eq!(mesh.materials[0].base_colour, [0.5, 1.0, 1.0, 1.0]);
    assert_eq!(mesh.materials[0].texture.as_ref().unwrap().bytes, PNG);
    assert!((mesh.colours[0][0] - 1.0).abs() < 1e-6 && mesh.colours[0][1] == 0.0);
    assert!((mesh.colours[2][0] - 0.735).abs() < 0.01, "linear half is bright in sRGB");
}
