//! `understudy plot`: curves become charts, edits become curves, and what cannot be drawn is refused.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{
    f64::consts::TAU,
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use common::{finish, folder, made, names, program};
use image::imageops::{FilterType, resize};
use understudy::muscle::{ARKIT_SHAPES, CurveTake, LIVE_LINK_ANGLES};

/// As paper 001 has them.
#[rustfmt::skip]
const MUSCLES: [&str; 16] = [
    "frontalis_left", "frontalis_right", "corrugator_left", "corrugator_right", "orbicularis_oculi_left",
    "orbicularis_oculi_right", "levator_labii_superioris_left", "levator_labii_superioris_right",
    "zygomatic_major_left", "zygomatic_major_right", "risorius_left", "risorius_right", "depressor_anguli_oris",
    "orbicularis_oris", "lips_pressor", "jaw_rotation",
];
const FRAMES: usize = 150;
/// Of the muscles, one that nothing tells of.
const ABSENT: usize = 14;

fn plot(curves: &Path, outputs: &[&Path], more: &[&str]) -> Command {
    let mut command = program();
    command.arg("plot").arg(curves).args(more);
    for output in outputs {
        command.arg("-o").arg(output);
    }
    command
}

/// Six seconds at 25 a second: every muscle contracts in its own turn; from 2 s to 2.4 s the face is lost.
fn table(folder: &Path) -> PathBuf {
    let mut text = format!("frame,timestamp,state,{},error_upper_mm,error_lower_mm", MUSCLES.join(","));
    text.push_str(&MUSCLES.map(|name| format!(",{name}_s")).concat());
    for frame in 0..FRAMES {
        let is_lost = (50..60).contains(&frame);
        let state = if is_lost { "holding" } else { "tracking" };
        write!(text, "\n{},{:.9},{state}", frame + 1, frame as f64 / 25.0).unwrap();
        for muscle in 0..MUSCLES.len() {
            let turn = frame as f64 / FRAMES as f64 - (muscle / 2) as f64 / 8.0;
            let strength = match muscle {
                ABSENT => 0.0,
                _ if muscle % 2 == 0 => 1.0,
                _ => 0.8,
            };
            let value = if (0.0..0.2).contains(&turn) { (turn / 0.2 * TAU / 2.0).sin() } else { 0.0 };
            write!(text, ",{:.6}", value * strength).unwrap();
        }
        let wave = (frame as f64 / 9.0).sin();
        let errors = format!(",{:.3},{:.3}", 0.4 + 0.1 * wave, 0.9 - 0.3 * wave);
        text.push_str(if is_lost { ",," } else { &errors });
        for muscle in 0..MUSCLES.len() {
            text.push_str(if muscle == ABSENT { ",absent" } else { ",measured" });
        }
    }
    let path = folder.join("take.muscles.csv");
    fs::write(&path, text + "\n").unwrap();
    path
}

/// A recording of Live Link Face: jaw and left eye move, the head turns.
fn recording(folder: &Path) -> PathBuf {
    let mut text = format!("Timecode,BlendShapeCount,{}", ARKIT_SHAPES.join(","));
    write!(text, ",{}", LIVE_LINK_ANGLES.join(",")).unwrap();
    for frame in 0..90 {
        write!(text, "\n10:00:{:02}:{:02}.250,61", frame / 30, frame % 30 * 2).unwrap();
        for shape in ARKIT_SHAPES {
            let value = match shape {
                "jawOpen" => 0.01 * frame as f64,
                "eyeBlinkLeft" => 0.5,
                _ => 0.0,
            };
            write!(text, ",{value:.10}").unwrap();
        }
        write!(text, ",{:.10},0.1,0,0.3,0,0,0.2,0,0", 0.002 * frame as f64).unwrap();
    }
    let path = folder.join("phone.csv");
    fs::write(&path, text + "\n").unwrap();
    path
}

/// `UPDATE_SNAPSHOTS=1 cargo test --release --test e2e_plot` stores the picture anew; look at it.
#[test]
fn the_overview_looks_as_it_did() {
    let folder = folder();
    let (png, svg) = (folder.path().join("curves.png"), folder.path().join("curves.svg"));
    finish(&mut plot(&table(folder.path()), &[&png, &svg], &[])).succeeded();
    let picture = image::open(&png).unwrap().into_rgb8();
    let picture = resize(&picture, picture.width() / 2, picture.height() / 2, FilterType::Triangle);

    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/snapshots/e2e_plot.png");
    if std::env::var_os("UPDATE_SNAPSHOTS").is_some() {
        picture.save(&path).unwrap();
    }
    let stored = image::open(&path).expect("UPDATE_SNAPSHOTS=1 stores the picture").into_rgb8();
    assert_eq!(stored.dimensions(), picture.dimensions());
    let differences = stored.iter().zip(picture.iter()).map(|(a, b)| f64::from(a.abs_diff(*b)));
    let mean = differences.sum::<f64>() / stored.len() as f64;
    assert!(mean < 0.05, "mean difference {mean:.3} levels");

    let text = fs::read_to_string(&svg).unwrap();
    let head = format!("<svg width=\"{}\" height=\"{}\" ", picture.width(), picture.height());
    assert!(text.starts_with(&head) && text.ends_with("</svg>\n"), "{}", &text[..100]);
    for word in [MUSCLES[0], MUSCLES[15], "upper face", "lower face", "millimetres", "seconds"] {
        assert!(text.contains(word), "{word} is not on the chart");
    }
}

#[test]
fn the_same_curves_give_the_same_bytes() {
    let folder = folder();
    let curves = table(folder.path());
    for more in
        [&[][..], &["--error"], &["--snapshots", "auto"], &["--muscles", "jaw_rotation,frontalis_left"]]
    {
        let bytes = |name: &str| {
            let outputs = ["png", "svg"].map(|end| folder.path().join(format!("{name}.{end}")));
            finish(&mut plot(&curves, &[&outputs[0], &outputs[1]], more)).succeeded();
            outputs.map(|path| fs::read(path).unwrap())
        };
        assert!(bytes("one") == bytes("two"), "{more:?}");
    }
}

#[test]
fn moments_stand_beside_the_films_pictures() {
    let folder = folder();
    let curves = table(folder.path());
    let film = "-f lavfi -i color=c=0x30a060:size=320x240:rate=25 -t 6 -pix_fmt yuv420p";
    let clip = made(folder.path(), "clip.mp4", &[], film);
    let (png, svg) = (folder.path().join("moments.png"), folder.path().join("moments.svg"));
    let more = ["--snapshots", "0.6,5.9", "--clip", clip.to_str().unwrap()];
    finish(&mut plot(&curves, &[&png, &svg], &more)).succeeded();
    let picture = image::open(&png).unwrap().into_rgb8();
    let is_film = |p: &&image::Rgb<u8>| p.0.iter().zip([0x30, 0xa0, 0x60]).all(|(a, b)| a.abs_diff(b) < 12);
    let share =
        picture.pixels().filter(is_film).count() as f64 / f64::from(picture.width() * picture.height());
    assert!((0.1..0.5).contains(&share), "the film has {share:.2} of the picture");
    let text = fs::read_to_string(&svg).unwrap();
    assert_eq!(text.matches("data:image/jpeg;base64,").count(), 2);
    assert!(text.contains("0.60 s, frame 16") && text.contains("5.88 s, frame 148"), "{}", text.len());
}

#[test]
fn edited_curves_are_written_and_read_back() {
    let folder = folder();
    let edits = folder.path().join("edits.toml");
    fs::write(&edits, "mirror = true\n[jawOpen]\nscale = 2.0\nclamp = [0.0, 1.0]\n").unwrap();
    let phone = recording(folder.path());
    let outputs = ["e.livelink.csv", "e.muscles.csv"].map(|name| folder.path().join(name));
    finish(&mut plot(&phone, &[&outputs[0], &outputs[1]], &["--edit", edits.to_str().unwrap()])).succeeded();
    let [before, after, table] =
        [&phone, &outputs[0], &outputs[1]].map(|path| CurveTake::read(path).unwrap());
    let place = |name| ARKIT_SHAPES.iter().position(|shape| *shape == name).unwrap();
    for (was, is) in before.curves.frames().iter().zip(after.curves.frames()) {
        assert_eq!(was.time, is.time);
        let [jaw, blink] = ["jawOpen", "eyeBlinkRight"].map(|name| is.contractions[place(name)]);
        assert!((jaw - (2.0 * was.contractions[place("jawOpen")]).min(1.0)).abs() < 1e-9);
        assert!((blink - 0.5).abs() < 1e-9 && is.contractions[place("eyeBlinkLeft")].abs() < 1e-9);
    }
    let (was, is) = (before.live_link.unwrap(), after.live_link.unwrap());
    assert_eq!(was.base, is.base);
    assert!((was.angles[50].head[0] + is.angles[50].head[0]).abs() < 1e-9);
    assert!((is.angles[0].right_eye[0] + 0.3).abs() < 1e-9 && (is.angles[0].left_eye[0] + 0.2).abs() < 1e-9);
    assert_eq!(table.curves.muscles(), after.curves.muscles());
    let first = fs::read_to_string(&outputs[0]).unwrap();
    assert!(first.lines().nth(1).unwrap().starts_with("10:00:00:00.250,61,0.0000000000,"), "{first:.200}");
}

#[test]
fn what_cannot_be_drawn_is_refused_and_writes_nothing() {
    let folder = folder();
    let (curves, phone) = (table(folder.path()), recording(folder.path()));
    let bad = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path
    };
    let motion = bad("motion.csv", "frame, face_id, timestamp, confidence, success, pose_Tx\n1,0,0,1,1,0\n");
    let nan = bad("nan.csv", "timestamp,jawOpen\n0,0.5\n0.04,NaN\n");
    let empty = bad("empty.csv", "");
    let edits = bad("edits.toml", "[frontalis]\nscale = 2\n");
    let clip = made(
        folder.path(),
        "short.mp4",
        &[],
        "-f lavfi -i color=c=gray:size=64x64:rate=25 -t 1 -pix_fmt yuv420p",
    );
    let before = names(folder.path());
    let gone = folder.path().join("gone.csv");
    let picture = folder.path().join("out.png");
    let path = |path: &PathBuf| path.to_str().unwrap().to_owned();
    let refused = |curves: &Path, output: &Path, more: &[&str], words: &[&str]| {
        finish(&mut plot(curves, &[output], more)).refused(words);
        assert_eq!(names(folder.path()), before, "{more:?}");
    };
    refused(&gone, &picture, &[], &["gone.csv", "Name a file"]);
    refused(
        &motion,
        &picture,
        &[],
        &["motion.csv", "line 1", "table of motion", "animate -o take.muscles.csv"],
    );
    refused(&nan, &picture, &[], &["nan.csv", "line 3", "no contraction of jawOpen"]);
    refused(&empty, &picture, &[], &["empty.csv", "empty"]);
    refused(folder.path(), &picture, &[], &["directory"]);
    refused(&curves, &picture, &["--muscles", "frontalis"], &["frontalis_left, frontalis_right"]);
    refused(&phone, &picture, &["--muscles", "smile"], &["mouthSmileLeft"]);
    refused(&phone, &picture, &["--error"], &["phone.csv", "no marker error", "Leave --error out"]);
    refused(&curves, &picture, &["--snapshots", "99"], &["nothing at 99 s", "ends at 5.96 s"]);
    refused(&curves, &picture, &["--edit", &path(&edits)], &["edits.toml", "did you mean frontalis_left"]);
    refused(&curves, &picture, &["--edit", &path(&gone)], &["gone.csv"]);
    let film = path(&clip);
    refused(
        &curves,
        &picture,
        &["--snapshots", "3", "--clip", &film],
        &["short.mp4", "moment at 3.00 s", "film of this take"],
    );
    refused(
        &curves,
        &picture,
        &["--snapshots", "3", "--clip", &path(&gone)],
        &["gone.csv", "Check the path"],
    );
    refused(&curves, &folder.path().join("out.jpg"), &[], &["out.jpg", ".livelink.csv"]);
    refused(&curves, &folder.path().join("e.livelink.csv"), &[], &["no head and eyes", "animate"]);
    refused(&curves, &folder.path().join("none/out.png"), &[], &["none/out.png", "Create the folder"]);
    refused(&curves, &curves, &[], &["would be written over"]);
    let run = finish(&mut plot(&curves, &[&picture], &["--snapshots", "soon"]));
    assert_eq!(run.code, Some(2), "{}", run.stderr);
}
