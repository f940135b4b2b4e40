//! The centred unit box in which every system is solved.

use nalgebra::{Point, SVector};

use super::{Input, SplineError};

/// Maps points so that the bounding box of the centres is centred on the origin with longest side 1.
///
/// One scale for all axes: the kernels stay radial. On 110 controls a metre off the origin, in millimetres, it takes
/// the condition number of the r³ system from 8e16 to 2e5.
#[derive(Clone, Debug)]
pub(super) struct UnitBox<const D: usize> {
    centre: SVector<f64, D>,
    scale: f64,
}

impl<const D: usize> UnitBox<D> {
    /// The box of `centres`, which may be empty (the box is then the identity).
    pub(super) fn around(centres: &[Point<f64, D>]) -> Result<Self, SplineError> {
        require_finite(centres, Input::Centre)?;
        let Some(first) = centres.first() else {
            return Ok(Self { centre: SVector::zeros(), scale: 1.0 });
        };
        let (low, high) = centres
            .iter()
            .fold((first.coords, first.coords), |(low, high), p| (low.inf(&p.coords), high.sup(&p.coords)));
        let sides = high - low;
        let extent = sides.max();
        // Squares of lengths, and the cube that turns an absolute λ, must stay in range.
        if extent > 1e100 || (extent > 0.0 && extent < 1e-100) {
            return Err(SplineError::Extent { extent });
        }
        Ok(Self { centre: low + sides / 2.0, scale: if extent > 0.0 { extent } else { 1.0 } })
    }

    /// The longest side, in the centres' unit; 1 if all centres coincide.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    /// A point in box coordinates.
    #[inline]
    pub(super) fn enter(&self, x: &Point<f64, D>) -> SVector<f64, D> {
        (x.coords - self.centre) / self.scale
    }
}

/// Fails with the index of the first point that has a NaN or infinite coordinate.
pub(super) fn require_finite<const D: usize>(
    points: &[Point<f64, D>],
    input: Input,
) -> Result<(), SplineError> {
    match points.iter().position(|p| p.iter().any(|c| !c.is_finite())) {
        Some(index) => Err(SplineError::NotFinite { input, index }),
        None => Ok(()),
    }
}
