//! H.264 video through the `ffmpeg` program, with the clip's sound.
//!
//! Pictures go through a pipe while they are rendered. The sound is joined afterwards, without touching the pictures:
//! only then is the video's length known, and sound is cut to it, never the pictures to the sound.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use serde::Deserialize;

use super::mp4_program::Program;
use super::{Draft, ExportError};
use crate::capture::{FrameRate, Timestamp};

/// Codecs that players expect inside MP4 and that are therefore copied; any other sound is encoded to AAC.
const COPIED: [&str; 6] = ["aac", "ac3", "alac", "eac3", "mp3", "opus"];

/// Below half a millisecond, a start of the pictures within their clip is rounding.
const START_SLACK_SECONDS: f64 = 5e-4;

/// Where the sound comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sound {
    /// A file with sound; one without is no error, the video then has none.
    pub clip: PathBuf,
    /// When of the clip the first picture shows, counted from the clip's first picture; not negative.
    pub start: Timestamp,
}

/// What a video needs to be told.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mp4Settings {
    /// Pixels, even: H.264's colour is stored at half resolution.
    pub width: u32,
    /// Pixels, even.
    pub height: u32,
    /// Constant.
    pub rate: FrameRate,
    /// None: a silent video.
    pub sound: Option<Sound>,
    /// The program to run; `ffprobe` is taken from beside it. A bare name is looked up in `PATH`.
    pub ffmpeg: PathBuf,
    /// Encoding threads. The same number and the same ffmpeg give the same bytes.
    pub threads: u32,
}

impl Mp4Settings {
    /// A silent video by the `ffmpeg` in `PATH`, on 4 threads.
    pub fn new(width: u32, height: u32, rate: FrameRate) -> Self {
        Self { width, height, rate, sound: None, ffmpeg: "ffmpeg".into(), threads: 4 }
    }
}

/// Writes an MP4 picture by picture: H.264 High, 4:2:0, crf 18, BT.709 limited range, index at the front.
#[derive(Debug)]
pub struct Mp4Writer {
    // Before the draft, so that the program ends before its file is removed.
    encoder: Program,
    draft: Draft,
    settings: Mp4Settings,
    destination: PathBuf,
    sound: Option<SoundPlan>,
    picture_bytes: usize,
    pictures: u64,
}

#[derive(Debug)]
struct SoundPlan {
    clip: PathBuf,
    start_seconds: f64,
    copy: bool,
}

impl Mp4Writer {
    /// Starts the encoder and looks into the sound's file, so that what is missing shows before any rendering.
    ///
    /// Refuses odd or zero sizes and a rate of zero.
    pub fn create(path: &Path, settings: Mp4Settings) -> Result<Self, ExportError> {
        let Mp4Settings { width, height, rate, threads, .. } = settings;
        if width == 0 || height == 0 || width % 2 == 1 || height % 2 == 1 {
            return Err(ExportError::refused(
                path,
                format!("a picture of {width}×{height} has no H.264 form"),
                "Choose even numbers of pixels",
            ));
        }
        if rate.numerator == 0 || rate.denominator == 0 {
            return Err(ExportError::refused(path, "the frame rate is zero", "Choose a frame rate"));
        }
        let draft = Draft::create(path)?;
        let sound = match &settings.sound {
            Some(sound) => plan_sound(path, sound, &settings.ffmpeg)?,
            None => None,
        };
        let mut arguments = common_arguments();
        push_all(&mut arguments, &["-f", "rawvideo", "-pix_fmt", "rgba"]);
        push_all(&mut arguments, &["-video_size", &format!("{width}x{height}")]);
        push_all(&mut arguments, &["-framerate", &format!("{}/{}", rate.numerator, rate.denominator)]);
        // swscale would convert by BT.601 unless told; tags alone would then lie.
        push_all(&mut arguments, &["-i", "pipe:0", "-an", "-vf"]);
        arguments.push(
            "scale=in_range=full:out_range=limited:out_color_matrix=bt709:\
             flags=bicubic+accurate_rnd+full_chroma_int+full_chroma_inp+bitexact,format=yuv420p"
                .into(),
        );
        push_all(&mut arguments, &["-c:v", "libx264", "-preset", "veryfast", "-crf", "18"]);
        push_all(&mut arguments, &["-threads", &threads.max(1).to_string(), "-filter_threads", "1"]);
        push_all(&mut arguments, &["-color_primaries", "bt709", "-color_trc", "bt709"]);
        push_all(&mut arguments, &["-colorspace", "bt709", "-color_range", "tv"]);
        push_all(&mut arguments, &container_arguments());
        arguments.push(file_argument(draft.path()));
        let encoder = Program::start(&settings.ffmpeg, arguments, path, Stdio::null())?;
        let picture_bytes = width as usize * height as usize * 4;
        Ok(Self { encoder, draft, settings, destination: path.into(), sound, picture_bytes, pictures: 0 })
    }

    /// Appends one picture: height × width × 4 bytes, sRGB and alpha, rows from the top. Alpha is ignored.
    ///
    /// An encoder that has died, of a full disk for example, is reported here or by [`Mp4Writer::commit`].
    pub fn write_picture(&mut self, rgba: &[u8]) -> Result<(), ExportError> {
        if rgba.len() != self.picture_bytes {
            return Err(ExportError::refused(
                &self.destination,
                format!("a picture has {} bytes, not {}", rgba.len(), self.picture_bytes),
                "Render at the size that the video was created with",
            ));
        }
        self.encoder.feed(rgba)?;
        self.pictures += 1;
        Ok(())
    }

    /// Ends the encoder, joins the sound, and puts the file in place.
    pub fn commit(self) -> Result<(), ExportError> {
        if self.pictures == 0 {
            return Err(ExportError::refused(
                &self.destination,
                "there are no pictures",
                "Choose a longer part of the clip",
            ));
        }
        self.encoder.finish()?;
        let Some(sound) = self.sound else {
            return self.draft.commit();
        };
        let seconds = self.settings.rate.tick(self.pictures).seconds();
        let joined = Draft::create(&self.destination)?;
        let join = |copy: bool| {
            let mut arguments = common_arguments();
            push_all(&mut arguments, &["-i"]);
            arguments.push(file_argument(self.draft.path()));
            if sound.start_seconds > START_SLACK_SECONDS {
                push_all(&mut arguments, &["-ss", &format!("{:.6}", sound.start_seconds)]);
            }
            push_all(&mut arguments, &["-t", &format!("{seconds:.6}"), "-i"]);
            arguments.push(file_argument(&sound.clip));
            push_all(&mut arguments, &["-map", "0:v", "-map", "1:a?", "-c:v", "copy", "-c:a"]);
            push_all(&mut arguments, if copy { &["copy"] } else { &["aac", "-b:a", "192k"] });
            push_all(&mut arguments, &["-map_metadata", "-1"]);
            push_all(&mut arguments, &container_arguments());
            arguments.push(file_argument(joined.path()));
            Program::start(&self.settings.ffmpeg, arguments, &self.destination, Stdio::null())?.finish()
        };
        match join(sound.copy) {
            // A stream that cannot be copied after all, broken headers for example, may still be decoded.
            Err(_) if sound.copy => join(false)?,
            done => done?,
        }
        joined.commit()
    }
}

fn push_all<T: AsRef<str>>(arguments: &mut Vec<OsString>, more: &[T]) {
    arguments.extend(more.iter().map(|argument| OsString::from(argument.as_ref())));
}

/// Says that it is a path: names with a leading dash or a colon would pass for options and protocols.
fn file_argument(path: &Path) -> OsString {
    let mut argument = OsString::from("file:");
    argument.push(path);
    argument
}

fn common_arguments() -> Vec<OsString> {
    let mut arguments = Vec::new();
    push_all(&mut arguments, &["-hide_banner", "-loglevel", "error", "-nostats", "-y"]);
    arguments
}

/// Bit-exact flags keep version strings and dates out of the file.
fn container_arguments() -> [&'static str; 10] {
    [
        "-fflags",
        "+bitexact",
        "-flags:v",
        "+bitexact",
        "-flags:a",
        "+bitexact",
        "-movflags",
        "+faststart",
        "-f",
        "mp4",
    ]
}

/// What ffprobe tells of a file, as far as we ask.
#[derive(Debug, Deserialize)]
struct Probe {
    #[serde(default)]
    streams: Vec<ProbeStream>,
    #[serde(default)]
    format: ProbeFormat,
}

#[derive(Debug, Deserialize)]
struct ProbeStream {
    codec_type: Option<String>,
    codec_name: Option<String>,
    start_time: Option<String>,
}

#[derive(Debug, Default, Deserialize)]
struct ProbeFormat {
    start_time: Option<String>,
}

/// None when the clip has no sound.
fn plan_sound(path: &Path, sound: &Sound, ffmpeg: &Path) -> Result<Option<SoundPlan>, ExportError> {
    let mut arguments = Vec::new();
    push_all(&mut arguments, &["-v", "error", "-of", "json", "-show_entries"]);
    push_all(&mut arguments, &["stream=codec_type,codec_name,start_time:format=start_time"]);
    arguments.push(file_argument(&sound.clip));
    let ffprobe = ffmpeg.with_file_name("ffprobe");
    let printed = Program::start(&ffprobe, arguments, path, Stdio::piped())?.output()?;
    let probe: Probe = serde_json::from_slice(&printed).map_err(|error| ExportError::Malformed {
        path: sound.clip.clone(),
        format: "media",
        reason: format!("ffprobe's answer cannot be read: {error}"),
        remedy: "Check the clip with ffprobe",
    })?;
    let of_type = |wanted: &'static str| {
        probe.streams.iter().filter(move |stream| stream.codec_type.as_deref() == Some(wanted))
    };
    if of_type("audio").next().is_none() {
        return Ok(None);
    }
    let seconds = |text: Option<&String>| text.and_then(|text| text.parse::<f64>().ok());
    // ffmpeg counts a file's time from its earliest stream, we from its first picture.
    let picture = of_type("video").find_map(|stream| seconds(stream.start_time.as_ref()));
    let earliest = seconds(probe.format.start_time.as_ref());
    let lead = match (picture, earliest) {
        (Some(picture), Some(earliest)) => (picture - earliest).max(0.0),
        _ => 0.0,
    };
    Ok(Some(SoundPlan {
        clip: sound.clip.clone(),
        start_seconds: lead + sound.start.seconds(),
        copy: of_type("audio")
            .all(|stream| stream.codec_name.as_deref().is_some_and(|name| COPIED.contains(&name))),
    }))
}
