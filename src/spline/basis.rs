//! The functions a spline is a sum of: one kernel for each centre, then the polynomial terms.

use nalgebra::{DMatrix, Point, SVD, SVector};

use super::unit_box::UnitBox;
use super::{Flatness, Kernel, Options, Polynomial, SplineError};

/// Thickness, as a fraction of the box, below which centres count as lying in a plane or on a line. On a face it is a
/// fifth of a micrometre.
const FLAT: f64 = 1e-6;

/// n kernels and k polynomial terms in box coordinates. Index i < n is the kernel of centre i; the rest is 1 and the
/// coordinates along `axes`.
#[derive(Clone, Debug)]
pub(super) struct Basis<const D: usize> {
    kernel: Kernel,
    unit_box: UnitBox<D>,
    centres: Vec<SVector<f64, D>>,
    stiffness_squared: Vec<f64>,
    constant: bool,
    axes: Vec<SVector<f64, D>>,
}

impl<const D: usize> Basis<D> {
    /// Lays out the functions for `centres`, or says why the polynomial part is not determined by them.
    pub(super) fn new(
        kernel: Kernel,
        centres: &[Point<f64, D>],
        options: Options,
    ) -> Result<Self, SplineError> {
        let Options { polynomial, stiffness, .. } = options;
        if !(stiffness.is_finite() && stiffness > 0.0) {
            return Err(SplineError::Stiffness { stiffness });
        }
        let unit_box = UnitBox::around(centres)?;
        let found = centres.len();
        if kernel.needs_affine() && matches!(polynomial, Polynomial::Constant | Polynomial::None) {
            return Err(SplineError::PolynomialTooLow { kernel, polynomial });
        }
        // A stiffness is a distance to another centre, so there must be one.
        let kernel_wants = if kernel.uses_stiffness() { 2 } else { 1 };
        let wanted = if polynomial == Polynomial::Affine { D + 1 } else { kernel_wants };
        if found < wanted {
            return Err(SplineError::TooFewCentres { polynomial, wanted, found });
        }
        let centres: Vec<_> = centres.iter().map(|p| unit_box.enter(p)).collect();
        let axes = match polynomial {
            Polynomial::Constant | Polynomial::None => Vec::new(),
            Polynomial::Affine | Polynomial::InSpan => polynomial_axes(&centres, polynomial)?,
        };
        let stiffness_squared =
            if kernel.uses_stiffness() { nearest_squared(&centres, stiffness) } else { vec![0.0; found] };
        Ok(Self {
            kernel,
            unit_box,
            centres,
            stiffness_squared,
            constant: polynomial != Polynomial::None,
            axes,
        })
    }

    pub(super) fn kernel(&self) -> Kernel {
        self.kernel
    }

    pub(super) fn unit_box(&self) -> &UnitBox<D> {
        &self.unit_box
    }

    /// n, the number of centres.
    pub(super) fn centres(&self) -> usize {
        self.centres.len()
    }

    /// n + k, the number of functions.
    pub(super) fn len(&self) -> usize {
        self.centres.len() + usize::from(self.constant) + self.axes.len()
    }

    /// Calls `f(i, value)` for every function at `u` (box coordinates), in order.
    #[inline]
    pub(super) fn at(&self, u: &SVector<f64, D>, mut f: impl FnMut(usize, f64)) {
        for (i, (centre, s2)) in self.centres.iter().zip(&self.stiffness_squared).enumerate() {
            f(i, self.kernel.value((u - centre).norm_squared(), *s2));
        }
        let mut next = self.centres.len();
        if self.constant {
            f(next, 1.0);
            next += 1;
        }
        for (k, axis) in self.axes.iter().enumerate() {
            f(next + k, axis.dot(u));
        }
    }

    /// Calls `f(i, gradient)` for every function at `u`, the gradient in the caller's unit (per box side).
    #[inline]
    pub(super) fn gradients_at(&self, u: &SVector<f64, D>, mut f: impl FnMut(usize, SVector<f64, D>)) {
        let scale = self.unit_box.scale();
        for (i, (centre, s2)) in self.centres.iter().zip(&self.stiffness_squared).enumerate() {
            let d = u - centre;
            f(i, d * (self.kernel.derivative_over_r(d.norm_squared(), *s2) / scale));
        }
        let first_axis = self.centres.len() + usize::from(self.constant);
        for (k, axis) in self.axes.iter().enumerate() {
            f(first_axis + k, axis / scale);
        }
    }

    /// L of 000 eq. 4.13, (n + k) × (n + k), its diagonal shifted by σλ: \[K + σλI, P; Pᵀ, 0\].
    ///
    /// Row i of K holds U(|Pᵢ − Pⱼ|) with *column* j's stiffness, as 002 eq. 2 has it.
    pub(super) fn system(&self, lambda: f64) -> DMatrix<f64> {
        let n = self.centres();
        let mut l = DMatrix::zeros(self.len(), self.len());
        for (i, u) in self.centres.iter().enumerate() {
            self.at(u, |j, value| {
                l[(i, j)] = value;
                if j >= n {
                    l[(j, i)] = value;
                }
            });
            l[(i, i)] += self.kernel.definiteness() * lambda;
        }
        l
    }

    /// The closest pair of centres whose distance is at most `limit` box sides: indices and distance in the caller's
    /// unit.
    pub(super) fn coincident(&self, limit: f64) -> Option<(usize, usize, f64)> {
        let mut closest: Option<(usize, usize, f64)> = None;
        for (j, b) in self.centres.iter().enumerate() {
            for (i, a) in self.centres[..j].iter().enumerate() {
                let distance = (a - b).norm();
                if distance <= limit && closest.is_none_or(|(_, _, d)| distance < d) {
                    closest = Some((i, j, distance));
                }
            }
        }
        closest.map(|(i, j, d)| (i, j, d * self.unit_box.scale()))
    }

    /// wᵀKw for one column of weights, without the regularisation.
    pub(super) fn quadratic_form(&self, weights: impl Fn(usize) -> f64) -> f64 {
        let mut sum = 0.0;
        for (i, a) in self.centres.iter().enumerate() {
            for (j, b) in self.centres.iter().enumerate() {
                let u = self.kernel.value((a - b).norm_squared(), self.stiffness_squared[j]);
                sum += weights(i) * u * weights(j);
            }
        }
        sum
    }
}

/// The directions of the affine part: the coordinate axes if the centres span the space, else, for
/// [`Polynomial::InSpan`], an orthonormal basis of what they do span.
fn polynomial_axes<const D: usize>(
    centres: &[SVector<f64, D>],
    polynomial: Polynomial,
) -> Result<Vec<SVector<f64, D>>, SplineError> {
    let mean = centres.iter().sum::<SVector<f64, D>>() / centres.len() as f64;
    let spread = DMatrix::from_fn(centres.len(), D, |i, axis| centres[i][axis] - mean[axis]);
    let singular = SplineError::Singular { pivot_ratio: 0.0 };
    let svd = SVD::try_new(spread, false, true, f64::EPSILON, 1000).ok_or(singular.clone())?;
    let directions = svd.v_t.ok_or(singular)?;
    // RMS extents in box sides, largest first. With fewer centres than axes the missing ones are zero.
    let extents: Vec<f64> = svd.singular_values.iter().map(|s| s / (centres.len() as f64).sqrt()).collect();
    let rank = extents.iter().filter(|extent| **extent > FLAT).count();
    if rank == D {
        return Ok((0..D).map(|axis| SVector::from_fn(|row, _| f64::from(u8::from(row == axis)))).collect());
    }
    if polynomial == Polynomial::InSpan {
        return Ok((0..rank).map(|r| SVector::from_fn(|axis, _| directions[(r, axis)])).collect());
    }
    let shape = match rank {
        0 => Flatness::Point,
        1 => Flatness::Line,
        _ => Flatness::Plane,
    };
    Err(SplineError::Flat {
        found: centres.len(),
        shape,
        thickness: extents.get(rank).copied().unwrap_or(0.0),
    })
}

/// sᵢ² of 002 eq. 3, times the square of `factor`: the squared distance from each centre to its nearest other centre.
fn nearest_squared<const D: usize>(centres: &[SVector<f64, D>], factor: f64) -> Vec<f64> {
    let nearest = |i: usize| {
        let others = centres.iter().enumerate().filter(|(j, _)| *j != i);
        others.map(|(_, p)| (p - centres[i]).norm_squared()).fold(f64::INFINITY, f64::min)
    };
    (0..centres.len()).map(|i| nearest(i) * factor * factor).collect()
}
