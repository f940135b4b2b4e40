//! `understudy muscles` through the binary: shapes on a scan, written, sculpted, read again.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use std::{fs, path::Path, process::Command};

use understudy::{
    assets::Assets,
    muscle::MuscleBasis,
    scan::{read_mesh, read_morphs},
};

fn james() -> std::path::PathBuf {
    let assets = Assets::locate().unwrap();
    for companion in ["james_mtl", "james_jpg"] {
        assets.verified(companion).unwrap();
    }
    assets.verified("james_obj").unwrap()
}

/// Exit status and what was said, both streams.
fn muscles(arguments: &[&Path]) -> (bool, String) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_understudy")).arg("muscles").args(arguments).output().unwrap();
    let said =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    (output.status.success(), said)
}

#[test]
fn shapes_are_written_sculpted_and_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (scan, sculpts, glb, sheet) = (james(), at("sculpts"), at("shapes.glb"), at("sheet.png"));
    let [target, output, basis] = ["--target", "-o", "--basis"].map(Path::new);
    let (done, said) =
        muscles(&[target, &scan, output, &sculpts, output, &glb, output, &sheet, Path::new("--as-scanned")]);
    assert!(done && said.contains("16 muscles"), "{said}");
    assert!(image::open(&sheet).unwrap().width() > 1000);

    let neutral = read_mesh(&sculpts.join("neutral.obj")).unwrap();
    let smile = read_mesh(&sculpts.join("zygomatic_major_left.obj")).unwrap();
    let scanned = read_mesh(&scan).unwrap();
    assert_eq!(neutral.positions.len(), scanned.positions.len());
    let longest = neutral.positions.iter().zip(&smile.positions).map(|(a, b)| (b - a).norm());
    assert!((4.0..30.0).contains(&longest.fold(0.0, f64::max)));
    let (_, morphs) = read_morphs(&glb).unwrap();
    assert!(morphs.iter().map(|morph| morph.name.as_str()).eq(MuscleBasis::sixteen().names()));

    // An artist doubles one muscle; the others stay.
    let mut doubled = smile.clone();
    for (moved, rest) in doubled.positions.iter_mut().zip(&neutral.positions) {
        *moved = rest + (*moved - rest) * 2.0;
    }
    understudy::export::write_obj(&sculpts.join("zygomatic_major_left.obj"), &doubled).unwrap();
    // The network needs the texture to find the neutral's landmarks.
    let landmarks = at("mine.json");
    let (done, said) =
        muscles(&[target, &scan, basis, &sculpts, output, &landmarks, Path::new("--as-scanned")]);
    assert!(done, "{said}");
    let mine = MuscleBasis::read(&landmarks).unwrap();
    let reach =
        |basis: &MuscleBasis, name: &str| basis.elements[basis.index(name).unwrap()].vectors[291].norm();
    let drawn = MuscleBasis::sixteen();
    let ratio = |name: &str| reach(&mine, name) / reach(drawn, name);
    let (left, jaw) = (ratio("zygomatic_major_left"), ratio("jaw_rotation"));
    assert!((1.5..2.6).contains(&left) && (0.7..1.4).contains(&jaw), "{left} {jaw}");

    // The same from the morph targets.
    let from_glb = at("glb.json");
    let (done, said) = muscles(&[target, &scan, basis, &glb, output, &from_glb]);
    assert!(done, "{said}");
    assert_eq!(MuscleBasis::read(&from_glb).unwrap().elements.len(), 16);
}

#[test]
fn sculpts_that_cannot_be_used_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let scan = james();
    let [target, output, basis] = ["--target", "-o", "--basis"].map(Path::new);
    let refused = |given: &Path, wanted: &[&str]| {
        let (done, said) = muscles(&[target, &scan, basis, given, output, &at("x.json")]);
        assert!(!done && wanted.iter().all(|word| said.contains(word)), "{said}");
        assert!(!said.contains("panicked") && !at("x.json").exists());
    };
    let empty = at("empty");
    fs::create_dir(&empty).unwrap();
    refused(&empty, &["neutral.obj"]);
    fs::write(empty.join("neutral.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    refused(&empty, &["no muscle"]);
    fs::write(empty.join("smile.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 3 4\n").unwrap();
    refused(&empty, &["smile.obj", "4 vertices", "has 3"]);
    refused(&at("nowhere.glb"), &["nowhere.glb"]);
    refused(&at("nowhere.json"), &["nowhere.json"]);
    fs::write(at("bad.json"), "{}").unwrap();
    refused(&at("bad.json"), &["bad.json"]);
    let (done, said) = muscles(&[target, &scan, output, &at("x.obj")]);
    assert!(!done && said.contains(".png"), "{said}");
}
