//! One picture with its time, and what every source of pictures promises.

use opencv::{
    core::{Mat, MatTraitConst, MatTraitConstManual},
    imgproc,
};

use super::{CaptureError, FrameRate, Timestamp};

/// An 8-bit BGR picture; pixel (0, 0) is the top left, x runs right, y down.
#[derive(Debug, Clone, Default)]
pub struct Image(Mat);

impl Image {
    /// Takes over an 8-bit, three-channel BGR matrix.
    pub fn from_bgr(mat: Mat) -> Self {
        Self(mat)
    }

    /// Copies tightly packed RGBA rows, leaving alpha out.
    pub fn from_rgba(width: usize, height: usize, rgba: &[u8]) -> opencv::Result<Self> {
        let bgr: Vec<opencv::core::Vec3b> =
            rgba.chunks_exact(4).take(width * height).map(|p| [p[2], p[1], p[0]].into()).collect();
        let rows = Mat::new_rows_cols_with_data(height as i32, width as i32, &bgr)?;
        Ok(Self(rows.try_clone()?))
    }

    /// Tightly packed, opaque RGBA rows.
    pub fn to_rgba(&self) -> opencv::Result<Vec<u8>> {
        let mut rgba = Mat::default();
        imgproc::cvt_color_def(&self.0, &mut rgba, imgproc::COLOR_BGR2RGBA)?;
        Ok(rgba.data_bytes()?.to_vec())
    }

    /// Pixels.
    pub fn width(&self) -> i32 {
        self.0.cols()
    }

    /// Pixels.
    pub fn height(&self) -> i32 {
        self.0.rows()
    }

    /// The matrix, for the image library.
    pub fn mat(&self) -> &Mat {
        &self.0
    }

    /// The pixels as one slice of B, G, R bytes; fails on a matrix with gaps between rows, which no source makes.
    pub fn bytes(&self) -> opencv::Result<&[u8]> {
        self.0.data_bytes()
    }

    pub(crate) fn mat_mut(&mut self) -> &mut Mat {
        &mut self.0
    }
}

/// A picture, its place in the clip and its time.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// The picture.
    pub image: Image,
    /// 0 for the clip's first frame.
    pub index: u64,
    /// From the container's clock; the first frame is at 0, later ones strictly later.
    pub timestamp: Timestamp,
}

/// What is known before the first frame.
#[derive(Debug, Clone, PartialEq)]
pub struct ClipInfo {
    /// For messages: the file's or device's name.
    pub name: String,
    /// Pixels, after the container's rotation flag.
    pub width: i32,
    /// Pixels, after the container's rotation flag.
    pub height: i32,
    /// The nominal rate; frames carry their own times.
    pub rate: FrameRate,
    /// How many frames the container announces, where it does; may be wrong.
    pub announced_frames: Option<u64>,
}

/// Anything that gives frames in order: a file now, a camera through the same door.
pub trait FrameSource: Send {
    /// What is known of the frames.
    fn info(&self) -> &ClipInfo;

    /// Overwrites `frame` with the next picture; `false` at the end of the clip.
    fn read(&mut self, frame: &mut Frame) -> Result<bool, CaptureError>;
}
