//! A face that leaves and returns: hold, ease to the neutral, blend back.

use std::str::FromStr;

use nalgebra::{Rotation3, Vector3};

use super::{Displacements, Eyes};
use crate::{
    capture::Timestamp,
    head::HeadPose,
    tracking::{LANDMARK_COUNT, LandmarkState},
};

/// Seconds for which a lost face keeps its last expression.
const HOLD: f64 = 0.3;
/// Seconds in which it then loses two thirds of it.
const EASE: f64 = 0.4;
/// Seconds in which a returning face is blended in.
const BLEND: f64 = 0.25;

/// What the shown face is made of; the `state` column of the motion file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaceState {
    /// No face has been seen yet: neutral.
    Waiting,
    /// The face is seen.
    Tracking,
    /// Lost a moment ago: the last expression is kept.
    Holding,
    /// Lost: going to neutral.
    Easing,
    /// Seen again: coming back from where it went.
    Blending,
}

impl FaceState {
    /// One lower-case word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Tracking => "tracking",
            Self::Holding => "holding",
            Self::Easing => "easing",
            Self::Blending => "blending",
        }
    }
}

impl FromStr for FaceState {
    type Err = ();

    /// Reads the word that [`FaceState::name`] gives.
    fn from_str(text: &str) -> Result<Self, ()> {
        let all = [Self::Waiting, Self::Tracking, Self::Holding, Self::Easing, Self::Blending];
        all.into_iter().find(|state| state.name() == text).ok_or(())
    }
}

/// Pose and expression, as shown.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    /// The head.
    pub pose: HeadPose,
    /// The face.
    pub displacements: Displacements,
    /// Lids and gaze.
    pub eyes: Eyes,
    /// How far each muscle is contracted, in the order of the basis by which the take was lifted; none where it was not.
    pub contractions: Vec<f64>,
}

impl Expression {
    /// The neutral face in some pose.
    pub fn neutral(pose: HeadPose) -> Self {
        let displacements = Displacements::neutral();
        Self { pose, displacements, eyes: Eyes::default(), contractions: Vec::new() }
    }

    /// `share` of the way from `self` to `other`.
    fn towards(&self, other: &Self, share: f64) -> Self {
        let rotation = self.pose.rotation.slerp(&other.pose.rotation, share);
        let mix = |a: &Vector3<f64>, b: &Vector3<f64>| a + (b - a) * share;
        Self {
            pose: HeadPose {
                rotation,
                translation: mix(&self.pose.translation, &other.pose.translation),
                reprojection_error: other.pose.reprojection_error,
            },
            displacements: Displacements {
                vectors: self
                    .displacements
                    .vectors
                    .iter()
                    .zip(&other.displacements.vectors)
                    .map(|(a, b)| mix(a, b))
                    .collect(),
                states: other.displacements.states.clone(),
            },
            eyes: self.eyes.towards(&other.eyes, share),
            contractions: mixed(&self.contractions, &other.contractions, share),
        }
    }
}

/// Contractions on the way from one to the other; those that only one has are 0 in the other.
fn mixed(from: &[f64], to: &[f64], share: f64) -> Vec<f64> {
    let at = |list: &[f64], i: usize| list.get(i).copied().unwrap_or(0.0);
    (0..from.len().max(to.len())).map(|i| at(from, i) + (at(to, i) - at(from, i)) * share).collect()
}

/// Carries the face over frames without one.
#[derive(Debug, Clone)]
pub struct Presence {
    rest: Expression,
    shown: Option<(Timestamp, Expression)>,
    lost_since: Option<Timestamp>,
    blending_since: Option<Timestamp>,
}

impl Presence {
    /// `rest` is the performer's pose while neutral, to which a lost face returns.
    pub fn new(rest: HeadPose) -> Self {
        Self { rest: Expression::neutral(rest), shown: None, lost_since: None, blending_since: None }
    }

    /// What to show at `time`, given what was seen.
    pub fn show(&mut self, time: Timestamp, seen: Option<Expression>) -> (Expression, FaceState) {
        let (expression, state) = match (seen, self.shown.take()) {
            (None, None) => return (self.rest.clone(), FaceState::Waiting),
            (Some(seen), None) => (seen, FaceState::Tracking),
            (Some(seen), Some((then, shown))) => self.come_back(time, then, &shown, seen),
            (None, Some((then, shown))) => self.go_away(time, then, shown),
        };
        self.shown = Some((time, expression.clone()));
        (expression, state)
    }

    fn come_back(
        &mut self,
        time: Timestamp,
        then: Timestamp,
        shown: &Expression,
        seen: Expression,
    ) -> (Expression, FaceState) {
        if self.lost_since.take().is_some() {
            self.blending_since = Some(then);
        }
        let Some(since) = self.blending_since else { return (seen, FaceState::Tracking) };
        let left = BLEND - Timestamp(then.0 - since.0).seconds();
        let interval = Timestamp(time.0 - then.0).seconds();
        if interval >= left {
            self.blending_since = None;
            return (seen, FaceState::Tracking);
        }
        (shown.towards(&seen, interval / left), FaceState::Blending)
    }

    fn go_away(
        &mut self,
        time: Timestamp,
        then: Timestamp,
        mut shown: Expression,
    ) -> (Expression, FaceState) {
        self.blending_since = None;
        let since = *self.lost_since.get_or_insert(then);
        shown.displacements.states = vec![LandmarkState::Inferred; LANDMARK_COUNT];
        if Timestamp(time.0 - since.0).seconds() <= HOLD {
            return (shown, FaceState::Holding);
        }
        let interval = Timestamp(time.0 - then.0).seconds();
        (shown.towards(&self.rest, 1.0 - (-interval / EASE).exp()), FaceState::Easing)
    }
}

/// The head's pose while it looks straight into the camera from half a metre, for tests and defaults.
pub fn frontal_pose() -> HeadPose {
    HeadPose {
        rotation: Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI),
        translation: Vector3::new(0.0, 0.0, 500.0),
        reprojection_error: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn smile(amount: f64) -> Expression {
        let mut displacements = Displacements::neutral();
        displacements.vectors[61].y = amount;
        displacements.states.fill(LandmarkState::Observed);
        Expression { displacements, ..Expression::neutral(frontal_pose()) }
    }

    #[test]
    fn a_lost_face_holds_eases_and_blends_back() {
        let mut presence = Presence::new(frontal_pose());
        let time = |frame: i64| Timestamp(frame * 40_000_000);
        assert_eq!(presence.show(time(0), None).1, FaceState::Waiting);
        assert_eq!(presence.show(time(1), Some(smile(10.0))).1, FaceState::Tracking);
        let mut previous = 10.0;
        let mut states = Vec::new();
        for frame in 2..60 {
            let (shown, state) = presence.show(time(frame), None);
            let amount = shown.displacements.vectors[61].y;
            assert!(
                amount <= previous + 1e-12 && (state != FaceState::Holding || (amount - 10.0).abs() < 1e-12)
            );
            previous = amount;
            states.push(state);
        }
        assert_eq!(states[0], FaceState::Holding);
        assert_eq!(states[20], FaceState::Easing);
        assert!(previous < 0.1);
        let (first, state) = presence.show(time(60), Some(smile(10.0)));
        assert_eq!(state, FaceState::Blending);
        assert!(first.displacements.vectors[61].y < 3.0, "no jump");
        for frame in 61..66 {
            presence.show(time(frame), Some(smile(10.0)));
        }
        let (back, state) = presence.show(time(66), Some(smile(10.0)));
        assert_eq!(state, FaceState::Tracking);
        assert_eq!(back, smile(10.0));
    }
}
