//! What the end-to-end tests share: the program run as a user runs it, clips made with ffmpeg, folders watched.

#![allow(dead_code, reason = "each test uses its own part of this file")]
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "helpers of tests fail as tests do"
)]

pub mod acting;
pub mod curves;
pub mod gltf_validator;
pub mod muscle_takes;
pub mod opened;
pub mod rays;
pub mod rims;
pub mod sound;
pub mod topology;

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use tempfile::TempDir;
use understudy::assets::Assets;

/// What a run of the program said and how it ended.
pub struct Run {
    /// `None` when a signal killed it.
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
    /// For messages.
    pub command: String,
}

impl Run {
    fn of(command: &Command, output: &Output) -> Self {
        Self {
            code: output.status.code(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
            command: format!("{command:?}"),
        }
    }

    /// The run ended well.
    #[track_caller]
    pub fn succeeded(self) -> Self {
        assert_eq!(self.code, Some(0), "{}\n{}\n{}", self.command, self.stdout, self.stderr);
        self
    }

    /// The run was refused in one line on standard error that holds every one of `words`.
    #[track_caller]
    pub fn refused(self, words: &[&str]) -> Self {
        assert_eq!(self.code, Some(1), "{}\n{}\n{}", self.command, self.stdout, self.stderr);
        let said = self.stderr.trim_end();
        assert!(said.starts_with("error: ") && said.lines().count() == 1, "not one sentence: {said}");
        for word in words {
            assert!(said.contains(word), "{word:?} is not in: {said}");
        }
        self
    }

    /// Standard error holds every one of `words`.
    #[track_caller]
    pub fn warned(self, words: &[&str]) -> Self {
        for word in words {
            assert!(self.stderr.contains(word), "{word:?} is not in: {}", self.stderr);
        }
        self
    }
}

/// The program, ready for its arguments.
pub fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_understudy"));
    command.env_remove("UNDERSTUDY_LOG");
    command
}

/// Runs a prepared command to its end.
pub fn finish(command: &mut Command) -> Run {
    let output = command.output().expect("the program starts");
    Run::of(command, &output)
}

/// `understudy animate CLIP --target SCAN -o … `, then `more`.
pub fn animate(clip: &Path, scan: &Path, outputs: &[&Path], more: &[&str]) -> Command {
    let mut command = program();
    command.arg("animate").arg(clip).arg("--target").arg(scan);
    for output in outputs {
        command.arg("-o").arg(output);
    }
    command.args(more);
    command
}

/// `understudy track CLIP -o TABLE`, then `more`.
pub fn track(clip: &Path, table: &Path, more: &[&str]) -> Command {
    let mut command = program();
    command.arg("track").arg(clip).arg("-o").arg(table).args(more);
    command
}

/// An asset that the set-up brings; its absence fails the test with what to do.
pub fn asset(name: &str) -> PathBuf {
    Assets::locate().and_then(|assets| assets.verified(name)).unwrap_or_else(|error| panic!("{error}"))
}

/// The textured scan that most tests animate, in the folder of its material and texture.
pub fn james() -> PathBuf {
    for companion in ["james_mtl", "james_jpg"] {
        asset(companion);
    }
    asset("james_obj")
}

/// An empty folder that is removed at the end.
pub fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// The names in a folder, hidden ones included, in order.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a readable folder");
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Runs a helper program and gives what it printed.
#[track_caller]
pub fn helper(name: &str, arguments: &[&str]) -> String {
    let output =
        Command::new(name).args(arguments).output().unwrap_or_else(|error| panic!("{name}: {error}"));
    assert!(output.status.success(), "{name} {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Makes `folder/name` with ffmpeg; `arguments` go from the inputs to the encoder's settings, separated by blanks.
#[track_caller]
pub fn made(folder: &Path, name: &str, inputs: &[&Path], arguments: &str) -> PathBuf {
    let path = folder.join(name);
    let mut all = vec!["-v", "error", "-y"];
    for input in inputs {
        all.extend(["-i", input.to_str().unwrap()]);
    }
    all.extend(arguments.split_whitespace());
    all.push(path.to_str().unwrap());
    helper("ffmpeg", &all);
    path
}

/// The first `seconds` of the webcam clip, hardly compressed.
pub fn short_clip(folder: &Path, seconds: f64) -> PathBuf {
    let arguments = format!("-t {seconds} -c:v libx264 -preset veryfast -crf 12 -an");
    made(folder, "clip.mp4", &[&asset("cap13")], &arguments)
}

/// One line of ffprobe's for each stream or frame that `stream` selects.
#[track_caller]
pub fn probe(path: &Path, stream: &str, entries: &str) -> Vec<String> {
    let printed = helper(
        "ffprobe",
        &[
            "-v",
            "error",
            "-count_packets",
            "-select_streams",
            stream,
            "-show_entries",
            entries,
            "-of",
            "csv=p=0",
            path.to_str().unwrap(),
        ],
    );
    printed
        .lines()
        .map(|line| line.trim_end_matches(',').to_owned())
        .filter(|line| !line.is_empty())
        .collect()
}

/// The vertices of an OBJ, read here once more so that the test does not lean on the program's own reader.
pub fn obj_vertices(path: &Path) -> Vec<[f64; 3]> {
    let text = fs::read_to_string(path).expect("an OBJ");
    text.lines()
        .filter_map(|line| line.strip_prefix("v "))
        .map(|rest| {
            let numbers: Vec<f64> = rest.split_whitespace().take(3).map(|n| n.parse().unwrap()).collect();
            [numbers[0], numbers[1], numbers[2]]
        })
        .collect()
}
