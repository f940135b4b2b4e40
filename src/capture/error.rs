//! What can go wrong while frames come in.

use std::path::PathBuf;

/// Every variant names the source, what was found, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// Nothing is there, or it may not be read.
    #[error("cannot read {path}: {source}. Check the path and its permissions")]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The system's own reason.
        source: std::io::Error,
    },
    /// The file holds nothing.
    #[error("{path} is empty (0 bytes): the recording was never finished. Record it again")]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file is not a video that the decoder knows.
    #[error(
        "{path} is not a video that can be decoded. It may be cut off, damaged, or of another kind; \
         `ffprobe {path}` says more, and `ffmpeg -i {path} -c:v libx264 fixed.mp4` often mends it"
    )]
    NotAVideo {
        /// The file.
        path: PathBuf,
    },
    /// A picture that cannot hold a face.
    #[error(
        "{path} is {width}×{height} pixels, too small to find a face in; at least {MIN_SIDE}×{MIN_SIDE} are needed"
    )]
    TooSmall {
        /// The file.
        path: PathBuf,
        /// Pixels.
        width: i32,
        /// Pixels.
        height: i32,
    },
    /// A folder without pictures.
    #[error(
        "{path} holds no .png, .jpg or .jpeg pictures. Name a folder of numbered frames, or a video file"
    )]
    NoPictures {
        /// The folder.
        path: PathBuf,
    },
    /// One picture of a sequence differs in size.
    #[error(
        "{path} is {found_width}×{found_height} pixels, but the first picture of the sequence is {width}×{height}. Resize it or take it out"
    )]
    SizeChanged {
        /// The picture.
        path: PathBuf,
        /// Pixels of the first picture.
        width: i32,
        /// Pixels of the first picture.
        height: i32,
        /// Pixels found.
        found_width: i32,
        /// Pixels found.
        found_height: i32,
    },
    /// A file of markers that is not what its format promises.
    #[error("{path} is not a usable marker file: {reason}. {remedy}")]
    Markers {
        /// The file.
        path: PathBuf,
        /// What was found, with line and column where known.
        reason: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A frame rate that makes no sense.
    #[error("the frame rate '{text}' is not a positive number or fraction such as 25 or 30000/1001")]
    BadRate {
        /// What was given.
        text: String,
    },
    /// The image library failed in a way no other variant describes.
    #[error("the image library failed on {path}: {source}")]
    Library {
        /// The file.
        path: PathBuf,
        /// The library's own reason.
        source: opencv::Error,
    },
}

/// Pixels; smaller pictures cannot hold a face that the detector knows.
pub const MIN_SIDE: i32 = 32;
