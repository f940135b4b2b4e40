//! A take of our own as if it were optical capture: each skin landmark a marker.

use std::path::Path;

use nalgebra::Point3;

use crate::{
    capture::{CaptureError, MarkerTake, Timestamp},
    lift::Displacements,
    tracking::{LandmarkState, SKIN_LANDMARK_COUNT},
};

/// The take of a performer whose `neutral` (478 points, scan frame, millimetres) is displaced in each of `frames`. Markers
/// are called `landmark 0` to `landmark 467`, which needs no mapping; those that a frame does not observe are not seen in
/// it. Its head's motion is out already. `path` is for messages.
pub fn own_take<'a>(
    path: &Path,
    neutral: &[Point3<f64>],
    frames: impl IntoIterator<Item = (Timestamp, &'a Displacements)>,
) -> Result<MarkerTake, CaptureError> {
    let names = (0..SKIN_LANDMARK_COUNT.min(neutral.len())).map(|l| format!("landmark {l}")).collect();
    let (times, frames) = frames
        .into_iter()
        .map(|(time, moved)| {
            let seen = moved
                .vectors
                .iter()
                .zip(&moved.states)
                .map(|(d, state)| (*state == LandmarkState::Observed).then_some(*d));
            let places =
                neutral.iter().zip(seen).take(SKIN_LANDMARK_COUNT).map(|(p, d)| Some(p + d?)).collect();
            (time, places)
        })
        .unzip();
    MarkerTake::new(path, names, times, frames)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::{
        actions::ActionLibrary,
        muscle::{Alignment, MarkerMap, MarkerMotion, place_markers},
        tracking::LANDMARK_COUNT,
    };

    #[test]
    fn displacements_come_back_at_the_landmarks_they_had() {
        let mut neutral = ActionLibrary::built_in().face[..SKIN_LANDMARK_COUNT].to_vec();
        neutral.resize(LANDMARK_COUNT, Point3::origin());
        // A performer is no average face.
        for p in &mut neutral {
            *p = Point3::new(1.1 * p.x, 0.9 * p.y, p.z);
        }
        let observed = vec![LandmarkState::Observed; LANDMARK_COUNT];
        let rest = Displacements { vectors: vec![Vector3::zeros(); LANDMARK_COUNT], states: observed };
        let mut smile = rest.clone();
        smile.vectors[291] = Vector3::new(5.0, 8.0, -2.0);
        smile.states[17] = LandmarkState::Inferred;
        let frames = [(Timestamp(0), &rest), (Timestamp(33_000_000), &smile)];
        let take = own_take("clip.mp4".as_ref(), &neutral, frames).unwrap();
        let places = take.mean(0..1);
        let map = place_markers(&take, &places, &MarkerMap::default()).unwrap();
        let alignment = Alignment {
            scale: 1.0,
            rotation: nalgebra::Rotation3::identity(),
            translation: Vector3::zeros(),
            markers: vec![None; SKIN_LANDMARK_COUNT],
            rest: places,
            errors: vec![0.0],
        };
        let motion = MarkerMotion::of(&take, &alignment, None);
        for (m, name) in take.names.iter().enumerate() {
            assert_eq!(map.places[name].landmarks(), [m], "{name}");
            let wanted = if m == 17 { None } else { Some(smile.vectors[m]) };
            let got = motion.displacements[1][m];
            assert_eq!(got.is_some(), wanted.is_some());
            assert!(got.is_none_or(|d| (d - smile.vectors[m]).norm() < 1e-12));
        }
    }
}
