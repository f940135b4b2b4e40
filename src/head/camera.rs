//! A pinhole camera without distortion.

use nalgebra::{Matrix2x3, Point3, Vector2, Vector3};

use super::HeadError;

/// Camera frame: x right, y down, z forward, millimetres. Image: pixels, pixel centres at integers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Focal length, pixels.
    pub focal: f64,
    /// Principal point, pixels.
    pub centre: Vector2<f64>,
}

impl Camera {
    /// The field of view of a common webcam, along the picture's longer side, degrees. A wrong guess hardly matters:
    /// displacements change by 5 % when the focal length is off by a factor of two, and estimating it from a face is
    /// less sure than this guess.
    pub const DEFAULT_FIELD_OF_VIEW: f64 = 60.0;

    /// A centred camera whose longer side spans `field_of_view` degrees.
    pub fn with_field_of_view(width: i32, height: i32, field_of_view: f64) -> Result<Self, HeadError> {
        if !(10.0..=150.0).contains(&field_of_view) {
            return Err(HeadError::FieldOfView { degrees: field_of_view });
        }
        let longer = f64::from(width.max(height));
        Ok(Self {
            focal: longer / 2.0 / (field_of_view.to_radians() / 2.0).tan(),
            centre: Vector2::new(f64::from(width - 1) / 2.0, f64::from(height - 1) / 2.0),
        })
    }

    /// The pixel of a point in front of the camera.
    pub fn project(&self, point: &Point3<f64>) -> Vector2<f64> {
        self.centre + point.coords.xy() * (self.focal / point.z)
    }

    /// How the pixel moves with the point: 2 × 3, pixels per millimetre.
    pub fn jacobian(&self, point: &Point3<f64>) -> Matrix2x3<f64> {
        let scale = self.focal / point.z;
        Matrix2x3::new(scale, 0.0, -scale * point.x / point.z, 0.0, scale, -scale * point.y / point.z)
    }

    /// The direction of a pixel's ray, with z = 1.
    pub fn ray(&self, pixel: Vector2<f64>) -> Vector3<f64> {
        let flat = (pixel - self.centre) / self.focal;
        Vector3::new(flat.x, flat.y, 1.0)
    }

    /// The point of a pixel's ray at `depth` millimetres.
    pub fn at_depth(&self, pixel: Vector2<f64>, depth: f64) -> Point3<f64> {
        Point3::from(self.ray(pixel) * depth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longer_side_spans_the_field_of_view() {
        let camera = Camera::with_field_of_view(401, 301, 60.0).unwrap();
        let edge = camera.ray(Vector2::new(camera.centre.x + 200.5, camera.centre.y));
        assert!((edge.x.atan().to_degrees() - 30.0).abs() < 1e-9);
        assert!(Camera::with_field_of_view(400, 300, 0.0).is_err());
    }

    #[test]
    fn projection_and_ray_are_inverse_and_the_jacobian_is_their_slope() {
        let camera = Camera::with_field_of_view(640, 480, 50.0).unwrap();
        let point = Point3::new(30.0, -20.0, 500.0);
        let pixel = camera.project(&point);
        assert!((camera.at_depth(pixel, 500.0) - point).norm() < 1e-9);
        let jacobian = camera.jacobian(&point);
        for axis in 0..3 {
            let mut moved = point;
            moved[axis] += 1e-4;
            let slope = (camera.project(&moved) - pixel) / 1e-4;
            assert!((slope - jacobian.column(axis)).norm() < 1e-5);
        }
    }
}
