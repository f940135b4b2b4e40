//! From a face's own frame to the average face's: eq. 5.1–5.4 of the thesis, or a similarity.

use nalgebra::{Matrix3, Matrix4, Point3, Vector3};

use super::{GridError, similarity_between};
use crate::tracking::index;

/// The middle of the chin's front, which is Bosphorus' "chin middle", and its lowest point for schemes without it.
pub const CHINS: [usize; 2] = [199, index::CHIN];
/// Four points whose condition number is larger lie nearly in a plane.
const CONDITION_LIMIT: f64 = 100.0;
/// Landmarks that a similarity needs.
const FEWEST: usize = 4;

/// A map from one frame to the frame in which the average face has the tip of its nose at the origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Normalisation {
    /// 4 × 4, acting on columns (x, y, z, 1); the last row is (0, 0, 0, 1).
    pub matrix: Matrix4<f64>,
    /// The ratio of largest to smallest singular value of what was inverted: the face's eye corners and chin as seen
    /// from its nose (the upper left 3 × 3 of B in eq. 5.2). 1 where nothing was.
    pub condition_number: f64,
    /// Numbers of the landmarks it rests on.
    pub landmarks: Vec<usize>,
    /// Root mean square distance of these landmarks from the average face's afterwards, in the average face's unit.
    pub residual: f64,
}

impl Normalisation {
    /// T = A·B⁻¹ (eq. 5.1–5.3) after the nose tips of both faces have been brought to (0, 0, 0): an affine map by which
    /// outer eye corners, chin and nose tip fall on the average face's exactly.
    ///
    /// Both lists go by the network's 478 landmarks, each in a frame and unit of its own. Any of [`CHINS`] that both
    /// have is the chin.
    pub fn affine(face: &[Option<Point3<f64>>], average: &[Option<Point3<f64>>]) -> Result<Self, GridError> {
        let both = |i: usize| Some((at(face, i)?, at(average, i)?));
        let chin = CHINS.into_iter().find(|chin| both(*chin).is_some()).unwrap_or(CHINS[0]);
        let names = [
            "of the left eye's outer corner",
            "of the right eye's outer corner",
            "of the chin",
            "of the nose tip",
        ];
        let used = [index::LEFT_EYE_OUTER, index::RIGHT_EYE_OUTER, chin, index::NOSE_TIP];
        for (landmark, name) in used.into_iter().zip(names) {
            for (points, whose) in [(face, "scan"), (average, "average face")] {
                at(points, landmark).ok_or(GridError::MissingLandmark { whose, name })?;
            }
        }
        // With the nose at the origin the fourth columns of A and B are (0, 0, 0, 1), and T has no translation.
        let seen_from_the_nose = |points: &[Option<Point3<f64>>]| {
            let nose = at(points, index::NOSE_TIP).unwrap_or_else(Point3::origin);
            let columns = [0, 1, 2].map(|k| at(points, used[k]).map_or_else(Vector3::zeros, |p| p - nose));
            (nose, Matrix3::from_columns(&columns))
        };
        let (nose, b) = seen_from_the_nose(face);
        let (_, a) = seen_from_the_nose(average);
        let condition_number = well_conditioned(&b, "scan")?;
        well_conditioned(&a, "average face")?;
        let inverse = b.try_inverse().ok_or(GridError::Singular {
            whose: "scan",
            condition: condition_number,
            limit: CONDITION_LIMIT,
        })?;
        let matrix = (a * inverse).to_homogeneous() * Matrix4::new_translation(&-nose.coords);
        Ok(Self { matrix, condition_number, landmarks: used.to_vec(), residual: 0.0 })
    }

    /// The similarity that brings all landmarks that both faces have as near together as it can, to the average face
    /// with the tip of its nose at the origin.
    pub fn similarity(
        face: &[Option<Point3<f64>>],
        average: &[Option<Point3<f64>>],
    ) -> Result<Self, GridError> {
        let landmarks: Vec<usize> =
            (0..face.len()).filter(|i| at(face, *i).is_some() && at(average, *i).is_some()).collect();
        let few = |found| GridError::TooFewCommon {
            found,
            wanted: FEWEST,
            remedy: "give landmarks of one scheme for the scan and the average face",
        };
        if landmarks.len() < FEWEST {
            return Err(few(landmarks.len()));
        }
        let nose = at(average, index::NOSE_TIP)
            .ok_or(GridError::MissingLandmark { whose: "average face", name: "of the nose tip" })?;
        let from: Vec<_> = landmarks.iter().filter_map(|i| at(face, *i)).collect();
        let to: Vec<_> = landmarks.iter().filter_map(|i| at(average, *i)).map(|p| p - nose.coords).collect();
        let found = similarity_between(&from, &to).ok_or(GridError::NoExtent { face: 0 })?;
        let squares: f64 = from.iter().zip(&to).map(|(a, b)| (found * a - b).norm_squared()).sum();
        let residual = (squares / from.len() as f64).sqrt();
        Ok(Self { matrix: found.to_homogeneous(), condition_number: 1.0, landmarks, residual })
    }

    /// No change of frame.
    pub fn none() -> Self {
        Self { matrix: Matrix4::identity(), condition_number: 1.0, landmarks: Vec::new(), residual: 0.0 }
    }
}

fn at(points: &[Option<Point3<f64>>], landmark: usize) -> Option<Point3<f64>> {
    points.get(landmark).copied().flatten()
}

/// The condition number, if it is one to work with.
fn well_conditioned(points: &Matrix3<f64>, whose: &'static str) -> Result<f64, GridError> {
    let values = points.singular_values();
    let condition = values.max() / values.min();
    if condition <= CONDITION_LIMIT {
        Ok(condition)
    } else {
        Err(GridError::Singular { whose, condition, limit: CONDITION_LIMIT })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::tracking::LANDMARK_COUNT;

    fn face(stretch: [f64; 3], shift: [f64; 3]) -> Vec<Option<Point3<f64>>> {
        let mut points = vec![None; LANDMARK_COUNT];
        for (i, p) in [
            (index::LEFT_EYE_OUTER, [45.0, 27.0, 32.0]),
            (index::RIGHT_EYE_OUTER, [-45.0, 26.0, 31.0]),
            (199, [1.0, -79.0, 52.0]),
            (index::NOSE_TIP, [0.0, -5.0, 76.0]),
            (index::MOUTH_LEFT, [25.0, -45.0, 45.0]),
        ] {
            points[i] =
                Some(Point3::from(std::array::from_fn::<f64, 3, _>(|k| p[k] * stretch[k] + shift[k])));
        }
        points
    }

    #[test]
    fn the_affine_map_brings_all_four_points_home() {
        let (own, average) = (face([0.9, 1.2, 0.8], [400.0, -3.0, 1000.0]), face([1.0; 3], [0.0; 3]));
        let found = Normalisation::affine(&own, &average).unwrap();
        let nose = average[index::NOSE_TIP].unwrap();
        for landmark in &found.landmarks {
            let moved = found.matrix.transform_point(&own[*landmark].unwrap());
            assert!((moved - (average[*landmark].unwrap() - nose.coords)).norm() < 1e-9);
        }
        assert!(found.condition_number > 1.0 && found.condition_number < 10.0, "{}", found.condition_number);
        let linear: Matrix3<f64> = found.matrix.fixed_view::<3, 3>(0, 0).into();
        assert!(
            (linear - Matrix3::from_diagonal(&Vector3::new(1.0 / 0.9, 1.0 / 1.2, 1.0 / 0.8))).norm() < 1e-9
        );
    }

    #[test]
    fn a_flat_face_has_no_affine_map_but_a_similarity() {
        let average = face([1.0; 3], [0.0; 3]);
        let flat = face([1.0, 1.0, 0.0], [0.0; 3]);
        let error = Normalisation::affine(&flat, &average).unwrap_err();
        assert!(matches!(error, GridError::Singular { whose: "scan", .. }), "{error}");
        assert!(error.to_string().contains("--normalise similarity"), "{error}");
        assert!(Normalisation::similarity(&flat, &average).unwrap().residual > 1.0);
        let mut blind = average.clone();
        blind[index::LEFT_EYE_OUTER] = None;
        let error = Normalisation::affine(&blind, &average).unwrap_err().to_string();
        assert!(error.contains("left eye"), "{error}");
        assert!(Normalisation::similarity(&vec![None; LANDMARK_COUNT], &average).is_err());
    }

    #[test]
    fn a_similarity_of_the_average_face_is_undone() {
        let average = face([1.0; 3], [0.0; 3]);
        let own = face([0.1; 3], [7.0, 8.0, 9.0]);
        let found = Normalisation::similarity(&own, &average).unwrap();
        assert!(found.residual < 1e-9 && found.landmarks.len() == 5);
        let nose = found.matrix.transform_point(&own[index::NOSE_TIP].unwrap());
        assert!(nose.coords.norm() < 1e-9);
    }

    proptest! {
        #[test]
        fn every_affine_map_of_the_average_is_undone(
            entries in prop::collection::vec(-0.3..0.3_f64, 9),
            shift in prop::array::uniform3(-500.0..500.0_f64),
        ) {
            let average = face([1.0; 3], [0.0; 3]);
            let linear = Matrix3::identity() + Matrix3::from_column_slice(&entries);
            prop_assume!(linear.determinant().abs() > 0.1);
            let own: Vec<_> = average
                .iter()
                .map(|p| p.map(|p| Point3::from(linear * p.coords + Vector3::from(shift))))
                .collect();
            // A map so steep that the four points become flat is refused, which is right too.
            if let Ok(found) = Normalisation::affine(&own, &average) {
                let nose = average[index::NOSE_TIP].unwrap();
                for (own, average) in own.iter().zip(&average) {
                    if let (Some(own), Some(average)) = (own, average) {
                        let off = found.matrix.transform_point(own) - (average - nose.coords);
                        prop_assert!(off.norm() < 1e-6);
                    }
                }
            }
        }
    }
}
