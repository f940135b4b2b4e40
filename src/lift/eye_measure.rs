//! What is measured of the eyes in one frame: how far the lids stand apart, where the iris points.
//!
//! Both come from landmarks lifted without the network's depth hint, so what lies along the camera's axis is unknown.
//! The lids' distance is therefore compared with what the neutral face shows in the same pose: that makes up for a head
//! that turns, and lids that meet have no distance in any pose.

use nalgebra::{Point3, Vector3, center};

use super::Performer;
use crate::{
    head::HeadPose,
    tracking::{LandmarkState, Landmarks, index},
};

/// Radius of the eyeball over the width of the eye between its corners: 12 mm over 30.
const EYEBALL: f64 = 0.40;
/// Lids of a neutral eye are at least this far apart, in widths of the eye; closer ones were shut.
const NARROWEST: f64 = 0.12;
/// The usual aperture of the neutral stretch is at least this share of its scan's.
const LEAST: f64 = 0.5;
/// Frames of the neutral below this share of its usual aperture are in a blink.
const BLINKING: f64 = 0.8;

/// One eye in one frame, before anything is smoothed or held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EyeMeasure {
    /// Mean distance of the lids over the eye's width; 1 as on the performer's neutral scan in this pose.
    pub aperture: f64,
    /// Turn of the iris to the subject's left since the performer's neutral scan, radians, level frame.
    pub yaw: f64,
    /// The same upwards.
    pub pitch: f64,
    /// False where a part of the eye lies outside the picture.
    pub seen: bool,
}

/// The landmarks of one eye.
struct EyeLandmarks {
    outer: usize,
    inner: usize,
    /// Upper and lower, around the middle, where the lids travel farthest.
    lids: [(usize, usize); 3],
    iris: usize,
}

const EYES: [EyeLandmarks; 2] = [
    EyeLandmarks {
        outer: index::RIGHT_EYE_OUTER,
        inner: index::RIGHT_EYE_INNER,
        lids: [(160, 144), (index::RIGHT_LID_UPPER, index::RIGHT_LID_LOWER), (158, 153)],
        iris: index::RIGHT_IRIS,
    },
    EyeLandmarks {
        outer: index::LEFT_EYE_OUTER,
        inner: index::LEFT_EYE_INNER,
        lids: [(387, 373), (index::LEFT_LID_UPPER, index::LEFT_LID_LOWER), (385, 380)],
        iris: index::LEFT_IRIS,
    },
];

/// Measures the right and the left eye.
pub fn measure_eyes(performer: &Performer, landmarks: &Landmarks, pose: &HeadPose) -> [EyeMeasure; 2] {
    EYES.map(|eye| {
        let seen = slot(&eye, pose, |landmark| performer.lift_flat(landmarks, pose, landmark));
        let neutral = slot(&eye, pose, |landmark| performer.neutral()[landmark]);
        let (yaw, pitch) = iris_turn(performer, landmarks, pose, &eye);
        let inside = |landmark: usize| landmarks.states[landmark] != LandmarkState::Absent;
        EyeMeasure {
            aperture: seen / neutral.max(NARROWEST),
            yaw,
            pitch,
            seen: [eye.outer, eye.inner, eye.iris].into_iter().all(inside)
                && eye.lids.iter().all(|&(upper, lower)| inside(upper) && inside(lower)),
        }
    })
}

/// Mean distance of the lids over the width of the eye, both parallel to the picture.
fn slot(eye: &EyeLandmarks, pose: &HeadPose, place: impl Fn(usize) -> Point3<f64>) -> f64 {
    let apart = |a: usize, b: usize| (pose.rotation * (place(a) - place(b))).xy().norm();
    let gap: f64 = eye.lids.iter().map(|&(upper, lower)| apart(upper, lower)).sum();
    gap / eye.lids.len() as f64 / apart(eye.outer, eye.inner).max(1e-6)
}

/// Yaw and pitch of the eyeball since the neutral, in which it is taken to look along the camera's axis.
fn iris_turn(
    performer: &Performer,
    landmarks: &Landmarks,
    pose: &HeadPose,
    eye: &EyeLandmarks,
) -> (f64, f64) {
    let flat = |landmark| performer.lift_flat(landmarks, pose, landmark);
    let neutral = |landmark: usize| performer.neutral()[landmark];
    let level = performer.level();
    let radius = EYEBALL * (neutral(eye.outer) - neutral(eye.inner)).norm();
    let from_corners = flat(eye.iris) - center(&flat(eye.outer), &flat(eye.inner));
    let at_rest = neutral(eye.iris) - center(&neutral(eye.outer), &neutral(eye.inner));
    let from_centre = level * (from_corners - at_rest) + Vector3::z() * radius;
    // The iris is where its ray enters the eyeball; a ray that misses is taken where it passes closest.
    let ray = level * (pose.rotation.inverse() * performer.camera().ray(landmarks.pixel(eye.iris)));
    let ray = ray.normalize();
    let along = from_centre.dot(&ray);
    let depth = radius * radius - from_centre.norm_squared() + along * along;
    let iris = from_centre - ray * (along + depth.max(0.0).sqrt());
    (iris.x.atan2(iris.z), iris.y.atan2(iris.x.hypot(iris.z)))
}

/// The eyes of the neutral stretch, from which closure and gaze are counted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeutralEyes([EyeMeasure; 2]);

impl NeutralEyes {
    /// From the frames of the stretch: the usual aperture, and the mean gaze of the frames that are not in a blink.
    pub fn new(frames: &[[EyeMeasure; 2]]) -> Self {
        Self([0, 1].map(|side| {
            let mut apertures: Vec<f64> = frames.iter().map(|eyes| eyes[side].aperture).collect();
            apertures.sort_by(f64::total_cmp);
            let usual = apertures.get(apertures.len() / 2).copied().unwrap_or(0.0);
            let awake: Vec<&EyeMeasure> = frames
                .iter()
                .map(|eyes| &eyes[side])
                .filter(|eye| eye.aperture >= BLINKING * usual)
                .collect();
            let mean = |value: fn(&EyeMeasure) -> f64| {
                awake.iter().map(|eye| value(eye)).sum::<f64>() / awake.len().max(1) as f64
            };
            let (yaw, pitch) = (mean(|eye| eye.yaw), mean(|eye| eye.pitch));
            EyeMeasure { aperture: usual.max(LEAST), yaw, pitch, seen: true }
        }))
    }

    /// Apertures of the right and the left eye.
    pub fn apertures(&self) -> [f64; 2] {
        self.0.map(|eye| eye.aperture)
    }

    /// Yaw and pitch of each eye since this neutral, radians.
    pub(super) fn turns(&self, eyes: &[EyeMeasure; 2]) -> [[f64; 2]; 2] {
        [0, 1].map(|side| [eyes[side].yaw - self.0[side].yaw, eyes[side].pitch - self.0[side].pitch])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn eye(aperture: f64, pitch: f64) -> EyeMeasure {
        EyeMeasure { aperture, yaw: 0.0, pitch, seen: true }
    }

    #[test]
    fn a_blink_in_the_neutral_does_not_narrow_it() {
        let mut frames = vec![[eye(1.1, 0.02), eye(0.9, 0.0)]; 25];
        frames[10..14].fill([eye(0.2, -0.2), eye(0.1, -0.2)]);
        let neutral = NeutralEyes::new(&frames);
        assert!((neutral.apertures()[0] - 1.1).abs() < 1e-12);
        assert!(neutral.turns(&frames[0])[0][1].abs() < 1e-12);
    }

    #[test]
    fn a_neutral_with_shut_eyes_or_none_still_has_a_range() {
        for frames in [&[][..], &[[eye(0.01, 0.0); 2]]] {
            let apertures = NeutralEyes::new(frames).apertures();
            assert!(apertures.iter().all(|aperture| (aperture - LEAST).abs() < 1e-15));
        }
    }
}
