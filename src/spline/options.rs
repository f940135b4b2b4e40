//! What a caller may choose about a fit besides its kernel.

use super::{Kernel, SplineError};

/// How far the spline may miss its values in exchange for bending less: Tikhonov regularisation (002 eq. 5).
///
/// The kernel matrix K becomes K + σλI with σ the kernel's [`definiteness`](Kernel::definiteness), so λ is never
/// negative here and more of it always means smoother. The residual at centre i is σλwᵢ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Regularisation {
    /// Interpolate: the spline passes through every value.
    #[default]
    None,
    /// λ for centres scaled so that their bounding box's longest side is 1. Free of scale: the same face in
    /// millimetres or metres gives the same spline. (002 uses 0.01, in its own unit.)
    UnitBox(f64),
    /// λ in the kernel's own unit at the scale of the centres given: a length for Linear and Hardy, a length squared
    /// for ThinPlate, a length cubed for Cubic, a mere number for Gaussian.
    ///
    /// With box side s it equals `UnitBox(λ / sᵖ)`, p = 1, 2, 3, 0. For r² ln r² the scale also adds s² ln s² · r²,
    /// but Σ wᵢ|x − Pᵢ|² = |x|²Σwᵢ − 2x·ΣwᵢPᵢ + Σwᵢ|Pᵢ|², of which the side conditions leave only a constant:
    /// the fit is the same. So "0.4 × the squared distance d of the outer eye corners" in millimetres is
    /// `Absolute(0.4 * d * d)` for points in millimetres. SciPy's r² ln r is half of this U: its `smoothing` is λ/2.
    Absolute(f64),
}

impl Regularisation {
    /// λ in the unit box for centres whose box has the longest side `scale`.
    pub(super) fn in_unit_box(self, kernel: Kernel, scale: f64) -> Result<f64, SplineError> {
        let (given, lambda) = match self {
            Self::None => (0.0, 0.0),
            Self::UnitBox(lambda) => (lambda, lambda),
            Self::Absolute(lambda) => (lambda, lambda / scale.powi(kernel.homogeneity())),
        };
        if lambda.is_finite() && lambda >= 0.0 {
            Ok(lambda)
        } else {
            Err(SplineError::Regularisation { lambda: given })
        }
    }
}

/// The polynomial part A·\[1 x\] of the spline, each term with its side condition on the weights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Polynomial {
    /// 1, x, y (, z): 000 eq. 4.18. Affine maps come out exactly. Centres must span the space.
    #[default]
    Affine,
    /// As Affine, but along only those directions in which the centres extend: for centres in one plane or on one
    /// line. Good for *displacements*, which stay constant across the plane to first order. Where the values are
    /// *positions* it flattens whatever lies off the plane: add anchors instead. Equal to Affine when the centres
    /// span the space.
    InSpan,
    /// 1 alone. Enough for Linear, Hardy and Gaussian only.
    Constant,
    /// No polynomial and no side conditions: 002 eq. 1–5 as printed. Linear, Hardy and Gaussian only. The matrix of the
    /// first two then keeps one positive eigenvalue among its negative ones, so λ must stay well below n times the mean
    /// distance.
    None,
}

impl std::fmt::Display for Polynomial {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Affine => "affine",
            Self::InSpan => "in-span affine",
            Self::Constant => "constant",
            Self::None => "absent polynomial",
        })
    }
}

/// The choices of a fit. The default interpolates with an affine part, as 000 does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// How far the spline may miss its values. Default: not at all.
    pub regularisation: Regularisation,
    /// The polynomial part. Default: affine.
    pub polynomial: Polynomial,
    /// Factor, above 0, on every centre's stiffness sᵢ (002 eq. 3), for the kernels that have one. Default: 1.
    pub stiffness: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { regularisation: Regularisation::default(), polynomial: Polynomial::default(), stiffness: 1.0 }
    }
}
