//! The camera of a drawn picture, in double precision so that pixels can be cast back onto the scan.
//!
//! Pixels: x right, y down, (0, 0) the upper left *corner* of the upper left pixel, whose centre is (0.5, 0.5).

use nalgebra::{Isometry3, Matrix4, Point2, Point3, Rotation3, Unit, Vector3, Vector4};

use super::ViewError;

/// How depth maps to size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// What is far is small.
    Perspective {
        /// Angle from the lower to the upper edge of the picture, radians, in 0..π.
        vertical_fov: f64,
    },
    /// Parallel rays.
    Orthographic {
        /// What the picture's height shows, in units of the scene.
        height: f64,
    },
}

/// A camera in the scene's frame, right-handed; it looks from `eye` to `target`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewCamera {
    /// Where the camera stands.
    pub eye: Point3<f64>,
    /// What stands in the middle of the picture.
    pub target: Point3<f64>,
    /// What points upwards in the picture; not parallel to the line of sight.
    pub up: Vector3<f64>,
    /// How depth maps to size.
    pub projection: Projection,
    /// Distance from `eye` along the line of sight before which nothing is drawn; above 0 in perspective.
    pub near: f64,
    /// Distance from `eye` along the line of sight beyond which nothing is drawn.
    pub far: f64,
    /// Width and height of the picture, pixels.
    pub viewport: [u32; 2],
}

/// The vertical angle of a framed portrait: about that of an 85 mm lens on a full frame held upright.
const PORTRAIT_FOV: f64 = 24.0 * std::f64::consts::PI / 180.0;

impl ViewCamera {
    /// A camera before a face (on +Z, +Y up) that shows a ball of the given centre and radius whole, with a little
    /// air, whichever of the picture's sides is shorter.
    pub fn frame_bounds(centre: Point3<f64>, radius: f64, viewport: [u32; 2]) -> Self {
        let half = PORTRAIT_FOV / 2.0;
        let aspect = aspect(viewport);
        let narrow = if aspect < 1.0 { (half.tan() * aspect).atan() } else { half };
        let distance = 1.04 * radius / narrow.sin();
        Self {
            eye: centre + Vector3::z() * distance,
            target: centre,
            up: Vector3::y(),
            projection: Projection::Perspective { vertical_fov: PORTRAIT_FOV },
            near: (distance - 3.0 * radius).max(distance * 0.05),
            far: distance + 3.0 * radius,
            viewport,
        }
    }

    /// The same camera after a walk around its target: by `yaw` about `up` (positive to the viewer's right, which
    /// before a face is the subject's left) and by `pitch` upwards. Radians.
    #[must_use]
    pub fn orbit(&self, yaw: f64, pitch: f64) -> Self {
        let away = self.eye - self.target;
        let (Some(up), Some(right)) =
            (Unit::try_new(self.up, 1e-12), Unit::try_new(self.up.cross(&away), 1e-12))
        else {
            return *self;
        };
        let walk = Rotation3::from_axis_angle(&up, yaw) * Rotation3::from_axis_angle(&right, -pitch);
        Self { eye: self.target + walk * away, ..*self }
    }

    /// Says what is wrong with the camera, if anything is.
    pub fn check(&self) -> Result<(), ViewError> {
        let wrong = |reason| Err(ViewError::Camera { reason });
        let sight = self.target - self.eye;
        let numbers = [self.near, self.far, sight.norm(), self.up.norm()];
        if !numbers.iter().all(|n| n.is_finite()) {
            return wrong("its numbers are not all finite");
        }
        if sight.cross(&self.up).norm() <= 1e-9 * sight.norm() * self.up.norm() {
            return wrong(
                "its line of sight has no length or is parallel to its up vector; turn one of them",
            );
        }
        if self.viewport.contains(&0) {
            return wrong("its viewport has no pixels; give it the picture's size");
        }
        if self.near >= self.far {
            return wrong("its near distance is not below its far distance");
        }
        match self.projection {
            Projection::Perspective { vertical_fov }
                if !(vertical_fov > 0.0 && vertical_fov < std::f64::consts::PI) =>
            {
                wrong("its vertical angle is not between 0 and 180 degrees")
            }
            Projection::Perspective { .. } if self.near <= 0.0 => {
                wrong("its near distance is not above 0, as perspective needs")
            }
            Projection::Orthographic { height } if !(height > 0.0 && height.is_finite()) => {
                wrong("its height is not above 0")
            }
            _ => Ok(()),
        }
    }

    /// Scene to camera: x right, y up, z towards the viewer, in units of the scene.
    pub fn view_from_world(&self) -> Matrix4<f64> {
        Isometry3::look_at_rh(&self.eye, &self.target, &self.up).to_homogeneous()
    }

    /// Camera to clip space: x and y in -1..=1, z from 0 (near) to 1 (far), after division by w.
    pub fn clip_from_view(&self) -> Matrix4<f64> {
        let (aspect, depth) = (aspect(self.viewport), self.near - self.far);
        let mut m = Matrix4::zeros();
        match self.projection {
            Projection::Perspective { vertical_fov } => {
                let f = 1.0 / (vertical_fov / 2.0).tan();
                m[(0, 0)] = f / aspect;
                m[(1, 1)] = f;
                m[(2, 2)] = self.far / depth;
                m[(2, 3)] = self.near * self.far / depth;
                m[(3, 2)] = -1.0;
            }
            Projection::Orthographic { height } => {
                m[(0, 0)] = 2.0 / (height * aspect);
                m[(1, 1)] = 2.0 / height;
                m[(2, 2)] = 1.0 / depth;
                m[(2, 3)] = self.near / depth;
                m[(3, 3)] = 1.0;
            }
        }
        m
    }

    /// Where a point of the scene lies in the picture, in pixels, also beyond the picture's edges; `None` for a
    /// point behind a perspective camera.
    pub fn project(&self, point: Point3<f64>) -> Option<Point2<f64>> {
        let clip = self.clip_from_view() * self.view_from_world() * point.to_homogeneous();
        if clip.w <= 0.0 {
            return None;
        }
        let [half_width, half_height] = self.viewport.map(|side| f64::from(side) / 2.0);
        Some(Point2::new((1.0 + clip.x / clip.w) * half_width, (1.0 - clip.y / clip.w) * half_height))
    }

    /// The line of sight through a pixel: where it starts, in the scene, and its direction.
    ///
    /// It starts at `eye` in perspective, on the plane through `eye` otherwise.
    pub fn ray(&self, pixel: Point2<f64>) -> (Point3<f64>, Unit<Vector3<f64>>) {
        let [width, height] = self.viewport.map(f64::from);
        let (x, y) = (2.0 * pixel.x / width - 1.0, 1.0 - 2.0 * pixel.y / height);
        let world = Isometry3::look_at_rh(&self.eye, &self.target, &self.up).inverse();
        let aspect = aspect(self.viewport);
        match self.projection {
            Projection::Perspective { vertical_fov } => {
                let t = (vertical_fov / 2.0).tan();
                let direction = world * Vector3::new(x * t * aspect, y * t, -1.0);
                (self.eye, Unit::new_normalize(direction))
            }
            Projection::Orthographic { height } => {
                let start = world * Point3::new(x * height * aspect / 2.0, y * height / 2.0, 0.0);
                (start, Unit::new_normalize(world * -Vector3::z()))
            }
        }
    }

    /// The eye in camera coordinates, homogeneous: a point in perspective, a direction otherwise.
    pub(super) fn eye_in_view(&self) -> Vector4<f64> {
        match self.projection {
            Projection::Perspective { .. } => Vector4::new(0.0, 0.0, 0.0, 1.0),
            Projection::Orthographic { .. } => Vector4::new(0.0, 0.0, 1.0, 0.0),
        }
    }
}

fn aspect([width, height]: [u32; 2]) -> f64 {
    f64::from(width) / f64::from(height.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn cameras() -> [ViewCamera; 3] {
        let framed = ViewCamera::frame_bounds(Point3::new(3.0, -20.0, 40.0), 130.0, [1280, 720]);
        let upright = ViewCamera::frame_bounds(Point3::origin(), 95.0, [480, 640]).orbit(0.6, -0.3);
        let parallel = ViewCamera { projection: Projection::Orthographic { height: 260.0 }, ..framed };
        [framed, upright, parallel.orbit(-1.1, 0.2)]
    }

    #[test]
    fn the_ray_of_a_projected_point_passes_through_it() {
        for camera in cameras() {
            camera.check().unwrap();
            for offset in [[0.0, 0.0, 0.0], [40.0, -60.0, 55.0], [-71.0, 12.0, -30.0]] {
                let point = camera.target + Vector3::from(offset);
                let pixel = camera.project(point).unwrap();
                let (start, direction) = camera.ray(pixel);
                let miss = (point - start).cross(&direction).norm();
                assert!(miss < 1e-9, "{miss}");
                assert!((point - start).dot(&direction) > 0.0);
            }
        }
    }

    #[test]
    fn a_pixel_comes_back_from_any_point_of_its_ray() {
        for camera in cameras() {
            for pixel in [Point2::new(0.0, 0.0), Point2::new(411.3, 77.7)] {
                let (start, direction) = camera.ray(pixel);
                let back = camera.project(start + direction.into_inner() * 700.0).unwrap();
                assert_relative_eq!(back, pixel, epsilon = 1e-8);
            }
        }
    }

    #[test]
    fn the_target_is_the_middle_and_left_is_the_subjects_right() {
        let camera = ViewCamera::frame_bounds(Point3::origin(), 100.0, [1280, 720]);
        assert_relative_eq!(
            camera.project(Point3::origin()).unwrap(),
            Point2::new(640.0, 360.0),
            epsilon = 1e-9
        );
        let subjects_left = camera.project(Point3::new(50.0, 50.0, 0.0)).unwrap();
        assert!(subjects_left.x > 640.0 && subjects_left.y < 360.0);
        assert_eq!(camera.project(camera.eye + Vector3::z()), None);
    }

    #[test]
    fn a_framed_ball_fits_whole() {
        for viewport in [[1280, 720], [300, 900]] {
            let camera = ViewCamera::frame_bounds(Point3::origin(), 100.0, viewport);
            let [width, height] = viewport.map(f64::from);
            let distance = camera.eye.z;
            // The silhouette circle of a ball seen from a finite distance.
            let radius = 100.0 * (1.0 - (100.0 / distance).powi(2)).sqrt();
            let z = 100.0 * 100.0 / distance;
            let right = camera.project(Point3::new(radius, 0.0, z)).unwrap().x;
            let top = camera.project(Point3::new(0.0, radius, z)).unwrap().y;
            assert!(right < width && top > 0.0);
            assert!((width - right).min(top) < 0.05 * width.min(height));
        }
    }

    #[test]
    fn useless_cameras_are_named() {
        let good = cameras()[0];
        for bad in [
            ViewCamera { eye: good.target, ..good },
            ViewCamera { up: Vector3::z(), ..good },
            ViewCamera { near: good.far, ..good },
            ViewCamera { near: 0.0, ..good },
            ViewCamera { far: f64::NAN, ..good },
            ViewCamera { viewport: [0, 10], ..good },
            ViewCamera { projection: Projection::Perspective { vertical_fov: 4.0 }, ..good },
            ViewCamera { projection: Projection::Orthographic { height: 0.0 }, ..good },
        ] {
            assert!(bad.check().is_err(), "{bad:?}");
        }
    }
}
