//! The spline that bends one face into another: proportions, and not every landmark.

use nalgebra::Point3;

use crate::{
    spline::{Kernel, Options, Regularisation, Spline, SplineError},
    tracking::{Region, SKIN_LANDMARK_COUNT, landmark_table},
};

/// λ over the squared outer canthal distance. More follows proportions, less follows detail: of 0.4, 1 and 3 this one errs
/// least over both tasks of `docs/benchmarks/transfer.md` together.
const LAMBDA: f64 = 1.0;

/// The skin landmarks that networks place alike on two faces, where both have them. `from` and `to` give a landmark's
/// place, each in a frame and unit of its own.
pub fn alike_pairs(
    from: impl Fn(usize) -> Option<Point3<f64>>,
    to: impl Fn(usize) -> Option<Point3<f64>>,
) -> Vec<(Point3<f64>, Point3<f64>)> {
    (0..SKIN_LANDMARK_COUNT)
        .filter(|&i| landmark_table()[i].region != Region::Oval)
        .filter_map(|i| Some((from(i)?, to(i)?)))
        .collect()
}

/// The regularised spline through pairs of places (000 §5.6.1, r² ln r²); `eyes` is the outer canthal distance of the face
/// that it leads from, in that face's unit.
pub fn face_spline(pairs: &[(Point3<f64>, Point3<f64>)], eyes: f64) -> Result<Spline<3>, SplineError> {
    let (centres, values): (Vec<_>, Vec<_>) = pairs.iter().map(|(from, to)| (*from, to.coords)).unzip();
    let options =
        Options { regularisation: Regularisation::Absolute(LAMBDA * eyes * eyes), ..Options::default() };
    Spline::fit(Kernel::ThinPlate, &centres, &values, options)
}
