//! `understudy prepare`: what it makes of a scan opens elsewhere, is the same every time, and bad places are refused.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{fs, path::Path};

use common::{finish, folder, gltf_validator, james, names, program};

fn prepare(scan: &Path, outputs: &[&Path]) -> std::process::Command {
    let mut command = program();
    command.arg("prepare").arg(scan);
    for output in outputs {
        command.arg("-o").arg(output);
    }
    command
}

#[test]
fn a_scan_becomes_named_nodes_and_morph_targets() {
    let folder = folder();
    let (glb, png) = (folder.path().join("avatar.glb"), folder.path().join("look.png"));
    let run = finish(&mut prepare(&james(), &[&glb, &png])).succeeded();
    assert!(run.stdout.contains("avatar.glb") && run.stdout.contains("look.png"), "{}", run.stdout);
    assert_eq!(names(folder.path()), ["avatar.glb", "look.png"]);

    let (document, buffers, _) = gltf::import(&glb).unwrap();
    let head = document.nodes().find(|node| node.name() == Some("head")).unwrap();
    let parts: Vec<_> = head.children().map(|node| node.name().unwrap().to_owned()).collect();
    assert_eq!(parts, ["face", "mouth", "upper teeth", "lower teeth", "tongue", "right eye", "left eye"]);
    assert_eq!(document.animations().count(), 0);
    for node in head.children() {
        let mesh = node.mesh().unwrap();
        let soft = matches!(node.name(), Some("face" | "mouth"));
        let targets = mesh.primitives().next().unwrap().morph_targets().len();
        assert_eq!(targets > 0, soft, "{:?} has {targets} morph targets", node.name());
        if soft {
            let extras: serde_json::Value =
                serde_json::from_str(mesh.extras().as_ref().unwrap().get()).unwrap();
            let targets = extras["targetNames"].as_array().unwrap();
            for name in ["jawOpen", "eyeBlinkLeft", "eyeBlinkRight"] {
                assert!(targets.iter().any(|target| target == name), "{name} is not among {targets:?}");
            }
        }
        for primitive in mesh.primitives() {
            let reader = primitive.reader(|buffer| Some(&buffers[buffer.index()]));
            assert!(reader.read_positions().unwrap().flatten().all(f32::is_finite));
        }
    }
    if let Some(validator) = gltf_validator::validator() {
        gltf_validator::validate(&validator, &[glb]);
    }
    let (width, height) = image::image_dimensions(png).unwrap();
    assert!(width > 1500 && height > 800, "{width} x {height}");
}

/// Also with what was kept of the first run, and without anything kept.
#[test]
fn the_same_scan_gives_the_same_bytes() {
    let folder = folder();
    let run = |name: &str, cache: &str| {
        let glb = folder.path().join(name);
        let kept = folder.path().join("cache");
        let place = if cache.is_empty() { kept.as_os_str() } else { cache.as_ref() };
        finish(prepare(&james(), &[&glb]).env("UNDERSTUDY_CACHE", place)).succeeded();
        fs::read(glb).unwrap()
    };
    let first = run("first.glb", "");
    assert_eq!(fs::read_dir(folder.path().join("cache")).unwrap().count(), 2);
    assert!(run("again.glb", "") == first, "the run from the cache differs");
    assert!(run("off.glb", "off") == first, "the run without a cache differs");
    for entry in fs::read_dir(folder.path().join("cache")).unwrap() {
        fs::write(entry.unwrap().path(), b"damaged").unwrap();
    }
    assert!(run("damaged.glb", "") == first, "the run with a damaged cache differs");
}

#[test]
fn bad_places_are_refused_before_any_work() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let scan = james();
    finish(&mut prepare(&at("none.obj"), &[&at("a.glb")])).refused(&["none.obj"]);
    finish(&mut prepare(&scan, &[&at("a.obj")])).refused(&["a.obj", ".glb"]);
    finish(&mut prepare(&scan, &[&at("missing/a.glb")])).refused(&["missing"]);
    finish(&mut prepare(&scan, &[&scan])).refused(&["james.obj"]);
    fs::write(at("broken.obj"), "v 0 0 nan\n").unwrap();
    finish(&mut prepare(&at("broken.obj"), &[&at("a.glb")])).refused(&["broken.obj"]);
    assert_eq!(names(folder.path()), ["broken.obj"]);
}
