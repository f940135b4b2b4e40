//! An asset is handed out only when it is the file that the manifest names; otherwise the error says what to do.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::{fs, path::Path};

use tempfile::TempDir;
use understudy::assets::{AssetError, Assets, Condition};

/// SHA-256 of `abc`, the first example of FIPS 180-2 (appendix B.1).
const ABC: &str = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
/// SHA-256 of `abd`.
const ABD: &str = "a52d159f262b2c6ddb724a61840befc36eb30c88877a4030b65cbe86298449c9";

fn assets(root: &Path) -> Assets {
    let manifest = format!(
        "[[package]]\nname = \"letters\"\nversion = \"1.0\"\nregistry = \"none\"\n\
         [[asset]]\nname = \"abc\"\npath = \"text/abc.txt\"\npackage = \"letters\"\nmember = \"abc\"\n\
         sha256 = \"{ABC}\"\nbytes = 3\nlicence = \"MIT\"\npurpose = \"the first letters\"\n"
    );
    Assets::with_manifests(root, &[&manifest]).unwrap()
}

fn folder_with(content: &str) -> (TempDir, Assets) {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("text")).unwrap();
    fs::write(folder.path().join("text/abc.txt"), content).unwrap();
    let assets = assets(folder.path());
    (folder, assets)
}

fn conditions(found: &[(&understudy::assets::Asset, Condition)]) -> Vec<Condition> {
    found.iter().map(|(_, condition)| *condition).collect()
}

#[test]
fn the_right_file_is_handed_out() {
    let (folder, assets) = folder_with("abc");
    assert_eq!(assets.verified("abc").unwrap(), folder.path().join("text/abc.txt"));
    assert_eq!(conditions(&assets.list()), [Condition::Present]);
    assert_eq!(conditions(&assets.check()), [Condition::Verified]);
    assert_eq!(assets.list()[0].0.package, "letters 1.0 (none)");
}

#[test]
fn a_changed_file_is_refused_and_both_hashes_are_named() {
    let (_folder, assets) = folder_with("abd");
    let text = assets.verified("abc").unwrap_err().to_string();
    assert!(text.contains(ABC) && text.contains(ABD), "{text}");
    assert!(text.contains("remove the file and run `make setup` again"), "{text}");
    // Of the right size, so only the hash can tell.
    assert_eq!(conditions(&assets.list()), [Condition::Present]);
    assert_eq!(conditions(&assets.check()), [Condition::Corrupt]);
}

#[test]
fn a_file_cut_short_is_refused_with_its_size() {
    let (_folder, assets) = folder_with("ab");
    let text = assets.verified("abc").unwrap_err().to_string();
    assert!(text.contains("wanted 3 bytes") && text.contains("found 2 bytes"), "{text}");
    assert_eq!(conditions(&assets.list()), [Condition::Corrupt]);
}

#[test]
fn a_file_that_changes_size_after_it_was_verified_is_hashed_again() {
    let (folder, assets) = folder_with("abc");
    assets.verified("abc").unwrap();
    fs::write(folder.path().join("text/abc.txt"), "abcd").unwrap();
    assert!(matches!(assets.verified("abc"), Err(AssetError::Corrupt { .. })));
}

#[test]
fn a_missing_file_names_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let assets = assets(folder.path());
    let error = assets.verified("abc").unwrap_err();
    assert!(matches!(error, AssetError::Missing { .. }));
    let text = error.to_string();
    assert!(text.contains("run `make setup`") && text.contains("text/abc.txt"), "{text}");
    assert_eq!(conditions(&assets.list()), [Condition::Missing]);
    assert_eq!(conditions(&assets.check()), [Condition::Missing]);
}

#[test]
fn a_folder_in_the_place_of_a_file_is_not_readable() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir_all(folder.path().join("text/abc.txt")).unwrap();
    let assets = assets(folder.path());
    assert!(matches!(assets.verified("abc"), Err(AssetError::Unreadable { .. })));
    assert_eq!(conditions(&assets.check()), [Condition::Corrupt]);
}

#[test]
fn an_unknown_name_lists_the_known_ones() {
    let assets = Assets::at("/nowhere").unwrap();
    let text = assets.verified("face_detecter").unwrap_err().to_string();
    assert!(text.contains("face_detecter") && text.contains("face_detector,"), "{text}");
}
