//! Living skin from the command line: wrinkles on a scan, their curves and their maps.

#![allow(clippy::panic, clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;
#[path = "../examples/shared/wrinkles.rs"]
mod wrinkles;

use std::{fs, path::Path};

use common::{asset, finish, folder, gltf_validator, james, names, program};
use gltf::animation::util::ReadOutputs;
use understudy::{
    appearance::{Classifier, Exemplar, RegionSkin, Skin, haar::Grid},
    export::write_skin,
    pipeline::SharedFace,
};

/// A skin of drawn wrinkles; what would tell their states is of no use here.
fn write_drawn_skin(path: &Path) {
    let face = SharedFace::read(&asset("canonical_face")).unwrap();
    let regions = wrinkles::volumes(face.frame()).into_iter().map(|volume| {
        let layers = volume.layers().len();
        let looks: Vec<Grid> = (0..layers)
            .map(|layer| {
                let mut grid: Grid = [0.0; 256];
                grid[1 + layer] = 1.0;
                grid[50] = 1.0;
                grid
            })
            .collect();
        let exemplars = (0..layers as u64).map(|frame| Exemplar { take: 0, frames: vec![frame] }).collect();
        RegionSkin { classifier: Classifier::new(&looks, 60.0).unwrap(), volume, exemplars }
    });
    let skin = Skin::new("nobody".into(), vec!["drawn".into()], regions.collect()).unwrap();
    write_skin(path, &skin).unwrap();
}

fn express(scan: &Path, more: &[&str], outputs: &[&Path]) -> common::Run {
    let mut command = program();
    command.arg("express").arg("--target").arg(scan).args(more);
    for output in outputs {
        command.arg("-o").arg(output);
    }
    finish(&mut command)
}

#[test]
fn wrinkles_are_seen_named_and_baked() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let skin = at("drawn.skin");
    write_drawn_skin(&skin);
    let skin = skin.to_str().unwrap();
    let small = ["--size", "256x256"];

    let (bare, bare_glb) = (at("bare.png"), at("bare.glb"));
    express(&james(), &small, &[&bare, &bare_glb]).succeeded();
    // A skin of which nothing is shown changes nothing.
    let (still, still_glb) = (at("still.png"), at("still.glb"));
    express(&james(), &["--skin", skin, small[0], small[1]], &[&still, &still_glb]).succeeded();
    assert!(fs::read(&bare).unwrap() == fs::read(&still).unwrap());
    assert!(fs::read(&bare_glb).unwrap() == fs::read(&still_glb).unwrap());

    let (shown, shown_glb, maps) = (at("shown.png"), at("shown.glb"), at("maps"));
    let wrinkles = ["--skin", skin, "--wrinkle", "forehead=0.8", "--wrinkle", "nasolabial"];
    let more = [&wrinkles[..], &["--bake", maps.to_str().unwrap()], &small[..]].concat();
    express(&james(), &more, &[&shown, &shown_glb]).succeeded();
    let [bare, shown] = [bare, shown].map(|path| image::open(path).unwrap().into_rgb8());
    let changed = bare.pixels().zip(shown.pixels()).filter(|(a, b)| a != b).count();
    println!("{changed} pixels changed");
    assert!((500..8_000).contains(&changed), "{changed}");

    let (document, buffers, _) = gltf::import(&shown_glb).unwrap();
    let face = document.meshes().next().unwrap();
    let extras: serde_json::Value = serde_json::from_str(face.extras().as_ref().unwrap().get()).unwrap();
    let targets: Vec<&str> =
        extras["targetNames"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    let curves: Vec<&str> = targets.iter().copied().filter(|name| name.starts_with("wrinkle_")).collect();
    assert_eq!(curves, ["wrinkle_forehead", "wrinkle_nasolabial_right", "wrinkle_nasolabial_left"]);
    let animation = document.animations().next().unwrap();
    let channel = animation.channels().next().unwrap();
    let outputs = channel.reader(|buffer| Some(&buffers[buffer.index()])).read_outputs().unwrap();
    let ReadOutputs::MorphTargetWeights(weights) = outputs else { panic!("no weights") };
    let weights: Vec<f32> = weights.into_f32().collect();
    let rows: Vec<&[f32]> = weights.chunks(targets.len()).collect();
    let forehead = targets.iter().position(|name| *name == "wrinkle_forehead").unwrap();
    let most = rows.iter().map(|row| row[forehead]).fold(0.0, f32::max);
    assert!((most - 0.8).abs() < 1e-6 && rows[0][forehead].abs() < 1e-6, "{most}");
    if let Some(validator) = gltf_validator::validator() {
        gltf_validator::validate(&validator, &[shown_glb]);
    }

    let written = names(&maps);
    assert_eq!(written.len(), 1 + 2 * 11);
    let map = |name: &str| image::open(maps.join(name)).unwrap().into_rgb8();
    let (neutral, wrinkled, mask) =
        (map("neutral.png"), map("wrinkle_forehead.png"), map("mask_forehead.png"));
    assert_eq!(neutral.dimensions(), wrinkled.dimensions());
    let mut seen = 0;
    for ((before, after), mask) in neutral.pixels().zip(wrinkled.pixels()).zip(mask.pixels()) {
        assert!(mask[0] > 0 || before == after, "the texture has changed beside its mask");
        seen += usize::from(before != after);
    }
    assert!(seen > 5_000, "{seen}");
}

#[test]
fn what_cannot_be_shown_is_refused_in_a_sentence() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let skin = at("drawn.skin");
    write_drawn_skin(&skin);
    let skin = skin.to_str().unwrap();
    let picture = at("x.png");
    express(&james(), &["--skin", skin, "--wrinkle", "nose=1"], &[&picture]).refused(&[
        "--wrinkle nose=1",
        "there is no region nose",
        "forehead",
    ]);
    express(&james(), &["--skin", skin, "--wrinkle", "chin=7"], &[&picture]).refused(&["STATE from 0 to 1"]);
    let maps = at("maps");
    let bake = ["--skin", skin, "--bake", maps.to_str().unwrap(), "--as-scanned"];
    express(&asset("template_ply"), &bake, &[&picture]).refused(&["has no texture", "--bake"]);
    assert!(!maps.exists());
}
