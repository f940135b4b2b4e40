//! `understudy express`: action units go in, every output comes out, the neutral is the scan's own, mistakes are refused.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use common::{finish, folder, gltf_validator, james, names, obj_vertices, probe, program};
use understudy::export::Pc2Reader;

fn express(scan: &Path, outputs: &[&Path], more: &[&str]) -> Command {
    let mut command = program();
    command.arg("express").arg("--target").arg(scan);
    for output in outputs {
        command.arg("-o").arg(output);
    }
    command.args(more);
    command
}

/// The vertices' indices of an OBJ's faces, from 1.
fn obj_faces(path: &Path) -> Vec<Vec<u32>> {
    let corner = |text: &str| text.split('/').next().unwrap().parse().unwrap();
    let text = fs::read_to_string(path).unwrap();
    let faces = text.lines().filter_map(|line| line.strip_prefix("f "));
    faces.map(|line| line.split_whitespace().map(corner).collect()).collect()
}

/// The farthest that any of the scan's own vertices has gone, in the file's unit.
fn farthest(scan: &[[f64; 3]], moved: &[[f64; 3]]) -> f64 {
    let distance = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    scan.iter().zip(moved).map(distance).fold(0.0, f64::max)
}

#[test]
fn one_expression_becomes_every_output() {
    let folder = folder();
    let paths: Vec<PathBuf> =
        ["x.obj", "x.png", "x.glb", "x.pc2", "x.mp4"].map(|name| folder.path().join(name)).to_vec();
    let outputs: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    let scan = james();
    let more = ["--au", "12=0.8", "--emotion", "surprise=0.5", "--size", "320x240", "--fps", "10"];
    let run = finish(&mut express(&scan, &outputs, &more)).succeeded();
    for name in ["x.glb", "x.mp4", "x.obj", "x.pc2", "x.png"] {
        assert!(run.stdout.contains(name), "{name} is not announced: {}", run.stdout);
        assert!(names(folder.path()).iter().any(|found| found == name), "{name} is not there");
    }
    let rest = obj_vertices(&scan);
    let moved = obj_vertices(&paths[0]);
    assert!(moved.len() > rest.len(), "mouth and eyes are missing");
    let far = farthest(&rest, &moved);
    assert!((3.0..40.0).contains(&far), "a vertex goes {far} mm");

    assert_eq!(image::image_dimensions(&paths[1]).unwrap(), (320, 240));

    let (document, ..) = gltf::import(&paths[2]).unwrap();
    assert_eq!(document.animations().count(), 1);
    let has_morphs = |mesh: gltf::Mesh<'_>| mesh.primitives().any(|part| part.morph_targets().len() > 0);
    assert!(document.meshes().any(has_morphs));
    if let Some(validator) = gltf_validator::validator() {
        gltf_validator::validate(&validator, &paths[2..3]);
    }

    // 2.4 s of coming, staying and going, both ends included: neutral, full in the middle, neutral.
    let mut cache = Pc2Reader::open(&paths[3]).unwrap();
    assert_eq!((cache.samples(), cache.points()), (25, moved.len()));
    let mut sample = Vec::new();
    let mut at = |index| {
        cache.read_sample(index, &mut sample).unwrap();
        sample.iter().map(|place| place.map(f64::from)).collect::<Vec<_>>()
    };
    let [first, middle, last] = [0, 12, 24].map(&mut at);
    let [first, last] = [first, last].map(|sample| farthest(&rest, &sample));
    // Opened, the cuts have moved some vertices along the surface.
    assert!(
        (first - last).abs() < 1e-9 && first < 6.0,
        "the film begins {first} mm and ends {last} mm from the neutral"
    );
    assert!(farthest(&moved, &middle) < 1e-3, "the film's middle is not the expression");
    assert_eq!(probe(&paths[4], "v", "stream=width,height,nb_read_packets"), ["320,240,25"]);
}

#[test]
fn magnitude_zero_is_the_neutral_byte_for_byte() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let scan = james();
    let write = |name: &str, more: &[&str]| {
        finish(&mut express(&scan, &[&at(name)], more)).succeeded();
        let text = fs::read_to_string(at(name)).unwrap();
        // The material's file is named after the OBJ.
        text.lines().filter(|line| !line.starts_with("mtllib")).collect::<Vec<_>>().join("\n")
    };
    let nothing = write("nothing.obj", &[]);
    assert!(nothing == write("zero.obj", &["--au", "12=0"]), "12=0 is not the neutral");
    assert!(nothing == write("none.obj", &["--emotion", "anger=0"]), "anger=0 is not the neutral");
    assert!(nothing != write("little.obj", &["--au", "12=0.1"]), "12=0.1 is the neutral");
}

#[test]
fn a_scan_left_as_it_was_keeps_its_vertices_and_triangles() {
    let folder = folder();
    let out = folder.path().join("out.obj");
    let scan = james();
    let more = ["--as-scanned", "--au", "12=0"];
    finish(&mut express(&scan, &[&out], &more)).succeeded();
    assert!(obj_vertices(&scan) == obj_vertices(&out), "coordinates differ");
    assert_eq!(obj_faces(&scan).len(), obj_faces(&out).len());
    assert!(obj_faces(&scan) == obj_faces(&out), "triangles differ");
    finish(&mut express(&scan, &[&out], &["--as-scanned", "--au", "12L=0.7"])).succeeded();
    let (rest, moved) = (obj_vertices(&scan), obj_vertices(&out));
    assert!(rest.len() == moved.len() && obj_faces(&scan) == obj_faces(&out));
    // What the smile does not reach keeps its numbers.
    let kept = rest.iter().zip(&moved).filter(|(a, b)| a.map(f64::to_bits) == b.map(f64::to_bits)).count();
    println!("{kept} of {} vertices keep their numbers", rest.len());
    assert!(kept > 0 && farthest(&rest, &moved) > 3.0);
}

#[test]
fn published_and_other_methods_give_other_faces() {
    let folder = folder();
    let scan = james();
    let mut seen: Vec<Vec<[f64; 3]>> = Vec::new();
    for (number, more) in [
        &["--au", "12"][..],
        &["--au", "12", "--warp", "spline"],
        &["--au", "12", "--preset", "thesis"],
        &["--au", "12", "--transfer", "copy"],
        &["--au", "12", "--au", "6", "--merge", "sum"],
        &["--au", "12", "--au", "6"],
    ]
    .into_iter()
    .enumerate()
    {
        let out = folder.path().join(format!("{number}.obj"));
        finish(&mut express(&scan, &[&out], more)).succeeded();
        let moved = obj_vertices(&out);
        assert!(farthest(&obj_vertices(&scan), &moved) > 5.0, "{more:?} moves nothing");
        for other in &seen {
            assert!(farthest(other, &moved) > 0.1, "{more:?} does what another does");
        }
        seen.push(moved);
    }
}

#[test]
fn mistakes_are_refused_with_what_to_do() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let scan = james();
    let out = at("x.obj");
    let refused = |more: &[&str], words: &[&str]| {
        finish(&mut express(&scan, &[&out], more)).refused(words);
    };
    refused(&["--au", "99"], &["99", "Known", "12"]);
    refused(&["--au", "17L"], &["AU17", "no sides", "write 17 alone"]);
    refused(&["--au", "12=1.5"], &["1.5", "12", "0 to 1"]);
    refused(&["--au", "12=much"], &["12", "0 to 1"]);
    refused(&["--emotion", "bliss"], &["bliss", "happiness"]);
    refused(&["--emotion", "anger=2"], &["2", "0 to 1"]);
    let missing = at("none.json");
    refused(&["--from", missing.to_str().unwrap()], &["none.json", "understudy author"]);
    fs::write(at("broken.json"), "{\"format\":\"understudy actions 1\"}").unwrap();
    refused(&["--from", at("broken.json").to_str().unwrap()], &["broken.json", "understudy author"]);
    finish(&mut express(&scan, &[&scan], &[])).refused(&["james.obj"]);
    finish(&mut express(&scan, &[&at("x.stl")], &[])).refused(&["x.stl", ".obj"]);
    finish(&mut express(&scan, &[&at("missing/x.obj")], &[])).refused(&["missing"]);
    finish(&mut express(&at("none.obj"), &[&out], &[])).refused(&["none.obj"]);
    assert_eq!(names(folder.path()), ["broken.json"]);
    assert!(obj_vertices(&scan).len() > 1000, "the scan is gone");
}
