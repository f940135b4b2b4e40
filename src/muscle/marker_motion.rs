//! What a marker take shows of the face: displacements since the neutral, in the model's frame.

use nalgebra::{Point3, Rotation3, Vector3};

use super::{Alignment, MarkerMap, MuscleError};
use crate::{
    capture::MarkerTake,
    head::rigid_between,
    tracking::{is_still, landmark_table},
};

/// So many still markers tell how a head lies.
const FEWEST: usize = 4;

/// Displacements d̂ of 001 eq. 2.
#[derive(Debug, Clone, PartialEq)]
pub struct MarkerMotion {
    /// F × M, millimetres in the model frame; `None` where a marker was not seen, is off, or the head's place is not
    /// known in that frame.
    pub displacements: Vec<Vec<Option<Vector3<f64>>>>,
    /// Frames that show too few still markers to tell how the head lies; they have no displacements.
    pub without_head: Vec<usize>,
}

impl MarkerMotion {
    /// Of a whole take by the alignment of its neutral. `still` holds M weights by which the head's motion is measured and
    /// taken out of each frame ([`still_weights`]); without it, places are compared as they are, as 001 does.
    pub fn of(take: &MarkerTake, alignment: &Alignment, still: Option<&[f64]>) -> Self {
        let mut without_head = Vec::new();
        let displacements = take
            .frames
            .iter()
            .enumerate()
            .map(|(f, frame)| {
                let places: Vec<Option<Point3<f64>>> =
                    frame.iter().map(|p| p.as_ref().map(|p| alignment.to_model(p))).collect();
                let head = match still {
                    Some(weights) => head(&places, &alignment.rest, weights),
                    None => Some((Rotation3::identity(), Vector3::zeros())),
                };
                let Some((turn, shift)) = head else {
                    without_head.push(f);
                    return vec![None; frame.len()];
                };
                places
                    .iter()
                    .zip(&alignment.rest)
                    .map(|(place, rest)| Some(turn * place.as_ref()?.coords + shift - rest.as_ref()?.coords))
                    .collect()
            })
            .collect();
        Self { displacements, without_head }
    }
}

/// The motion that brings a frame's still markers back to the neutral; `None` where too few are seen.
fn head(
    places: &[Option<Point3<f64>>],
    rest: &[Option<Point3<f64>>],
    weights: &[f64],
) -> Option<(Rotation3<f64>, Vector3<f64>)> {
    let (mut now, mut before, mut counts) = (Vec::new(), Vec::new(), Vec::new());
    for ((place, rest), weight) in places.iter().zip(rest).zip(weights) {
        if let (Some(place), Some(rest), true) = (place, rest, *weight > 0.0) {
            now.push(place.coords);
            before.push(rest.coords);
            counts.push(*weight);
        }
    }
    (now.len() >= FEWEST).then(|| rigid_between(&now, &before, &counts))
}

/// M weights, 0..=1: how far the head's motion may rely on each marker, by how little expressions move the landmarks it
/// sits at (nose, eye corners, temples, the high forehead); 0 for others. Refuses a take with fewer than four such markers.
pub fn still_weights(take: &MarkerTake, map: &MarkerMap) -> Result<Vec<f64>, MuscleError> {
    let weights: Vec<f64> = map
        .landmarks(&take.names)
        .map(|landmarks| {
            if landmarks.is_empty() || !landmarks.iter().all(|l| is_still(*l)) {
                return 0.0;
            }
            let sum: f64 = landmarks.iter().map(|l| landmark_table()[*l].pose_weight).sum();
            sum / landmarks.len() as f64
        })
        .collect();
    let still = weights.iter().filter(|weight| **weight > 0.0).count();
    if still < FEWEST {
        return Err(MuscleError::Alignment {
            reason: format!(
                "{}: {still} markers sit where expressions hardly move the face, too few to take the head's motion out",
                take.path.display()
            ),
            remedy: "Give nose, eye corners and temples markers, or a take whose head motion is taken out already",
        });
    }
    Ok(weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{actions::ActionLibrary, capture::Timestamp};

    const PLACES: &str =
        "[markers]\nbridge = 168\ntip = 4\nright = 133\nleft = 362\ntemple = 139\nchin = 199\nwand = \"off\"";
    const NAMES: [&str; 7] = ["bridge", "tip", "right", "left", "temple", "chin", "wand"];
    const CHIN: usize = 5;

    /// A take in millimetres, its alignment, and the map: the chin falls while the head turns and moves.
    fn falling_chin() -> (MarkerTake, Alignment, MarkerMap) {
        let map = MarkerMap::parse(PLACES).unwrap();
        let face = &ActionLibrary::built_in().face;
        let rest: Vec<Option<Point3<f64>>> =
            NAMES.iter().map(|name| map.places[*name].landmarks().first().map(|l| face[*l])).collect();
        let frames = (0..4)
            .map(|f| {
                let f = f64::from(f);
                let turn = Rotation3::from_euler_angles(0.05 * f, -0.1 * f, 0.02 * f);
                rest.iter()
                    .enumerate()
                    .map(|(m, p)| {
                        let fall = if m == CHIN { -7.0 * f } else { 0.0 };
                        let p = p.unwrap_or_else(Point3::origin).coords + Vector3::new(0.0, fall, 0.0);
                        Some(Point3::from(turn * p + Vector3::new(30.0, -2.0, 5.0) * f))
                    })
                    .collect()
            })
            .collect();
        let times = (0..4).map(|f| Timestamp(f * 10_000_000)).collect();
        let names = NAMES.map(str::to_owned).to_vec();
        let take = MarkerTake::new("take.c3d".as_ref(), names, times, frames).unwrap();
        let alignment = Alignment {
            scale: 1.0,
            rotation: Rotation3::identity(),
            translation: Vector3::zeros(),
            markers: vec![None; NAMES.len()],
            rest,
            errors: vec![0.0],
        };
        (take, alignment, map)
    }

    #[test]
    fn the_head_is_taken_out_and_the_chin_stays() {
        let (mut take, alignment, map) = falling_chin();
        let weights = still_weights(&take, &map).unwrap();
        assert!(weights[..CHIN].iter().all(|w| *w > 0.0) && weights[CHIN..].iter().all(|w| *w == 0.0));
        take.frames[2][1] = None;
        take.frames[3][..2].fill(None);
        let motion = MarkerMotion::of(&take, &alignment, Some(&weights));
        for (f, frame) in motion.displacements[..3].iter().enumerate() {
            for (m, d) in frame.iter().enumerate() {
                let wanted = match m {
                    6 => None,
                    1 if f == 2 => None,
                    CHIN => Some(Vector3::new(0.0, -7.0 * f as f64, 0.0)),
                    _ => Some(Vector3::zeros()),
                };
                assert_eq!(d.is_some(), wanted.is_some());
                assert!(d.is_none_or(|d| (d - wanted.unwrap()).norm() < 1e-9), "{f} {m} {d:?}");
            }
        }
        assert_eq!(motion.without_head, [3]);
        assert!(motion.displacements[3].iter().all(Option::is_none));
        let plain = MarkerMotion::of(&take, &alignment, None);
        assert!(plain.without_head.is_empty() && plain.displacements[1][0].unwrap().norm() > 20.0);
    }

    #[test]
    fn too_few_still_markers_are_refused() {
        let (take, _, mut map) = falling_chin();
        map.places.remove("tip");
        map.places.remove("left");
        let said = still_weights(&take, &map).unwrap_err().to_string();
        assert!(said.contains("take.c3d: 3 markers"), "{said}");
    }
}
