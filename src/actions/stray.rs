//! Landmarks that were found in a wrong place on one scan of a pair.
//!
//! The networks' landmarks are cast onto the surface, and a ray that meets a hole lands on the far side of the head: one
//! landmark then moves by centimetres and none beside it does. Skin moves with its neighbourhood, lids included, which have
//! neighbours on their own rim; lips that part move with the rest of their own lip. Where a whole neighbourhood is lost, as
//! a nose's wing seen past its edge, what expressions do at most tells.

use nalgebra::{Point3, Vector3};

use crate::{
    head::rotation_between,
    tracking::{Region, SKIN_LANDMARK_COUNT, landmark_table},
};

/// How many of the nearest landmarks are asked.
const NEIGHBOURS: usize = 8;
/// Of lips, which lie on each other at rest and part: so many of the nearest landmarks of both lips.
const LIP_NEIGHBOURS: usize = 32;
/// So many of them move alike, where a landmark is right. Two that fall through one hole support each other.
const SUPPORT: usize = 2;
/// Motions alike differ by this at most, millimetres…
const ALIKE: f64 = 10.0;
/// … or by this share of the motion, where it is large.
const SHARE: f64 = 0.35;
/// No expression moves a landmark farther than so many times what the landmark table has for it …
const BEYOND: f64 = 2.0;
/// … and this besides, millimetres.
const ALLOWANCE: f64 = 10.0;
/// Landmarks that move less than this in any expression, millimetres, tell how the head is turned.
const STILL: f64 = 4.0;

/// Skin landmarks known on both scans that move as nothing beside them does, or farther than any expression moves them;
/// ascending. Both lists in millimetres and
/// their own scan frames.
pub fn stray_landmarks(neutral: &[Option<Point3<f64>>], expressive: &[Option<Point3<f64>>]) -> Vec<usize> {
    let mut common: Vec<(usize, Vector3<f64>, Vector3<f64>)> = (0..SKIN_LANDMARK_COUNT)
        .filter_map(|i| Some((i, (*neutral.get(i)?)?.coords, (*expressive.get(i)?)?.coords)))
        .collect();
    let mut strays = Vec::new();
    // Strays that support each other fall one after the other.
    while common.len() > NEIGHBOURS {
        let found = unsupported(&common);
        if found.is_empty() {
            break;
        }
        common.retain(|(i, ..)| found.binary_search(i).is_err());
        strays.extend(found);
    }
    strays.sort_unstable();
    strays
}

/// Which of the landmarks, known by number and both places, have too few neighbours that move alike.
fn unsupported(common: &[(usize, Vector3<f64>, Vector3<f64>)]) -> Vec<usize> {
    let most = |i: usize| landmark_table()[i].max_motion;
    let is_still = |landmark: &&(usize, _, _)| most(landmark.0) < STILL;
    let split = |list: &mut dyn Iterator<Item = &(usize, Vector3<f64>, Vector3<f64>)>| -> (Vec<_>, Vec<_>) {
        list.map(|&(_, rest, acting)| (rest, acting)).unzip()
    };
    let (mut to, mut from) = split(&mut common.iter().filter(is_still));
    let (rest, acting) = split(&mut common.iter());
    if to.len() <= NEIGHBOURS {
        (to, from) = (rest.clone(), acting.clone());
    }
    let turn = rotation_between(&from, &to);
    let mean = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let (from, to) = (mean(&from), mean(&to));
    let motion = |(rest, acting): (&Vector3<f64>, &Vector3<f64>)| turn * (acting - from) + to - rest;
    let motions: Vec<_> = rest.iter().zip(&acting).map(motion).collect();
    let is_stray = |at: &usize| {
        if motions[*at].norm() > BEYOND * most(common[*at].0) + ALLOWANCE {
            return true;
        }
        let is_lip = |at: usize| landmark_table()[common[at].0].region == Region::Lips;
        let lip = is_lip(*at);
        let asked = |other: &usize| other != at && (!lip || is_lip(*other));
        let mut others: Vec<usize> = (0..rest.len()).filter(asked).collect();
        let distance = |other: &usize| (rest[*other] - rest[*at]).norm_squared();
        others.sort_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)));
        let reach = ALIKE.max(SHARE * motions[*at].norm());
        let alike = |other: &&usize| (motions[**other] - motions[*at]).norm() < reach;
        let count = if lip { LIP_NEIGHBOURS } else { NEIGHBOURS };
        others.iter().take(count).filter(alike).count() < SUPPORT
    };
    (0..rest.len()).filter(is_stray).map(|at| common[at].0).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;
    use crate::actions::ActionLibrary;

    /// The built-in library's face with some of its actions, turned and shifted.
    fn pair(actions: &[u8]) -> [Vec<Option<Point3<f64>>>; 2] {
        let library = ActionLibrary::built_in();
        let rest = &library.face[..SKIN_LANDMARK_COUNT];
        let mut acting = rest.to_vec();
        for action in library.actions.iter().filter(|action| actions.contains(&action.key.au)) {
            for v in action.vectors.iter().filter(|v| v.handle < SKIN_LANDMARK_COUNT) {
                acting[v.handle] += v.vector;
            }
        }
        let turn = Rotation3::from_euler_angles(0.1, 0.2, -0.1);
        let posed = acting.iter().map(|p| Some(turn * p + Vector3::new(10.0, -20.0, 5.0)));
        [rest.iter().copied().map(Some).collect(), posed.collect()]
    }

    #[test]
    fn no_action_of_the_library_has_strays() {
        let strays = ActionLibrary::built_in().actions.iter().filter_map(|action| {
            let [rest, acting] = pair(&[action.key.au]);
            let found = stray_landmarks(&rest, &acting);
            (!found.is_empty()).then(|| format!("AU{}: {found:?}", action.key))
        });
        assert_eq!(strays.collect::<Vec<_>>(), [""; 0]);
        let [rest, acting] = pair(&[1, 2, 5, 27, 43]);
        assert_eq!(stray_landmarks(&rest, &acting), [0; 0]);
    }

    #[test]
    fn landmarks_that_fall_through_a_hole_are_found() {
        let [rest, mut acting] = pair(&[12]);
        for i in [50, 280, 281] {
            acting[i] = acting[i].map(|p| p - Vector3::z() * 40.0);
        }
        acting[7] = None;
        assert_eq!(stray_landmarks(&rest, &acting), [50, 280, 281]);
        assert_eq!(stray_landmarks(&rest, &[]), [0; 0]);
    }
}
