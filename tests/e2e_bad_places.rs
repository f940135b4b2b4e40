//! Places that cannot be written to, disks that fill up, and assets that are missing or damaged.

#![allow(clippy::panic, clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{
    fs,
    os::unix::fs::symlink,
    path::{Path, PathBuf},
    process::Command,
};

use common::{animate, finish, folder, james, names, short_clip, track};
use understudy::assets::Assets;

#[test]
fn outputs_that_cannot_be_written_are_refused_at_once() {
    let folder = folder();
    let clip = short_clip(folder.path(), 0.4);
    let scan = james();
    let at = |name: &str| folder.path().join(name);
    let refused = |output: &Path, words: &[&str]| {
        // The good output beside it must not be begun either.
        finish(&mut animate(&clip, &scan, &[&at("good.csv"), output], &[])).refused(words);
        assert_eq!(names(folder.path()), ["clip.mp4"]);
    };
    refused(&at("film.avi"), &["film.avi", "name it .mp4, .glb, .pc2, .csv or .png"]);
    refused(&at("film"), &["film", "name it .mp4"]);
    refused(&at("none/film.mp4"), &["none/film.mp4", "Create the folder"]);
    refused(&clip.join("film.mp4"), &["clip.mp4/film.mp4", "Not a directory"]);
    refused(Path::new("/proc/film.mp4"), &["/proc/film.mp4"]);
    fs::create_dir(at("folder.csv")).unwrap();
    finish(&mut track(&clip, &at("folder.csv"), &[])).refused(&["folder.csv", "Name a file"]);
}

/// A file system of 64 KiB, unmounted at the end.
struct SmallDisk(PathBuf);

impl SmallDisk {
    fn mount(at: PathBuf) -> Option<Self> {
        fs::create_dir(&at).unwrap();
        let mount = Command::new("mount")
            .args(["-t", "tmpfs", "-o", "size=64k", "understudy-test"])
            .arg(&at)
            .output();
        mount.is_ok_and(|output| output.status.success()).then_some(Self(at))
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        // The temporary folder's removal would fail on a mount that stays, and say so.
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

#[test]
fn a_full_disk_keeps_the_old_file() {
    let folder = folder();
    let clip = short_clip(folder.path(), 0.4);
    let Some(disk) = SmallDisk::mount(folder.path().join("disk")) else {
        println!("skipped: mounting a small file system takes more rights than this user has");
        return;
    };
    for name in ["a.pc2", "a.csv", "a.mp4", "a.glb", "a.png"] {
        let output = disk.0.join(name);
        fs::write(&output, b"old").unwrap();
        let run = finish(&mut animate(&clip, &james(), &[&output], &["--size", "1280x720"]));
        // A film of a few pictures may fit.
        if name != "a.mp4" || run.code != Some(0) {
            run.refused(&[name, "space"]);
            assert_eq!(fs::read(&output).unwrap(), b"old");
        }
        assert_eq!(names(&disk.0), [name]);
        fs::remove_file(&output).unwrap();
    }
}

/// The asset folder once more, made of links; what a test changes is copied first.
fn linked_assets(to: &Path) {
    let assets = Assets::locate().unwrap();
    for (asset, _) in assets.list() {
        let link = to.join(&asset.path);
        fs::create_dir_all(link.parent().unwrap()).unwrap();
        symlink(assets.verified(&asset.name).unwrap(), link).unwrap();
    }
}

#[test]
fn a_damaged_model_is_named_with_both_hashes() {
    let folder = folder();
    let clip = short_clip(folder.path(), 0.4);
    let copy = folder.path().join("assets");
    linked_assets(&copy);
    let table = folder.path().join("motion.csv");
    finish(track(&clip, &table, &[]).env("UNDERSTUDY_ASSETS", &copy)).succeeded();
    fs::remove_file(&table).unwrap();

    let model = copy.join("models/face_blendshapes.onnx");
    let mut bytes = fs::read(&model).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::remove_file(&model).unwrap();
    fs::write(&model, &bytes).unwrap();
    let wanted = Assets::locate().unwrap();
    let wanted =
        wanted.list().into_iter().find(|(a, _)| a.name == "face_blendshapes").unwrap().0.sha256.clone();
    let run = finish(track(&clip, &table, &[]).env("UNDERSTUDY_ASSETS", &copy));
    let run = run.refused(&["face_blendshapes.onnx", &wanted, "make setup"]);
    let hashes = run.stderr.split(|c: char| !c.is_ascii_hexdigit()).filter(|word| word.len() == 64).count();
    assert_eq!(hashes, 2, "{}", run.stderr);
    assert!(!table.exists());

    fs::remove_file(&model).unwrap();
    let run = finish(track(&clip, &table, &[]).env("UNDERSTUDY_ASSETS", &copy));
    run.refused(&["face_blendshapes.onnx", "no file there", "make setup"]);
    let run = finish(track(&clip, &table, &[]).env("UNDERSTUDY_ASSETS", folder.path().join("nowhere")));
    run.refused(&["nowhere", "make setup"]);
    assert_eq!(names(folder.path()), ["assets", "clip.mp4"]);
}

#[test]
fn the_scan_is_never_written_over() {
    let folder = folder();
    let clip = short_clip(folder.path(), 0.4);
    let scan = folder.path().join("scan.glb");
    fs::write(&scan, b"a scan").unwrap();
    finish(&mut animate(&clip, &scan, &[&scan], &[])).refused(&["scan.glb", "another name"]);
    assert_eq!(fs::read(&scan).unwrap(), b"a scan");
}
