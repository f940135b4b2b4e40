//! The picture that is sampled.

use nalgebra::Vector2;

use crate::capture::Image;

/// BGR bytes, row by row.
#[derive(Debug, Clone, Copy)]
pub struct Picture<'a> {
    bytes: &'a [u8],
    width: usize,
    height: usize,
}

impl<'a> Picture<'a> {
    /// `bytes` has three for each pixel, blue first; `None` if it has another number, or there is no pixel.
    pub fn new(bytes: &'a [u8], width: usize, height: usize) -> Option<Self> {
        let fits = width.checked_mul(height)?.checked_mul(3)? == bytes.len() && !bytes.is_empty();
        fits.then_some(Self { bytes, width, height })
    }

    /// Of a frame's picture.
    pub fn of(image: &'a Image) -> Option<Self> {
        Self::new(image.bytes().ok()?, image.width().try_into().ok()?, image.height().try_into().ok()?)
    }

    /// Luma (Rec. 709 weights on the encoded colour), 0..=255, linear between pixels, whose centres are integers. `None` beyond the
    /// picture.
    pub fn luma(&self, place: Vector2<f32>) -> Option<f32> {
        let (x, y) = (place.x, place.y);
        if !(x >= 0.0 && y >= 0.0 && x <= (self.width - 1) as f32 && y <= (self.height - 1) as f32) {
            return None;
        }
        let (left, top) = (x as usize, y as usize);
        let (across, down) =
            (3 * usize::from(left + 1 < self.width), 3 * self.width * usize::from(top + 1 < self.height));
        let (u, v) = (x - left as f32, y - top as f32);
        let first = 3 * (top * self.width + left);
        let at = |pixel: usize| {
            let colour = &self.bytes[pixel..pixel + 3];
            0.0722 * f32::from(colour[0]) + 0.7152 * f32::from(colour[1]) + 0.2126 * f32::from(colour[2])
        };
        let row = |start: usize| at(start) + (at(start + across) - at(start)) * u;
        let (upper, lower) = (row(first), row(first + down));
        Some(upper + (lower - upper) * v)
    }

    /// Red, green and blue of the nearest pixel.
    pub fn colour(&self, place: Vector2<f32>) -> Option<[u8; 3]> {
        let (x, y) = (place.x.round(), place.y.round());
        if !(x >= 0.0 && y >= 0.0 && x < self.width as f32 && y < self.height as f32) {
            return None;
        }
        let first = 3 * (y as usize * self.width + x as usize);
        let colour = self.bytes.get(first..first + 3)?;
        Some([colour[2], colour[1], colour[0]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_blend_between_pixels_and_end_with_the_picture() {
        let bytes = [0, 0, 0, 255, 255, 255, 0, 100, 0, 0, 0, 200];
        let picture = Picture::new(&bytes, 2, 2).unwrap();
        let at = |x: f32, y: f32| picture.luma(Vector2::new(x, y));
        assert!((at(0.25, 0.0).unwrap() - 63.75).abs() < 1e-3);
        assert!((at(0.0, 1.0).unwrap() - 71.52).abs() < 1e-3);
        assert!((at(1.0, 1.0).unwrap() - 42.52).abs() < 1e-3);
        assert!((at(0.5, 0.5).unwrap() - (255.0 + 71.52 + 42.52) / 4.0).abs() < 1e-2);
        assert_eq!([at(-0.1, 0.0), at(0.0, 1.1), at(f32::NAN, 0.0)], [None; 3]);
        assert_eq!(picture.colour(Vector2::new(0.9, 1.2)), Some([200, 0, 0]));
        assert!(Picture::new(&bytes, 3, 2).is_none() && Picture::new(&[], 0, 5).is_none());
    }
}
