//! Contractions of a clip as curves, edited, on several targets, and played again.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use common::{animate, finish, folder, james, names, obj_vertices, program, short_clip, track};
use understudy::{
    export::Pc2Reader,
    muscle::{ARKIT_SHAPES, Channel, CurveTake, LIVE_LINK_ANGLES},
};

type Vertices = Vec<[f64; 3]>;

fn play(scan: &Path, curves: &Path, outputs: &[&Path], more: &[&str]) -> Command {
    let mut command = program();
    command.arg("express").arg("--target").arg(scan).arg("--play").arg(curves).args(more);
    for output in outputs {
        command.arg("-o").arg(output);
    }
    command
}

fn samples(path: &Path) -> Vec<Vertices> {
    let mut cache = Pc2Reader::open(path).unwrap();
    let mut sample = Vec::new();
    let read = (0..cache.samples()).map(|index| {
        cache.read_sample(index, &mut sample).unwrap();
        sample.iter().map(|place| place.map(f64::from)).collect()
    });
    read.collect()
}

fn apart(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// The farthest that any vertex of `which` goes between two samples.
fn farthest(a: &Vertices, b: &Vertices, which: impl Fn(usize) -> bool) -> f64 {
    let pairs = a.iter().zip(b).enumerate();
    pairs.filter(|(k, _)| which(*k)).map(|(_, (a, b))| apart(a, b)).fold(0.0, f64::max)
}

fn header(shapes: &[&str]) -> String {
    let channels: Vec<String> = shapes.iter().map(|name| format!("{name}_s")).collect();
    format!("frame,timestamp,state,{},error_upper_mm,error_lower_mm,{}", shapes.join(","), channels.join(","))
}

/// A second at 10 frames, in which each muscle goes from 0 to `most` of it.
fn ramp(folder: &Path, name: &str, muscles: &[(&str, f64)]) -> PathBuf {
    let names: Vec<&str> = muscles.iter().map(|(name, _)| *name).collect();
    let mut text = format!("timestamp,{}", names.join(","));
    for frame in 0..=10 {
        write!(text, "\n{}.{}", frame / 10, frame % 10).unwrap();
        for (_, most) in muscles {
            write!(text, ",{:.6}", most * f64::from(frame) / 10.0).unwrap();
        }
    }
    let path = folder.join(name);
    fs::write(&path, text + "\n").unwrap();
    path
}

#[test]
fn a_clip_drives_two_targets_and_its_curves_play_again() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let clip = short_clip(folder.path(), 2.0);
    let (scan, other) = (james(), common::asset("template_ply"));
    let outputs = ["take.pc2", "take.muscles.csv", "take.livelink.csv"].map(at);
    let paths: Vec<&Path> = outputs.iter().map(AsRef::as_ref).collect();
    let more = ["--drive", "muscles", "--head", "still", "--target", other.to_str().unwrap()];
    let run = finish(&mut animate(&clip, &scan, &paths, &more)).succeeded();
    let stems = [&scan, &other].map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned());
    let caches = stems.map(|stem| at(&format!("take.{stem}.pc2")));
    let mut wanted = vec!["clip.mp4".to_owned(), "take.livelink.csv".into(), "take.muscles.csv".into()];
    wanted.extend(caches.iter().map(|path| path.file_name().unwrap().to_str().unwrap().to_owned()));
    wanted.sort();
    assert_eq!(names(folder.path()), wanted, "{}", run.stdout);

    the_curves_are_whole(&at("take.muscles.csv"));
    the_recording_is_that_of_the_app(&at("take.livelink.csv"), &at("take.muscles.csv"));

    // Tracked without a scan, the curves are the same.
    finish(&mut track(&clip, &at("alone.muscles.csv"), &[])).succeeded();
    assert!(fs::read(at("alone.muscles.csv")).unwrap() == fs::read(at("take.muscles.csv")).unwrap());

    // Played on the same scan, they move it as the clip did.
    for (scan, cache) in [(&scan, &caches[0]), (&other, &caches[1])] {
        finish(&mut play(scan, &at("take.muscles.csv"), &[&at("again.pc2")], &[])).succeeded();
        let (first, again) = (samples(cache), samples(&at("again.pc2")));
        assert_eq!((first.len(), again.len()), (50, 50));
        let most = first[0].iter().flatten().fold(0.0_f64, |most, value| most.max(value.abs()));
        let (mut moved, mut off) = (0.0_f64, 0.0_f64);
        for (before, after) in first.iter().zip(&again) {
            off = off.max(farthest(before, after, |_| true) / most);
            moved = moved.max(farthest(&first[0], before, |_| true) / most);
        }
        println!("{}: vertices go {moved:.3} of the head, and {off:.1e} apart", scan.display());
        // A micrometre of a head, whatever the scan's unit.
        assert!(off < 6e-6, "{}: {off} apart", scan.display());
        assert!(moved > 0.02, "nothing moves");
    }

    // So does the recording, whose head moves besides.
    finish(&mut play(&scan, &at("take.livelink.csv"), &[&at("live.pc2")], &[])).succeeded();
    assert_eq!(samples(&at("live.pc2")).len(), 50);
}

fn the_curves_are_whole(path: &Path) {
    let text = fs::read_to_string(path).unwrap();
    assert_eq!(text.lines().next().unwrap(), header(&ARKIT_SHAPES));
    let curves = CurveTake::read(path).unwrap().curves;
    assert_eq!((curves.frames().len(), curves.rate().per_second()), (50, 25.0));
    let of = |name: &str| ARKIT_SHAPES.iter().position(|shape| *shape == name).unwrap();
    assert_eq!(curves.channels()[of("tongueOut")], Channel::Absent);
    assert_eq!(curves.channels()[of("eyeBlinkLeft")], Channel::Measured);
    for name in ["eyeBlinkLeft", "eyeBlinkRight"] {
        let most = curves.track(of(name)).fold(0.0, f64::max);
        println!("{name}: {most:.2} at most");
        assert!(most > 0.05 && most <= 1.0, "{name} reaches {most}");
    }
    for frame in curves.frames() {
        let [upper, lower] = frame.error.unwrap();
        assert!((0.01..5.0).contains(&upper) && (0.01..5.0).contains(&lower), "{upper} {lower} mm");
        assert!(frame.contractions.iter().all(|value| (0.0..1.5).contains(value)));
    }
}

fn the_recording_is_that_of_the_app(path: &Path, curves: &Path) {
    let text = fs::read_to_string(path).unwrap();
    let capital = |name: &str| name[..1].to_uppercase() + &name[1..];
    let shapes: Vec<String> = ARKIT_SHAPES.iter().map(|name| capital(name)).collect();
    let mut lines = text.lines();
    let angles = LIVE_LINK_ANGLES.join(",");
    assert_eq!(lines.next().unwrap(), format!("Timecode,BlendShapeCount,{},{angles}", shapes.join(",")));
    for (k, line) in lines.enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!((cells.len(), cells[1]), (63, "61"));
        assert_eq!(cells[0], format!("00:00:{:02}:{:02}.000", k / 25, k % 25));
    }
    let (take, curves) = (CurveTake::read(path).unwrap(), CurveTake::read(curves).unwrap().curves);
    let angles = take.live_link.unwrap().angles;
    assert!(angles.iter().all(|angles| angles.head.iter().all(|angle| angle.abs() < 1.0)));
    for (frame, same) in take.curves.frames().iter().zip(curves.frames()) {
        assert_eq!(frame.time, same.time);
        let off = frame.contractions.iter().zip(&same.contractions).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-6);
    }
}

#[test]
fn edits_change_what_is_written_and_what_moves() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let clip = short_clip(folder.path(), 1.0);
    fs::write(at("mirror.toml"), "mirror = true").unwrap();
    fs::write(at("still.toml"), "[all]\nmute = true\n").unwrap();
    finish(&mut track(&clip, &at("take.muscles.csv"), &[])).succeeded();
    let mirror = at("mirror.toml");
    finish(&mut track(&clip, &at("swapped.muscles.csv"), &["--edit", mirror.to_str().unwrap()])).succeeded();
    let mut back = program();
    back.arg("plot").arg(at("swapped.muscles.csv")).arg("--edit").arg(&mirror);
    finish(back.arg("-o").arg(at("back.muscles.csv"))).succeeded();
    let [take, swapped, back] =
        ["take", "swapped", "back"].map(|name| fs::read(at(&format!("{name}.muscles.csv"))).unwrap());
    assert!(take == back, "mirrored twice, the curves are others");
    assert!(take != swapped, "the mirror does nothing");

    // Everything muted, the clip leaves the scan as it is.
    let still = at("still.toml");
    let more = ["--drive", "muscles", "--head", "still", "--edit", still.to_str().unwrap()];
    let (scan, cache) = (james(), at("still.pc2"));
    finish(&mut animate(&clip, &scan, &[&cache], &more)).succeeded();
    let samples = samples(&cache);
    assert!(samples.iter().all(|sample| *sample == samples[0]), "muted muscles move");
}

#[test]
fn single_muscles_move_their_part_of_the_face() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let scan = james();
    let curves = ramp(
        folder.path(),
        "ramp.csv",
        &[("jawOpen", 1.0), ("browInnerUp", 1.0), ("eyeBlinkLeft", 0.5), ("eyeLookInRight", 0.8)],
    );
    let rest = obj_vertices(&scan);
    let extent = |pick: fn(f64, f64) -> f64| rest.iter().map(|place| place[1]).reduce(pick).unwrap();
    println!("the scan goes from {} to {}", extent(f64::min), extent(f64::max));
    let cache = at("x.pc2");
    let mut seen = Vec::new();
    for (name, edits) in
        [("all", ""), ("jaw", "jawOpen"), ("brow", "browInnerUp"), ("none", "eyeLookInRight")]
    {
        let edit = at("edits.toml");
        let text = if edits.is_empty() {
            String::new()
        } else {
            format!("[all]\nmute = true\n[{edits}]\nmute = false\n")
        };
        fs::write(&edit, text).unwrap();
        finish(&mut play(&scan, &curves, &[&cache], &["--edit", edit.to_str().unwrap()])).succeeded();
        let samples = samples(&cache);
        assert_eq!(samples.len(), 11);
        seen.push((name, samples));
    }
    let [(_, all), (_, jaw), (_, brow), (_, look)] = seen.as_slice() else { unreachable!() };
    let skin = rest.len();
    let moved = |samples: &[Vertices]| -> Vec<f64> {
        samples[0].iter().zip(&samples[10]).take(skin).map(|(a, b)| apart(a, b)).collect()
    };
    let (jaw, brow) = (moved(jaw), moved(brow));
    let most = |moves: &[f64]| {
        let k = (0..moves.len()).max_by(|&a, &b| moves[a].total_cmp(&moves[b])).unwrap();
        (k, moves[k])
    };
    let ((chin, opened), (forehead, raised)) = (most(&jaw), most(&brow));
    println!("the jaw goes {opened:.1}, the brows {raised:.1}");
    assert!(opened > 10.0 && raised > 2.0);
    assert!(rest[chin][1] < rest[forehead][1]);
    // The muted jaw keeps the chin still, the muted brows the forehead.
    assert!(brow[chin] < 0.05, "the brows move the chin by {}", brow[chin]);
    assert!(jaw[forehead] < 0.2, "the jaw moves the forehead by {}", jaw[forehead]);
    assert!(farthest(&all[0], &all[10], |_| true) > 10.0);
    // An eye that looks about moves no skin, and itself.
    assert!(moved(look).iter().all(|far| *far < 1e-6));
    assert!(farthest(&look[0], &look[10], |k| k >= skin) > 2.0);
}

#[test]
fn relaxed_muscles_are_the_neutral_byte_for_byte() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let scan = james();
    let text = |name: &str| {
        let text = fs::read_to_string(at(name)).unwrap();
        // The material's file is named after the OBJ.
        text.lines().filter(|line| !line.starts_with("mtllib")).collect::<Vec<_>>().join("\n")
    };
    let mut neutral = program();
    neutral.arg("express").arg("--target").arg(&scan).arg("-o").arg(at("nothing.obj"));
    finish(&mut neutral).succeeded();
    for (name, muscles) in
        [("arkit", ["jawOpen", "eyeBlinkLeft"]), ("sixteen", ["jaw_rotation", "frontalis_left"])]
    {
        let curves = ramp(folder.path(), "zero.csv", &muscles.map(|muscle| (muscle, 0.0)));
        finish(&mut play(&scan, &curves, &[&at("zero.obj")], &[])).succeeded();
        assert!(text("nothing.obj") == text("zero.obj"), "{name}: nothing contracted is not the neutral");
        let curves = ramp(folder.path(), "some.csv", &muscles.map(|muscle| (muscle, 0.5)));
        finish(&mut play(&scan, &curves, &[&at("some.obj")], &[])).succeeded();
        assert!(text("nothing.obj") != text("some.obj"), "{name}: contractions do nothing");
    }
}

#[test]
fn the_head_turns_by_a_recordings_angles() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let scan = james();
    let mut text =
        format!("Timecode,BlendShapeCount,{},{}", ARKIT_SHAPES.join(","), LIVE_LINK_ANGLES.join(","));
    for frame in 0..2 {
        let shapes = ",0.0".repeat(52);
        write!(text, "\n10:00:00:{frame:02}.000,61{shapes},{}{}", 0.4 * f64::from(frame), ",0.0".repeat(8))
            .unwrap();
    }
    fs::write(at("phone.csv"), text).unwrap();
    let cache = at("x.pc2");
    finish(&mut play(&scan, &at("phone.csv"), &[&cache, &at("x.png")], &["--size", "128x128"])).succeeded();
    let samples = samples(&cache);
    // The foremost vertex is the nose; the subject's right is −X.
    let nose = (0..samples[0].len()).max_by(|&a, &b| samples[0][a][2].total_cmp(&samples[0][b][2])).unwrap();
    let step = samples[1][nose][0] - samples[0][nose][0];
    println!("the nose goes {step:.1} mm along X");
    assert!(step < -15.0, "{step}");
}

#[test]
fn mistakes_are_refused_with_what_to_do() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let clip = short_clip(folder.path(), 0.4);
    let (scan, out) = (james(), at("x.mp4"));
    let edit = |text: &str| {
        fs::write(at("edits.toml"), text).unwrap();
        at("edits.toml").to_str().unwrap().to_owned()
    };
    let live = at("x.livelink.csv");
    finish(&mut track(&clip, &live, &["--basis", "sixteen"])).refused(&[
        "ARKit",
        "--basis arkit",
        ".muscles.csv",
    ]);
    finish(&mut track(&clip, &live, &["--lift", "plane"])).refused(&["--lift plane"]);
    finish(&mut track(&clip, &at("x.csv"), &["--edit", &edit("mirror = true")]))
        .refused(&["--edit", ".muscles.csv"]);
    let curves = at("x.muscles.csv");
    finish(&mut track(&clip, &curves, &["--edit", &edit("[JawOpen]\nmute = true")]))
        .refused(&["edits.toml", "did you mean jawOpen"]);
    finish(&mut track(&clip, &curves, &["--edit", "none.toml"])).refused(&["none.toml"]);
    finish(&mut animate(&clip, &scan, &[&out], &["--edit", &edit("")]))
        .refused(&["--edit", "--drive muscles"]);
    finish(&mut animate(&clip, &scan, &[&out], &["--drive", "muscles", "--lift", "plane"]))
        .refused(&["--lift plane"]);
    finish(&mut animate(&clip, &scan, &[&out], &["--target", scan.to_str().unwrap()])).refused(&[
        "james.obj",
        "one name",
        "Rename",
    ]);

    let refused = |text: &str, more: &[&str], words: &[&str]| {
        fs::write(at("curves.csv"), text).unwrap();
        finish(&mut play(&scan, &at("curves.csv"), &[&out], more)).refused(words);
    };
    refused("timestamp,jawOpen\n", &[], &["curves.csv", "no rows"]);
    refused("timestamp,jawOpen,wiggle,ears\n0,1,1,1\n", &[], &["curves.csv", "wiggle, ears", "--basis"]);
    refused("timestamp,jawOpen\n0,1\n", &["--basis", "sixteen"], &["curves.csv", "jawOpen"]);
    refused("timestamp,jawOpen\n0,1\n", &["--edit", &edit("[jaw]\nmute = true")], &["edits.toml", "jawOpen"]);
    refused("timestamp,jawOpen\n0,soon\n", &[], &["curves.csv", "soon"]);
    refused("", &[], &["curves.csv", "empty"]);
    let mut command = program();
    command.args(["express", "--au", "12", "--basis", "sixteen", "--target"]).arg(&scan);
    finish(command.arg("-o").arg(&out)).refused(&["--basis", "--play"]);
    assert_eq!(names(folder.path()), ["clip.mp4", "curves.csv", "edits.toml"]);
}
