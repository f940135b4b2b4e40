//! Drawn pictures on their way back from the device, up to two at once.

use std::collections::VecDeque;
use std::sync::mpsc;

use image::RgbaImage;

use super::edges::EdgeSmoother;
use super::{Gpu, ViewError};

/// Rows of a copied picture start at multiples of this many bytes.
const ALIGNMENT: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;

/// RGBA rows without padding as a picture of `size` pixels.
pub fn as_picture(size: [u32; 2], rgba: Vec<u8>) -> Result<RgbaImage, ViewError> {
    let [width, height] = size;
    let reason = || "the picture came back in another size".to_owned();
    RgbaImage::from_raw(width, height, rgba).ok_or_else(|| ViewError::Size {
        width,
        height,
        reason: reason(),
    })
}

/// Pictures in flight, oldest first, and the buffers that are free.
#[derive(Debug)]
pub(super) struct Readback {
    size: wgpu::Extent3d,
    row_stride: u32,
    free: Vec<wgpu::Buffer>,
    flying: VecDeque<Flight>,
}

#[derive(Debug)]
struct Flight {
    buffer: wgpu::Buffer,
    submission: wgpu::SubmissionIndex,
    mapped: mpsc::Receiver<Result<(), wgpu::BufferAsyncError>>,
    transparent: bool,
}

impl Readback {
    pub(super) fn new(gpu: &Gpu, size: wgpu::Extent3d) -> Self {
        let row_stride = (4 * size.width).next_multiple_of(ALIGNMENT);
        let buffer = |_| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("readback"),
                size: u64::from(row_stride) * u64::from(size.height),
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            })
        };
        Self { size, row_stride, free: (0..2).map(buffer).collect(), flying: VecDeque::with_capacity(2) }
    }

    /// Starts the copy of the picture as it will be once all work submitted so far is done.
    pub(super) fn submit(
        &mut self,
        gpu: &Gpu,
        picture: &wgpu::Texture,
        transparent: bool,
    ) -> Result<(), ViewError> {
        let buffer = self.free.pop().ok_or(ViewError::Turn {
            reason: "two pictures are on their way already; fetch one before submitting another",
        })?;
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            picture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(self.row_stride),
                    rows_per_image: None,
                },
            },
            self.size,
        );
        let submission = gpu.queue.submit([encoder.finish()]);
        let (sender, mapped) = mpsc::channel();
        // The receiver may be gone when the renderer is dropped with a picture in flight.
        buffer.map_async(wgpu::MapMode::Read, .., move |result| drop(sender.send(result)));
        self.flying.push_back(Flight { buffer, submission, mapped, transparent });
        gpu.check()
    }

    /// Waits for the oldest picture in flight and copies its rows, without padding, to `out`.
    pub(super) fn fetch(
        &mut self,
        gpu: &Gpu,
        out: &mut Vec<u8>,
        edges: Option<&mut EdgeSmoother>,
    ) -> Result<(), ViewError> {
        let flight = self
            .flying
            .pop_front()
            .ok_or(ViewError::Turn { reason: "no picture is on its way; submit one before fetching" })?;
        let result = self.land(gpu, &flight, out);
        flight.buffer.unmap();
        self.free.push(flight.buffer);
        gpu.check()?;
        result?;
        if let Some(edges) = edges {
            edges.smooth(out, self.size.width as usize);
        }
        if flight.transparent {
            unmultiply(out);
        }
        Ok(())
    }

    fn land(&self, gpu: &Gpu, flight: &Flight, out: &mut Vec<u8>) -> Result<(), ViewError> {
        let failed = |reason: String| ViewError::Gpu { adapter: gpu.adapter_name().to_owned(), reason };
        let wait = wgpu::PollType::Wait { submission_index: Some(flight.submission.clone()), timeout: None };
        gpu.device.poll(wait).map_err(|error| failed(error.to_string()))?;
        match flight.mapped.recv() {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(failed(error.to_string())),
            Err(error) => return Err(failed(error.to_string())),
        }
        let bytes = flight.buffer.get_mapped_range(..).map_err(|error| failed(error.to_string()))?;
        out.clear();
        let row = 4 * self.size.width as usize;
        if row == self.row_stride as usize {
            out.extend_from_slice(&bytes);
        } else {
            out.reserve_exact(row * self.size.height as usize);
            for padded in bytes.chunks_exact(self.row_stride as usize) {
                out.extend_from_slice(&padded[..row]);
            }
        }
        Ok(())
    }
}

/// Smoothed edges hold their colour times their coverage; image files hold the colour itself.
fn unmultiply(rgba: &mut [u8]) {
    for pixel in rgba.chunks_exact_mut(4) {
        let alpha = u32::from(pixel[3]);
        if alpha != 0 && alpha != 255 {
            for channel in &mut pixel[..3] {
                *channel = ((u32::from(*channel) * 255 + alpha / 2) / alpha).min(255) as u8;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::unmultiply;

    #[test]
    fn half_covered_pixels_get_their_colour_back() {
        let mut rgba = [64, 32, 0, 128, 9, 9, 9, 255, 0, 0, 0, 0];
        unmultiply(&mut rgba);
        assert_eq!(rgba, [128, 64, 0, 128, 9, 9, 9, 255, 0, 0, 0, 0]);
    }
}
