//! `understudy animate --drive volume`, as a user runs it.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{fs, path::Path};

use common::{animate, finish, folder, gltf_validator, james, names, obj_vertices, probe, short_clip};
use understudy::export::Pc2Reader;

const SECONDS: f64 = 1.2;
const FRAMES: usize = 30;

type Vertices = Vec<[f32; 3]>;

fn samples(path: &Path) -> Vec<Vertices> {
    let mut cache = Pc2Reader::open(path).unwrap();
    let mut sample = Vec::new();
    let read = (0..cache.samples()).map(|index| {
        cache.read_sample(index, &mut sample).unwrap();
        sample.clone()
    });
    read.collect()
}

fn apart(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>().sqrt()
}

/// The farthest that vertices go in any frame.
fn farthest(frames: &[Vertices], others: &[Vertices], which: impl Fn(usize) -> bool) -> f32 {
    let pairs = frames.iter().zip(others).flat_map(|(a, b)| a.iter().zip(b).enumerate());
    pairs.filter(|(v, _)| which(*v)).map(|(_, (a, b))| apart(a, b)).fold(0.0, f32::max)
}

#[test]
fn a_clip_moves_a_scan_and_the_edge_of_its_head_stays() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let clip = short_clip(folder.path(), SECONDS);
    let scan = james();
    let rest: Vertices = obj_vertices(&scan).iter().map(|place| place.map(|c| c as f32)).collect();
    let outputs = ["a.pc2", "a.glb", "a.mp4", "a.png"].map(at);
    let paths: Vec<&Path> = outputs.iter().map(AsRef::as_ref).collect();
    let more = ["--drive", "volume", "--head", "still", "--size", "128x96"];
    finish(&mut animate(&clip, &scan, &paths, &more)).succeeded();
    assert_eq!(names(folder.path()), ["a.glb", "a.mp4", "a.pc2", "a.png", "clip.mp4"]);
    let frames = samples(&at("a.pc2"));
    assert_eq!(frames.len(), FRAMES);
    assert!(frames.iter().flatten().flatten().all(|value| value.is_finite()));
    assert!(frames[0].len() > rest.len(), "no mouth and no eyes");
    assert_eq!(probe(&at("a.mp4"), "v", "stream=width,height,nb_read_packets"), ["128,96,30"]);
    if let Some(validator) = gltf_validator::validator() {
        gltf_validator::validate(&validator, &[at("a.glb")]);
    }

    // The face moves. At the back and the sides of the scan hardly anything is left of it.
    let back = rest.iter().map(|place| place[2]).fold(f32::MAX, f32::min);
    let still = vec![rest.clone(); FRAMES];
    let face = farthest(&frames, &still, |_| true);
    let behind = farthest(&frames, &still, |v| rest[v][2] < back + 20.0);
    println!("the face goes {face:.2} mm, the back of the scan {behind:.2} mm");
    assert!((1.0..40.0).contains(&face), "{face} mm");
    assert!(behind < 0.05 * face, "{behind} mm");
    // Lids blink and teeth follow the jaw: parts that the morph does not move.
    let parts = farthest(&frames, &vec![frames[0].clone(); FRAMES], |v| v >= rest.len());
    assert!(parts > 0.5, "mouth and eyes stand still: {parts} mm");

    // More points, another kernel, more smoothing: every choice does something.
    let mut all = vec![("published", frames)];
    for (name, choice) in [
        ("68", ["--points", "68"]),
        ("468", ["--points", "468"]),
        ("gaussian", ["--kernel", "gaussian"]),
        ("lambda", ["--lambda", "0.2"]),
        ("stiffness", ["--stiffness", "3"]),
        ("transfer", ["--transfer", "copy"]),
    ] {
        let cache = at("b.pc2");
        let more = [&more[..], &choice].concat();
        finish(&mut animate(&clip, &scan, &[&cache], &more)).succeeded();
        let frames = samples(&cache);
        for (other, others) in &all {
            let off = farthest(&frames, others, |v| v < rest.len());
            assert!(off > 0.05, "{name} does what {other} does: {off} mm");
        }
        all.push((name, frames));
    }
}

#[test]
fn runs_and_thread_counts_give_the_same_bytes() {
    let folder = folder();
    let clip = short_clip(folder.path(), 0.6);
    let scan = james();
    let kinds = ["pc2", "glb", "png", "mp4"];
    let run = |name: &str, threads: &str| {
        let outputs = kinds.map(|kind| folder.path().join(format!("{name}.{kind}")));
        let paths: Vec<_> = outputs.iter().map(AsRef::as_ref).collect();
        let more = ["--drive", "volume", "--kernel", "gaussian", "--threads", threads, "--size", "128x96"];
        finish(&mut animate(&clip, &scan, &paths, &more)).succeeded();
        outputs.map(|path| fs::read(path).unwrap())
    };
    let first = run("first", "1");
    for (name, threads) in [("again", "1"), ("threads", "2")] {
        for ((kind, one), other) in kinds.iter().zip(&first).zip(run(name, threads)) {
            assert!(*one == other, "the .{kind} of the run `{name}` differs");
        }
    }
}

#[test]
fn mistakes_are_refused_with_what_to_do() {
    let folder = folder();
    let clip = short_clip(folder.path(), 0.4);
    let (scan, out) = (james(), folder.path().join("x.mp4"));
    let refused = |more: &[&str], words: &[&str]| {
        finish(&mut animate(&clip, &scan, &[&out], more)).refused(words);
    };
    refused(&["--points", "68"], &["--points", "--drive volume"]);
    refused(&["--lambda", "0.1", "--drive", "actions"], &["--lambda", "--drive volume"]);
    refused(&["--drive", "volume", "--warp", "spline"], &["--warp", "--drive volume"]);
    refused(&["--drive", "volume", "--preset", "thesis"], &["--preset", "--drive volume"]);
    for (option, value, word) in [
        ("--points", "4", "18"),
        ("--kernel", "cubic", "hardy"),
        ("--lambda", "-0.01", "below 0"),
        ("--lambda", "NaN", "not a finite number"),
        ("--lambda", "some", "not a finite number"),
        ("--stiffness", "0", "not above 0"),
        ("--stiffness", "inf", "not a finite number"),
    ] {
        let run = finish(&mut animate(&clip, &scan, &[&out], &["--drive", "volume", option, value]));
        assert_eq!(run.code, Some(2), "{option} {value}: {}", run.stderr);
        assert!(run.stderr.contains(option) && run.stderr.contains(word), "{}", run.stderr);
    }
    assert_eq!(names(folder.path()), ["clip.mp4"]);
}
