//! Choosing the stretch of a clip in which the performer is neutral, and saying why another will not do.

use std::fmt;

use crate::{
    capture::Timestamp,
    head::HeadPose,
    lift::{LiftError, upright},
    tracking::{Landmarks, index},
};

/// Seconds that a chosen stretch lasts, where the clip allows.
const LENGTH: f64 = 1.0;
/// Lip gap over outer canthal distance beyond which the lips are parted.
const PARTED: f64 = 0.03;
/// Smile score beyond which the performer smiles.
const SMILING: f64 = 0.05;
/// Degrees of yaw or pitch, off the clip's usual pose, beyond which the head is turned.
const TURNED: f64 = 15.0;
/// Lid opening relative to the clip's usual one below which an eye is closing.
const CLOSING: f64 = 0.7;
/// Outer canthal distances per second beyond which the face moves.
const MOVING: f64 = 0.35;
/// How many stretches are looked at closely before the calmest is taken as it is.
const TRIES: usize = 12;

/// Why a stretch is not neutral.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NotNeutral {
    /// Lip gap over outer canthal distance.
    LipsParted(f64),
    /// Smile score.
    Smiling(f64),
    /// Degrees.
    HeadTurned(f64),
    /// Lid opening relative to the usual one.
    EyesClosing(f64),
    /// Outer canthal distances per second.
    Moving(f64),
}

impl fmt::Display for NotNeutral {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LipsParted(gap) => {
                write!(
                    formatter,
                    "the lips are parted by {:.0} % of the eye distance (at most {:.0} %)",
                    gap * 100.0,
                    PARTED * 100.0
                )
            }
            Self::Smiling(score) => {
                write!(formatter, "the performer smiles (score {score:.2}, at most {SMILING})")
            }
            Self::HeadTurned(angle) => {
                write!(formatter, "the head is turned by {angle:.0}° from its usual pose (at most {TURNED}°)")
            }
            Self::EyesClosing(opening) => {
                write!(
                    formatter,
                    "the eyes close to {:.0} % of their usual opening (at least {:.0} %)",
                    opening * 100.0,
                    CLOSING * 100.0
                )
            }
            Self::Moving(speed) => {
                write!(formatter, "the face moves by {speed:.2} eye distances a second (at most {MOVING})")
            }
        }
    }
}

/// One tracked frame, as the choice needs it.
#[derive(Debug, Clone, Copy)]
pub struct Candidate<'a> {
    /// When.
    pub time: Timestamp,
    /// What the network saw.
    pub landmarks: &'a Landmarks,
    /// Head pose from the average face.
    pub pose: HeadPose,
}

/// The chosen frames, and what speaks against them.
#[derive(Debug, Clone, PartialEq)]
pub struct NeutralStretch {
    /// Index of the first frame among the candidates.
    pub first: usize,
    /// Index after the last.
    pub end: usize,
    /// Empty for a good neutral.
    pub objections: Vec<NotNeutral>,
}

/// Measures of each frame, against the clip's usual ones.
pub struct NeutralSearch<'a> {
    candidates: &'a [Candidate<'a>],
    measures: Vec<Measures>,
}

#[derive(Debug, Clone, Copy)]
struct Measures {
    gap: f64,
    opening: f64,
    angle: f64,
    speed: f64,
}

impl<'a> NeutralSearch<'a> {
    /// Measures all candidates, which are tracked frames in order.
    pub fn new(candidates: &'a [Candidate<'a>]) -> Self {
        let openings: Vec<f64> = candidates.iter().map(|c| lid_opening(c.landmarks)).collect();
        let usual_opening = quantile(&openings, 0.6).max(1e-6);
        let angles: Vec<(f64, f64)> = candidates.iter().map(|c| yaw_pitch(&c.pose)).collect();
        let usual = (
            quantile(&angles.iter().map(|a| a.0).collect::<Vec<_>>(), 0.5),
            quantile(&angles.iter().map(|a| a.1).collect::<Vec<_>>(), 0.5),
        );
        let measures = (0..candidates.len())
            .map(|i| Measures {
                gap: lip_gap(candidates[i].landmarks),
                opening: openings[i] / usual_opening,
                angle: (angles[i].0 - usual.0).hypot(angles[i].1 - usual.1),
                speed: speed(candidates, i),
            })
            .collect();
        Self { candidates, measures }
    }

    /// The calmest stretch of about a second that passes the gate; the calmest of all, with the objections to it,
    /// where none does. `smile` scores a frame by the blendshape network and is asked sparingly.
    pub fn choose<E>(
        &self,
        mut smile: impl FnMut(&Landmarks) -> Result<f64, E>,
    ) -> Result<Option<NeutralStretch>, E> {
        let mut stretches: Vec<(f64, usize, usize)> = (0..self.candidates.len())
            .filter_map(|first| {
                let end = self.end_of_stretch(first)?;
                let badness = self.measures[first..end].iter().map(Measures::badness).sum::<f64>();
                Some((badness / (end - first) as f64, first, end))
            })
            .collect();
        stretches.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut best: Option<NeutralStretch> = None;
        let mut looked_at: Vec<(usize, usize)> = Vec::new();
        for &(_, first, end) in &stretches {
            // Overlapping stretches would be refused for the same reason.
            if looked_at.iter().any(|&(f, e)| first < e && f < end) {
                continue;
            }
            looked_at.push((first, end));
            let objections = self.objections(first, end, &mut smile)?;
            if objections.is_empty() {
                return Ok(Some(NeutralStretch { first, end, objections }));
            }
            if best.as_ref().is_none_or(|b| objections.len() < b.objections.len()) {
                best = Some(NeutralStretch { first, end, objections });
            }
            if looked_at.len() >= TRIES {
                break;
            }
        }
        Ok(best)
    }

    /// The frames between two times that the user named, with what speaks against them.
    pub fn between<E>(
        &self,
        start: f64,
        end: f64,
        mut smile: impl FnMut(&Landmarks) -> Result<f64, E>,
    ) -> Result<Result<NeutralStretch, LiftError>, E> {
        let inside = |c: &Candidate| (start - 1e-6..=end + 1e-6).contains(&c.time.seconds());
        let Some(first) = self.candidates.iter().position(inside) else {
            let duration = self.candidates.last().map_or(0.0, |c| c.time.seconds());
            return Ok(Err(LiftError::EmptyNeutral { start, end, duration }));
        };
        let end = first + self.candidates[first..].iter().take_while(|c| inside(c)).count();
        let objections = self.objections(first, end, &mut smile)?;
        Ok(Ok(NeutralStretch { first, end, objections }))
    }

    /// The index after the last frame of the stretch that starts at `first`; `None` where the clip ends before.
    fn end_of_stretch(&self, first: usize) -> Option<usize> {
        let start = self.candidates[first].time.seconds();
        let last = self.candidates.last()?.time.seconds();
        let length = LENGTH.min(last - self.candidates[0].time.seconds());
        if start + length > last + 1e-6 {
            return None;
        }
        Some(
            first
                + self.candidates[first..]
                    .iter()
                    .take_while(|c| c.time.seconds() <= start + length + 1e-6)
                    .count(),
        )
    }

    fn objections<E>(
        &self,
        first: usize,
        end: usize,
        smile: &mut impl FnMut(&Landmarks) -> Result<f64, E>,
    ) -> Result<Vec<NotNeutral>, E> {
        let of = |value: fn(&Measures) -> f64, share: f64| {
            quantile(&self.measures[first..end].iter().map(value).collect::<Vec<_>>(), share)
        };
        let mut smiles = Vec::new();
        for i in [first, usize::midpoint(first, end - 1), end - 1] {
            smiles.push(smile(self.candidates[i].landmarks)?);
        }
        let (gap, angle, opening, motion) =
            (of(|m| m.gap, 0.5), of(|m| m.angle, 0.8), of(|m| m.opening, 0.1), of(|m| m.speed, 0.8));
        let smiling = quantile(&smiles, 0.5);
        Ok([
            (gap > PARTED).then_some(NotNeutral::LipsParted(gap)),
            (smiling > SMILING).then_some(NotNeutral::Smiling(smiling)),
            (angle > TURNED).then_some(NotNeutral::HeadTurned(angle)),
            (opening < CLOSING).then_some(NotNeutral::EyesClosing(opening)),
            (motion > MOVING).then_some(NotNeutral::Moving(motion)),
        ]
        .into_iter()
        .flatten()
        .collect())
    }
}

impl Measures {
    /// 0 for a perfectly neutral frame; each part is about 1 at its limit.
    fn badness(&self) -> f64 {
        (self.gap / PARTED).powi(2)
            + (self.angle / TURNED).powi(2)
            + (self.speed / MOVING).powi(2)
            + ((1.0 - self.opening).max(0.0) / (1.0 - CLOSING)).powi(2)
    }
}

fn lip_gap(landmarks: &Landmarks) -> f64 {
    landmarks.distance(index::UPPER_LIP_INNER, index::LOWER_LIP_INNER)
        / landmarks.outer_canthal_distance().max(1e-6)
}

/// The narrower eye's height over its width.
fn lid_opening(landmarks: &Landmarks) -> f64 {
    let eye = |upper, lower, inner, outer| {
        landmarks.distance(upper, lower) / landmarks.distance(inner, outer).max(1e-6)
    };
    eye(index::RIGHT_LID_UPPER, index::RIGHT_LID_LOWER, index::RIGHT_EYE_INNER, index::RIGHT_EYE_OUTER)
        .min(eye(index::LEFT_LID_UPPER, index::LEFT_LID_LOWER, index::LEFT_EYE_INNER, index::LEFT_EYE_OUTER))
}

/// Degrees, of a head before the camera.
fn yaw_pitch(pose: &HeadPose) -> (f64, f64) {
    let forward = (upright() * pose.rotation) * nalgebra::Vector3::z();
    (forward.x.atan2(forward.z).to_degrees(), (-forward.y).atan2(forward.z).to_degrees())
}

/// Mean landmark speed around frame `i`, in outer canthal distances a second.
fn speed(candidates: &[Candidate], i: usize) -> f64 {
    let (a, b) = (&candidates[i.saturating_sub(1)], &candidates[(i + 1).min(candidates.len() - 1)]);
    let interval = Timestamp(b.time.0 - a.time.0).seconds();
    if interval <= 0.0 {
        return 0.0;
    }
    let points = a.landmarks.points.len() as f64;
    let moved: f64 =
        a.landmarks.points.iter().zip(&b.landmarks.points).map(|(p, q)| (p.xy() - q.xy()).norm()).sum();
    moved / points / a.landmarks.outer_canthal_distance().max(1e-6) / interval
}

fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1);
    sorted.get((last as f64 * share).round() as usize).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::{
        lift::frontal_pose,
        tracking::{LANDMARK_COUNT, LandmarkState},
    };

    /// A face with eyes 100 px apart, lids 12 px open and lips parted by `gap` px.
    fn face(gap: f64, shift: f64) -> Landmarks {
        let mut points = vec![Vector3::new(100.0 + shift, 100.0, 0.0); LANDMARK_COUNT];
        let mut put = |i: usize, x: f64, y: f64| points[i] = Vector3::new(x + shift, y, 0.0);
        put(index::RIGHT_EYE_OUTER, 50.0, 80.0);
        put(index::RIGHT_EYE_INNER, 80.0, 80.0);
        put(index::LEFT_EYE_INNER, 120.0, 80.0);
        put(index::LEFT_EYE_OUTER, 150.0, 80.0);
        for (upper, lower, x) in [
            (index::RIGHT_LID_UPPER, index::RIGHT_LID_LOWER, 65.0),
            (index::LEFT_LID_UPPER, index::LEFT_LID_LOWER, 135.0),
        ] {
            put(upper, x, 74.0);
            put(lower, x, 86.0);
        }
        put(index::UPPER_LIP_INNER, 100.0, 140.0);
        put(index::LOWER_LIP_INNER, 100.0, 140.0 + gap);
        Landmarks { points, states: vec![LandmarkState::Observed; LANDMARK_COUNT], presence: 1.0 }
    }

    fn candidates(faces: &[Landmarks]) -> Vec<Candidate<'_>> {
        faces
            .iter()
            .enumerate()
            .map(|(i, landmarks)| Candidate {
                time: Timestamp(i as i64 * 40_000_000),
                landmarks,
                pose: frontal_pose(),
            })
            .collect()
    }

    #[allow(clippy::unnecessary_wraps)] // the search takes scores that may fail
    fn never(_: &Landmarks) -> Result<f64, std::convert::Infallible> {
        Ok(0.0)
    }

    #[test]
    fn the_closed_mouthed_still_stretch_is_chosen() {
        // Two seconds of talking, one and a half of rest, two of moving about.
        let faces: Vec<_> = (0..140)
            .map(|i| match i {
                0..50 => face(10.0 + 8.0 * f64::from(i).sin(), 0.0),
                50..90 => face(0.5, 0.0),
                _ => face(0.5, 3.0 * f64::from(i)),
            })
            .collect();
        let candidates = candidates(&faces);
        let chosen = NeutralSearch::new(&candidates).choose(never).unwrap().unwrap();
        assert!(chosen.first >= 49 && chosen.end <= 92, "{chosen:?}");
        assert!(chosen.objections.is_empty());
    }

    #[test]
    fn a_refused_stretch_says_why() {
        let faces: Vec<_> = (0..50).map(|_| face(10.0, 0.0)).collect();
        let candidates = candidates(&faces);
        let search = NeutralSearch::new(&candidates);
        let named = search.between(0.2, 0.8, |_| Ok::<_, std::convert::Infallible>(0.6)).unwrap().unwrap();
        assert!(matches!(named.objections[..], [NotNeutral::LipsParted(_), NotNeutral::Smiling(_)]));
        assert!(named.objections[0].to_string().contains("parted by 10 %"));
        assert!(matches!(search.between(7.0, 8.0, never).unwrap(), Err(LiftError::EmptyNeutral { .. })));
    }
}
