//! The rotated square that a network looks at, and the way there and back.

use nalgebra::{Matrix2, Vector2};
use opencv::{core, imgproc};

use super::{
    TrackingError,
    landmarks::{Landmarks, index},
};
use crate::capture::Image;

/// How far beyond the face box or the landmarks the square reaches.
const MARGIN: f64 = 1.5;

/// A square in the picture, rotated so that the eyes are level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaceRegion {
    /// Image pixels.
    pub centre: Vector2<f64>,
    /// Side, image pixels.
    pub side: f64,
    /// Clockwise in the picture, radians.
    pub angle: f64,
}

impl FaceRegion {
    /// Around an axis-aligned box, level along the line from one eye keypoint to the other.
    pub fn around(
        minimum: Vector2<f64>,
        maximum: Vector2<f64>,
        right_eye: Vector2<f64>,
        left_eye: Vector2<f64>,
    ) -> Self {
        let extent = maximum - minimum;
        let eyes = left_eye - right_eye;
        Self {
            centre: (minimum + maximum) / 2.0,
            side: extent.x.max(extent.y) * MARGIN,
            angle: eyes.y.atan2(eyes.x),
        }
    }

    /// For the next frame: around all landmarks of this one.
    pub fn around_landmarks(landmarks: &Landmarks) -> Self {
        let (mut minimum, mut maximum) = (landmarks.pixel(0), landmarks.pixel(0));
        for point in &landmarks.points {
            minimum = minimum.inf(&point.xy());
            maximum = maximum.sup(&point.xy());
        }
        Self::around(
            minimum,
            maximum,
            landmarks.pixel(index::RIGHT_EYE_OUTER),
            landmarks.pixel(index::LEFT_EYE_OUTER),
        )
    }

    /// Region pixels of a `size` × `size` crop to image pixels.
    pub fn linear(&self, size: i32) -> Matrix2<f64> {
        let (sine, cosine) = self.angle.sin_cos();
        Matrix2::new(cosine, -sine, sine, cosine) * (self.side / f64::from(size))
    }

    /// A crop's pixel in the image.
    pub fn to_image(&self, size: i32, pixel: Vector2<f64>) -> Vector2<f64> {
        self.centre + self.linear(size) * (pixel - Vector2::repeat(f64::from(size) / 2.0))
    }

    /// True while the square can still hold a face: finite, not tiny, and its centre inside the picture.
    pub fn is_usable(&self, width: i32, height: i32) -> bool {
        self.side.is_finite()
            && self.side >= 16.0
            && self.side <= 16.0 * f64::from(width.max(height))
            && (0.0..f64::from(width)).contains(&self.centre.x)
            && (0.0..f64::from(height)).contains(&self.centre.y)
    }

    /// Fills `crop` with `size` × `size` pixels of the region, bilinear, the border repeated outwards.
    pub fn cut(&self, image: &Image, size: i32, crop: &mut core::Mat) -> Result<(), TrackingError> {
        let linear = self.linear(size);
        let offset = self.centre - linear * Vector2::repeat(f64::from(size) / 2.0);
        let map = core::Mat::from_slice_2d(&[
            [linear[(0, 0)], linear[(0, 1)], offset.x],
            [linear[(1, 0)], linear[(1, 1)], offset.y],
        ])?;
        imgproc::warp_affine(
            image.mat(),
            crop,
            &map,
            core::Size::new(size, size),
            imgproc::INTER_LINEAR | imgproc::WARP_INVERSE_MAP,
            core::BORDER_REPLICATE,
            core::Scalar::default(),
        )?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_the_crop_is_the_centre_and_corners_turn_with_the_angle() {
        let region =
            FaceRegion { centre: Vector2::new(100.0, 50.0), side: 64.0, angle: std::f64::consts::FRAC_PI_2 };
        assert!((region.to_image(256, Vector2::new(128.0, 128.0)) - region.centre).norm() < 1e-12);
        // A quarter turn clockwise: the crop's right edge points down in the picture.
        let right = region.to_image(256, Vector2::new(256.0, 128.0));
        assert!((right - Vector2::new(100.0, 82.0)).norm() < 1e-12);
    }
}
