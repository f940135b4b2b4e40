//! Every handle from the markers (001 §4.2: "scattered data interpolation … with a radial basis function").
//!
//! What is interpolated is by how much markers were found to differ from the draft, and it is added to the draft: where no
//! marker is near, the artist's shape stays. The kernel is r with a constant, which neither overshoots between markers nor
//! runs away beyond them.

use nalgebra::{Point3, Vector3};

use super::{MarkerSeat, MuscleError};
use crate::{
    spline::{Factored, Kernel, Options, Polynomial, SplineError},
    tracking::{SKIN_LANDMARK_COUNT, is_still},
};

/// Markers nearer to each other than this are one to the spline, millimetres.
const ONE_PLACE: f64 = 1.0;
/// Landmarks that expressions hardly move keep the draft's motion where no marker is this near, millimetres.
const ALONE: f64 = 20.0;
/// A marker between landmarks is met only by what the spline does to these: so often is the miss added again.
const CORRECTIONS: usize = 4;

/// The spline of one set of markers, factored.
#[derive(Debug, Clone)]
pub(super) struct Completion {
    spline: Factored<3>,
    /// The markers that are its first centres.
    markers: Vec<(usize, MarkerSeat)>,
    handles: Vec<Point3<f64>>,
}

impl Completion {
    /// `handles` are the basis' face.
    pub(super) fn new(handles: &[Point3<f64>], seats: &[Option<MarkerSeat>]) -> Result<Self, MuscleError> {
        let mut markers = Vec::new();
        let mut centres: Vec<Point3<f64>> = Vec::new();
        for (marker, seat) in seats.iter().enumerate() {
            let Some(seat) = seat else { continue };
            let place = seat.place(handles);
            if centres.iter().all(|centre| (centre - place).norm() > ONE_PLACE) {
                centres.push(place);
                markers.push((marker, seat.clone()));
            }
        }
        let placed = centres.len();
        for landmark in (0..SKIN_LANDMARK_COUNT.min(handles.len())).filter(|landmark| is_still(*landmark)) {
            let place = handles[landmark];
            let far = |(k, centre): (usize, &Point3<f64>)| {
                (centre - place).norm() > if k < placed { ALONE } else { ONE_PLACE }
            };
            if centres.iter().enumerate().all(far) {
                centres.push(place);
            }
        }
        let options = Options { polynomial: Polynomial::Constant, ..Options::default() };
        let spline = Factored::new(Kernel::Linear, &centres, options).map_err(|error| fault(&error))?;
        Ok(Self { spline, markers, handles: handles.to_vec() })
    }

    /// Adds to one vector for each handle what `differences`, one for each marker, make of it.
    pub(super) fn add(
        &self,
        differences: &[Vector3<f64>],
        vectors: &mut [Vector3<f64>],
    ) -> Result<(), MuscleError> {
        let mut values = vec![Vector3::zeros(); self.spline.centres()];
        for ((marker, _), value) in self.markers.iter().zip(&mut values) {
            *value = differences[*marker];
        }
        let mut spread = Vec::new();
        for correction in 0..=CORRECTIONS {
            let spline = self.spline.solve(&values).map_err(|error| fault(&error))?;
            spread = self.handles.iter().map(|handle| spline.evaluate(handle)).collect();
            if correction < CORRECTIONS {
                for ((marker, seat), value) in self.markers.iter().zip(&mut values) {
                    *value += differences[*marker] - seat.vector(&spread);
                }
            }
        }
        for (vector, own) in vectors.iter_mut().zip(spread) {
            *vector += own;
        }
        Ok(())
    }
}

fn fault(error: &SplineError) -> MuscleError {
    MuscleError::Training {
        reason: format!("the markers do not spread over the face: {error}"),
        remedy: "Give more markers a place on the face",
    }
}
