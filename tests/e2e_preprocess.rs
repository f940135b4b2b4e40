//! `understudy preprocess` and `understudy average`: what they write lies on the scan, returns to it, and is the same
//! every time; bad files and places are refused.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests fail as tests do")]

mod common;

use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use common::{asset, finish, folder, james, names, obj_vertices, program};
use nalgebra::{Point2, Point3};
use understudy::{
    grid::{Raster, similarity_between},
    pipeline::read_canonical_face,
    scan::{BOSPHORUS_LANDMARKS, Mesh, Surface, read_landmarks, read_mesh},
    tracking::index,
};

fn preprocess(scan: &Path, more: &[&str], outputs: &[&Path]) -> Command {
    let mut command = program();
    command.arg("preprocess").arg(scan).args(more);
    for output in outputs {
        command.arg("-o").arg(output);
    }
    command
}

/// The largest distance of an OBJ's vertices from a surface.
fn farthest(obj: &Path, surface: &Surface) -> f64 {
    let off = |p: &[f64; 3]| (surface.nearest(Point3::from(*p)).unwrap().position - Point3::from(*p)).norm();
    obj_vertices(obj).iter().map(off).fold(0.0, f64::max)
}

fn landmark(file: &Path, number: usize) -> Point3<f64> {
    read_landmarks(file).unwrap().points[number].unwrap()
}

#[test]
fn the_grid_lies_on_the_scan_with_texture_and_landmarks() {
    let folder = folder();
    let (obj, png) = (folder.path().join("grid.obj"), folder.path().join("look.png"));
    let more = ["--grid", "60x80", "--texture", "256"];
    let run = finish(&mut preprocess(&james(), &more, &[&obj, &png])).succeeded();
    assert!(run.stdout.contains("60x80 points") && run.stdout.contains("on the face"), "{}", run.stdout);
    let files =
        ["grid.landmarks.json", "grid.mtl", "grid.obj", "grid.png", "grid.transform.json", "look.png"];
    assert_eq!(names(folder.path()), files);

    let surface = Surface::new(&read_mesh(&james()).unwrap()).unwrap();
    assert!(farthest(&obj, &surface) < 1e-6, "{}", farthest(&obj, &surface));
    let text = fs::read_to_string(&obj).unwrap();
    let corners: Vec<usize> =
        text.lines().filter(|l| l.starts_with("f ")).map(|l| l.split(' ').count() - 1).collect();
    assert!(corners.len() > 3000 && corners.iter().all(|count| *count == 4));
    let mesh = read_mesh(&obj).unwrap();
    for uv in &mesh.uvs {
        let places = [f64::from(uv[0]) * 59.0, f64::from(uv[1]) * 79.0];
        assert!(places.iter().all(|place| (place - place.round()).abs() < 1e-4), "{uv:?}");
    }
    let texture = mesh.materials[0].texture.clone().unwrap();
    let picture = image::load_from_memory(&texture.bytes).unwrap();
    assert_eq!(picture.width().max(picture.height()), 256);

    let landmarks = read_landmarks(&folder.path().join("grid.landmarks.json")).unwrap();
    assert_eq!(landmarks.points.len(), 478);
    let vertices = obj_vertices(&obj);
    for p in landmarks.points.iter().flatten() {
        let nearest = vertices.iter().map(|v| (Point3::from(*v) - p).norm()).fold(f64::MAX, f64::min);
        assert!(nearest < 1e-9, "a landmark is on no vertex");
    }

    let again = folder.path().join("again");
    fs::create_dir(&again).unwrap();
    finish(&mut preprocess(&james(), &more, &[&again.join("grid.obj"), &again.join("look.png")])).succeeded();
    for file in files {
        assert!(fs::read(folder.path().join(file)).unwrap() == fs::read(again.join(file)).unwrap(), "{file}");
    }
}

#[test]
fn a_normalised_face_has_the_average_faces_corners_and_returns() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let small = ["--grid", "50x50", "--texture", "64"];
    finish(&mut preprocess(&james(), &small, &[&at("own.obj")])).succeeded();
    let canonical = read_canonical_face(&asset("canonical_face")).unwrap();
    for (method, near) in [("affine", 1e-6), ("similarity", 15.0)] {
        let obj = at(&format!("{method}.obj"));
        let more = [&small[..], &["--normalise", method]].concat();
        let run = finish(&mut preprocess(&james(), &more, &[&obj])).succeeded();
        assert!(run.stdout.contains(&format!("normalised: {method}")), "{}", run.stdout);
        let file = obj.with_extension("landmarks.json");
        for number in [index::NOSE_TIP, index::LEFT_EYE_OUTER, index::RIGHT_EYE_OUTER, 199] {
            let wanted = canonical[number] - canonical[index::NOSE_TIP];
            let off = (landmark(&file, number).coords - wanted).norm();
            assert!(off < near, "{method}: landmark {number} is {off} mm off");
        }
        let record: serde_json::Value =
            serde_json::from_str(&fs::read_to_string(obj.with_extension("transform.json")).unwrap()).unwrap();
        assert_eq!(record["method"], method);

        let back = at("back.obj");
        let transform = obj.with_extension("transform.json");
        let undo = ["--undo", transform.to_str().unwrap()];
        finish(&mut preprocess(&obj, &undo, &[&back])).succeeded();
        for (a, b) in obj_vertices(&back).iter().zip(obj_vertices(&at("own.obj"))) {
            assert!((Point3::from(*a) - Point3::from(b)).norm() < 1e-6);
        }
    }
    // To an average face of one's own: the face itself, so that nothing is left to do but bring its nose to the origin.
    let own = at("own.obj");
    let more = [&small[..], &["--normalise", "affine", "--to", own.to_str().unwrap()]].concat();
    let run = finish(&mut preprocess(&james(), &more, &[&at("same.obj")])).succeeded();
    assert!(run.stdout.contains("scales 1.000, 1.000, 1.000"), "{}", run.stdout);
}

/// The scan james as a Bosphorus scan: a range image and 22 landmarks.
struct Bosphorus {
    bnt: PathBuf,
    lm3: PathBuf,
}

impl Bosphorus {
    fn of(mesh: &Mesh, landmarks: &Path, folder: &Path) -> Self {
        let mut text = "# 3D Facial Landmarks\r\n\r\n22 landmarks:\r\n".to_owned();
        let points = read_landmarks(landmarks).unwrap().points;
        for (name, number) in BOSPHORUS_LANDMARKS {
            if let Some(p) = number.and_then(|number| points[number]) {
                let _ = write!(text, "{name}\r\n{} {} {}\r\n", p.x, p.y, p.z);
            }
        }
        let lm3 = folder.join("face.lm3");
        fs::write(&lm3, text).unwrap();

        let middle = points[index::NOSE_TIP].unwrap().xy();
        let reach = (points[index::LEFT_EYE_OUTER].unwrap() - points[index::RIGHT_EYE_OUTER].unwrap()).norm();
        let corner = Point2::new(reach, 1.3 * reach).coords;
        let raster = Raster::new(180, 200, middle - corner, middle + corner).unwrap();
        let samples = raster.sample(&mesh.positions, (0..).zip(mesh.triangles.iter().copied()));
        let background = -1e9_f64;
        let mut bytes = [200_u16.to_le_bytes(), 180_u16.to_le_bytes()].concat();
        bytes.extend(background.to_le_bytes());
        bytes.extend(8_u16.to_le_bytes());
        bytes.extend(b"none.png");
        bytes.extend((5 * raster.len() as u32).to_le_bytes());
        for array in 0..5 {
            for (number, sample) in samples.iter().enumerate() {
                let (p, [u, v]) = (raster.at(number), raster.uv(number));
                let value = sample.map_or(background, |s| [p.x, p.y, s.depth, u, 1.0 - v][array]);
                bytes.extend(value.to_le_bytes());
            }
        }
        let bnt = folder.join("face.bnt");
        fs::write(&bnt, bytes).unwrap();
        Self { bnt, lm3 }
    }
}

#[test]
fn bosphorus_files_are_gridded() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let found = at("found.json");
    finish(program().arg("landmark").arg(james()).arg("-o").arg(&found)).succeeded();
    let mesh = read_mesh(&james()).unwrap();
    let files = Bosphorus::of(&mesh, &found, folder.path());
    let more = ["--landmarks", files.lm3.to_str().unwrap(), "--normalise", "affine", "--grid", "90x90"];
    let run = finish(&mut preprocess(&files.bnt, &more, &[&at("grid.obj")])).succeeded();
    assert!(run.stdout.contains("22 of 478 landmarks"), "{}", run.stdout);
    let landmarks = read_landmarks(&at("grid.landmarks.json")).unwrap();
    assert_eq!(landmarks.points.iter().flatten().count(), 22);
    let transform = at("grid.transform.json");
    let undo = ["--undo", transform.to_str().unwrap()];
    finish(&mut preprocess(&at("grid.obj"), &undo, &[&at("back.obj")])).succeeded();
    let off = farthest(&at("back.obj"), &Surface::new(&mesh).unwrap());
    // The range image rounds off what lies between its points, james' collar and hair most of all.
    assert!(off < 6.0, "{off}");
    // No texture beside it: then there is none.
    assert!(!at("grid.mtl").exists());
    // With it, what is above on the picture is above on the face, though this file counts b from the top.
    let red_above = |_, y: u32| image::Rgb(if y < 100 { [220, 30, 30] } else { [30, 30, 220] });
    image::RgbImage::from_fn(180, 200, red_above).save(at("none.png")).unwrap();
    finish(&mut preprocess(&files.bnt, &more, &[&at("coloured.obj")])).succeeded();
    let baked = image::open(at("coloured.png")).unwrap().into_rgb8();
    let (width, height) = baked.dimensions();
    let (above, below) =
        (baked.get_pixel(width / 2, height / 8).0, baked.get_pixel(width / 2, height * 7 / 8).0);
    assert!(above[0] > 150 && below[2] > 150, "{above:?} {below:?}");

    let noseless = fs::read_to_string(&files.lm3).unwrap().replace("22 landmarks:", "21 landmarks:");
    let (before_nose, after) = noseless.split_once("nose tip\r\n").unwrap();
    let (_, after_nose) = after.split_once("\r\n").unwrap();
    fs::write(at("noseless.lm3"), [before_nose, after_nose].concat()).unwrap();
    let noseless = at("noseless.lm3");
    let before = names(folder.path());
    let more = ["--landmarks", noseless.to_str().unwrap(), "--normalise", "affine"];
    finish(&mut preprocess(&files.bnt, &more, &[&at("none.obj")])).refused(&["face.bnt", "nose tip"]);
    assert_eq!(names(folder.path()), before);

    let whole = fs::read(&files.bnt).unwrap();
    fs::write(at("cut.bnt"), &whole[..whole.len() / 2]).unwrap();
    fs::write(at("counts.bnt"), [&[0xff; 4][..], &whole[4..]].concat()).unwrap();
    for (name, words) in [("cut.bnt", "has room for"), ("counts.bnt", "65535 x 65535")] {
        let more = ["--landmarks", files.lm3.to_str().unwrap()];
        finish(&mut preprocess(&at(name), &more, &[&at("none.obj")])).refused(&[name, words]);
    }
    assert!(!at("none.obj").exists());
}

#[test]
fn bad_places_and_options_are_refused_before_any_work() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let scan = james();
    finish(&mut preprocess(&scan, &[], &[&at("a.stl")])).refused(&["a.stl", ".obj or .png"]);
    finish(&mut preprocess(&scan, &[], &[&at("missing/a.obj")])).refused(&["missing"]);
    finish(&mut preprocess(&scan, &[], &[&scan])).refused(&["james.obj"]);
    finish(&mut preprocess(&scan, &[], &[&at("a.obj"), &at("a.png")])).refused(&["a.png", "twice"]);
    finish(&mut preprocess(&scan, &[], &[&at("my a.obj"), &at("my_a.png")])).refused(&["my_a.png", "twice"]);
    finish(&mut preprocess(&scan, &["--to", "x.obj"], &[&at("a.obj")])).refused(&["--normalise"]);
    finish(&mut preprocess(&at("none.obj"), &[], &[&at("a.obj")])).refused(&["none.obj"]);
    let to = ["--normalise", "affine", "--to", "/nonexistent/average.obj"];
    finish(&mut preprocess(&scan, &to, &[&at("a.obj")])).refused(&["average.landmarks.json"]);
    fs::write(at("odd.json"), "{}").unwrap();
    let odd = at("odd.json");
    let undo = ["--undo", odd.to_str().unwrap()];
    finish(&mut preprocess(&scan, &undo, &[&at("a.obj")])).refused(&["odd.json", "no transform"]);
    finish(program().arg("average").arg(&scan).arg("-o").arg(at("a.stl"))).refused(&["a.stl"]);
    finish(program().arg("average").arg(&scan).arg("-o").arg(&scan)).refused(&["james.obj"]);
    assert_eq!(names(folder.path()), ["odd.json"]);
}

#[test]
fn the_average_of_copies_is_the_scan() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let found = at("found.json");
    finish(program().arg("landmark").arg(james()).arg("-o").arg(&found)).succeeded();
    let text = fs::read_to_string(james()).unwrap();
    let copies = ["one.obj", "two.obj", "three.obj"].map(at);
    for copy in &copies {
        fs::write(copy, &text).unwrap();
        fs::copy(&found, copy.with_extension("landmarks.json")).unwrap();
    }
    let average = |scans: &[PathBuf], outputs: &[PathBuf]| {
        let mut command = program();
        command.arg("average").args(scans).args(["--grid", "60x60"]);
        for output in outputs {
            command.arg("-o").arg(output);
        }
        finish(&mut command).succeeded()
    };
    let run = average(&copies, &[at("average.obj"), at("spread.png")]);
    assert!(run.stdout.contains("mean 0.00 mm, at most 0.00 mm"), "{}", run.stdout);
    assert!(image::image_dimensions(at("spread.png")).unwrap().0 > 1500);
    average(&copies[..1], &[at("single.obj")]);
    let (many, single) = (obj_vertices(&at("average.obj")), obj_vertices(&at("single.obj")));
    assert!(many.len() > 2000 && many.len() == single.len());
    for (a, b) in many.iter().zip(single) {
        assert!((Point3::from(*a) - Point3::from(b)).norm() < 1e-6);
    }
    // Laid back by its landmarks, it lies on the scan.
    let (from, to): (Vec<_>, Vec<_>) = read_landmarks(&at("average.landmarks.json"))
        .unwrap()
        .points
        .iter()
        .zip(&read_landmarks(&found).unwrap().points)
        .filter_map(|(a, b)| Some(((*a)?, (*b)?)))
        .unzip();
    let back = similarity_between(&from, &to).unwrap();
    assert!((back.scaling() - 1.0).abs() < 1e-6);
    let surface = Surface::new(&read_mesh(&james()).unwrap()).unwrap();
    for vertex in &many {
        let place = back * Point3::from(*vertex);
        assert!((surface.nearest(place).unwrap().position - place).norm() < 1e-4);
    }
}
