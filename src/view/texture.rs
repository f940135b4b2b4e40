//! A scan's texture: decoded, reduced to what the device takes, with its mipmaps.

use std::io::Cursor;

use image::{ImageReader, Limits, RgbaImage};

use super::{Gpu, ViewError};
use crate::scan::{Texture, TextureFormat};

/// The widest texture that is read. A larger one would need over a gigabyte of memory.
const LARGEST: u32 = 16_384;

/// Decodes a texture and puts it on the device, sRGB as it is, with mipmaps down to one pixel.
pub(super) fn upload(gpu: &Gpu, texture: &Texture) -> Result<wgpu::TextureView, ViewError> {
    let linear = LinearLight::new();
    let limit = gpu.device.limits().max_texture_dimension_2d;
    let mut image = decode(texture)?;
    while image.width().max(image.height()) > limit {
        image = linear.halve(&image);
    }
    Ok(upload_image(gpu, image, &linear))
}

/// A texture of one white pixel, for surfaces that have none.
pub(super) fn white(gpu: &Gpu) -> wgpu::TextureView {
    upload_image(gpu, RgbaImage::from_pixel(1, 1, image::Rgba([255; 4])), &LinearLight::new())
}

fn upload_image(gpu: &Gpu, mut image: RgbaImage, linear: &LinearLight) -> wgpu::TextureView {
    let (width, height) = image.dimensions();
    let levels = width.max(height).ilog2() + 1;
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("scan texture"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for mip_level in 0..levels {
        if mip_level > 0 {
            image = linear.halve(&image);
        }
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo { mip_level, ..texture.as_image_copy() },
            image.as_raw(),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(4 * image.width()),
                rows_per_image: None,
            },
            wgpu::Extent3d { width: image.width(), height: image.height(), depth_or_array_layers: 1 },
        );
    }
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// A texture's picture; refused above the size that is read.
pub(crate) fn decode(texture: &Texture) -> Result<RgbaImage, ViewError> {
    let format = match texture.format {
        TextureFormat::Png => image::ImageFormat::Png,
        TextureFormat::Jpeg => image::ImageFormat::Jpeg,
    };
    let broken = |error: image::ImageError| ViewError::Texture {
        name: texture.name.clone(),
        reason: error.to_string(),
        remedy: "Open it in an image editor and export it again as PNG or JPEG",
    };
    let reader = || ImageReader::with_format(Cursor::new(texture.bytes.as_slice()), format);
    // The size is in the first bytes: refuse before anything is allocated for it.
    let (width, height) = reader().into_dimensions().map_err(broken)?;
    if width.max(height) > LARGEST {
        return Err(ViewError::Texture {
            name: texture.name.clone(),
            reason: format!("it is {width} x {height} pixels, and the limit is {LARGEST} a side"),
            remedy: "Scale it down; 4096 pixels a side are plenty for a face",
        });
    }
    let mut reader = reader();
    let mut limits = Limits::default();
    limits.max_image_width = Some(LARGEST);
    limits.max_image_height = Some(LARGEST);
    limits.max_alloc = Some(u64::from(LARGEST) * u64::from(LARGEST) * 4);
    reader.limits(limits);
    Ok(reader.decode().map_err(broken)?.into_rgba8())
}

/// Tables between 8-bit sRGB and linear light. Averaging encoded bytes would darken every mipmap.
struct LinearLight {
    decode: [f32; 256],
    encode: Vec<u8>,
}

/// Fine enough that the darkest sRGB steps stay apart.
const ENCODE_STEPS: usize = 1 << 14;

impl LinearLight {
    fn new() -> Self {
        let decode = std::array::from_fn(|byte| {
            let c = byte as f32 / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        });
        let encode = (0..=ENCODE_STEPS)
            .map(|step| {
                let l = step as f32 / ENCODE_STEPS as f32;
                let c = if l <= 0.003_130_8 { l * 12.92 } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 };
                (c * 255.0).round() as u8
            })
            .collect();
        Self { decode, encode }
    }

    /// Half the size, rounded down but never 0: every pixel the average in linear light of the area it covers.
    fn halve(&self, image: &RgbaImage) -> RgbaImage {
        let (width, height) = image.dimensions();
        let (columns, rows) = (taps(width), taps(height));
        let row_bytes = 4 * width as usize;
        let mut half = Vec::with_capacity(4 * columns.len() * rows.len());
        for row in &rows {
            for column in &columns {
                let (mut rgb, mut alpha) = ([0.0_f32; 3], 0.0_f32);
                for &(y, wy) in row {
                    for &(x, wx) in column {
                        let weight = wx * wy;
                        if weight > 0.0 {
                            let at = y as usize * row_bytes + 4 * x as usize;
                            let pixel = &image.as_raw()[at..at + 4];
                            for (sum, &byte) in rgb.iter_mut().zip(pixel) {
                                *sum += weight * self.decode[usize::from(byte)];
                            }
                            alpha += weight * f32::from(pixel[3]);
                        }
                    }
                }
                let encode = |l: f32| self.encode[((l * ENCODE_STEPS as f32) as usize).min(ENCODE_STEPS)];
                half.extend([encode(rgb[0]), encode(rgb[1]), encode(rgb[2]), alpha.round() as u8]);
            }
        }
        RgbaImage::from_raw(columns.len() as u32, rows.len() as u32, half).unwrap_or_default()
    }
}

/// For every pixel along the halved side, the source pixels it covers and their shares. Three where the side is odd.
fn taps(size: u32) -> Vec<[(u32, f32); 3]> {
    let half = (size / 2).max(1);
    let step = f64::from(size) / f64::from(half);
    (0..half)
        .map(|i| {
            let (start, end) = (f64::from(i) * step, f64::from(i + 1) * step);
            let first = start.floor() as u32;
            std::array::from_fn(|k| {
                let x = first + k as u32;
                let overlap = (end.min(f64::from(x) + 1.0) - start.max(f64::from(x))).max(0.0);
                (x.min(size - 1), (overlap / step) as f32)
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgba;

    #[test]
    fn every_byte_survives_linear_light() {
        let linear = LinearLight::new();
        for byte in 0..=255 {
            let flat = RgbaImage::from_pixel(4, 2, Rgba([byte, byte, byte, byte]));
            assert!(linear.halve(&flat).pixels().all(|p| p.0 == [byte; 4]), "{byte}");
        }
    }

    #[test]
    fn a_fine_checker_keeps_its_brightness() {
        let checker =
            RgbaImage::from_fn(8, 8, |x, y| Rgba([[0, 0, 0, 255], [255; 4]][((x + y) % 2) as usize]));
        // Half the light is 188 in sRGB, not 128.
        assert!(LinearLight::new().halve(&checker).pixels().all(|p| p.0 == [188, 188, 188, 255]));
    }

    #[test]
    fn odd_sides_count_every_pixel_once() {
        for size in [1, 2, 3, 5, 7, 12, 13] {
            let mut share = vec![0.0_f32; size as usize];
            let all = taps(size);
            for &(x, w) in all.iter().flatten() {
                share[x as usize] += w * size as f32 / all.len() as f32;
            }
            assert!(
                share.iter().all(|s| (s - 1.0 * size as f32 / size as f32).abs() < 1e-5),
                "{size}: {share:?}"
            );
        }
    }
}
