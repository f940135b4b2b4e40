//! Landmark files: what is written is read back, and nothing read makes a reader panic.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]
#![allow(clippy::float_cmp, reason = "values pass through unchanged")]

use std::path::Path;

use nalgebra::Point3;
use proptest::prelude::*;
use understudy::scan::{
    LandmarkFile, LandmarkFormat, LandmarkScheme, read_landmarks, read_landmarks_bytes, write_landmarks,
};
use understudy::tracking::LandmarkState;

fn any_file() -> impl Strategy<Value = LandmarkFile> {
    let state = prop_oneof![
        Just(LandmarkState::Observed),
        Just(LandmarkState::Inferred),
        Just(LandmarkState::Absent)
    ];
    let number = prop_oneof![-300.0..300.0_f64, -1e-6..1e-6_f64, -1e12..1e12_f64, Just(-0.0)];
    let one = (state, [number.clone(), number.clone(), number], 0.0..=1.0_f64);
    (".{0,12}", proptest::collection::vec(one, 1..80)).prop_map(|(scan, list)| {
        let mut file = LandmarkFile::new(scan, vec![None; list.len()]);
        for (i, (state, place, confidence)) in list.into_iter().enumerate() {
            if state != LandmarkState::Absent {
                file.points[i] = Some(Point3::from(place));
                file.states[i] = state;
                file.confidences[i] = confidence;
            }
        }
        file
    })
}

fn near(a: Option<Point3<f64>>, b: Option<Point3<f64>>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => a.iter().zip(b.iter()).all(|(a, b)| (a - b).abs() <= 1e-14 * a.abs()),
        (None, None) => true,
        _ => false,
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    /// Places to 14 digits in every format, and the second writing byte for byte like the first.
    #[test]
    fn written_and_read_back(file in any_file()) {
        let folder = tempfile::tempdir().unwrap();
        for extension in ["json", "pts", "ljson"] {
            let path = folder.path().join(format!("a.{extension}"));
            write_landmarks(&path, &file).unwrap();
            let first = std::fs::read(&path).unwrap();
            let back = read_landmarks(&path).unwrap();
            prop_assert_eq!(back.points.len(), file.points.len());
            for (a, b) in back.points.iter().zip(&file.points) {
                prop_assert!(near(*a, *b), "{:?} {:?}", a, b);
            }
            if extension == "json" {
                prop_assert_eq!(&back.states, &file.states);
                prop_assert_eq!(&back.scan, &file.scan);
            }
            write_landmarks(&path, &back).unwrap();
            prop_assert_eq!(std::fs::read(&path).unwrap(), first);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn broken_files_never_panic(
        start in prop_oneof![
            Just(""),
            Just("{\"format\":\"understudy landmarks 1\",\"count\":2,\"points\":[{\"index\":0,"),
            Just("{\"version\":3,\"groups\":{\"a\":{\"landmarks\":{\"points\":[["),
            Just("version: 1\nn_points: 2\n{\n1 2"),
        ],
        rest in "[\\[\\]{}0-9nul.,:\"xyz \n-]{0,60}",
        bytes in proptest::collection::vec(any::<u8>(), 0..8),
    ) {
        let text = [start.as_bytes(), rest.as_bytes(), &bytes].concat();
        for format in [LandmarkFormat::Json, LandmarkFormat::Pts, LandmarkFormat::Ljson] {
            let _ = read_landmarks_bytes(&text, format, Path::new("x"));
        }
    }
}

#[test]
fn schemes_by_count() {
    let folder = tempfile::tempdir().unwrap();
    for (count, scheme) in [
        (478, LandmarkScheme::Network478),
        (468, LandmarkScheme::Network468),
        (68, LandmarkScheme::Ibug68),
        (22, LandmarkScheme::Other(22)),
    ] {
        let path = folder.path().join("l.json");
        write_landmarks(&path, &LandmarkFile::new("s", vec![Some(Point3::origin()); count])).unwrap();
        assert_eq!(read_landmarks(&path).unwrap().scheme(), scheme);
    }
}

#[test]
fn errors_name_the_file_and_the_way_out() {
    let folder = tempfile::tempdir().unwrap();
    let error = read_landmarks(&folder.path().join("a.lmk")).unwrap_err().to_string();
    assert!(error.contains("a.lmk") && error.contains(".pts"), "{error}");
    let file = LandmarkFile::new("s", vec![Some(Point3::origin())]);
    let error = write_landmarks(&folder.path().join("a.lm3"), &file).unwrap_err().to_string();
    assert!(error.contains("a.lm3") && error.contains(".ljson"), "{error}");
    let error = write_landmarks(&folder.path().join("none/a.json"), &file).unwrap_err().to_string();
    assert!(error.contains("cannot write") && error.contains("a.json"), "{error}");
    let path = folder.path().join("ljson inside.json");
    std::fs::write(&path, "{\"version\":2,\"landmarks\":{\"points\":[[1,2,3]]}}").unwrap();
    assert_eq!(read_landmarks(&path).unwrap().points[0], Some(Point3::new(1.0, 2.0, 3.0)));
}
