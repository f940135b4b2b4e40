//! The analysis of 001 stated on one camera's landmarks: head pose and bounded contractions solved together.
//!
//! The paper minimises Σ|d̂ⱼ − Σ xᵢdᵢⱼ|² over markers in space (eq. 2). One camera sees no depth, and a pose that is fitted
//! alone takes part of the expression for head motion. Here the same sum runs over landmarks in the picture,
//! Σ wⱼ |qⱼ − π(R(pⱼ + Σ xᵢdᵢⱼ) + t)|², by Gauss–Newton over R, t and x with 0 ≤ xᵢ ≤ 1, each round a problem of
//! `BoxSolver`. What is missing in depth then follows from the basis.

use nalgebra::{DMatrix, DVector, Matrix2x3, Point3, Rotation3, Vector2, Vector3};

use super::{BoxSolver, FaceBasis};
use crate::{
    head::{Camera, HeadPose},
    tracking::{Region, SKIN_LANDMARK_COUNT, landmark_table},
};

/// Turn and shift come before the contractions among the unknowns.
const POSE: usize = 6;
/// Rounds end when no contraction changes by more.
const SETTLED: f64 = 2e-3;

/// What the sum is made of beside the landmarks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraFit {
    /// Millimetres that a landmark is off by where its shape is wrong: the unit of residuals.
    pub accuracy: f64,
    /// By which share of its displacement a landmark is off beyond that.
    pub share: f64,
    /// Weight of x² where all landmarks are seen, in squared units of residuals.
    pub ridge: f64,
    /// Landmarks that are off by more of these units count less and less (Geman–McClure).
    pub outlier: f64,
    /// Gauss–Newton rounds at most.
    pub rounds: usize,
    /// What a landmark of the face's outline counts.
    pub outline: f64,
    /// What a landmark of the lids counts.
    pub lids: f64,
}

impl Default for CameraFit {
    fn default() -> Self {
        Self { accuracy: 0.7, share: 0.3, ridge: 20.0, outlier: 2.0, rounds: 3, outline: 0.25, lids: 1.0 }
    }
}

/// Solves frame after frame of one performer.
#[derive(Debug, Clone)]
pub struct CameraSolver {
    camera: Camera,
    basis: FaceBasis,
    fit: CameraFit,
    weights: Vec<f64>,
    /// For each landmark 3 × M, a row an axis: how it moves with each contraction.
    slopes: Vec<f64>,
    solver: BoxSolver,
    rows: DMatrix<f64>,
    gram: DMatrix<f64>,
    right: DVector<f64>,
    displaced: Vec<Vector3<f64>>,
}

impl CameraSolver {
    /// For a performer's landmarks and the shapes on them; of `basis` the first 468 points count.
    pub fn new(camera: Camera, basis: FaceBasis, fit: CameraFit) -> Self {
        let count = basis.count();
        let weights = landmark_table()[..SKIN_LANDMARK_COUNT]
            .iter()
            .map(|facts| match facts.region {
                Region::Oval => fit.outline,
                Region::Lids => fit.lids,
                _ => 1.0,
            })
            .collect();
        let mut slopes = vec![0.0; SKIN_LANDMARK_COUNT * 3 * count];
        for (muscle, vectors) in basis.vectors.iter().enumerate() {
            for (landmark, vector) in vectors[..SKIN_LANDMARK_COUNT].iter().enumerate() {
                for axis in 0..3 {
                    slopes[(landmark * 3 + axis) * count + muscle] = vector[axis];
                }
            }
        }
        let unbounded = [f64::NEG_INFINITY; POSE].into_iter();
        let lower: Vec<f64> = unbounded.chain(std::iter::repeat_n(0.0, count)).collect();
        let upper = [f64::INFINITY; POSE].into_iter().chain(std::iter::repeat_n(1.0, count)).collect();
        Self {
            camera,
            fit,
            weights,
            slopes,
            solver: BoxSolver::new(lower, upper),
            rows: DMatrix::zeros(POSE + count, 2 * SKIN_LANDMARK_COUNT),
            gram: DMatrix::zeros(POSE + count, POSE + count),
            right: DVector::zeros(POSE + count),
            displaced: Vec::new(),
            basis,
        }
    }

    /// The shapes it solves with.
    pub fn basis(&self) -> &FaceBasis {
        &self.basis
    }

    /// Pose and contractions that explain `pixels`, of which the first 468 count and those that are not a number do not.
    /// `pose` is where to start from, `contractions` too, and what comes out.
    pub fn solve(&mut self, pixels: &[Vector2<f64>], pose: &HeadPose, contractions: &mut [f64]) -> HeadPose {
        let mut pose = *pose;
        for _ in 0..self.fit.rounds {
            let seen = self.equations(pixels, &pose, contractions);
            if seen == 0 {
                break;
            }
            let Some(solution) = self.solver.solve(&self.gram, &self.right) else { break };
            pose.rotation = Rotation3::new(solution.fixed_rows::<3>(0).into_owned()) * pose.rotation;
            pose.translation += solution.fixed_rows::<3>(3);
            let mut change = 0.0_f64;
            for (own, &new) in contractions.iter_mut().zip(solution.iter().skip(POSE)) {
                change = change.max((new - *own).abs());
                *own = new;
            }
            if change < SETTLED {
                break;
            }
        }
        pose.reprojection_error = self.reprojection_error(pixels, &pose, contractions);
        pose
    }

    /// Fills in the normal equations; how many landmarks make them up.
    fn equations(&mut self, pixels: &[Vector2<f64>], pose: &HeadPose, contractions: &[f64]) -> usize {
        let count = self.basis.count();
        self.basis.synthesize(contractions, &mut self.displaced);
        let millimetres_per_pixel = pose.translation.z / self.camera.focal;
        let turn = pose.rotation.matrix();
        self.right.fill(0.0);
        let mut seen = 0;
        for (landmark, pixel) in pixels.iter().take(SKIN_LANDMARK_COUNT).enumerate() {
            if !(pixel.x.is_finite() && pixel.y.is_finite()) || self.weights[landmark] <= 0.0 {
                continue;
            }
            let arm = turn * (self.basis.points[landmark].coords + self.displaced[landmark]);
            let placed = Point3::from(arm + pose.translation);
            let slope = self.camera.jacobian(&placed);
            let residual = pixel - self.camera.project(&placed);
            // A shape that is not the performer's own is wrong by a share of itself.
            let unit = self.fit.accuracy.hypot(self.fit.share * self.displaced[landmark].norm());
            let off = (residual * millimetres_per_pixel / (self.fit.outlier * unit)).norm_squared();
            let weight = self.weights[landmark].sqrt() * millimetres_per_pixel / (unit * (1.0 + off));
            let turned: Matrix2x3<f64> = slope * turn;
            for axis in 0..2 {
                let mut row = self.rows.column_mut(2 * seen + axis);
                let s = slope.row(axis) * weight;
                // A turn moves the point by ω × arm.
                let about = arm.cross(&Vector3::new(s[0], s[1], s[2]));
                row[0] = about.x;
                row[1] = about.y;
                row[2] = about.z;
                row[3] = s[0];
                row[4] = s[1];
                row[5] = s[2];
                let t = turned.row(axis) * weight;
                let slopes = &self.slopes[landmark * 3 * count..(landmark + 1) * 3 * count];
                let (xs, rest) = slopes.split_at(count);
                let (ys, zs) = rest.split_at(count);
                let own = &mut row.as_mut_slice()[POSE..];
                // Contractions are sought themselves and not their change: what they do already is put back.
                let mut wanted = residual[axis] * weight;
                for ((((own, x), y), z), contraction) in
                    own.iter_mut().zip(xs).zip(ys).zip(zs).zip(contractions)
                {
                    *own = t[0] * x + t[1] * y + t[2] * z;
                    wanted += *own * contraction;
                }
                self.right.axpy(wanted, &self.rows.column(2 * seen + axis), 1.0);
            }
            seen += 1;
        }
        let ridge = self.fit.ridge * seen as f64 / SKIN_LANDMARK_COUNT as f64;
        let rows = self.rows.columns(0, 2 * seen);
        self.gram.gemm(1.0, &rows, &rows.transpose(), 0.0);
        for k in 0..POSE {
            self.gram[(k, k)] *= 1.0 + 1e-9;
        }
        for k in POSE..POSE + count {
            self.gram[(k, k)] += ridge;
        }
        seen
    }

    fn reprojection_error(&mut self, pixels: &[Vector2<f64>], pose: &HeadPose, contractions: &[f64]) -> f64 {
        self.basis.synthesize(contractions, &mut self.displaced);
        let (mut sum, mut total) = (0.0, 0.0);
        for (landmark, pixel) in pixels.iter().take(SKIN_LANDMARK_COUNT).enumerate() {
            let point = self.basis.points[landmark] + self.displaced[landmark];
            let off = (pixel - self.camera.project(&pose.to_camera(&point))).norm_squared();
            if off.is_finite() {
                sum += off * self.weights[landmark];
                total += self.weights[landmark];
            }
        }
        (sum / total.max(f64::MIN_POSITIVE)).sqrt()
    }
}
