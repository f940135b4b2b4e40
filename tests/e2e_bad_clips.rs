//! Clips that cannot be used are refused in one sentence that names the file and what to do; nothing is left behind.

#![allow(clippy::panic, clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{
    fs,
    path::{Path, PathBuf},
};

use common::{Run, animate, asset, finish, folder, helper, james, made, names, short_clip, track};

/// Animates into a folder of its own that holds a good film already.
struct Attempt {
    folder: tempfile::TempDir,
}

impl Attempt {
    fn new() -> Self {
        let folder = folder();
        fs::write(folder.path().join("film.mp4"), b"a good film").unwrap();
        Self { folder }
    }

    fn run(&self, clip: &Path, more: &[&str]) -> Run {
        let at = |name: &str| self.folder.path().join(name);
        finish(&mut animate(clip, &james(), &[&at("film.mp4"), &at("motion.csv")], more))
    }

    /// Nothing new in the folder, and the film untouched.
    #[track_caller]
    fn left_nothing(&self) {
        assert_eq!(names(self.folder.path()), ["film.mp4"]);
        assert_eq!(fs::read(self.folder.path().join("film.mp4")).unwrap(), b"a good film");
    }
}

#[track_caller]
fn refused(clip: &Path, more: &[&str], words: &[&str]) {
    let attempt = Attempt::new();
    let name = clip.file_name().unwrap().to_str().unwrap();
    attempt.run(clip, more).refused(words).refused(&[name]);
    attempt.left_nothing();
}

#[test]
fn files_that_are_no_videos() {
    let folder = folder();
    let clip = short_clip(folder.path(), 0.5);
    let bytes = fs::read(&clip).unwrap();
    let write = |name: &str, bytes: &[u8]| -> PathBuf {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        path
    };
    refused(&folder.path().join("missing.mp4"), &[], &["No such file", "Check the path"]);
    refused(&write("empty.mp4", b""), &[], &["is empty", "Record it again"]);
    refused(&write("cut.mp4", &bytes[..bytes.len() / 3]), &[], &["cut off", "ffmpeg -i"]);
    refused(&write("text.mp4", b"This is no film."), &[], &["not a video", "ffmpeg -i"]);
    refused(&write("noise.mp4", &bytes.iter().rev().copied().collect::<Vec<_>>()), &[], &["not a video"]);
    let bare = folder.path().join("bare");
    fs::create_dir(&bare).unwrap();
    refused(&bare, &[], &["holds no .png", "Name a folder"]);
}

#[test]
fn a_picture_of_one_pixel() {
    let folder = folder();
    let raw = folder.path().join("raw");
    fs::write(&raw, [128_u8; 5]).unwrap();
    let dot = folder.path().join("dot.mkv");
    let input = ["-f", "rawvideo", "-pix_fmt", "gray", "-s", "1x1", "-r", "25", "-i", raw.to_str().unwrap()];
    let all = [&["-v", "error"], &input[..], &["-c:v", "ffv1", dot.to_str().unwrap()]].concat();
    helper("ffmpeg", &all);
    refused(&dot, &[], &["1×1 pixels", "too small", "at least 32×32"]);
}

#[test]
fn a_clip_without_a_face() {
    let folder = folder();
    let pattern = "-f lavfi -i testsrc=size=320x240:rate=25:duration=1 -c:v libx264";
    let clip = made(folder.path(), "pattern.mp4", &[], pattern);
    refused(&clip, &[], &["no face was found in any of the 25 frames", "Check that the face is upright"]);
}

#[test]
fn settings_that_do_not_fit_the_clip() {
    let folder = folder();
    let clip = short_clip(folder.path(), 1.0);
    refused(&clip, &["--neutral", "40..50"], &["between 40.00 and 50.00 s", "leave it out"]);
    let unfit =
        [("--fov", "0"), ("--neutral", "5..1"), ("--size", "99x99"), ("--threads", "0"), ("--fps", "0")];
    for (option, value) in unfit {
        let attempt = Attempt::new();
        let run = attempt.run(&clip, &[option, value]);
        assert_eq!(run.code, Some(2), "{option} {value}: {}", run.stderr);
        assert!(run.stderr.contains(option) && run.stderr.contains(value), "{}", run.stderr);
        attempt.left_nothing();
    }
}

#[test]
fn a_talking_stretch_is_no_neutral_unless_it_is_accepted() {
    let folder = folder();
    let clip = asset("cap13");
    let part = made(folder.path(), "talk.mp4", &[&clip], "-t 6 -c:v libx264 -preset veryfast -crf 12");
    let table = folder.path().join("talk.csv");
    finish(&mut track(&part, &table, &["--raw"])).succeeded();
    let records = understudy::export::read_motion_csv(&table).unwrap();
    let gap = |i: usize| records[i].landmarks[14][1] - records[i].landmarks[13][1];
    let widest = (0..records.len()).max_by(|&a, &b| gap(a).total_cmp(&gap(b))).unwrap();
    let time = records[widest].timestamp.seconds();
    let stretch = format!("{time:.2}..{time:.2}");
    refused(
        &part,
        &["--neutral", &stretch],
        &["cannot serve as the neutral", "lips are parted", "--accept-neutral"],
    );
    let run = finish(&mut track(&part, &table, &["--neutral", &stretch, "--accept-neutral"])).succeeded();
    assert!(run.stdout.contains(&format!("neutral taken from {time:.2}")), "{}", run.stdout);
}

#[test]
fn the_clip_is_never_written_over() {
    let folder = folder();
    let clip = short_clip(folder.path(), 0.5);
    let before = fs::read(&clip).unwrap();
    finish(&mut animate(&clip, &james(), &[&clip], &[])).refused(&["clip.mp4", "another name"]);
    let link = folder.path().join("link.mp4");
    std::os::unix::fs::symlink(&clip, &link).unwrap();
    finish(&mut animate(&clip, &james(), &[&link], &[])).refused(&["link.mp4", "another name"]);
    finish(&mut track(&clip, &clip, &[])).refused(&["clip.mp4", "another name"]);
    assert_eq!(fs::read(&clip).unwrap(), before);
    assert_eq!(names(folder.path()), ["clip.mp4", "link.mp4"]);
}
