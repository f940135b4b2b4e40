//! What can go wrong in fitting a spline, said with what was wanted, what was found and what to do.

use super::{Kernel, Polynomial};

/// Which list an index in a [`SplineError`] counts in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// The centres of a spline; in a warp, the controls followed by the anchors.
    Centre,
    /// The values at the centres.
    Value,
    /// The points at which a warp is built.
    Point,
    /// The entries of a warp's matrix, control by control.
    Entry,
    /// The displacements given to a warp.
    Displacement,
    /// The vertices that a warp writes.
    Output,
}

impl std::fmt::Display for Input {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Centre => "centre",
            Self::Value => "value",
            Self::Point => "point",
            Self::Entry => "matrix entry",
            Self::Displacement => "displacement",
            Self::Output => "output vertex",
        })
    }
}

/// The shape in which centres lie when they do not span the space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flatness {
    /// All in one place.
    Point,
    /// On one line.
    Line,
    /// In one plane.
    Plane,
}

impl std::fmt::Display for Flatness {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Point => "in one place",
            Self::Line => "on one line",
            Self::Plane => "in one plane",
        })
    }
}

/// Everything that keeps a spline from being fitted or a warp from being applied.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SplineError {
    /// Too few centres to fix the polynomial part.
    #[error(
        "the spline's {polynomial} part wants at least {wanted} centres, {found} were given: add centres or choose \
         a lower polynomial"
    )]
    TooFewCentres {
        /// The polynomial asked for.
        polynomial: Polynomial,
        /// How many centres it needs.
        wanted: usize,
        /// How many came.
        found: usize,
    },

    /// A coordinate is NaN or infinite.
    #[error("{input} {index} is not finite: every coordinate must be an ordinary number, drop or repair it")]
    NotFinite {
        /// The list it stands in.
        input: Input,
        /// Its place in that list.
        index: usize,
    },

    /// The centres' bounding box cannot be measured in f64.
    #[error("the centres span {extent:e}, beyond what f64 can square: bring them into a sensible unit")]
    Extent {
        /// Longest side of the bounding box, in the centres' unit.
        extent: f64,
    },

    /// Two lists that belong together differ in length.
    #[error("wanted {wanted} of {input}, found {found}: give one for each")]
    Count {
        /// The list with the wrong length.
        input: Input,
        /// The length it should have.
        wanted: usize,
        /// The length it has.
        found: usize,
    },

    /// Two centres stand in one place and nothing allows their values to differ.
    #[error(
        "centres {first} and {second} coincide ({distance:e} apart), so an interpolating spline does not exist: \
         merge them, or give a regularisation above zero"
    )]
    Coincident {
        /// Index of the earlier centre.
        first: usize,
        /// Index of the later centre.
        second: usize,
        /// How far apart they are, in the centres' unit.
        distance: f64,
    },

    /// The centres do not span the space, so the affine part is undetermined.
    #[error(
        "the {found} centres lie {shape} (thickness {thickness:e} of the bounding box), so an affine part is not \
         determined: add anchors off it, or choose Polynomial::InSpan"
    )]
    Flat {
        /// How many centres there are.
        found: usize,
        /// What they lie in.
        shape: Flatness,
        /// RMS extent across it, as a fraction of the bounding box's longest side.
        thickness: f64,
    },

    /// The kernel needs more polynomial terms than were chosen.
    #[error(
        "the {kernel} kernel is definite only against an affine part, {polynomial} was chosen: choose \
         Polynomial::Affine or InSpan, or the Linear, Hardy or Gaussian kernel"
    )]
    PolynomialTooLow {
        /// The kernel asked for.
        kernel: Kernel,
        /// The polynomial asked for.
        polynomial: Polynomial,
    },

    /// λ is negative, infinite or NaN.
    #[error("the regularisation is {lambda}: it must be a finite number, zero or above")]
    Regularisation {
        /// The λ that was given.
        lambda: f64,
    },

    /// The factor on the stiffnesses is zero, negative, infinite or NaN.
    #[error("the stiffness factor is {stiffness}: it must be a finite number above zero")]
    Stiffness {
        /// The factor that was given.
        stiffness: f64,
    },

    /// The system could not be solved to any useful accuracy.
    #[error(
        "the spline's system is singular to working precision (pivots span a ratio of {pivot_ratio:e}): move centres \
         that nearly coincide apart, or give a regularisation above zero"
    )]
    Singular {
        /// Smallest over largest pivot of the factorisation.
        pivot_ratio: f64,
    },
}
