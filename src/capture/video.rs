//! Video files, decoded by OpenCV's FFmpeg back end.

use std::path::{Path, PathBuf};

use opencv::{
    core::{Mat, MatTraitConst},
    prelude::{VideoCaptureTrait, VideoCaptureTraitConst},
    videoio,
};

use super::{
    CaptureError, ClipInfo, Frame, FrameRate, FrameSource, Image, Timestamp, error::MIN_SIDE,
    packet_times::packet_times,
};

/// Nanoseconds between two accounts of one frame's time.
const AGREEMENT: i64 = 2_000;

/// A video file with the container's own timestamps; the rotation flag is applied.
pub struct VideoFile {
    path: PathBuf,
    capture: videoio::VideoCapture,
    info: ClipInfo,
    /// The frame read while opening, which proves that the file decodes.
    pending: Option<(Image, f64)>,
    next_index: u64,
    first_milliseconds: f64,
    previous: Option<Timestamp>,
    /// What the packets say; read when the decoder first withholds a time.
    stated: Option<Vec<Timestamp>>,
}

impl VideoFile {
    /// Opens the file and decodes its first frame, so that a file which cannot be decoded is refused here.
    pub fn open(path: &Path) -> Result<Self, CaptureError> {
        let library = |source| CaptureError::Library { path: path.into(), source };
        let length =
            std::fs::metadata(path).map_err(|source| CaptureError::Read { path: path.into(), source })?.len();
        if length == 0 {
            return Err(CaptureError::Empty { path: path.into() });
        }
        let text = path.to_string_lossy().into_owned();
        // OpenCV applies the container's rotation flag by default.
        let mut capture = videoio::VideoCapture::from_file(&text, videoio::CAP_FFMPEG).map_err(library)?;
        if !capture.is_opened().map_err(library)? {
            return Err(CaptureError::NotAVideo { path: path.into() });
        }
        let mut first = Mat::default();
        if !capture.read(&mut first).map_err(library)? || first.empty() {
            return Err(CaptureError::NotAVideo { path: path.into() });
        }
        let first_milliseconds = capture.get(videoio::CAP_PROP_POS_MSEC).map_err(library)?;
        let image = Image::from_bgr(first);
        if image.width() < MIN_SIDE || image.height() < MIN_SIDE {
            return Err(CaptureError::TooSmall {
                path: path.into(),
                width: image.width(),
                height: image.height(),
            });
        }
        let announced = capture.get(videoio::CAP_PROP_FRAME_COUNT).map_err(library)?;
        let rate = FrameRate::nearest(capture.get(videoio::CAP_PROP_FPS).map_err(library)?);
        let info = ClipInfo {
            name: path.file_name().map_or_else(|| text.clone(), |name| name.to_string_lossy().into_owned()),
            width: image.width(),
            height: image.height(),
            rate,
            announced_frames: (announced >= 1.0).then_some(announced as u64),
        };
        Ok(Self {
            path: path.into(),
            capture,
            info,
            pending: Some((image, first_milliseconds)),
            next_index: 0,
            first_milliseconds,
            previous: None,
            stated: None,
        })
    }

    /// The decoder's time where it moves forward; where it does not, the container's own time of the frame, or one
    /// nominal frame later.
    fn stamp(&mut self, milliseconds: f64) -> Timestamp {
        let container = Timestamp(((milliseconds - self.first_milliseconds) * 1e6).round() as i64);
        let stamp = match self.previous {
            None => Timestamp(0),
            Some(previous) if container > previous => container,
            Some(previous) => {
                self.stated_after(previous).unwrap_or(Timestamp(previous.0 + self.info.rate.tick(1).0.max(1)))
            }
        };
        self.previous = Some(stamp);
        stamp
    }

    /// The time that the container states for the next frame, if it agrees with the one before.
    fn stated_after(&mut self, previous: Timestamp) -> Option<Timestamp> {
        let stated = self.stated.get_or_insert_with(|| packet_times(&self.path).unwrap_or_default());
        let next = usize::try_from(self.next_index).ok()?;
        let before = stated.get(next.checked_sub(1)?)?;
        let time = *stated.get(next)?;
        ((before.0 - previous.0).abs() < AGREEMENT && time > previous).then_some(time)
    }
}

impl FrameSource for VideoFile {
    fn info(&self) -> &ClipInfo {
        &self.info
    }

    fn read(&mut self, frame: &mut Frame) -> Result<bool, CaptureError> {
        let library = |source| CaptureError::Library { path: self.path.clone(), source };
        let milliseconds = if let Some((image, milliseconds)) = self.pending.take() {
            frame.image = image;
            milliseconds
        } else {
            let more = self.capture.read(frame.image.mat_mut()).map_err(library)?;
            if !more || frame.image.mat().empty() {
                if let Some(announced) = self.info.announced_frames
                    && self.next_index + 1 < announced
                {
                    tracing::warn!(
                        "{} ends after {} of {announced} announced frames: the file may be cut off",
                        self.info.name,
                        self.next_index
                    );
                }
                return Ok(false);
            }
            self.capture.get(videoio::CAP_PROP_POS_MSEC).map_err(library)?
        };
        frame.index = self.next_index;
        frame.timestamp = self.stamp(milliseconds);
        self.next_index += 1;
        Ok(true)
    }
}
