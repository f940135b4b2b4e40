//! Head pose: a perspective n-point start, refined by weighted Gauss–Newton.
//!
//! 002 §III weighs rigid points above the others and reads expression from what is left over. The weights are those of
//! `tracking::landmark_table`: 1 / (0.8² + m²) where m is how far expressions move the point.

use nalgebra::{Matrix3, Matrix6, Point3, Rotation3, SMatrix, Vector2, Vector3, Vector6};
use opencv::{calib3d, core, prelude::*};

use super::{Camera, HeadError};

/// Refinement steps; the error stops falling after three.
const STEPS: usize = 5;
/// Points lighter than this fraction of the heaviest do not take part in the start.
const START_WEIGHT: f64 = 0.02;
/// Residuals beyond this many pixels per 100 px of focal depth scale count less and less (Geman–McClure), millimetres.
const OUTLIER: f64 = 4.0;

/// Rotation and translation from the performer's scan frame to the camera frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadPose {
    /// Scan frame (+X subject's left, +Y up, +Z out of the face) to camera frame (x right, y down, z forward).
    pub rotation: Rotation3<f64>,
    /// The scan frame's origin in the camera frame, millimetres.
    pub translation: Vector3<f64>,
    /// Weighted root mean square distance between landmarks and projections, pixels.
    pub reprojection_error: f64,
}

impl HeadPose {
    /// A point of the scan frame in the camera frame.
    pub fn to_camera(&self, point: &Point3<f64>) -> Point3<f64> {
        self.rotation * point + self.translation
    }

    /// A point of the camera frame in the scan frame.
    pub fn to_scan(&self, point: &Point3<f64>) -> Point3<f64> {
        self.rotation.inverse() * (point - self.translation)
    }
}

/// Solves poses of one face: its points and weights are fixed, pixels change.
#[derive(Debug, Clone)]
pub struct PoseSolver {
    camera: Camera,
    points: Vec<Point3<f64>>,
    weights: Vec<f64>,
}

impl PoseSolver {
    /// `points` in the scan frame, millimetres; `weights` one each, 0 leaves a point out.
    pub fn new(camera: Camera, points: Vec<Point3<f64>>, weights: Vec<f64>) -> Self {
        Self { camera, points, weights }
    }

    /// The camera the solver was made with.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The pose that explains `pixels` (one per point). `previous` saves the search for a start.
    pub fn solve(&self, pixels: &[Vector2<f64>], previous: Option<&HeadPose>) -> Result<HeadPose, HeadError> {
        let mut pose = match previous {
            Some(pose) => *pose,
            None => self.start(pixels)?,
        };
        for _ in 0..STEPS {
            self.step(pixels, &mut pose);
        }
        if !(pose.translation.iter().all(|v| v.is_finite()) && pose.translation.z > 0.0) {
            return if previous.is_some() { self.solve(pixels, None) } else { Err(HeadError::NoPose) };
        }
        pose.reprojection_error = self.reprojection_error(pixels, &pose);
        Ok(pose)
    }

    /// SQPnP on the points that matter.
    fn start(&self, pixels: &[Vector2<f64>]) -> Result<HeadPose, HeadError> {
        let least = START_WEIGHT * self.weights.iter().copied().fold(0.0, f64::max);
        let (mut objects, mut images) =
            (core::Vector::<core::Point3d>::new(), core::Vector::<core::Point2d>::new());
        for ((point, pixel), &weight) in self.points.iter().zip(pixels).zip(&self.weights) {
            if weight > least {
                objects.push(core::Point3d::new(point.x, point.y, point.z));
                images.push(core::Point2d::new(pixel.x, pixel.y));
            }
        }
        let intrinsics = core::Mat::from_slice_2d(&[
            [self.camera.focal, 0.0, self.camera.centre.x],
            [0.0, self.camera.focal, self.camera.centre.y],
            [0.0, 0.0, 1.0],
        ])?;
        let (mut rotation, mut translation) = (core::Mat::default(), core::Mat::default());
        let solved = calib3d::solve_pnp(
            &objects,
            &images,
            &intrinsics,
            &core::no_array(),
            &mut rotation,
            &mut translation,
            false,
            calib3d::SOLVEPNP_SQPNP,
        )?;
        if !solved {
            return Err(HeadError::NoPose);
        }
        let read = |mat: &core::Mat| -> Result<Vector3<f64>, HeadError> {
            let values = mat.data_typed::<f64>()?;
            Ok(Vector3::new(values[0], values[1], values[2]))
        };
        Ok(HeadPose {
            rotation: Rotation3::new(read(&rotation)?),
            translation: read(&translation)?,
            reprojection_error: 0.0,
        })
    }

    /// One Gauss–Newton step on a rotation about the head's origin and a translation, both in the camera frame.
    fn step(&self, pixels: &[Vector2<f64>], pose: &mut HeadPose) {
        let mut normal = Matrix6::<f64>::zeros();
        let mut gradient = Vector6::<f64>::zeros();
        let millimetres_per_pixel = pose.translation.z / self.camera.focal;
        for ((point, pixel), &weight) in self.points.iter().zip(pixels).zip(&self.weights) {
            if weight <= 0.0 {
                continue;
            }
            let arm = pose.rotation * point.coords;
            let placed = Point3::from(arm + pose.translation);
            let slope = self.camera.jacobian(&placed);
            let residual = pixel - self.camera.project(&placed);
            let distance = (residual * millimetres_per_pixel).norm_squared() / (OUTLIER * OUTLIER);
            let weight = weight / (1.0 + distance).powi(2);
            let mut jacobian = SMatrix::<f64, 2, 6>::zeros();
            jacobian.fixed_view_mut::<2, 3>(0, 0).copy_from(&(-slope * cross_matrix(&arm)));
            jacobian.fixed_view_mut::<2, 3>(0, 3).copy_from(&slope);
            normal += jacobian.transpose() * jacobian * weight;
            gradient += jacobian.transpose() * residual * weight;
        }
        normal += Matrix6::from_diagonal(&normal.diagonal()) * 1e-9;
        if let Some(cholesky) = normal.cholesky() {
            let update = cholesky.solve(&gradient);
            pose.rotation = Rotation3::new(update.fixed_rows::<3>(0).into_owned()) * pose.rotation;
            pose.translation += update.fixed_rows::<3>(3);
        }
    }

    fn reprojection_error(&self, pixels: &[Vector2<f64>], pose: &HeadPose) -> f64 {
        let (mut sum, mut total) = (0.0, 0.0);
        for ((point, pixel), &weight) in self.points.iter().zip(pixels).zip(&self.weights) {
            sum += weight * (pixel - self.camera.project(&pose.to_camera(point))).norm_squared();
            total += weight;
        }
        (sum / total.max(f64::MIN_POSITIVE)).sqrt()
    }
}

fn cross_matrix(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn face() -> Vec<Point3<f64>> {
        (0..60)
            .map(|i| {
                let (a, b) = (f64::from(i) * 2.4, f64::from(i) * 1.1);
                Point3::new(70.0 * a.sin(), 80.0 * b.cos(), 30.0 * (a * b).cos())
            })
            .collect()
    }

    #[test]
    fn exact_landmarks_give_the_pose_back() {
        let camera = Camera::with_field_of_view(640, 480, 60.0).unwrap();
        let solver = PoseSolver::new(camera, face(), vec![1.0; 60]);
        for step in -6..=6 {
            let truth = HeadPose {
                rotation: Rotation3::from_euler_angles(
                    std::f64::consts::PI + 0.1,
                    0.1 * f64::from(step),
                    0.05,
                ),
                translation: Vector3::new(20.0, -10.0, 550.0),
                reprojection_error: 0.0,
            };
            let pixels: Vec<_> = face().iter().map(|p| camera.project(&truth.to_camera(p))).collect();
            let found = solver.solve(&pixels, None).unwrap();
            assert!((found.rotation.matrix() - truth.rotation.matrix()).norm() < 1e-7);
            assert!((found.translation - truth.translation).norm() < 1e-5);
            assert!(found.reprojection_error < 1e-6);
        }
    }

    #[test]
    fn moving_points_hardly_matter_when_their_weight_is_small() {
        let camera = Camera::with_field_of_view(640, 480, 60.0).unwrap();
        let mut weights = vec![1.0; 60];
        weights[40..].fill(0.001);
        let solver = PoseSolver::new(camera, face(), weights);
        let truth = HeadPose {
            rotation: Rotation3::from_euler_angles(std::f64::consts::PI, 0.2, 0.0),
            translation: Vector3::new(0.0, 0.0, 600.0),
            reprojection_error: 0.0,
        };
        let pixels: Vec<_> = face()
            .iter()
            .enumerate()
            .map(|(i, p)| {
                let drop = if i >= 40 { Vector3::new(0.0, -15.0, 0.0) } else { Vector3::zeros() };
                camera.project(&truth.to_camera(&(p + drop)))
            })
            .collect();
        let found = solver.solve(&pixels, None).unwrap();
        assert!(found.rotation.angle_to(&truth.rotation).to_degrees() < 0.05);
    }
}
