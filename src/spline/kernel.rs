//! The radial kernels U(r) and what fitting has to know about each.

/// A radial kernel U(r), r the distance from a centre.
///
/// All are conditionally definite, [`Kernel::Gaussian`] without conditions: with enough polynomial terms and matching
/// side conditions the system of 000 eq. 4.13 has exactly one solution for distinct centres. For [`Kernel::Hardy`] and
/// [`Kernel::Gaussian`] that is proved when all stiffnesses are equal; with eq. 3's own stiffness for each centre it
/// holds in practice and is checked on fitting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kernel {
    /// U = r, the biharmonic kernel of three dimensions (VTK's `BasisToR`). Influence falls off soonest: the choice
    /// where controls that move apart nearly touch, as lips and lids do.
    #[default]
    Linear,
    /// U = r² ln r² (000 eq. 4.4), the thin plate of two dimensions, used by the thesis in space as well. Smoother,
    /// and wilder between controls that nearly touch.
    ThinPlate,
    /// U = r³, the triharmonic kernel of three dimensions. The smoothest and the widest-reaching.
    Cubic,
    /// U = √(r² + sᵢ²), Hardy's multiquadric (002 eq. 2) with sᵢ the distance from centre i to its nearest other
    /// centre (002 eq. 3).
    Hardy,
    /// U = exp(−r²/sᵢ²) with sᵢ as for Hardy: what 002 compares Hardy with. It ends where sᵢ does, so between centres
    /// far apart nothing moves unless the stiffness is raised, and raising it smooths over whatever is finer.
    Gaussian,
}

impl Kernel {
    /// U from the squared distance. `stiffness_squared` is sᵢ² and is read by [`Kernel::Hardy`] and
    /// [`Kernel::Gaussian`] alone.
    #[inline]
    pub fn value(self, r_squared: f64, stiffness_squared: f64) -> f64 {
        match self {
            Self::Linear => r_squared.sqrt(),
            // The limit at r = 0 is 0, where the logarithm alone is −∞.
            Self::ThinPlate if r_squared > 0.0 => r_squared * r_squared.ln(),
            Self::ThinPlate => 0.0,
            Self::Cubic => r_squared * r_squared.sqrt(),
            Self::Hardy => (r_squared + stiffness_squared).sqrt(),
            // Where centres coincide their stiffness is none: the narrowest of Gaussians is 1 there and 0 elsewhere.
            Self::Gaussian if r_squared > 0.0 => (-r_squared / stiffness_squared).exp(),
            Self::Gaussian => 1.0,
        }
    }

    /// U′(r) / r from the squared distance, so that the gradient of U(|x − P|) is this times (x − P).
    ///
    /// At r = 0 it is 0 for [`Kernel::Linear`] and for Hardy with zero stiffness, whose cone has no gradient at its
    /// tip (the mean of all directions is taken), and for [`Kernel::ThinPlate`], whose gradient tends to 0 there.
    #[inline]
    pub fn derivative_over_r(self, r_squared: f64, stiffness_squared: f64) -> f64 {
        match self {
            Self::Linear if r_squared > 0.0 => 1.0 / r_squared.sqrt(),
            Self::ThinPlate if r_squared > 0.0 => 2.0 * (r_squared.ln() + 1.0),
            Self::Cubic => 3.0 * r_squared.sqrt(),
            Self::Hardy if r_squared + stiffness_squared > 0.0 => {
                1.0 / (r_squared + stiffness_squared).sqrt()
            }
            Self::Gaussian if stiffness_squared > 0.0 => {
                -2.0 / stiffness_squared * (-r_squared / stiffness_squared).exp()
            }
            Self::Linear | Self::ThinPlate | Self::Hardy | Self::Gaussian => 0.0,
        }
    }

    /// The sign of wᵀKw over weights that satisfy the side conditions: −1 for Linear and Hardy, +1 for ThinPlate,
    /// Cubic and Gaussian.
    ///
    /// Regularisation adds λ times this to the diagonal. The other sign would carry the matrix through singularity
    /// as λ grows.
    pub fn definiteness(self) -> f64 {
        match self {
            Self::Linear | Self::Hardy => -1.0,
            Self::ThinPlate | Self::Cubic | Self::Gaussian => 1.0,
        }
    }

    /// Whether definiteness needs the whole affine part (order 2) rather than a constant (order 1).
    pub fn needs_affine(self) -> bool {
        matches!(self, Self::ThinPlate | Self::Cubic)
    }

    /// The power p by which kernel values grow when all lengths grow: U(s·r) = sᵖ·U(r), up to a multiple of r² which
    /// the side conditions turn into a polynomial. So λ in the original unit is sᵖ times λ in the unit box. A Gaussian
    /// grows with its width and keeps its values.
    pub fn homogeneity(self) -> i32 {
        match self {
            Self::Gaussian => 0,
            Self::Linear | Self::Hardy => 1,
            Self::ThinPlate => 2,
            Self::Cubic => 3,
        }
    }

    /// Whether the kernel reads a stiffness for each centre.
    pub fn uses_stiffness(self) -> bool {
        matches!(self, Self::Hardy | Self::Gaussian)
    }
}

impl std::fmt::Display for Kernel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Linear => "Linear",
            Self::ThinPlate => "ThinPlate",
            Self::Cubic => "Cubic",
            Self::Hardy => "Hardy",
            Self::Gaussian => "Gaussian",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const ALL: [Kernel; 5] =
        [Kernel::Linear, Kernel::ThinPlate, Kernel::Cubic, Kernel::Hardy, Kernel::Gaussian];

    #[test]
    fn values_are_the_papers() {
        let (r, s) = (1.7_f64, 0.4_f64);
        assert_relative_eq!(Kernel::Linear.value(r * r, 0.0), r, max_relative = 1e-15);
        assert_relative_eq!(Kernel::ThinPlate.value(r * r, 0.0), r * r * (r * r).ln(), max_relative = 1e-15);
        assert_relative_eq!(Kernel::Cubic.value(r * r, 0.0), r.powi(3), max_relative = 1e-15);
        assert_relative_eq!(Kernel::Hardy.value(r * r, s * s), r.hypot(s), max_relative = 1e-15);
        let gaussian = (-(r / s) * (r / s)).exp();
        assert_relative_eq!(Kernel::Gaussian.value(r * r, s * s), gaussian, max_relative = 1e-13);
    }

    /// 000, below eq. 4.4: U is zero on the unit circle, and −U is greatest at r = 1/√e.
    #[test]
    fn thin_plate_has_the_zeros_and_the_extremum_of_the_thesis() {
        assert!(Kernel::ThinPlate.value(0.0, 0.0).abs() < f64::EPSILON);
        assert!(Kernel::ThinPlate.value(1.0, 0.0).abs() < f64::EPSILON);
        assert!(Kernel::ThinPlate.derivative_over_r((-1.0_f64).exp(), 0.0).abs() < 1e-15);
    }

    #[test]
    fn derivatives_match_finite_differences() {
        let (s2, h) = (0.09, 1e-6);
        for kernel in ALL {
            for r in [0.01_f64, 0.3, 1.0, 2.5] {
                let u = |r: f64| kernel.value(r * r, s2);
                let numeric = (u(r + h) - u(r - h)) / (2.0 * h);
                assert_relative_eq!(r * kernel.derivative_over_r(r * r, s2), numeric, epsilon = 1e-8);
            }
        }
    }

    #[test]
    fn nothing_is_infinite_at_a_centre() {
        for kernel in ALL {
            let top = if kernel == Kernel::Gaussian { 1.0 } else { 0.0 };
            assert!((kernel.value(0.0, 0.0) - top).abs() < f64::EPSILON, "{kernel}");
            assert!(kernel.derivative_over_r(0.0, 0.0).abs() < f64::EPSILON, "{kernel}");
        }
    }
}
