//! Missing, noisy and jumping landmarks, as 002 §III treats them.
//!
//! "Missing feature points decay slowly toward their neutral expression locations. Facial expressions are assumed
//! symmetric. Feature motion is held from a previous frame whenever it changes abruptly or extremely."

use nalgebra::{Point3, Vector3};

use super::{Displacements, Performer};
use crate::{
    capture::Timestamp,
    head::HeadPose,
    tracking::{LANDMARK_COUNT, LandmarkState, landmark_table},
};

/// Seconds in which a missing landmark loses two thirds of its displacement.
const DECAY: f64 = 0.8;
/// Seconds in which a missing landmark goes two thirds of the way to its mirror image.
const SYMMETRY: f64 = 0.12;
/// A landmark that moves faster than this within the face has jumped, millimetres per second.
const ABRUPT: f64 = 900.0;
/// A landmark displaced by more than this many times what any expression does has jumped.
const EXTREME: f64 = 3.0;
/// A jump that lasts longer than this is a motion after all, seconds.
const PATIENCE: f64 = 0.1;
/// Skin that faces the camera by less than this cosine is guessed by the network, not seen.
const GRAZING: f64 = 0.05;
/// The ellipsoid that stands for the head where a normal is wanted: its centre lies this far behind the bridge.
const HEAD_DEPTH: f64 = 75.0;

/// Repairs one landmark after another, remembering the last good displacement of each.
#[derive(Debug, Clone)]
pub struct Repair {
    outward: Vec<Vector3<f64>>,
    last: Option<(Timestamp, Vec<Vector3<f64>>)>,
    jumping_for: Vec<f64>,
}

impl Repair {
    /// For the performer's neutral.
    pub fn new(performer: &Performer) -> Self {
        let bridge = performer.neutral()[crate::tracking::index::NOSE_BRIDGE];
        let centre = Point3::new(bridge.x, bridge.y, bridge.z - HEAD_DEPTH);
        let outward = performer.neutral().iter().map(|point| (point - centre).normalize()).collect();
        Self { outward, last: None, jumping_for: vec![0.0; LANDMARK_COUNT] }
    }

    /// Forgets the past, as when the face was lost.
    pub fn reset(&mut self) {
        self.last = None;
        self.jumping_for.fill(0.0);
    }

    /// Marks what is turned away from the camera as absent: there the network guesses.
    pub fn hide(&self, pose: &HeadPose, states: &mut [LandmarkState]) {
        for (state, outward) in states.iter_mut().zip(&self.outward) {
            // The camera looks along +z, so skin that faces it points to -z.
            if *state == LandmarkState::Observed && -(pose.rotation * outward).z < GRAZING {
                *state = LandmarkState::Absent;
            }
        }
    }

    /// Replaces what is missing or has jumped, and marks it inferred.
    pub fn apply(&mut self, time: Timestamp, pose: &HeadPose, displacements: &mut Displacements) {
        self.hide(pose, &mut displacements.states);
        if let Some((then, last)) = &self.last {
            let interval = Timestamp(time.0 - then.0).seconds().max(1e-3);
            hold_jumps(displacements, last, interval, &mut self.jumping_for);
            fill_missing(displacements, last, interval);
        } else {
            fill_missing(displacements, &vec![Vector3::zeros(); LANDMARK_COUNT], 1e-3);
        }
        self.last = Some((time, displacements.vectors.clone()));
    }
}

fn hold_jumps(
    displacements: &mut Displacements,
    last: &[Vector3<f64>],
    interval: f64,
    jumping_for: &mut [f64],
) {
    for (i, facts) in landmark_table().iter().enumerate() {
        if displacements.states[i] != LandmarkState::Observed {
            continue;
        }
        let vector = displacements.vectors[i];
        let abrupt = (vector - last[i]).norm() > ABRUPT * interval;
        let extreme = vector.norm() > EXTREME * facts.max_motion.max(4.0);
        if (abrupt || extreme) && jumping_for[i] < PATIENCE {
            jumping_for[i] += interval;
            displacements.vectors[i] = last[i];
            displacements.states[i] = LandmarkState::Inferred;
        } else {
            jumping_for[i] = 0.0;
        }
    }
}

fn fill_missing(displacements: &mut Displacements, last: &[Vector3<f64>], interval: f64) {
    let observed: Vec<bool> =
        displacements.states.iter().map(|state| *state == LandmarkState::Observed).collect();
    for (i, facts) in landmark_table().iter().enumerate() {
        if displacements.states[i] != LandmarkState::Absent {
            continue;
        }
        displacements.vectors[i] = if observed[facts.mirror] {
            let twin = displacements.vectors[facts.mirror];
            let mirrored = Vector3::new(-twin.x, twin.y, twin.z);
            last[i] + (mirrored - last[i]) * (1.0 - (-interval / SYMMETRY).exp())
        } else {
            last[i] * (-interval / DECAY).exp()
        };
        displacements.states[i] = LandmarkState::Inferred;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn still(states: LandmarkState) -> Displacements {
        Displacements {
            vectors: vec![Vector3::zeros(); LANDMARK_COUNT],
            states: vec![states; LANDMARK_COUNT],
        }
    }

    #[test]
    fn a_missing_landmark_decays_to_neutral_when_its_twin_is_missing_too() {
        let mut last = vec![Vector3::zeros(); LANDMARK_COUNT];
        last[61] = Vector3::new(0.0, 8.0, 0.0);
        let mut now = still(LandmarkState::Absent);
        fill_missing(&mut now, &last, DECAY);
        assert!((now.vectors[61].y - 8.0 / std::f64::consts::E).abs() < 1e-12);
        assert_eq!(now.states[61], LandmarkState::Inferred);
    }

    #[test]
    fn a_missing_landmark_follows_its_mirror_image() {
        let mut now = still(LandmarkState::Observed);
        now.states[61] = LandmarkState::Absent;
        now.vectors[291] = Vector3::new(5.0, 3.0, 1.0);
        fill_missing(&mut now, &vec![Vector3::zeros(); LANDMARK_COUNT], 10.0);
        assert!((now.vectors[61] - Vector3::new(-5.0, 3.0, 1.0)).norm() < 1e-9);
    }

    #[test]
    fn one_wild_frame_is_held_and_a_lasting_change_is_believed() {
        let last = vec![Vector3::zeros(); LANDMARK_COUNT];
        let mut jumping = vec![0.0; LANDMARK_COUNT];
        let mut wild = still(LandmarkState::Observed);
        wild.vectors[4] = Vector3::new(80.0, 0.0, 0.0);
        for frame in 0..4 {
            let mut now = wild.clone();
            hold_jumps(&mut now, &last, 0.04, &mut jumping);
            let held = now.vectors[4].norm() < 1e-12;
            assert_eq!(held, frame < 3, "frame {frame}");
        }
    }
}
