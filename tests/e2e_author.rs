//! `understudy author`: an action that is known is measured as it is, and what cannot be measured is refused.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use common::{Run, asset, finish, folder, james, names, obj_vertices, program};
use nalgebra::{Point3, Vector3};
use tempfile::TempDir;
use understudy::{
    actions::{Action, ActionKey, ActionLibrary, Catalogue},
    export::write_library,
    scan::{LandmarkFile, Surface, read_landmarks, read_mesh, write_landmarks},
};

/// Reach of the smile, millimetres.
const REACH: f64 = 15.0;
/// How far a vector may be from the motion it was measured from, millimetres, of 7.3 at most.
const BY_MESH: f64 = 0.4;
const BY_SPLINE: f64 = 0.5;
/// At a corner of the mouth, where the networks look at two pictures.
const BY_NETWORKS: f64 = 4.5;

/// A folder with James' landmarks, and what a smile does to him. His scan lies in the scan frame, in millimetres.
struct Subject {
    folder: TempDir,
    scan: PathBuf,
    landmarks: Vec<Option<Point3<f64>>>,
}

impl Subject {
    fn new() -> Self {
        let (folder, scan) = (folder(), james());
        let place = folder.path().join("rest.json");
        finish(program().arg("landmark").arg(&scan).arg("-o").arg(&place)).succeeded();
        let landmarks = read_landmarks(&place).unwrap().points;
        Self { folder, scan, landmarks }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Where the handles lie on him.
    fn places(&self) -> Vec<Point3<f64>> {
        let surface = Surface::new(&read_mesh(&self.scan).unwrap()).unwrap();
        Catalogue::get().place(&self.landmarks, &surface).into_iter().map(Option::unwrap).collect()
    }

    /// The corners of the mouth drawn out, up and back.
    fn smile(&self, p: Point3<f64>, size: f64) -> Vector3<f64> {
        self.pull(61, p, -size) + self.pull(291, p, size)
    }

    fn pull(&self, corner: usize, p: Point3<f64>, size: f64) -> Vector3<f64> {
        let share = (-(p - self.landmarks[corner].unwrap()).norm_squared() / (2.0 * REACH * REACH)).exp();
        Vector3::new(5.0 * size, 5.0 * size.abs(), -2.0 * size.abs()) * share
    }

    /// The scan with its vertices moved.
    fn moved(&self, name: &str, by: impl Fn(Point3<f64>) -> Vector3<f64>) -> PathBuf {
        let mut vertices = obj_vertices(&self.scan).into_iter();
        let mut text = String::new();
        for line in fs::read_to_string(&self.scan).unwrap().lines() {
            if line.starts_with("v ") {
                let p = Point3::from(vertices.next().unwrap());
                let p = p + by(p);
                writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
            } else if !line.starts_with("mtllib") {
                writeln!(text, "{line}").unwrap();
            }
        }
        fs::write(self.at(name), text).unwrap();
        self.at(name)
    }

    /// The same with its vertices in another order and every 97th triangle left out.
    fn shuffled(&self, name: &str, by: impl Fn(Point3<f64>) -> Vector3<f64>) -> PathBuf {
        let mesh = read_mesh(&self.scan).unwrap();
        let count = mesh.positions.len();
        let stride = (1000..2000).find(|stride| gcd(*stride, count) == 1).unwrap();
        let mut text = String::new();
        for k in 0..count {
            let p = mesh.positions[k * stride % count];
            let p = p + by(p);
            writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
        }
        let mut number = vec![0; count];
        (0..count).for_each(|k| number[k * stride % count] = k + 1);
        for (_, triangle) in mesh.triangles.iter().enumerate().filter(|(k, _)| k % 97 != 0) {
            let [a, b, c] = triangle.map(|corner| number[corner as usize]);
            writeln!(text, "f {a} {b} {c}").unwrap();
        }
        fs::write(self.at(name), text).unwrap();
        self.at(name)
    }

    fn landmark_file(&self, name: &str, at: impl Fn(usize, Point3<f64>) -> Option<Point3<f64>>) -> PathBuf {
        let points = self.landmarks.iter().enumerate().map(|(i, p)| at(i, (*p)?));
        write_landmarks(&self.at(name), &LandmarkFile::new("", points.collect())).unwrap();
        self.at(name)
    }

    /// A library without actions, on his own face: vectors come back as they were measured.
    fn own_library(&self, name: &str) -> PathBuf {
        let middle = Vector3::x() * self.landmarks[1].unwrap().x;
        let mut library = ActionLibrary::built_in().empty("own");
        library.face = self.places().iter().map(|p| p - middle).collect();
        write_library(&self.at(name), &library).unwrap();
        self.at(name)
    }

    /// `author` with the neutral's landmarks, then `more`.
    fn author(&self, expressive: &Path, au: &str, library: &Path, more: &[&str]) -> Command {
        let mut command = program();
        command.arg("author").arg("--neutral").arg(&self.scan).arg("--expressive").arg(expressive);
        command.arg("--landmarks").arg(self.at("rest.json")).args(["--au", au]).arg("-o").arg(library);
        command.args(more);
        command
    }

    /// Farthest that the handles of one corner's half are from `size` times the smile; those beside the midline and
    /// on the other half must not be there.
    fn worst(&self, library: &ActionLibrary, action: &Action, size: f64) -> f64 {
        let places = self.places();
        let left = action.key.side == Some(understudy::lift::Side::Left);
        let mut worst: f64 = 0.0;
        for (handle, place) in places.iter().enumerate() {
            let outwards = if left { library.face[handle].x } else { -library.face[handle].x };
            let vector = action.vectors.iter().find(|v| v.handle == handle);
            if outwards < -8.0 {
                assert!(vector.is_none(), "handle {handle} lies on the other side and moves");
            } else if outwards > 8.0 {
                let vector = vector.map_or_else(Vector3::zeros, |v| v.vector);
                worst = worst.max((vector - self.smile(*place, size)).norm());
            }
        }
        worst
    }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

fn units(library: &ActionLibrary) -> String {
    library.actions.iter().map(|action| action.key.to_string()).collect::<Vec<_>>().join(" ")
}

fn both_sides(library: &ActionLibrary) -> [&Action; 2] {
    let keys = ActionKey::parse("12").unwrap();
    [library.get(keys[0]).unwrap(), library.get(keys[1]).unwrap()]
}

#[track_caller]
fn said(run: &Run, words: &[&str]) {
    for word in words {
        assert!(run.stdout.contains(word), "{word:?} is not in: {}", run.stdout);
    }
}

#[test]
fn a_smile_on_the_same_mesh_is_measured_as_it_is_and_further_ones_are_averaged() {
    let subject = Subject::new();
    let place = subject.own_library("own.json");
    let read = || ActionLibrary::read(&place).unwrap();
    let smile = subject.moved("smile.obj", |p| subject.smile(p, 1.0));
    let run = finish(&mut subject.author(&smile, "12", &place, &[])).succeeded();
    said(&run, &["584 of 584 points by the mesh", "7.3 mm, of", "AU12R from 1 pair, AU12L from 1 pair"]);
    let library = read();
    for action in both_sides(&library) {
        let worst = subject.worst(&library, action, 1.0);
        println!("AU{} by the mesh: {worst:.3} mm at most", action.key);
        assert!(worst < BY_MESH, "AU{}: {worst}", action.key);
        assert_eq!((action.pairs, action.source.as_str()), (1, "james to smile"));
        assert!(action.closure.iter().all(|closure| closure.abs() < 1e-9));
    }

    let half = subject.moved("half.obj", |p| subject.smile(p, 0.5));
    let run = finish(&mut subject.author(&half, "12", &place, &[])).succeeded();
    said(&run, &["AU12R from 2 pairs, AU12L from 2 pairs"]);
    let library = read();
    for action in both_sides(&library) {
        assert!(subject.worst(&library, action, 0.75) < BY_MESH);
        let corner = action.vectors.iter().max_by(|a, b| a.spread.total_cmp(&b.spread)).unwrap();
        assert!((corner.spread - 0.25 * 54_f64.sqrt()).abs() < BY_MESH, "{}", corner.spread);
        assert_eq!(action.source, "james to smile; james to half");
    }

    // Replaced on one side alone.
    let run = finish(&mut subject.author(&half, "12L", &place, &["--replace"])).succeeded();
    said(&run, &["AU12L from 1 pair; it has 12R, 12L"]);
    let library = read();
    let [right, left] = both_sides(&library);
    assert_eq!((right.pairs, left.pairs), (2, 1));
    assert!(subject.worst(&library, left, 0.5) < BY_MESH);
    assert_eq!(left.source, "james to half");

    // A library that begins is the built-in one's face; runs are alike, and quiet ones say nothing.
    let [first, second] = ["first.json", "second.json"].map(|name| subject.at(name));
    for place in [&first, &second] {
        let run = finish(&mut subject.author(&smile, "AU12L", place, &["--quiet"])).succeeded();
        assert_eq!(run.stdout, "");
    }
    assert_eq!(fs::read(&first).unwrap(), fs::read(&second).unwrap());
    let library = ActionLibrary::read(&first).unwrap();
    assert_eq!((units(&library), library.face.len()), ("12L".into(), Catalogue::get().handles()));
    let corner = library.actions[0].vectors.iter().find(|v| v.handle == 291).unwrap().vector;
    let wanted = subject.smile(subject.landmarks[291].unwrap(), 1.0);
    println!("on the average face: {corner:?} of {wanted:?}, {:.1}°", corner.angle(&wanted).to_degrees());
    assert!(corner.angle(&wanted) < 15_f64.to_radians());
    assert!((0.75..1.35).contains(&(corner.norm() / wanted.norm())));
}

#[test]
fn a_smile_on_another_mesh_is_carried_by_the_landmark_spline() {
    let subject = Subject::new();
    let place = subject.own_library("own.json");
    let shift = Vector3::new(4.0, -3.0, 6.0);
    let smile = subject.shuffled("smile.obj", |p| subject.smile(p, 1.0) + shift);
    let moved = |p| p + subject.smile(p, 1.0) + shift;
    let all = subject.landmark_file("all.json", |_, p| Some(moved(p)));
    let run =
        finish(subject.author(&smile, "12", &place, &[]).arg("--expressive-landmarks").arg(&all)).succeeded();
    said(&run, &["by the spline of 468 common landmarks and the expressive surface", "584 of 584"]);
    let library = ActionLibrary::read(&place).unwrap();
    for action in both_sides(&library) {
        let worst = subject.worst(&library, action, 1.0);
        println!("AU{} by the spline: {worst:.3} mm at most", action.key);
        assert!(worst < BY_SPLINE, "AU{}: {worst}", action.key);
    }

    // Landmarks of one scan alone are left out, and said.
    let some = subject
        .landmark_file("some.json", |i, p| Some(moved(p)).filter(|_| i != 7 && !(20..23).contains(&i)));
    let run =
        finish(subject.author(&smile, "12", &place, &["--replace"]).arg("--expressive-landmarks").arg(&some))
            .succeeded();
    said(&run, &["464 common landmarks", "left out: 7, 20-22", "580 of 584"]);
    let library = ActionLibrary::read(&place).unwrap();
    assert!(both_sides(&library).iter().all(|action| subject.worst(&library, action, 1.0) < BY_SPLINE));

    // Without files, by what the networks find on both textured scans.
    for file in ["james_mtl", "james_jpg"].map(asset) {
        fs::copy(&file, subject.at(file.file_name().unwrap().to_str().unwrap())).unwrap();
    }
    let textured = fs::read_to_string(subject.moved("textured.obj", |p| subject.smile(p, 1.0))).unwrap();
    let holed: Vec<_> = textured
        .lines()
        .enumerate()
        .filter(|(k, line)| !(line.starts_with("f ") && k % 97 == 0))
        .map(|(_, line)| line)
        .collect();
    let material = "mtllib ./james.obj.mtl";
    fs::write(subject.at("textured.obj"), format!("{material}\n{}\n", holed.join("\n"))).unwrap();
    let run = finish(
        program()
            .arg("author")
            .arg("--neutral")
            .arg(&subject.scan)
            .arg("--expressive")
            .arg(subject.at("textured.obj"))
            .args(["--replace", "--au", "12", "-o"])
            .arg(&place),
    )
    .succeeded();
    said(&run, &["common landmarks", "AU12R from 1 pair"]);
    run.warned(&["as no expression does"]);
    let library = ActionLibrary::read(&place).unwrap();
    for (action, corner) in both_sides(&library).into_iter().zip([61, 291]) {
        let vector = action.vectors.iter().find(|v| v.handle == corner).unwrap().vector;
        let off = (vector - subject.smile(subject.landmarks[corner].unwrap(), 1.0)).norm();
        println!("AU{} by the networks: {off:.1} mm off at the corner", action.key);
        assert!(off < BY_NETWORKS, "AU{}: {vector:?}", action.key);
    }
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let subject = Subject::new();
    let smile = subject.moved("smile.obj", |p| subject.smile(p, 1.0));
    let library = subject.at("library.json");
    let refused = |expressive: &Path, au: &str, output: &Path, more: &[&str], words: &[&str]| {
        finish(&mut subject.author(expressive, au, output, more)).refused(words);
    };
    refused(&smile, "99", &library, &[], &["\"99\"", "Known: 1, 2"]);
    refused(&smile, "17L", &library, &[], &["AU17", "no sides"]);
    refused(&subject.at("none.obj"), "12", &library, &[], &["none.obj"]);
    refused(&subject.scan, "12", &library, &[], &["james.obj", "two scans"]);
    refused(&smile, "12", &subject.at("library.txt"), &[], &["library.txt", ".json"]);
    refused(&smile, "12", &subject.at("missing/library.json"), &[], &["missing"]);
    refused(&smile, "12", &subject.at("rest.json"), &[], &["rest.json", "another name"]);
    fs::write(subject.at("other.json"), "{\"format\":\"something\"}").unwrap();
    refused(&smile, "12", &subject.at("other.json"), &[], &["other.json", "understudy author"]);
    fs::write(subject.at("broken.obj"), "v 0 0 nan\n").unwrap();
    refused(&subject.at("broken.obj"), "12", &library, &[], &["broken.obj"]);
    refused(&smile, "12", &library, &["--expressive-landmarks", "none.pts"], &["none.pts"]);

    // The same expression elsewhere; and one side that does not act.
    let same = subject.moved("same.obj", |p| Vector3::new(1.0, 2.0, 3.0) + p.coords * 1e-5);
    refused(&same, "12", &library, &[], &["AU12", "same expression"]);
    refused(&same, "26", &library, &[], &["AU26", "same expression", "0.2 mm"]);
    let left = subject.moved("left.obj", |p| subject.pull(291, p, 1.0));
    let place = subject.at("left.json");
    let run = finish(&mut subject.author(&left, "12", &place, &[])).succeeded();
    run.warned(&["the side of AU12R moves", "--au 12L"]);
    let run = finish(&mut subject.author(&left, "12L", &place, &["--replace"])).succeeded();
    assert!(!run.stderr.contains("12R"), "{}", run.stderr);

    // Landmarks that carry nothing.
    let shuffled = subject.shuffled("shuffled.obj", |p| subject.smile(p, 1.0));
    let given = |landmarks: &Path, expressive: &Path, words: &[&str]| {
        let mut command = program();
        command.arg("author").arg("--neutral").arg(&subject.scan).arg("--expressive").arg(&shuffled);
        command.arg("--landmarks").arg(landmarks).arg("--expressive-landmarks").arg(expressive);
        command.args(["--unit", "mm", "--au", "12", "-o"]).arg(&library);
        finish(&mut command).refused(words);
    };
    let rest = subject.at("rest.json");
    let few = subject.landmark_file("few.json", |i, p| Some(p).filter(|_| i % 50 == 0));
    given(&rest, &few, &["only 10 landmarks", "--expressive-landmarks"]);
    let flat = subject.landmark_file("flat.json", |_, p| Some(Point3::new(p.x, p.y, 0.0)));
    given(&flat, &flat, &["spline", "in one plane"]);
    let heap = subject.landmark_file("heap.json", |_, _| Some(Point3::new(1.0, 2.0, 3.0)));
    given(&heap, &heap, &["spline", "in one place"]);
    let small = subject.landmark_file("small.json", |_, p| Some(p * 0.1));
    given(&rest, &small, &["eyes", "not one face"]);

    assert!(!library.exists());
    assert!(names(subject.folder.path()).iter().all(|name| !name.contains("partial")));
}
