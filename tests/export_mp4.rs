//! Videos written through ffmpeg, probed with ffprobe.

// What was written comes back exactly, and a helper that cannot go on ends its test.
#![allow(clippy::float_cmp, clippy::panic, clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use understudy::capture::{FrameRate, Timestamp};
use understudy::export::{ExportError, Mp4Settings, Mp4Writer, Sound};

const NTSC: FrameRate = FrameRate { numerator: 30_000, denominator: 1001 };

fn run(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).output().unwrap();
    assert!(output.status.success(), "{program} {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn probe(path: &Path, stream: &str, entries: &str) -> String {
    let arguments = ["-v", "error", "-count_packets", "-select_streams", stream, "-show_entries", entries];
    let mut arguments = arguments.to_vec();
    arguments.extend(["-of", "csv=p=0", path.to_str().unwrap()]);
    run("ffprobe", &arguments).trim().to_owned()
}

/// Three seconds of test pattern and tone in `codec`.
fn clip(folder: &Path, name: &str, codec: &[&str]) -> PathBuf {
    let path = folder.join(name);
    let mut arguments = vec!["-v", "error", "-f", "lavfi", "-i", "testsrc=s=64x48:r=30000/1001:d=3"];
    arguments.extend(["-f", "lavfi", "-i", "sine=f=440:d=3", "-c:v", "libx264"]);
    arguments.extend(codec);
    arguments.push(path.to_str().unwrap());
    run("ffmpeg", &arguments);
    path
}

fn write(path: &Path, settings: Mp4Settings, pictures: usize) -> Result<(), ExportError> {
    let (width, height) = (settings.width as usize, settings.height as usize);
    let mut writer = Mp4Writer::create(path, settings)?;
    for picture in 0..pictures {
        let rgba: Vec<u8> = (0..width * height)
            .flat_map(|pixel| [(pixel % width) as u8, (picture * 4) as u8, (pixel / width) as u8, 255])
            .collect();
        writer.write_picture(&rgba)?;
    }
    writer.commit()
}

fn settings(width: u32, height: u32) -> Mp4Settings {
    Mp4Settings::new(width, height, NTSC)
}

fn sounding(clip: PathBuf) -> Mp4Settings {
    let sound = Some(Sound { clip, start: Timestamp(0) });
    Mp4Settings { sound, ..settings(64, 48) }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_silent_video_has_every_picture_at_its_exact_rate_and_is_tagged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.mp4");
    write(&path, settings(64, 48), 50).unwrap();
    let entries = "stream=codec_name,profile,width,height,pix_fmt,color_range,color_space,color_transfer,\
                   color_primaries,r_frame_rate,avg_frame_rate,nb_read_packets";
    assert_eq!(
        probe(&path, "v", entries),
        "h264,High,64,48,yuv420p,tv,bt709,bt709,bt709,30000/1001,30000/1001,50"
    );
    assert_eq!(names(folder.path()), ["out.mp4"]);
    let bytes = fs::read(&path).unwrap();
    let at = |tag: &[u8]| bytes.windows(4).position(|window| window == tag).unwrap();
    assert!(at(b"moov") < at(b"mdat"), "the index comes first");

    write(&folder.path().join("again.mp4"), settings(64, 48), 50).unwrap();
    assert_eq!(bytes, fs::read(folder.path().join("again.mp4")).unwrap());
}

#[test]
fn colours_are_converted_by_bt709() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("red.mp4");
    let mut writer = Mp4Writer::create(&path, settings(64, 64)).unwrap();
    for _ in 0..3 {
        writer.write_picture(&[255, 0, 0, 255].repeat(64 * 64)).unwrap();
    }
    writer.commit().unwrap();
    let raw = folder.path().join("red.yuv");
    let (from, to) = (path.to_str().unwrap(), raw.to_str().unwrap());
    run("ffmpeg", &["-v", "error", "-i", from, "-f", "rawvideo", "-pix_fmt", "yuv420p", to]);
    let yuv = fs::read(raw).unwrap();
    // BT.709 limited range of pure red is (63, 102, 240); BT.601 would give (81, 90, 240).
    let (y, u, v) = (yuv[0], yuv[64 * 64], yuv[64 * 64 + 32 * 32]);
    assert!(y.abs_diff(63) <= 1 && u.abs_diff(102) <= 1 && v.abs_diff(240) <= 1, "{y} {u} {v}");
}

#[test]
fn sound_is_copied_where_it_fits_and_cut_to_the_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let clip = clip(folder.path(), "clip.mp4", &["-c:a", "aac"]);
    let path = folder.path().join("out.mp4");
    write(&path, sounding(clip), 60).unwrap();
    assert_eq!(probe(&path, "v", "stream=r_frame_rate,nb_read_packets"), "30000/1001,60");
    assert_eq!(probe(&path, "a", "stream=codec_name"), "aac");
    let seconds: f64 = probe(&path, "a", "stream=duration").parse().unwrap();
    assert!((seconds - 60.0 * 1.001 / 30.0).abs() < 0.05, "{seconds}");
    assert_eq!(names(folder.path()), ["clip.mp4", "out.mp4"]);
}

#[test]
fn pictures_are_never_cut_to_a_shorter_sound() {
    let folder = tempfile::tempdir().unwrap();
    let clip = clip(folder.path(), "clip.mp4", &["-c:a", "aac"]);
    let path = folder.path().join("out.mp4");
    write(&path, sounding(clip), 150).unwrap();
    assert_eq!(probe(&path, "v", "stream=nb_read_packets"), "150");
}

#[test]
fn sound_that_does_not_fit_mp4_becomes_aac() {
    let folder = tempfile::tempdir().unwrap();
    for (name, codec) in [("pcm.mkv", "pcm_s16le"), ("vorbis.mkv", "libvorbis")] {
        let clip = clip(folder.path(), name, &["-c:a", codec]);
        let path = folder.path().join("out.mp4");
        write(&path, sounding(clip), 30).unwrap();
        assert_eq!(probe(&path, "a", "stream=codec_name"), "aac", "{name}");
        assert_eq!(probe(&path, "v", "stream=nb_read_packets"), "30", "{name}");
    }
}

#[test]
fn a_clip_without_sound_gives_a_silent_video() {
    let folder = tempfile::tempdir().unwrap();
    let clip = clip(folder.path(), "clip.mp4", &["-an"]);
    let path = folder.path().join("out.mp4");
    write(&path, sounding(clip), 10).unwrap();
    assert_eq!(probe(&path, "a", "stream=codec_name"), "");
}

#[test]
fn sound_starts_with_the_first_picture() {
    let folder = tempfile::tempdir().unwrap();
    // Silence for one second, then a tone; the pictures begin half a second after the sound.
    let clip = folder.path().join("late.mkv");
    let tone = "sine=f=440:d=2,adelay=1000";
    let mut arguments =
        vec!["-v", "error", "-itsoffset", "0.5", "-f", "lavfi", "-i", "testsrc=s=64x48:r=25:d=2"];
    arguments.extend(["-f", "lavfi", "-i", tone, "-c:v", "libx264", "-c:a", "pcm_s16le"]);
    arguments.push(clip.to_str().unwrap());
    run("ffmpeg", &arguments);
    let path = folder.path().join("out.mp4");
    let start = Timestamp(200_000_000);
    let sound = Some(Sound { clip, start });
    write(&path, Mp4Settings { sound, ..settings(64, 48) }, 45).unwrap();
    let raw = folder.path().join("sound.raw");
    let (from, to) = (path.to_str().unwrap(), raw.to_str().unwrap());
    run("ffmpeg", &["-v", "error", "-i", from, "-f", "s16le", "-ar", "48000", "-ac", "1", to]);
    let samples = fs::read(raw).unwrap();
    let loud = samples.chunks(2).position(|two| i16::from_le_bytes([two[0], two[1]]).abs() > 500).unwrap();
    let seconds = loud as f64 / 48_000.0;
    assert!((seconds - 0.3).abs() < 0.05, "the tone begins at {seconds} s");
}

#[test]
fn odd_sizes_wrong_pictures_and_no_pictures_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.mp4");
    fs::write(&path, b"old").unwrap();
    let odd = Mp4Writer::create(&path, settings(63, 48)).unwrap_err().to_string();
    assert!(odd.contains("63×48") && odd.contains("even"), "{odd}");
    let mut writer = Mp4Writer::create(&path, settings(64, 48)).unwrap();
    assert!(writer.write_picture(&[0; 12]).unwrap_err().to_string().contains("12 bytes"));
    assert!(writer.commit().unwrap_err().to_string().contains("no pictures"));
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(names(folder.path()), ["out.mp4"]);
}

#[test]
fn a_missing_program_a_missing_clip_and_a_missing_folder_say_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.mp4");
    let ffmpeg = folder.path().join("ffmpeg");
    let error = Mp4Writer::create(&path, Mp4Settings { ffmpeg, ..settings(64, 48) }).unwrap_err();
    assert!(matches!(error, ExportError::ProgramMissing { .. }));
    assert!(error.to_string().contains("apt-get install ffmpeg"), "{error}");
    let clip = folder.path().join("none.mp4");
    let error = Mp4Writer::create(&path, sounding(clip)).unwrap_err();
    assert!(error.to_string().contains("none.mp4"), "{error}");
    let error = Mp4Writer::create(&folder.path().join("no/out.mp4"), settings(64, 48)).unwrap_err();
    assert!(error.to_string().contains("Create the folder"), "{error}");
    assert!(names(folder.path()).is_empty());
}

#[test]
fn a_dead_encoder_is_an_error_with_its_last_words() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.mp4");
    fs::write(&path, b"old").unwrap();
    let fake = folder.path().join("dying");
    // Written by another process: a file that this one has open for writing may not be run yet.
    let script = "printf '#!/bin/sh\nhead -c 100000 >/dev/null\necho first line >&2\n\
                  echo No space left on device >&2\nexit 3\n' > \"$0\" && chmod +x \"$0\"";
    run("sh", &["-c", script, fake.to_str().unwrap()]);
    let mut writer = Mp4Writer::create(&path, Mp4Settings { ffmpeg: fake, ..settings(640, 480) }).unwrap();
    let rgba = vec![9; 640 * 480 * 4];
    let error = (0..100).find_map(|_| writer.write_picture(&rgba).err()).unwrap().to_string();
    assert!(error.contains("exit status: 3") && error.contains("first line / No space"), "{error}");
    assert!(error.contains("free some space"), "{error}");
    drop(writer);
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(names(folder.path()), ["dying", "out.mp4"]);
}

#[test]
fn a_full_disk_ends_a_real_encoder_with_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let mount = folder.path().to_str().unwrap();
    let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", "size=256k", "none", mount]).output();
    if !mounted.is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: a small file system cannot be mounted here");
        return;
    }
    let path = folder.path().join("out.mp4");
    let mut noise = 1_u32;
    let result = Mp4Writer::create(&path, settings(640, 480)).and_then(|mut writer| {
        for _ in 0..40 {
            let rgba: Vec<u8> = (0..640 * 480 * 4)
                .map(|_| {
                    noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    (noise >> 24) as u8
                })
                .collect();
            writer.write_picture(&rgba)?;
        }
        writer.commit()
    });
    let left = names(folder.path());
    run("umount", &[mount]);
    let error = result.unwrap_err().to_string();
    assert!(error.contains("out.mp4") && error.contains("free some space"), "{error}");
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn a_dropped_writer_ends_its_encoder_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.mp4");
    let mut writer = Mp4Writer::create(&path, settings(64, 48)).unwrap();
    writer.write_picture(&[7; 64 * 48 * 4]).unwrap();
    drop(writer);
    assert!(names(folder.path()).is_empty());
}
