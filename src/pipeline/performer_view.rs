//! The performer's own pictures, fetched again for pictures that show both.

use opencv::{core, imgproc};

use super::PipelineError;
use crate::capture::{CaptureError, Frame, FrameSource, Image};

/// Reads a clip a second time, forwards only.
pub struct PerformerView {
    source: Box<dyn FrameSource>,
    frame: Frame,
    read: u64,
}

impl PerformerView {
    /// Takes over a freshly opened clip.
    pub fn new(source: Box<dyn FrameSource>) -> Self {
        Self { source, frame: Frame::default(), read: 0 }
    }

    /// Width at which the clip has `height`, rounded to an even number.
    pub fn width_at(&self, height: u32) -> u32 {
        let info = self.source.info();
        let width = f64::from(height) * f64::from(info.width) / f64::from(info.height.max(1));
        ((width / 2.0).round() as u32 * 2).max(2)
    }

    /// Frame `index` of the clip, scaled to the size given; frames before the last one asked for are gone.
    pub fn picture(&mut self, index: u64, size: [u32; 2]) -> Result<Vec<u8>, PipelineError> {
        while self.read <= index && self.source.read(&mut self.frame)? {
            self.read += 1;
        }
        let scaled = || -> opencv::Result<Vec<u8>> {
            let mut mat = core::Mat::default();
            let wanted = core::Size::new(size[0] as i32, size[1] as i32);
            imgproc::resize(self.frame.image.mat(), &mut mat, wanted, 0.0, 0.0, imgproc::INTER_LINEAR)?;
            Image::from_bgr(mat).to_rgba()
        };
        let name = self.source.info().name.clone();
        scaled().map_err(|source| CaptureError::Library { path: name.into(), source }.into())
    }
}
