//! Fitting a spline: the system of 000 eq. 4.13–4.19, solved once or factored for many sets of values.

use nalgebra::{DMatrix, Dyn, LU, Point, SMatrix, SVector};

use super::basis::Basis;
use super::{Input, Kernel, Options, SplineError};

/// Centres closer than this, in box sides, are one place: an interpolating system would be singular.
const COINCIDENT: f64 = 1e-9;

/// Smallest ratio of pivots that still leaves useful digits in f64.
const PIVOT_RATIO: f64 = 1e-15;

/// The factored system of a set of centres: solves for any values at them without factoring again.
///
/// Memory is 2·(n + D + 1)² numbers; factoring costs about ⅔n³ operations, each solve 4Dn².
#[derive(Clone, Debug)]
pub struct Factored<const D: usize> {
    basis: Basis<D>,
    system: DMatrix<f64>,
    lu: LU<f64, Dyn, Dyn>,
}

impl<const D: usize> Factored<D> {
    /// Factors the system of `centres`, n points of dimension D = 2 or 3 in any one unit.
    ///
    /// # Errors
    /// Too few or non-finite centres; coincident ones while λ = 0; centres in a plane or on a line under
    /// [`Polynomial::Affine`](super::Polynomial::Affine); a polynomial too low for the kernel; a negative λ; a
    /// stiffness that is not above zero; a system that is singular to working precision.
    pub fn new(kernel: Kernel, centres: &[Point<f64, D>], options: Options) -> Result<Self, SplineError> {
        const { assert!(D == 2 || D == 3, "splines are fitted in the plane or in space") }
        let basis = Basis::new(kernel, centres, options)?;
        let lambda = options.regularisation.in_unit_box(kernel, basis.unit_box().scale())?;
        if lambda <= 0.0
            && let Some((first, second, distance)) = basis.coincident(COINCIDENT)
        {
            return Err(SplineError::Coincident { first, second, distance });
        }
        let system = basis.system(lambda);
        // LU, not Cholesky: the bordered matrix is indefinite, and Hardy's is not even symmetric.
        let lu = system.clone().lu();
        let pivots = lu.u().diagonal().abs();
        let pivot_ratio = pivots.min() / pivots.max();
        if pivot_ratio > PIVOT_RATIO {
            Ok(Self { basis, system, lu })
        } else {
            Err(SplineError::Singular { pivot_ratio })
        }
    }

    /// n, the number of centres.
    pub fn centres(&self) -> usize {
        self.basis.centres()
    }

    /// The spline through `values`, one for each centre, in any unit: positions for a map, displacements for a warp.
    ///
    /// # Errors
    /// A number of values other than n, or a value that is not finite.
    pub fn solve(&self, values: &[SVector<f64, D>]) -> Result<Spline<D>, SplineError> {
        let n = self.centres();
        if values.len() != n {
            return Err(SplineError::Count { input: Input::Value, wanted: n, found: values.len() });
        }
        if let Some(index) = values.iter().position(|v| v.iter().any(|c| !c.is_finite())) {
            return Err(SplineError::NotFinite { input: Input::Value, index });
        }
        let right = DMatrix::from_fn(self.basis.len(), D, |i, axis| values.get(i).map_or(0.0, |v| v[axis]));
        let solved = self.solve_columns(&right)?;
        let coefficients = solved.row_iter().map(|row| SVector::from_fn(|axis, _| row[axis])).collect();
        Ok(Spline { basis: self.basis.clone(), coefficients })
    }

    /// The coefficients, (n + k) × m, of the spline that is 1 at centre j and 0 at the others, for each j < m.
    pub(super) fn cardinal(&self, m: usize) -> Result<DMatrix<f64>, SplineError> {
        self.solve_columns(&DMatrix::identity(self.basis.len(), m))
    }

    pub(super) fn basis(&self) -> &Basis<D> {
        &self.basis
    }

    /// L⁻¹Y with one step of iterative refinement, which brings the residual at the centres down to rounding.
    fn solve_columns(&self, right: &DMatrix<f64>) -> Result<DMatrix<f64>, SplineError> {
        let singular = SplineError::Singular { pivot_ratio: 0.0 };
        let mut solution = self.lu.solve(right).ok_or(singular.clone())?;
        let residual = right - product(&self.system, &solution);
        solution += self.lu.solve(&residual).ok_or(singular)?;
        Ok(solution)
    }
}

/// A·X by columns. The library's product picks its instructions by the machine, and with them its rounding.
fn product(a: &DMatrix<f64>, x: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(a.nrows(), x.ncols());
    for (mut to, from) in out.column_iter_mut().zip(x.column_iter()) {
        for (column, factor) in a.column_iter().zip(from.iter()) {
            to.axpy(*factor, &column, 1.0);
        }
    }
    out
}

/// A fitted spline f(x) = A·\[1 x\] + Σ wᵢ U(|x − Pᵢ|), from D dimensions to D (000 eq. 4.10, 4.19).
#[derive(Clone, Debug)]
pub struct Spline<const D: usize> {
    basis: Basis<D>,
    /// W then A, in box coordinates: one row for each function of the basis.
    coefficients: Vec<SVector<f64, D>>,
}

impl<const D: usize> Spline<D> {
    /// Fits a spline that takes `values[i]` at `centres[i]`, exactly or, when regularised, nearly.
    ///
    /// For one use; where the centres stay and the values change, keep a [`Factored`].
    ///
    /// # Errors
    /// As [`Factored::new`] and [`Factored::solve`].
    ///
    /// ```
    /// use nalgebra::{Point2, Vector2};
    /// use understudy::spline::{Kernel, Options, Spline};
    ///
    /// let centres = [Point2::new(0.0, 0.0), Point2::new(1.0, 0.0), Point2::new(0.0, 1.0), Point2::new(1.0, 1.0)];
    /// let values = [Vector2::zeros(), Vector2::zeros(), Vector2::zeros(), Vector2::new(0.2, 0.1)];
    /// let spline = Spline::fit(Kernel::ThinPlate, &centres, &values, Options::default())?;
    /// assert!((spline.evaluate(&centres[3]) - values[3]).norm() < 1e-12);
    /// # Ok::<(), understudy::spline::SplineError>(())
    /// ```
    pub fn fit(
        kernel: Kernel,
        centres: &[Point<f64, D>],
        values: &[SVector<f64, D>],
        options: Options,
    ) -> Result<Self, SplineError> {
        if values.len() != centres.len() {
            return Err(SplineError::Count {
                input: Input::Value,
                wanted: centres.len(),
                found: values.len(),
            });
        }
        Factored::new(kernel, centres, options)?.solve(values)
    }

    /// f(x), in the unit of the values, at a point in the unit of the centres.
    pub fn evaluate(&self, x: &Point<f64, D>) -> SVector<f64, D> {
        let mut sum = SVector::zeros();
        self.basis.at(&self.basis.unit_box().enter(x), |i, value| sum += self.coefficients[i] * value);
        sum
    }

    /// ∂f/∂x, D × D: row a holds the derivatives of component a, in the unit of the values over that of the centres.
    ///
    /// At a centre of the Linear kernel f has a kink; the mean over all directions is given there.
    pub fn jacobian(&self, x: &Point<f64, D>) -> SMatrix<f64, D, D> {
        let mut sum = SMatrix::zeros();
        self.basis.gradients_at(&self.basis.unit_box().enter(x), |i, gradient| {
            sum += self.coefficients[i] * gradient.transpose();
        });
        sum
    }

    /// σ·wᵀKw summed over the components (000 §4.4.2): zero for an affine map, otherwise proportional to the bending
    /// energy. Measured in the unit box, so comparable only between splines on the same centres and kernel.
    pub fn bending_energy(&self) -> f64 {
        let sign = self.basis.kernel().definiteness();
        (0..D).map(|axis| sign * self.basis.quadratic_form(|i| self.coefficients[i][axis])).sum()
    }
}
