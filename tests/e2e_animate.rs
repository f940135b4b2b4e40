//! A clip goes in, every output comes out, and the avatar does what the performer did.

#![allow(clippy::panic, clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::path::Path;

use common::{
    animate, curves, finish, folder, gltf_validator, james, made, names, obj_vertices, probe, short_clip,
    track,
};
use gltf::animation::{Property, util::ReadOutputs};
use understudy::export::{Pc2Reader, read_motion_csv};

#[test]
fn one_clip_becomes_every_output() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let clip = short_clip(folder.path(), 2.0);
    let scan = james();
    let outputs = ["a.mp4", "a.glb", "a.pc2", "a.csv", "a.png"].map(at);
    let paths: Vec<&Path> = outputs.iter().map(AsRef::as_ref).collect();
    let run = finish(&mut animate(&clip, &scan, &paths, &["--compare", "--size", "320x240"])).succeeded();

    assert_eq!(names(folder.path()), ["a.csv", "a.glb", "a.mp4", "a.pc2", "a.png", "clip.mp4"]);
    for name in ["a.csv", "a.glb", "a.mp4", "a.pc2", "a.png"] {
        assert!(run.stdout.contains(name), "{name} is not announced: {}", run.stdout);
    }
    // The performer, 400 × 300, at the avatar's height, and a square for the avatar.
    assert_eq!(
        probe(&at("a.mp4"), "v", "stream=codec_name,width,height,r_frame_rate,nb_read_packets"),
        ["h264,560,240,25/1,50"]
    );
    let sheet = image::image_dimensions(at("a.png")).unwrap();
    assert!(sheet.0 > 1000 && sheet.1 > 700, "{sheet:?}");

    the_point_cache_is_the_scan_in_motion(&at("a.pc2"), &scan);
    the_glb_has_morphs_and_turning_parts(&at("a.glb"));
    if let Some(validator) = gltf_validator::validator() {
        gltf_validator::validate(&validator, &[at("a.glb")]);
    }
    the_table_has_every_frame(&at("a.csv"));
}

fn the_point_cache_is_the_scan_in_motion(path: &Path, scan: &Path) {
    let vertices = obj_vertices(scan);
    let mut cache = Pc2Reader::open(path).unwrap();
    // The scan's own vertices come first, in its order; then those of mouth and eyes.
    assert!(cache.points() > vertices.len(), "{} points, {} in the scan", cache.points(), vertices.len());
    assert_eq!(cache.samples(), 50);
    let mut sample = Vec::new();
    let mut distances = Vec::new();
    for index in 0..cache.samples() {
        cache.read_sample(index, &mut sample).unwrap();
        let squares = sample.iter().zip(&vertices).map(|(moved, rest)| {
            (0..3).map(|axis| (f64::from(moved[axis]) - rest[axis]).powi(2)).sum::<f64>()
        });
        distances.push((squares.sum::<f64>() / vertices.len() as f64).sqrt());
    }
    let nearest = distances.iter().copied().fold(f64::INFINITY, f64::min);
    let farthest = distances.iter().copied().fold(0.0, f64::max);
    println!("RMS distance from the scan: {nearest:.2} to {farthest:.2} mm");
    assert!(nearest < 2.0, "the neutral lies {nearest} mm from the scan");
    assert!(farthest > nearest + 0.5, "nothing moves");
}

fn the_glb_has_morphs_and_turning_parts(path: &Path) {
    let (document, buffers, _) = gltf::import(path).unwrap();
    let mesh = document.meshes().next().unwrap();
    let extras: serde_json::Value = serde_json::from_str(mesh.extras().as_ref().unwrap().get()).unwrap();
    let targets = extras["targetNames"].as_array().unwrap().len();
    assert!(targets > 2, "{targets} morph targets");
    assert!(mesh.primitives().all(|primitive| primitive.morph_targets().len() == targets));
    let animation = document.animations().next().unwrap();
    assert_eq!(animation.name(), Some("performance"));
    let mut found = Vec::new();
    for channel in animation.channels() {
        let reader = channel.reader(|buffer| Some(&buffers[buffer.index()]));
        let times: Vec<f32> = reader.read_inputs().unwrap().collect();
        assert_eq!(times.len(), 50);
        assert!((times[49] - 49.0 / 25.0).abs() < 1e-4, "the last key is at {}", times[49]);
        let name = channel.target().node().name().map(str::to_owned);
        let keys = match reader.read_outputs().unwrap() {
            ReadOutputs::MorphTargetWeights(weights) => weights.into_f32().count() / targets,
            ReadOutputs::Translations(keys) => keys.count(),
            ReadOutputs::Rotations(keys) => keys.into_f32().count(),
            ReadOutputs::Scales(_) => panic!("{name:?} is scaled"),
        };
        assert_eq!(keys, 50);
        found.push((channel.target().property(), name));
    }
    let nodes: Vec<_> = document.nodes().filter_map(|node| node.name().map(str::to_owned)).collect();
    let parts = ["face", "mouth", "upper teeth", "lower teeth", "tongue", "right eye", "left eye"];
    assert_eq!(nodes[..parts.len()], parts);
    let has = |name: &str, property| found.contains(&(property, Some(name.to_owned())));
    for turning in ["head", "lower teeth", "tongue", "right eye", "left eye"] {
        assert!(
            has(turning, Property::Rotation) && has(turning, Property::Translation),
            "{turning}: {found:?}"
        );
    }
    for bending in ["face", "mouth"] {
        assert!(has(bending, Property::MorphTargetWeights), "{bending}: {found:?}");
    }
    assert!(!found.iter().any(|(_, name)| name.as_deref() == Some("upper teeth")), "{found:?}");
}

fn the_table_has_every_frame(path: &Path) {
    let records = read_motion_csv(path).unwrap();
    assert_eq!(records.len(), 50);
    for (i, record) in records.iter().enumerate() {
        assert_eq!((record.frame, record.timestamp.0), (i as u64 + 1, i as i64 * 40_000_000));
        assert!(record.success && record.state == "tracking" && record.confidence > 0.5);
        assert_eq!(record.landmarks.len(), 478);
        assert!(record.landmarks.iter().flatten().all(|value| value.is_finite()));
        assert!((200.0..1500.0).contains(&record.translation[2]), "{:?}", record.translation);
    }
}

#[test]
fn the_clips_sound_is_kept() {
    let folder = folder();
    let silent = short_clip(folder.path(), 1.2);
    let sounding = made(
        folder.path(),
        "sound.mp4",
        &[&silent],
        "-f lavfi -i sine=frequency=440:duration=1.2 -c:v copy -c:a aac -shortest",
    );
    let film = folder.path().join("film.mp4");
    finish(&mut animate(&sounding, &james(), &[&film], &["--size", "64x64"])).succeeded();
    assert_eq!(probe(&film, "v", "stream=nb_read_packets"), ["30"]);
    let sound = probe(&film, "a", "stream=codec_name,duration");
    let duration: f64 = sound[0].strip_prefix("aac,").unwrap().parse().unwrap();
    assert!((duration - 1.2).abs() < 0.08, "{duration} s of sound");
    assert_eq!(names(folder.path()), ["clip.mp4", "film.mp4", "sound.mp4"]);
}

/// The avatar's own film is tracked again by the networks that tracked the performer, and the two are compared.
#[test]
fn the_avatar_follows_the_performer() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let clip = common::asset("cap13");
    let (film, performer, avatar) = (at("avatar.mp4"), at("performer.csv"), at("avatar.csv"));
    finish(&mut animate(&clip, &james(), &[&film], &["--size", "480x480"])).succeeded();
    finish(&mut track(&clip, &performer, &["--raw"])).succeeded();
    finish(&mut track(&film, &avatar, &["--raw"])).succeeded();
    let (performer, avatar) = (read_motion_csv(&performer).unwrap(), read_motion_csv(&avatar).unwrap());
    assert_eq!((performer.len(), avatar.len()), (765, 765));
    let rows: Vec<_> = curves::MEASURES
        .iter()
        .map(|measure| (measure.name, curves::following(&measure.curve(&performer), &measure.curve(&avatar))))
        .collect();
    println!("{}", curves::table(&rows));
    for (name, correlation, gains) in [
        ("mouth gap", 0.95, 0.6..1.3),
        ("mouth width", 0.88, 0.6..1.3),
        ("chin", 0.9, 0.5..1.4),
        ("brows", 0.85, 0.5..1.4),
        ("lids", 0.75, 0.35..1.4),
    ] {
        let found = rows.iter().find(|(measure, _)| *measure == name).unwrap().1;
        assert!(found.correlation >= correlation, "{name}: {found:?}, wanted {correlation}");
        assert!(gains.contains(&found.gain), "{name}: {found:?}, wanted {gains:?}");
    }
}
