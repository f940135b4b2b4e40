//! Point caches and motion tables, read back.

// What was written comes back exactly, and a helper that cannot go on ends its test.
#![allow(clippy::float_cmp, clippy::panic, clippy::unwrap_used)]

use std::fs;
use std::process::Command;

use understudy::capture::FrameRate;
use understudy::export::{ExportError, MotionCsvWriter, MotionRow, Pc2Reader, Pc2Writer, read_motion_csv};

fn sample(index: usize) -> Vec<[f32; 3]> {
    (0..7).map(|point| [point as f32 * 0.1, -(index as f32), 1e-20]).collect()
}

#[test]
fn a_point_cache_comes_back_in_any_order() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("face.pc2");
    let mut writer = Pc2Writer::create(&path, 7).unwrap();
    for index in 0..5 {
        writer.write_sample(&sample(index)).unwrap();
    }
    assert!(!path.exists());
    writer.commit().unwrap();
    let mut reader = Pc2Reader::open(&path).unwrap();
    assert_eq!((reader.points(), reader.samples(), reader.start(), reader.sampling()), (7, 5, 0.0, 1.0));
    let mut positions = Vec::new();
    for index in [4, 0, 2, 2] {
        reader.read_sample(index, &mut positions).unwrap();
        assert_eq!(positions, sample(index));
    }
    assert!(reader.read_sample(5, &mut positions).unwrap_err().to_string().contains("sample 5"));
    let bytes = fs::read(&path).unwrap();
    let header = b"POINTCACHE2\0\x01\0\0\0\x07\0\0\0\0\0\0\0\0\0\x80\x3f\x05\0\0\0";
    assert_eq!(&bytes[..32], header);
    assert_eq!(bytes.len(), 32 + 5 * 7 * 12);
}

#[test]
fn a_point_cache_refuses_what_it_cannot_hold_and_keeps_the_old_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("face.pc2");
    fs::write(&path, b"old").unwrap();
    for points in [0, 1 << 31, usize::MAX] {
        assert!(matches!(Pc2Writer::create(&path, points), Err(ExportError::Refused { .. })));
    }
    let mut writer = Pc2Writer::create(&path, 7).unwrap();
    writer.write_sample(&sample(0)).unwrap();
    let mut bad = sample(1);
    assert!(writer.write_sample(&bad[..6]).unwrap_err().to_string().contains("6 points, not 7"));
    bad[3][1] = f32::NAN;
    let error = writer.write_sample(&bad).unwrap_err().to_string();
    assert!(error.contains("point 3 of sample 1") && error.contains("face.pc2"), "{error}");
    drop(writer);
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn damaged_point_caches_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("face.pc2");
    let mut writer = Pc2Writer::create(&path, 7).unwrap();
    writer.write_sample(&sample(0)).unwrap();
    writer.commit().unwrap();
    let good = fs::read(&path).unwrap();
    let damaged = |change: &dyn Fn(&mut Vec<u8>), words: &str| {
        let mut bytes = good.clone();
        change(&mut bytes);
        fs::write(&path, bytes).unwrap();
        let error = Pc2Reader::open(&path).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("face.pc2"), "{error}");
    };
    damaged(&|bytes| bytes.truncate(20), "20 bytes");
    damaged(&|bytes| bytes.truncate(100), "take 116 bytes");
    damaged(&|bytes| bytes[0] = b'X', "POINTCACHE2");
    damaged(&|bytes| bytes[12] = 2, "version 2");
    damaged(&|bytes| bytes[19] = 0xff, "claims -");
    damaged(&|bytes| bytes[16..20].copy_from_slice(&i32::MAX.to_le_bytes()), "take");
    let missing = Pc2Reader::open(&folder.path().join("none.pc2")).unwrap_err();
    assert!(matches!(missing, ExportError::Read { .. }));
}

const RATE: FrameRate = FrameRate { numerator: 30_000, denominator: 1001 };

fn landmarks(frame: u64) -> Vec<[f64; 3]> {
    (0..478)
        .map(|index| [f64::from(index) * 1.234_567_891, 479.9996 - frame as f64, -f64::from(index) / 7.1])
        .collect()
}

fn row(frame: u64, landmarks: &[[f64; 3]]) -> MotionRow<'_> {
    MotionRow {
        actions: &[],
        frame,
        timestamp: RATE.tick(frame - 1),
        confidence: 0.987_65,
        success: true,
        translation: [-12.345_67, 3.0, 600.123_4],
        rotation: [0.123_456_7, -1.0, 2.999_999_9],
        landmarks,
        state: "tracking",
        gaze: [-0.123_456_7, 0.25],
        closure: [-0.4, 0.876_54],
    }
}

#[test]
fn a_motion_table_comes_back_to_the_printed_decimals() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.csv");
    let mut writer = MotionCsvWriter::create(&path, 478, &[]).unwrap();
    for frame in 1..=20 {
        writer.write_row(&row(frame, &landmarks(frame))).unwrap();
    }
    writer.commit().unwrap();
    let records = read_motion_csv(&path).unwrap();
    assert_eq!(records.len(), 20);
    let printed = |value: f64, decimals: usize| format!("{value:.decimals$}").parse::<f64>().unwrap();
    for (record, frame) in records.iter().zip(1..) {
        assert_eq!((record.frame, record.success, record.state.as_str()), (frame, true, "tracking"));
        assert_eq!(record.timestamp, RATE.tick(frame - 1), "exact to the nanosecond");
        assert!((record.confidence - 0.987_65).abs() <= 0.000_05);
        assert_eq!(record.translation, [-12.346, 3.0, 600.123]);
        assert_eq!(record.rotation, [0.123_457, -1.0, 3.0]);
        assert_eq!((record.gaze, record.closure), ([-0.123_457, 0.25], [-0.4, 0.8765]));
        for (got, wanted) in record.landmarks.as_flattened().iter().zip(landmarks(frame).as_flattened()) {
            assert_eq!(*got, printed(*wanted, 3));
        }
    }
    let text = fs::read_to_string(&path).unwrap();
    let header =
        "frame,face_id,timestamp,confidence,success,pose_Tx,pose_Ty,pose_Tz,pose_Rx,pose_Ry,pose_Rz,x_0,x_1,";
    assert!(text.starts_with(header));
    let last = ",z_477,state,gaze_angle_x,gaze_angle_y,closure_right,closure_left";
    assert!(text.lines().next().unwrap().ends_with(last));
    assert!(text.lines().nth(2).unwrap().starts_with("2,0,0.033366666,0.98"));
}

#[test]
fn what_is_absent_is_an_empty_cell() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.csv");
    let mut writer = MotionCsvWriter::create(&path, 2, &[]).unwrap();
    let gone = [f64::NAN; 3];
    let lost = MotionRow {
        success: false,
        confidence: 0.0,
        translation: gone,
        rotation: gone,
        state: "lost",
        gaze: [f64::NAN; 2],
        closure: [f64::NAN; 2],
        ..row(1, &[])
    };
    writer.write_row(&lost).unwrap();
    let half = [[1.5, 2.5, f64::NAN], gone];
    writer.write_row(&row(2, &half)).unwrap();
    writer.commit().unwrap();
    let text = fs::read_to_string(&path).unwrap();
    assert_eq!(text.lines().nth(1).unwrap(), "1,0,0.000000000,0.0000,0,,,,,,,,,,,,,lost,,,,");
    assert!(
        text.lines().nth(2).unwrap().ends_with(",1.500,,2.500,,,,tracking,-0.123457,0.250000,-0.4000,0.8765")
    );
    let records = read_motion_csv(&path).unwrap();
    assert!(
        records[0].translation.iter().chain(records[0].landmarks.as_flattened()).all(|value| value.is_nan())
    );
    assert!(records[0].gaze.iter().chain(&records[0].closure).all(|value| value.is_nan()));
    assert_eq!(records[1].landmarks[0][..2], [1.5, 2.5]);
}

#[test]
fn a_motion_table_refuses_what_breaks_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.csv");
    let mut writer = MotionCsvWriter::create(&path, 478, &[]).unwrap();
    let points = landmarks(1);
    let mut refused = |row: MotionRow, words: &str| {
        let error = writer.write_row(&row).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("motion.csv"), "{error}");
    };
    refused(row(1, &points[..68]), "68 landmarks, not 478");
    refused(MotionRow { confidence: f64::INFINITY, ..row(3, &points) }, "frame 3 holds an infinite");
    refused(MotionRow { closure: [1.0, f64::INFINITY], ..row(4, &points) }, "frame 4 holds an infinite");
    refused(MotionRow { state: "a,b", ..row(1, &points) }, "a,b");
    drop(writer);
    assert!(!path.exists());
}

#[test]
fn a_full_disk_stops_a_point_cache_with_its_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let mount = folder.path().to_str().unwrap();
    let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", "size=64k", "none", mount]).output();
    if !mounted.is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: a small file system cannot be mounted here");
        return;
    }
    let path = folder.path().join("face.pc2");
    fs::write(&path, b"old").unwrap();
    let result = Pc2Writer::create(&path, 7).and_then(|mut writer| {
        for index in 0..10_000 {
            writer.write_sample(&sample(index))?;
        }
        writer.commit()
    });
    let (kept, count) = (fs::read(&path).unwrap(), fs::read_dir(folder.path()).unwrap().count());
    assert!(Command::new("umount").arg(mount).status().unwrap().success());
    let error = result.unwrap_err().to_string();
    assert!(error.contains("face.pc2") && error.contains("free some space"), "{error}");
    assert_eq!((kept.as_slice(), count), (&b"old"[..], 1));
}

#[test]
fn an_unwritable_folder_is_refused_at_once() {
    // The kernel's own folders refuse even root.
    let error = Pc2Writer::create("/proc/face.pc2".as_ref(), 7).unwrap_err();
    assert!(matches!(error, ExportError::Create { .. }), "{error}");
}
