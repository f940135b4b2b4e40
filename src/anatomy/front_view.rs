//! The scan seen straight from the front: its colours over the plane of the face.

use image::RgbImage;
use nalgebra::Point2;

/// An orthographic picture in the axes of a [`FaceFrame`](super::FaceFrame): the scan's own colours, unlit.
#[derive(Debug, Clone)]
pub struct FrontView {
    /// sRGB.
    pub picture: RgbImage,
    /// Face coordinates (x, y) of the picture's middle, millimetres.
    pub centre: Point2<f64>,
    /// Millimetres a pixel.
    pub scale: f64,
}

impl FrontView {
    /// The colour at (x, y) of the face's axes, millimetres, by bilinear interpolation; sRGB 0..=1. Beyond the picture
    /// its edge is repeated.
    pub fn colour(&self, x: f64, y: f64) -> [f64; 3] {
        let (width, height) = self.picture.dimensions();
        let column = (x - self.centre.x) / self.scale + f64::from(width) / 2.0 - 0.5;
        let row = (self.centre.y - y) / self.scale + f64::from(height) / 2.0 - 0.5;
        let column = column.clamp(0.0, f64::from(width) - 1.0);
        let row = row.clamp(0.0, f64::from(height) - 1.0);
        let (left, top) = (column.floor() as u32, row.floor() as u32);
        let (right, bottom) = ((left + 1).min(width - 1), (top + 1).min(height - 1));
        let (s, t) = (column.fract(), row.fract());
        let pixel = |x: u32, y: u32| self.picture.get_pixel(x, y).0.map(|byte| f64::from(byte) / 255.0);
        let (a, b, c, d) = (pixel(left, top), pixel(right, top), pixel(left, bottom), pixel(right, bottom));
        std::array::from_fn(|k| (a[k] * (1.0 - s) + b[k] * s) * (1.0 - t) + (c[k] * (1.0 - s) + d[k] * s) * t)
    }

    /// Luma at (x, y), 0..=1.
    pub fn luma(&self, x: f64, y: f64) -> f64 {
        let [r, g, b] = self.colour(x, y);
        0.299 * r + 0.587 * g + 0.114 * b
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_lie_where_their_millimetres_say() {
        let picture = RgbImage::from_fn(4, 2, |x, y| image::Rgb([(50 * x) as u8, (100 * y) as u8, 0]));
        let view = FrontView { picture, centre: Point2::new(10.0, 20.0), scale: 2.0 };
        // The middle of the picture lies between its four middle pixels.
        let [r, g, _] = view.colour(10.0, 20.0);
        assert!((r * 255.0 - 75.0).abs() < 1e-9 && (g * 255.0 - 50.0).abs() < 1e-9);
        // x grows to the right, y upwards.
        assert!(view.colour(12.0, 20.0)[0] > r && view.colour(10.0, 21.0)[1] < g);
        assert!((view.colour(-1e3, 20.0)[0]).abs() < 1e-9);
    }
}
