//! The manifests that are compiled in: complete, well formed, without doubles, and true of what `make setup` brought.

use std::{collections::BTreeSet, path::Component};

use understudy::assets::{Assets, Condition};

#[test]
fn every_entry_is_complete() {
    let assets = Assets::at("/nowhere").unwrap();
    let entries = assets.list();
    assert!(entries.len() >= 15, "only {} assets", entries.len());
    for (asset, condition) in &entries {
        let name = &asset.name;
        let hexadecimal = |c: char| c.is_ascii_digit() || ('a'..='f').contains(&c);
        assert_eq!(asset.sha256.len(), 64, "{name}");
        assert!(asset.sha256.chars().all(hexadecimal), "{name}: {}", asset.sha256);
        assert!(asset.bytes > 0, "{name}");
        assert!(
            ["Apache-2.0", "MIT", "BSD-3-Clause", "LicenseRef-Pexels"].contains(&asset.licence.as_str()),
            "{name}"
        );
        assert!(!asset.purpose.is_empty() && !asset.member.is_empty(), "{name}");
        let inside = |part: Component| matches!(part, Component::Normal(_));
        assert!(asset.path.components().all(inside), "{name}: {}", asset.path.display());
        assert_eq!(*condition, Condition::Missing, "{name}");
    }
}

#[test]
fn no_name_and_no_path_stands_twice() {
    let assets = Assets::at("/nowhere").unwrap();
    let entries = assets.list();
    let names: BTreeSet<_> = entries.iter().map(|(asset, _)| &asset.name).collect();
    let paths: BTreeSet<_> = entries.iter().map(|(asset, _)| &asset.path).collect();
    assert_eq!((names.len(), paths.len()), (entries.len(), entries.len()));
}

#[test]
fn what_the_set_up_brought_verifies() {
    let assets = Assets::locate().unwrap();
    for (asset, _) in assets.list() {
        if let Err(error) = assets.verified(&asset.name) {
            panic!("{error}");
        }
    }
}

#[test]
fn the_canonical_face_has_the_shape_that_the_landmarks_want() {
    let path = Assets::locate().unwrap().verified("canonical_face").unwrap();
    let face: serde_json::Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let count = |key: &str| face[key].as_array().map(Vec::len);
    assert_eq!(count("positions_cm"), Some(468));
    assert_eq!(count("uvs"), Some(468));
    assert_eq!(count("triangles"), Some(898));
    assert_eq!(count("procrustes_weights"), Some(33));
    // The outer corners of the eyes, 33 the subject's right, mirror each other and +X is the subject's left.
    let x = |index: usize| face["positions_cm"][index][0].as_f64();
    assert_eq!((x(33), x(263)), (Some(-4.445_859), Some(4.445_859)));
}
