//! The performer's own neutral scan in place of the average face.

use nalgebra::Point3;

use super::{PipelineError, Target};
use crate::{
    rig::RigError,
    spline::{Kernel, Options, Spline},
    tracking::SKIN_LANDMARK_COUNT,
};

/// 468 points of the performer's scan, scan frame, millimetres.
///
/// Landmarks that were not found on the scan are carried over from the average face by the spline (r² ln r²,
/// interpolating) through those that were.
pub fn performer_face(scan: &Target, average: &[Point3<f64>]) -> Result<Vec<Point3<f64>>, PipelineError> {
    let found = &scan.landmarks[..SKIN_LANDMARK_COUNT];
    let (centres, values): (Vec<_>, Vec<_>) =
        average.iter().zip(found).filter_map(|(from, to)| Some((*from, (*to)?.coords))).unzip();
    if centres.len() == average.len() {
        return Ok(values.into_iter().map(Point3::from).collect());
    }
    let spline = Spline::fit(Kernel::ThinPlate, &centres, &values, Options::default())
        .map_err(|source| RigError::Spline { what: "the performer's scan", source })?;
    Ok(average
        .iter()
        .zip(found)
        .map(|(from, to)| to.unwrap_or_else(|| Point3::from(spline.evaluate(from))))
        .collect())
}
