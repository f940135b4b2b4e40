//! Frames with their time: video files and pictures now, a camera through the same trait later; and what optical
//! capture gives instead of pictures, markers in space.

mod error;
mod frame;
mod marker_c3d;
mod marker_c3d_cut;
mod marker_csv;
mod marker_take;
mod packet_times;
mod pictures;
mod time;
mod video;

use std::path::Path;

pub use error::CaptureError;
pub use frame::{ClipInfo, Frame, FrameSource, Image};
pub use marker_take::{MarkerTake, read_markers};
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
