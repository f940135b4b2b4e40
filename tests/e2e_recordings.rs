//! The recordings whose truth is known: head pose and the size of every motion come back.

#![allow(clippy::panic, clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{fs, path::PathBuf};

use common::{
    curves::{self, Measure},
    finish, folder, track,
};
use nalgebra::{Rotation3, Vector3};
use understudy::export::{MotionRecord, read_motion_csv};

/// The actors hold still for the first second.
const NEUTRAL_FRAMES: usize = 25;

/// Pixels of the films' sides.
const SIDE: f64 = 400.0;
/// Degrees that they span.
const FIELD_OF_VIEW: f64 = 24.0;

/// How much wider the mouth gets by a millimetre of smile: each corner goes out by 0.8 of it.
const WIDENING: f64 = 1.6;

/// One row of the truth; lengths in outer canthal distances.
struct Truth {
    rotation: Rotation3<f64>,
    yaw: f64,
    jaw: f64,
    smile: f64,
    brow: f64,
}

/// OpenFace's order of turns.
fn rotation([x, y, z]: [f64; 3]) -> Rotation3<f64> {
    Rotation3::new(Vector3::x() * x) * Rotation3::new(Vector3::y() * y) * Rotation3::new(Vector3::z() * z)
}

fn recording(name: &str) -> (Vec<MotionRecord>, Vec<Truth>) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("recordings").join(name);
    let folder = folder();
    let table = folder.path().join("motion.csv");
    finish(&mut track(
        &path.with_extension("mp4"),
        &table,
        &["--fov", &FIELD_OF_VIEW.to_string(), "--neutral", "0..0.96"],
    ))
    .succeeded();
    let records = read_motion_csv(&table).unwrap();
    let truth: Vec<Truth> = fs::read_to_string(path.with_extension("csv"))
        .unwrap()
        .lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            let angles = [cells[2], cells[3], cells[4]];
            let (rotation, yaw) = (rotation(angles), angles[1]);
            let [jaw, smile, brow] = [5, 6, 7].map(|motion: usize| cells[motion] / cells[8]);
            Truth { rotation, yaw, jaw, smile, brow }
        })
        .collect();
    assert_eq!(records.len(), truth.len());
    assert!(records.iter().all(|record| record.state == "tracking"));
    (records, truth)
}

/// The landmarks with the head's turn taken out: millimetres in the performer's own frame, y down as in a picture.
fn unposed(record: &MotionRecord) -> MotionRecord {
    let focal = SIDE / 2.0 / (FIELD_OF_VIEW.to_radians() / 2.0).tan();
    let translation = Vector3::from(record.translation);
    let back = rotation(record.rotation).inverse();
    let landmarks = record
        .landmarks
        .iter()
        .map(|[x, y, z]| {
            let depth = translation.z * (1.0 + z / focal);
            let centre = (SIDE - 1.0) / 2.0;
            let point = Vector3::new((x - centre) * depth / focal, (y - centre) * depth / focal, depth);
            (back * (point - translation)).into()
        })
        .collect();
    MotionRecord { landmarks, ..record.clone() }
}

/// Root mean square over the frames, and the largest: degrees between the head's true and its tracked turn since the
/// neutral.
fn head_error(records: &[MotionRecord], truth: &[Truth]) -> (f64, f64) {
    let tracked: Vec<_> = records.iter().map(|record| rotation(record.rotation)).collect();
    let (at_rest, true_rest) = (tracked[NEUTRAL_FRAMES / 2], truth[NEUTRAL_FRAMES / 2].rotation);
    let errors: Vec<f64> = tracked
        .iter()
        .zip(truth)
        .filter(|(_, truth)| truth.yaw.abs() <= 30_f64.to_radians())
        .map(|(tracked, truth)| {
            ((tracked * at_rest.inverse()).angle_to(&(truth.rotation * true_rest.inverse()))).to_degrees()
        })
        .collect();
    let squares = errors.iter().map(|error| error * error).sum::<f64>();
    ((squares / errors.len() as f64).sqrt(), errors.iter().copied().fold(0.0, f64::max))
}

fn measure(name: &str) -> &'static Measure {
    curves::MEASURES.iter().find(|measure| measure.name == name).unwrap()
}

/// How each motion of the face follows its truth; a gain of 1 is the motion's own size.
fn face(records: &[MotionRecord], truth: &[Truth]) -> Vec<(&'static str, curves::Following)> {
    let records: Vec<_> = records.iter().map(unposed).collect();
    [
        ("mouth gap", truth.iter().map(|t| t.jaw).collect::<Vec<_>>()),
        ("lower lip", truth.iter().map(|t| t.jaw).collect()),
        ("chin", truth.iter().map(|t| t.jaw).collect()),
        ("mouth width", truth.iter().map(|t| t.smile * WIDENING).collect()),
        ("brows", truth.iter().map(|t| t.brow).collect()),
    ]
    .into_iter()
    .map(|(name, truth)| (name, curves::following(&truth, &measure(name).curve(&records))))
    .collect()
}

#[track_caller]
fn well_followed(rows: &[(&str, curves::Following)], wanted: &[(&str, f64)]) {
    println!("{}", curves::table(rows));
    for (name, correlation) in wanted {
        let found = rows.iter().find(|(measure, _)| measure == name).unwrap().1;
        assert!(found.correlation >= *correlation, "{name}: {found:?}, wanted {correlation}");
    }
}

/// Pitch is what a single camera sees worst: james's comes out at 0.70 of its size, the average face's at 0.86, while
/// yaw and roll come out whole.
#[test]
fn a_turning_head_is_measured() {
    let (records, truth) = recording("james_turns");
    let (rms, worst) = head_error(&records, &truth);
    println!("james turns: {rms:.2}° RMS, {worst:.2}° at worst");
    assert!(rms <= 2.1, "{rms:.2}° RMS");
}

/// The scan has no mouth to look into, so the network sees its lips part late: the lower lip's place says more.
#[test]
fn a_still_heads_face_is_measured() {
    let (records, truth) = recording("james_acts");
    let (rms, worst) = head_error(&records, &truth);
    println!("james acts: head {rms:.2}° RMS, {worst:.2}° at worst");
    assert!(rms <= 1.0, "the face turns the head by {rms:.2}° RMS");
    let wanted =
        [("mouth gap", 0.88), ("lower lip", 0.95), ("chin", 0.95), ("mouth width", 0.95), ("brows", 0.95)];
    well_followed(&face(&records, &truth), &wanted);
}

#[test]
fn a_turning_acting_average_face_is_measured() {
    let (records, truth) = recording("average_turns_and_acts");
    let (rms, worst) = head_error(&records, &truth);
    println!("the average face turns and acts: head {rms:.2}° RMS, {worst:.2}° at worst");
    assert!(rms <= 2.1, "{rms:.2}° RMS");
    let wanted =
        [("mouth gap", 0.93), ("lower lip", 0.93), ("chin", 0.9), ("mouth width", 0.9), ("brows", 0.9)];
    well_followed(&face(&records, &truth), &wanted);
}
