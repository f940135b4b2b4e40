//! `understudy compare` run as a user runs it, on a real scan.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use common::{finish, folder, james, names, obj_vertices, program};

fn compare(neutral: &Path, predicted: &Path, truth: &Path, outputs: &[&Path]) -> Command {
    let mut command = program();
    command.arg("compare").arg("--neutral").arg(neutral);
    command.arg("--predicted").arg(predicted).arg("--truth").arg(truth);
    for output in outputs {
        command.arg("-o").arg(output);
    }
    command
}

/// The scan with its vertices moved, and further lines at the end.
fn moved(scan: &Path, path: PathBuf, by: impl Fn([f64; 3]) -> [f64; 3], more: &str) -> PathBuf {
    let mut vertices = obj_vertices(scan).into_iter();
    let mut text = String::new();
    for line in fs::read_to_string(scan).unwrap().lines() {
        if line.starts_with("v ") {
            let p = vertices.next().unwrap();
            let d = by(p);
            writeln!(text, "v {} {} {}", p[0] + d[0], p[1] + d[1], p[2] + d[2]).unwrap();
        } else {
            writeln!(text, "{line}").unwrap();
        }
    }
    text.push_str(more);
    fs::write(&path, text).unwrap();
    path
}

/// The rows of a table by their first cell.
fn row(table: &str, name: &str) -> Vec<String> {
    let line = table.lines().find(|line| line.starts_with(&format!("{name},"))).unwrap();
    line.split(',').map(str::to_owned).collect()
}

fn number(cells: &[String], column: usize) -> f64 {
    cells[column].parse().unwrap()
}

/// How far the file's unit is from millimetres is not known here; ratios are.
#[test]
fn a_scan_is_measured_part_by_part() {
    let (folder, scan) = (folder(), james());
    let at = |name: &str| folder.path().join(name);
    let truth = moved(&scan, at("truth.obj"), |_| [0.0, 0.0, 0.4], "");
    let half = moved(&scan, at("half.obj"), |_| [0.0, 0.0, 0.2], "");
    let (png, csv) = (at("error.png"), at("errors.csv"));
    let run = finish(compare(&scan, &half, &truth, &[&png, &csv]).args(["--unit", "mm"])).succeeded();
    assert!(run.stdout.contains("vertex to vertex") && run.stdout.contains("| whole |"), "{}", run.stdout);
    let table = fs::read_to_string(&csv).unwrap();
    for name in ["whole", "forehead", "brows", "lids", "nose", "cheeks", "lips", "jaw", "outline"] {
        let cells = row(&table, name);
        assert_eq!(cells[1], "vertex");
        for (column, wanted) in [(3, 0.2), (4, 0.2), (5, 0.2), (6, 0.2), (7, 0.4), (8, 0.5)] {
            assert!((number(&cells, column) - wanted).abs() < 1e-4, "{name}: {cells:?}");
        }
    }
    let (width, height) = image::image_dimensions(&png).unwrap();
    assert!(width > 1500 && height > 1000, "{width} x {height}");
    // The error's colours are in the picture: 0.2 mm is the largest shown, which is yellow.
    let picture = image::open(&png).unwrap().into_rgba8();
    let yellow = |p: &image::Rgba<u8>| p[0] > 150 && p[1] > 150 && p[2] < 90;
    assert!(picture.pixels().filter(|p| yellow(p)).count() > 50_000);

    let everything = finish(compare(&scan, &half, &truth, &[&csv]).arg("--all")).succeeded();
    assert!(everything.stdout.contains("| elsewhere |"), "{}", everything.stdout);
    let whole: usize = row(&fs::read_to_string(&csv).unwrap(), "whole")[2].parse().unwrap();
    assert_eq!(whole, obj_vertices(&scan).len());

    let perfect = finish(&mut compare(&scan, &truth, &truth, &[&csv])).succeeded();
    assert!(!perfect.stderr.contains("warn"), "{}", perfect.stderr);
    let cells = row(&fs::read_to_string(&csv).unwrap(), "whole");
    assert!(number(&cells, 6) == 0.0 && number(&cells, 8) == 0.0, "{cells:?}");
    assert_eq!(names(folder.path()), ["error.png", "errors.csv", "half.obj", "truth.obj"]);
}

/// Landmarks that are given are used as those that are found.
#[test]
fn landmarks_from_a_file_give_the_same_figures() {
    let (folder, scan) = (folder(), james());
    let at = |name: &str| folder.path().join(name);
    let truth = moved(&scan, at("truth.obj"), |p| [0.0, 0.01 * p[0], 0.02 * p[1]], "");
    let landmarks = at("james.landmarks.json");
    finish(program().arg("landmark").arg(&scan).arg("-o").arg(&landmarks)).succeeded();
    let (found, given) = (at("found.csv"), at("given.csv"));
    finish(&mut compare(&scan, &scan, &truth, &[&found])).succeeded();
    finish(compare(&scan, &scan, &truth, &[&given]).arg("--landmarks").arg(&landmarks)).succeeded();
    let table = fs::read_to_string(&found).unwrap();
    assert!(table == fs::read_to_string(&given).unwrap() && table.lines().count() == 10, "{table}");
    for line in table.lines().skip(1) {
        assert!(line.ends_with(",1.000000"), "doing nothing is worth 1: {line}");
    }
}

#[test]
fn a_truth_of_another_topology_is_measured_to_its_surface() {
    let (folder, scan) = (folder(), james());
    let at = |name: &str| folder.path().join(name);
    // One more triangle far behind the head makes it another mesh with the same face.
    let more = "v 0 0 -900\nv 1 0 -900\nv 0 1 -900\nf -1 -2 -3\n";
    let truth = moved(&scan, at("truth.obj"), |_| [0.0; 3], more);
    let csv = at("errors.csv");
    let run = finish(&mut compare(&scan, &scan, &truth, &[&csv])).succeeded();
    assert!(run.stdout.contains("truth's surface"), "{}", run.stdout);
    let cells = row(&fs::read_to_string(&csv).unwrap(), "whole");
    assert!(cells[1] == "surface" && number(&cells, 6) < 1e-6 && cells[8].is_empty(), "{cells:?}");
}

#[test]
fn a_mesh_without_a_face_is_measured_as_a_whole() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let sheet = |name: &str, z: f64| {
        fs::write(at(name), format!("v 0 0 {z}\nv 200 0 {z}\nv 0 200 {z}\nf 1 2 3\n")).unwrap();
        at(name)
    };
    let (neutral, truth, predicted) = (sheet("n.obj", 0.0), sheet("t.obj", 4.0), sheet("p.obj", 3.0));
    let csv = at("errors.csv");
    let run = finish(&mut compare(&neutral, &predicted, &truth, &[&csv])).succeeded();
    run.warned(&["no face was found", "n.obj", "millimetres"]);
    let table = fs::read_to_string(&csv).unwrap();
    assert_eq!(table.lines().count(), 2);
    assert!((number(&row(&table, "whole"), 8) - 0.25).abs() < 1e-6, "{table}");

    let far = sheet("far.obj", 5000.0);
    finish(compare(&neutral, &far, &truth, &[]).args(["--unit", "cm"]))
        .succeeded()
        .warned(&["far.obj", "unit"]);
    fs::write(at("tiny.obj"), "v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n").unwrap();
    let tiny = at("tiny.obj");
    finish(&mut compare(&tiny, &tiny, &tiny, &[])).refused(&["tiny.obj", "--unit"]);
}

#[test]
fn what_does_not_fit_is_refused_with_its_name_and_leaves_nothing() {
    let (folder, scan) = (folder(), james());
    let at = |name: &str| folder.path().join(name);
    fs::write(at("other.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    fs::write(at("broken.obj"), "v 0 0 nan\n").unwrap();
    let (other, broken, csv) = (at("other.obj"), at("broken.obj"), at("e.csv"));
    finish(&mut compare(&scan, &other, &scan, &[&csv])).refused(&["other.obj", "3 vertices", "james.obj"]);
    finish(&mut compare(&scan, &broken, &scan, &[&csv])).refused(&["broken.obj"]);
    finish(&mut compare(&scan, &scan, &broken, &[&csv])).refused(&["broken.obj"]);
    finish(&mut compare(&scan, &scan, &at("none.obj"), &[&csv])).refused(&["none.obj"]);
    finish(&mut compare(&at("none.obj"), &scan, &scan, &[&csv])).refused(&["none.obj"]);
    finish(&mut compare(&scan, &scan, &scan, &[&at("e.txt")])).refused(&["e.txt", ".png or .csv"]);
    finish(&mut compare(&scan, &scan, &scan, &[&at("missing/e.csv")])).refused(&["missing"]);
    finish(compare(&scan, &scan, &scan, &[&csv]).args(["--landmarks", other.to_str().unwrap()]))
        .refused(&["other.obj"]);
    assert_eq!(names(folder.path()), ["broken.obj", "other.obj"]);
}
