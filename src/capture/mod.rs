//! Frames with their time: video files and pictures now, a camera through the same trait later.

mod error;
mod frame;
mod packet_times;
mod pictures;
mod time;
mod video;

use std::path::Path;

pub use error::CaptureError;
pub use frame::{ClipInfo, Frame, FrameSource, Image};
pub use pictures::{PictureSequence, is_picture};
pub use time::{FrameRate, Timestamp};
pub use video::VideoFile;

/// Opens a video file, a folder of pictures, or one picture; `picture_rate` is used where the files carry no time.
pub fn open(path: &Path, picture_rate: FrameRate) -> Result<Box<dyn FrameSource>, CaptureError> {
    if path.is_dir() || is_picture(path) {
        Ok(Box::new(PictureSequence::open(path, picture_rate)?))
    } else {
        Ok(Box::new(VideoFile::open(path)?))
    }
}
