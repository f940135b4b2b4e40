//! Scans that cannot be used are refused in one sentence that names the file and what to do; odd but usable ones are
//! taken.

#![allow(clippy::panic, clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
};

use common::{Run, animate, finish, folder, james, names, obj_vertices, short_clip};
use understudy::export::Pc2Reader;

struct Bench {
    folder: tempfile::TempDir,
    clip: PathBuf,
}

impl Bench {
    fn new() -> Self {
        let folder = folder();
        let clip = short_clip(folder.path(), 0.4);
        fs::create_dir(folder.path().join("out")).unwrap();
        Self { folder, clip }
    }

    fn scan(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.folder.path().join(name);
        fs::write(&path, content).unwrap();
        path
    }

    fn cache(&self) -> PathBuf {
        self.folder.path().join("out/motion.pc2")
    }

    fn animate(&self, scan: &Path, more: &[&str]) -> Run {
        finish(&mut animate(&self.clip, scan, &[&self.cache()], more))
    }

    #[track_caller]
    fn refuses(&self, scan: &Path, words: &[&str]) {
        let name = scan.file_name().unwrap().to_str().unwrap();
        self.animate(scan, &[]).refused(words).refused(&[name]);
        assert!(names(&self.folder.path().join("out")).is_empty(), "{name} left something behind");
    }
}

/// A box of 10 cm.
fn cube() -> String {
    let mut text = String::new();
    for corner in 0..8 {
        let side = |bit: i32| if corner & bit == 0 { -50 } else { 50 };
        let _ = writeln!(text, "v {} {} {}", side(1), side(2), side(4));
    }
    for [a, b, c, d] in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
        let _ = writeln!(text, "f {a} {b} {c} {d}");
    }
    text
}

#[test]
fn files_that_are_no_scans() {
    let bench = Bench::new();
    bench.refuses(&bench.folder.path().join("missing.obj"), &["No such file", "Check the path"]);
    bench.refuses(&bench.scan("empty.obj", ""), &["is empty", "export the file again"]);
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let nan = "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n";
    bench.refuses(&bench.scan("nan.obj", nan), &["vertex 1", "NaN", "Remove broken vertices"]);
    let range = format!("{triangle}f 1 2 9\n");
    bench.refuses(&bench.scan("range.obj", range), &["triangle 0", "vertex 8", "only 3"]);
    bench.refuses(&bench.scan("points.obj", triangle), &["no triangle", "meshed first"]);
    bench.refuses(&bench.scan("noise.glb", [7_u8; 300]), &["noise.glb"]);
    bench.refuses(
        &bench.scan("scan.xyz", cube()),
        &["\".xyz\"", ".obj, .ply, .stl, .glb, .gltf", "Convert it"],
    );
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 5000000\nproperty float x\nproperty float y\n\
                  property float z\nelement face 10\nproperty list uchar int vertex_indices\nend_header\nabc";
    bench.refuses(&bench.scan("huge.ply", header), &["5000000 vertices", "at most 4000000", "Decimate"]);
    let short = header.replace("5000000", "3000000");
    bench.refuses(&bench.scan("short.ply", short), &["short.ply"]);
}

#[test]
fn a_box_has_no_face() {
    let bench = Bench::new();
    bench.refuses(&bench.scan("cube.obj", cube()), &["no face was found", "--landmarks"]);
}

#[test]
fn landmark_files_that_do_not_fit() {
    let bench = Bench::new();
    let few = bench.scan("few.pts", "version: 1\nn_points: 2\n{\n1 2 3\n4 5 6\n}\n");
    let scan = james();
    for (file, words) in [(few, "few.pts"), (bench.folder.path().join("none.json"), "none.json")] {
        bench.animate(&scan, &["--landmarks", file.to_str().unwrap()]).refused(&[words]);
        assert!(names(&bench.folder.path().join("out")).is_empty());
    }
}

/// A face with a second part behind it, a third triangle on an edge, a triangle without area and a vertex of no
/// triangle: as scans come.
#[test]
fn a_scan_of_several_parts_is_taken_as_it_is() {
    let bench = Bench::new();
    let original = james();
    let mut text = fs::read_to_string(&original).unwrap();
    let count = obj_vertices(&original).len();
    for vertex in ["-20 0 -150", "20 0 -150", "0 30 -150", "0 0 -160", "0 60 -140"] {
        let _ = write!(text, "\nv {vertex}");
    }
    let [a, b, c, d] = [1, 2, 3, 4].map(|i| count + i);
    let _ = write!(text, "\nf {a} {b} {c}\nf {a} {b} {d}\nf {b} {a} 1\nf {a} {a} {b}\nf 10 10 11\n");
    let scan = bench.scan("parts.obj", text);
    bench.animate(&scan, &[]).succeeded();
    let mut cache = Pc2Reader::open(&bench.cache()).unwrap();
    // What belongs to no face is still there, before everything that was added, and nothing moves it far.
    let mut sample = Vec::new();
    cache.read_sample(0, &mut sample).unwrap();
    assert!(sample.len() > count + 5);
    for (found, wanted) in sample[count..].iter().zip([[-20.0_f32, 0.0, -150.0], [20.0, 0.0, -150.0]]) {
        let away = (0..3).map(|k| (found[k] - wanted[k]).powi(2)).sum::<f32>().sqrt();
        assert!(away < 5.0, "{found:?} for {wanted:?}");
    }
}
