//! Clips as they come: faces that leave, two faces, folders of pictures, odd rates and rotation flags.

#![allow(clippy::panic, clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{fs, path::Path};

use common::{animate, asset, finish, folder, james, made, probe, short_clip, track};
use understudy::export::{MotionRecord, read_motion_csv};

const GOOD: &str = "-c:v libx264 -preset veryfast -crf 12 -an";

fn tracked(clip: &Path, more: &[&str]) -> (common::Run, Vec<MotionRecord>) {
    let table = clip.with_extension("csv");
    let run = finish(&mut track(clip, &table, more)).succeeded();
    (run, read_motion_csv(&table).unwrap())
}

/// The presentation times that ffprobe gives, nanoseconds since the first, to the microsecond.
fn stated_times(clip: &Path) -> Vec<i64> {
    let seconds: Vec<f64> =
        probe(clip, "v", "frame=pts_time").iter().map(|time| time.parse().unwrap()).collect();
    seconds.iter().map(|time| ((time - seconds[0]) * 1e9).round() as i64).collect()
}

#[track_caller]
fn times_agree(records: &[MotionRecord], stated: &[i64]) {
    assert_eq!(records.len(), stated.len());
    for (record, stated) in records.iter().zip(stated) {
        let error = (record.timestamp.0 - stated).abs();
        assert!(error <= 1_000, "frame {}: {:?}, but ffprobe says {stated}", record.frame, record.timestamp);
    }
}

#[test]
fn a_face_that_leaves_is_held_eased_and_blended_back() {
    let folder = folder();
    let blank = "-t 2.4 -vf drawbox=enable='between(t,0.79,1.59)':color=gray:t=fill";
    let clip = made(folder.path(), "gap.mp4", &[&asset("cap13")], &format!("{blank} {GOOD}"));
    let film = folder.path().join("film.mp4");
    let table = folder.path().join("gap.csv");
    finish(&mut animate(&clip, &james(), &[&film, &table], &["--size", "64x64"]))
        .succeeded()
        .warned(&["not seen in", "of 60 frames"]);
    assert_eq!(probe(&film, "v", "stream=nb_read_packets"), ["60"]);
    let records = read_motion_csv(&table).unwrap();
    let mut runs: Vec<(&str, usize)> = Vec::new();
    for record in &records {
        match runs.last_mut() {
            Some((state, count)) if *state == record.state => *count += 1,
            _ => runs.push((&record.state, 1)),
        }
        assert_eq!(record.success, matches!(record.state.as_str(), "tracking" | "blending"));
    }
    println!("{runs:?}");
    let states: Vec<&str> = runs.iter().map(|(state, _)| *state).collect();
    assert_eq!(states, ["tracking", "holding", "easing", "blending", "tracking"]);
    // 0.3 s of holding, 0.25 s of blending.
    assert!((7..=8).contains(&runs[1].1) && (5..=7).contains(&runs[3].1), "{runs:?}");
    let nose = |record: &MotionRecord| record.landmarks[4];
    for pair in records.windows(2) {
        let (a, b) = (nose(&pair[0]), nose(&pair[1]));
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 12.0, "the head jumps at frame {}", pair[1].frame);
    }
}

#[test]
fn of_two_faces_the_larger_is_followed() {
    let folder = folder();
    let filter = "-t 1 -filter_complex [0]split[a][b];[b]crop=200:220:110:60,scale=300:330[c];\
                  [a]crop=200:220:110:60,pad=200:330:0:60[d];[c][d]hstack";
    let clip = made(folder.path(), "two.mp4", &[&asset("cap13")], &format!("{filter} {GOOD}"));
    let (run, records) = tracked(&clip, &[]);
    run.warned(&["2 faces", "the largest is followed"]);
    assert_eq!(records.len(), 25);
    for record in &records {
        let [x, ..] = record.landmarks[4];
        assert!(record.success && x < 300.0, "frame {}: the nose is at {x}", record.frame);
    }
}

#[test]
fn a_folder_of_pictures_is_a_clip() {
    let folder = folder();
    let pictures = folder.path().join("pictures");
    fs::create_dir(&pictures).unwrap();
    made(&pictures, "%d.png", &[&asset("cap13")], "-frames:v 12");
    let table = folder.path().join("pictures.csv");
    finish(&mut track(&pictures, &table, &["--fps", "24"])).succeeded();
    let from_pictures = read_motion_csv(&table).unwrap();
    let film = made(folder.path(), "film.mkv", &[&asset("cap13")], "-frames:v 12 -c:v ffv1 -an");
    let (_, from_film) = tracked(&film, &[]);
    assert_eq!((from_pictures.len(), from_film.len()), (12, 12));
    for (i, (picture, frame)) in from_pictures.iter().zip(&from_film).enumerate() {
        assert_eq!(picture.timestamp.0, i as i64 * 1_000_000_000 / 24);
        let distance = (picture.landmarks[4][0] - frame.landmarks[4][0]).abs();
        assert!(distance < 0.5, "frame {i}: {distance} px apart");
    }
}

#[test]
fn a_variable_rate_keeps_the_containers_times() {
    let folder = folder();
    let dropped = "-t 2 -vf select='not(eq(mod(n,3),1))*not(eq(mod(n,7),2))' -vsync vfr";
    // Reordered frames are the ones whose times a decoder may withhold at the end of the file.
    for (name, codec) in [("reordered", "-bf 3"), ("plain", "-bf 0")] {
        let clip = made(
            folder.path(),
            &format!("{name}.mp4"),
            &[&asset("cap13")],
            &format!("{dropped} {GOOD} {codec}"),
        );
        let (_, records) = tracked(&clip, &[]);
        let stated = stated_times(&clip);
        assert!(stated.windows(3).any(|t| t[2] - t[1] != t[1] - t[0]), "the clip's rate is constant");
        times_agree(&records, &stated);
    }
}

#[test]
fn an_ntsc_rate_stays_exact() {
    let folder = folder();
    let source = short_clip(folder.path(), 0.8);
    let clip = folder.path().join("ntsc.mp4");
    let [source, target] = [&source, &clip].map(|path| path.to_str().unwrap());
    let mut arguments = vec!["-v", "error", "-r", "30000/1001", "-i", source];
    arguments.extend(GOOD.split(' '));
    arguments.push(target);
    common::helper("ffmpeg", &arguments);
    let (film, table) = (folder.path().join("film.mp4"), folder.path().join("ntsc.csv"));
    finish(&mut animate(&clip, &james(), &[&film, &table], &["--size", "64x64"])).succeeded();
    assert_eq!(
        probe(&film, "v", "stream=r_frame_rate,avg_frame_rate,nb_read_packets"),
        ["30000/1001,30000/1001,20"]
    );
    let records = read_motion_csv(&table).unwrap();
    times_agree(&records, &stated_times(&clip));
    assert_eq!(records[19].timestamp.0, (19.0 * 1001.0 / 30000.0 * 1e9_f64).round() as i64);
}

#[test]
fn a_rotation_flag_is_followed() {
    let folder = folder();
    let upright = short_clip(folder.path(), 0.4);
    for (flag, turn) in [("90", "transpose=2"), ("180", "hflip,vflip"), ("270", "transpose=1")] {
        let side = made(folder.path(), "side.mp4", &[&upright], &format!("-vf {turn} {GOOD}"));
        let flagged = format!("-c copy -metadata:s:v rotate={flag}");
        let clip = made(folder.path(), "flagged.mp4", &[&side], &flagged);
        let (run, records) = tracked(&clip, &[]);
        assert!(run.stdout.contains("400×300"), "{}", run.stdout);
        let [right, left, chin] = [33, 263, 152].map(|i: usize| records[0].landmarks[i]);
        assert!(right[0] < left[0] && chin[1] > right[1] + 40.0, "flag {flag}: the face is not upright");
        // Where the flag turns the face is where it is in the clip that was never turned.
        assert!((chin[0] - 208.0).abs() < 25.0 && (200.0..260.0).contains(&chin[1]), "chin at {chin:?}");
    }
}
