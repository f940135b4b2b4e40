//! The same cube through every reader, and what readers do with files that are not what they should be.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]
#![allow(clippy::float_cmp, reason = "values pass through unchanged")]

use std::fmt::Write as _;
use std::path::Path;

use proptest::prelude::*;
use understudy::scan::{Mesh, MeshFormat, ScanError, read_mesh, read_mesh_bytes};

const CORNERS: [[f32; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];
const QUADS: [[u32; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [2, 3, 7, 6], [1, 2, 6, 5], [0, 4, 7, 3]];

fn triangles() -> Vec<[u32; 3]> {
    QUADS.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect()
}

fn obj() -> Vec<u8> {
    let mut out = String::new();
    for [x, y, z] in CORNERS {
        writeln!(out, "v {x} {y} {z}").unwrap();
    }
    for q in QUADS {
        let [a, b, c, d] = q.map(|i| i + 1);
        writeln!(out, "f {a} {b} {c} {d}").unwrap();
    }
    out.into_bytes()
}

/// `order` is "ascii", "binary_little_endian" or "binary_big_endian".
fn ply(order: &str) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat {order} 1.0\ncomment by hand\nelement vertex 8\nproperty float x\nproperty float y\n\
         property double z\nelement face 6\nproperty list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    let big = order == "binary_big_endian";
    if order == "ascii" {
        let mut text = String::new();
        for [x, y, z] in CORNERS {
            writeln!(text, "{x} {y} {z}").unwrap();
        }
        for [a, b, c, d] in QUADS {
            writeln!(text, "4 {a} {b} {c} {d}").unwrap();
        }
        out.extend(text.bytes());
        return out;
    }
    for [x, y, z] in CORNERS {
        for c in [x, y] {
            out.extend(if big { c.to_be_bytes() } else { c.to_le_bytes() });
        }
        let z = f64::from(z);
        out.extend(if big { z.to_be_bytes() } else { z.to_le_bytes() });
    }
    for q in QUADS {
        out.push(4);
        for i in q {
            out.extend(if big { i.to_be_bytes() } else { i.to_le_bytes() });
        }
    }
    out
}

fn stl_ascii() -> Vec<u8> {
    let mut out = "solid cube\n".to_owned();
    for t in triangles() {
        out.push_str("facet normal 0 0 0\nouter loop\n");
        for i in t {
            let [x, y, z] = CORNERS[i as usize];
            writeln!(out, "vertex {x:e} {y:e} {z:e}").unwrap();
        }
        out.push_str("endloop\nendfacet\n");
    }
    out.push_str("endsolid cube\n");
    out.into_bytes()
}

fn stl_binary() -> Vec<u8> {
    let mut out = vec![b' '; 80];
    out.extend((triangles().len() as u32).to_le_bytes());
    for t in triangles() {
        out.extend([0; 12]);
        for i in t {
            out.extend(CORNERS[i as usize].iter().flat_map(|c| c.to_le_bytes()));
        }
        out.extend([0; 2]);
    }
    out
}

fn gltf_bin() -> Vec<u8> {
    let mut bin: Vec<u8> = CORNERS.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
    bin.extend(triangles().iter().flatten().flat_map(|i| (*i as u16).to_le_bytes()));
    bin
}

/// `node` and `primitive` go into the node and the primitive; `uri` into the buffer.
fn gltf_json(node: &str, primitive: &str, uri: &str) -> String {
    format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[0]}}],\
         \"nodes\":[{{\"mesh\":0{node}}}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}},\"indices\":1{primitive}}}]}}],\
         \"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\"count\":8,\"type\":\"VEC3\",\
         \"min\":[-1,-1,-1],\"max\":[1,1,1]}},\
         {{\"bufferView\":1,\"componentType\":5123,\"count\":36,\"type\":\"SCALAR\"}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteOffset\":0,\"byteLength\":96}},\
         {{\"buffer\":0,\"byteOffset\":96,\"byteLength\":72}}],\
         \"buffers\":[{{\"byteLength\":168{uri}}}]}}"
    )
}

fn glb_of(json: &str, bin: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend((12 + 8 + json.len() as u32 + 8 + bin.len() as u32).to_le_bytes());
    out.extend((json.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(json);
    out.extend((bin.len() as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(bin);
    out
}

fn glb() -> Vec<u8> {
    glb_of(&gltf_json("", "", ""), &gltf_bin())
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for chunk in bytes.chunks(3) {
        let n = chunk.iter().fold(0, |n, b| n << 8 | u32::from(*b)) << (8 * (3 - chunk.len()));
        for k in 0..4 {
            let digit = DIGITS[(n >> (18 - 6 * k) & 63) as usize] as char;
            out.push(if k <= chunk.len() { digit } else { '=' });
        }
    }
    out
}

fn gltf() -> Vec<u8> {
    let uri = format!(",\"uri\":\"data:application/octet-stream;base64,{}\"", base64(&gltf_bin()));
    gltf_json("", "", &uri).into_bytes()
}

fn every_file() -> Vec<(&'static str, MeshFormat, Vec<u8>)> {
    vec![
        ("obj", MeshFormat::Obj, obj()),
        ("ascii ply", MeshFormat::Ply, ply("ascii")),
        ("little-endian ply", MeshFormat::Ply, ply("binary_little_endian")),
        ("big-endian ply", MeshFormat::Ply, ply("binary_big_endian")),
        ("ascii stl", MeshFormat::Stl, stl_ascii()),
        ("binary stl", MeshFormat::Stl, stl_binary()),
        ("glb", MeshFormat::Gltf, glb()),
        ("gltf", MeshFormat::Gltf, gltf()),
    ]
}

fn parse(bytes: &[u8], format: MeshFormat) -> Result<Mesh, ScanError> {
    read_mesh_bytes(bytes, format, Path::new("/nonexistent/file"))
}

fn corners(mesh: &Mesh) -> Vec<[[f64; 3]; 3]> {
    mesh.triangles.iter().map(|t| t.map(|i| mesh.positions[i as usize].into())).collect()
}

#[test]
fn the_same_cube_through_every_reader() {
    let wanted: Vec<[[f64; 3]; 3]> =
        triangles().iter().map(|t| t.map(|i| CORNERS[i as usize].map(f64::from))).collect();
    for (name, format, bytes) in every_file() {
        let mesh = parse(&bytes, format).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(corners(&mesh), wanted, "{name}");
        assert_eq!(mesh.positions.len(), 8, "{name}");
        if format != MeshFormat::Stl {
            let own: Vec<[f64; 3]> = mesh.positions.iter().map(|p| (*p).into()).collect();
            assert_eq!(own, CORNERS.map(|c| c.map(f64::from)), "{name} keeps its vertex order");
        }
    }
}

#[test]
fn files_are_told_apart_by_extension() {
    let folder = tempfile::tempdir().unwrap();
    for (extension, bytes) in
        [("OBJ", obj()), ("ply", ply("ascii")), ("stl", stl_binary()), ("glb", glb()), ("gltf", gltf())]
    {
        let path = folder.path().join(format!("cube.{extension}"));
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(read_mesh(&path).unwrap().triangles.len(), 12);
    }
    for name in ["cube.fbx", "cube"] {
        let error = read_mesh(&folder.path().join(name)).unwrap_err().to_string();
        assert!(error.contains(".obj, .ply, .stl, .glb, .gltf"), "{error}");
    }
    let error = read_mesh(&folder.path().join("none.obj")).unwrap_err().to_string();
    assert!(error.contains("cannot read") && error.contains("none.obj"), "{error}");
    std::fs::create_dir(folder.path().join("folder.obj")).unwrap();
    assert!(matches!(read_mesh(&folder.path().join("folder.obj")), Err(ScanError::Read { .. })));
}

#[test]
fn gltf_buffers_beside_the_file() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("my cube.bin"), gltf_bin()).unwrap();
    let path = folder.path().join("cube.gltf");
    std::fs::write(&path, gltf_json("", "", ",\"uri\":\"my%20cube.bin\"")).unwrap();
    assert_eq!(read_mesh(&path).unwrap().positions.len(), 8);
    std::fs::write(&path, gltf_json("", "", ",\"uri\":\"/etc/hostname%FF\"")).unwrap();
    assert!(read_mesh(&path).is_err());
}

#[test]
fn gltf_nodes_place_and_mirror() {
    let moved =
        parse(&glb_of(&gltf_json(",\"translation\":[0,1.5,0]", "", ""), &gltf_bin()), MeshFormat::Gltf);
    assert_eq!(moved.unwrap().positions[0].y, 0.5);
    let json = gltf_json(",\"scale\":[-1,1,1]", "", "");
    let mesh = parse(&glb_of(&json, &gltf_bin()), MeshFormat::Gltf).unwrap();
    // A mirrored cube still faces outward.
    for [a, b, c] in mesh.triangles.iter().map(|t| t.map(|i| mesh.positions[i as usize])) {
        assert!((b - a).cross(&(c - a)).dot(&a.coords) > 0.0);
    }
}

#[test]
fn gltf_trees_that_are_none() {
    for (node, wanted) in [(",\"children\":[0]", "twice"), (",\"children\":[7]", "out of bounds")] {
        let error = parse(&glb_of(&gltf_json(node, "", ""), &gltf_bin()), MeshFormat::Gltf).unwrap_err();
        assert!(error.to_string().to_lowercase().contains(wanted), "{error}");
    }
    // gltf-json 1.4.1 panics in its own validation when POSITION leads nowhere.
    let astray = gltf_json("", "", "").replace("\"POSITION\":0", "\"POSITION\":2");
    let error = parse(&glb_of(&astray, &gltf_bin()), MeshFormat::Gltf).unwrap_err();
    assert!(error.to_string().contains("accessor 2"), "{error}");
    let points = parse(&glb_of(&gltf_json("", ",\"mode\":0", ""), &gltf_bin()), MeshFormat::Gltf);
    assert!(points.unwrap_err().to_string().contains("has 0 vertices"));
    let short = parse(&glb_of(&gltf_json("", "", ""), &gltf_bin()[..100]), MeshFormat::Gltf);
    assert!(short.unwrap_err().to_string().contains("beyond its buffer"));
}

#[test]
fn strange_but_usable_surfaces() {
    // Three triangles on one edge, a part of its own, an unused vertex, a triangle without area.
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 5 5 5\nv 6 5 5\nv 5 6 5\nv 9 9 9\n\
                f 1 2 3\nf 1 2 4\nf 1 2 5\nf 6 7 8\nf 1 1 2\n";
    let mesh = parse(text.as_bytes(), MeshFormat::Obj).unwrap();
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (9, 4));
}

#[test]
fn unusable_surfaces_say_why() {
    for (text, wanted) in [
        ("", "empty"),
        ("# nothing\n", "0 vertices"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no triangle"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 1 2\n", "no triangle"),
        ("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "vertex 1"),
        ("v 0 0 0\nv 1e300 0 0\nv 0 1 0\nf 1 2 3\n", "vertex 1"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "refers to vertex 3, but there are only 3"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/9 2/9 3/9\n", "texture coordinate 8"),
        ("v 2 2 2\nv 2 2 2\nv 2 2 2\nf 1 2 3\n", "one point"),
    ] {
        let error = parse(text.as_bytes(), MeshFormat::Obj).unwrap_err().to_string();
        assert!(error.contains(wanted), "{text:?}: {error}");
    }
    for format in [MeshFormat::Ply, MeshFormat::Stl, MeshFormat::Gltf] {
        assert!(parse(b"", format).is_err());
    }
}

fn any_format() -> impl Strategy<Value = MeshFormat> {
    prop_oneof![Just(MeshFormat::Obj), Just(MeshFormat::Ply), Just(MeshFormat::Stl), Just(MeshFormat::Gltf)]
}

/// Bytes that get past the first look of some reader.
fn any_start() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        Just(Vec::new()),
        Just(b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nend_header\n".to_vec()),
        Just(b"ply\nformat binary_big_endian 1.0\nelement face 9\nproperty list uint int vertex_index\nend_header\n".to_vec()),
        Just(b"solid x\nfacet ".to_vec()),
        Just(b"glTF\x02\0\0\0".to_vec()),
        Just(b"{\"asset\":{\"version\":\"2.0\"},".to_vec()),
        Just(b"v 1 2 3\nv 2 3 4\nv 1 5 4\nf ".to_vec()),
    ]
}

/// A mesh that was accepted keeps what [`Mesh::validate`] promises.
fn holds(read: Result<Mesh, ScanError>) -> bool {
    read.map_or(true, |mesh| mesh.validate().is_ok())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_bytes_never_panic(
        format in any_format(),
        start in any_start(),
        rest in proptest::collection::vec(any::<u8>(), 0..300),
    ) {
        prop_assert!(holds(parse(&[start, rest].concat(), format)));
    }

    #[test]
    fn cut_files_never_panic(which in 0..8_usize, keep in 0.0..1.0_f64) {
        let (_, format, bytes) = every_file().swap_remove(which);
        let end = (bytes.len() as f64 * keep) as usize;
        prop_assert!(holds(parse(&bytes[..end], format)));
    }

    #[test]
    fn corrupt_bytes_never_panic(
        which in 0..8_usize,
        changes in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let (_, format, mut bytes) = every_file().swap_remove(which);
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        prop_assert!(holds(parse(&bytes, format)));
    }

    #[test]
    fn corrupt_digits_never_panic(which in 0..8_usize, at in any::<proptest::sample::Index>(), digit in b'0'..=b'9') {
        let (_, format, mut bytes) = every_file().swap_remove(which);
        let digits: Vec<usize> = (0..bytes.len()).filter(|i| bytes[*i].is_ascii_digit()).collect();
        if !digits.is_empty() {
            bytes[digits[at.index(digits.len())]] = digit;
        }
        prop_assert!(holds(parse(&bytes, format)));
    }
}
