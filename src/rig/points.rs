//! What a performer's landmarks say of the control points between them.
//!
//! The network sees landmarks, not control points. Between them the performer's skin is taken to move as the smoothest
//! spline through the landmarks does. Where skin folds it does not: what a library of action units knows beyond that
//! spline at its wrinkle control points (000 §5.5.2) is added, as strongly as each action is on.

use nalgebra::{Point3, Vector3};

use super::{ActionSolver, RigError};
use crate::{
    actions::{ActionLibrary, Catalogue},
    anatomy::{LOWER_INNER, UPPER_INNER, eye_landmarks},
    lift::Side,
    spline::{Kernel, Options, Regularisation, Warp},
    tracking::{Region, SKIN_LANDMARK_COUNT, landmark_table},
};

/// λ over the distance of the eyes' outer corners of the spline between landmarks.
const LAMBDA: f64 = 1e-5;

/// Landmarks in, control points out.
#[derive(Debug, Clone)]
pub(super) struct PointFill {
    members: Vec<usize>,
    shares: Warp,
    /// For each action that the solver measures its handles and what they do beyond the spline, performer's scan frame.
    relief: Vec<Vec<(usize, Vector3<f64>)>>,
}

impl PointFill {
    /// For a face with these handles, scan frame, millimetres.
    pub fn new(handles: &[Point3<f64>]) -> Result<Self, RigError> {
        let members: Vec<usize> = (0..SKIN_LANDMARK_COUNT).filter(|&i| is_spread(i)).collect();
        let centres: Vec<_> = members.iter().map(|&i| handles[i]).collect();
        let scale = (handles[33] - handles[263]).norm();
        let options =
            Options { regularisation: Regularisation::Absolute(LAMBDA * scale), ..Options::default() };
        let shares = Warp::new(Kernel::Linear, &centres, &[], &handles[SKIN_LANDMARK_COUNT..], options)
            .map_err(|source| RigError::Spline { what: "the performer's landmarks", source })?;
        Ok(Self { members, shares, relief: Vec::new() })
    }

    /// Adds what the library's wrinkle points do beyond a spline through its landmarks, on the face that `solver` knows.
    pub fn with_relief(mut self, library: &ActionLibrary, solver: &ActionSolver) -> Result<Self, RigError> {
        let on_library = Self::new(&library.face)?;
        for action in solver.actions() {
            let own = action.dense(library.face.len());
            let mut smooth = own.clone();
            on_library.fill(&mut smooth);
            let points = &Catalogue::get().points;
            let relief = (SKIN_LANDMARK_COUNT..library.face.len())
                .filter(|&handle| points[handle - SKIN_LANDMARK_COUNT].is_wrinkle)
                .map(|handle| (handle, solver.to_performer(handle, &(own[handle] - smooth[handle]))))
                .filter(|(_, beyond)| beyond.norm() > 0.05)
                .collect();
            self.relief.push(relief);
        }
        Ok(self)
    }

    /// Writes the control points' vectors behind the landmarks'.
    pub fn fill(&self, vectors: &mut Vec<Vector3<f64>>) {
        vectors.truncate(SKIN_LANDMARK_COUNT);
        vectors.resize(SKIN_LANDMARK_COUNT + self.shares.vertices(), Vector3::zeros());
        for (column, &member) in self.members.iter().enumerate() {
            let vector = vectors[member];
            let points = vectors[SKIN_LANDMARK_COUNT..].iter_mut();
            for (point, share) in points.zip(self.shares.column(column)) {
                *point += vector * f64::from(*share);
            }
        }
    }

    /// Adds the folds of the actions that are on, in the solver's order.
    pub fn fold(&self, magnitudes: &[f64], vectors: &mut [Vector3<f64>]) {
        for (relief, magnitude) in self.relief.iter().zip(magnitudes) {
            for (handle, beyond) in relief {
                vectors[*handle] += beyond * *magnitude;
            }
        }
    }
}

/// Landmarks that move as the skin around them does: not lips and lids, which part, and not the outline, which slides.
fn is_spread(landmark: usize) -> bool {
    let rim = |side: Side| {
        let eye = eye_landmarks(side);
        eye.upper.contains(&landmark) || eye.lower.contains(&landmark)
    };
    landmark_table()[landmark].region != Region::Oval
        && !UPPER_INNER.contains(&landmark)
        && !LOWER_INNER.contains(&landmark)
        && !Side::BOTH.into_iter().any(rim)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_face_that_moves_as_one_carries_its_control_points_along() {
        let library = ActionLibrary::built_in();
        let fill = PointFill::new(&library.face).unwrap();
        let shift = Vector3::new(1.0, -2.0, 0.5);
        let mut vectors = vec![shift; SKIN_LANDMARK_COUNT];
        fill.fill(&mut vectors);
        assert_eq!(vectors.len(), library.face.len());
        for (handle, vector) in vectors.iter().enumerate() {
            assert!((vector - shift).norm() < 1e-4, "{}", Catalogue::get().handle_name(handle));
        }
    }
}
