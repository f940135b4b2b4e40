//! Action units played on a target (000 §5.6): one expression, or a score of keys.

use super::Play;
use crate::{
    actions::{ActionWeights, Score},
    capture::Timestamp,
    rig::{ActionRig, AvatarFrame, Puppet},
};

/// A single expression is shown as it comes, stays and goes, seconds.
const COMING: f64 = 0.6;
const STAYING: f64 = 1.2;
/// Moments on a score's sheet.
const MOMENTS: i64 = 8;

/// What is played.
#[derive(Debug, Clone, PartialEq)]
pub enum Playing {
    /// One expression.
    Expression(ActionWeights),
    /// Keys over time.
    Score(Score),
}

impl Playing {
    /// The magnitudes at a moment.
    pub fn at(&self, time: Timestamp) -> ActionWeights {
        match self {
            Self::Score(score) => score.at(time),
            Self::Expression(weights) => ActionWeights::default().towards(weights, expression_share(time)),
        }
    }
}

/// How much of a single expression shows at a moment.
pub(super) fn expression_share(time: Timestamp) -> f64 {
    let seconds = time.seconds();
    let from_end = 2.0 * COMING + STAYING - seconds;
    let ramp = (seconds.min(from_end) / COMING).clamp(0.0, 1.0);
    ramp * ramp * (3.0 - 2.0 * ramp)
}

/// Action units and the rig that they move.
pub struct ActionTake {
    /// The library tied to the target.
    pub rig: ActionRig,
    /// What is played.
    pub playing: Playing,
}

impl Play for ActionTake {
    fn puppet(&self) -> &Puppet {
        self.rig.puppet()
    }

    fn pose_controls(&self, time: Timestamp, frame: &mut AvatarFrame) {
        let weights = self.playing.at(time);
        self.rig.pose_controls(&weights, &self.rig.eyes(&weights), frame);
    }

    fn end(&self) -> Timestamp {
        match &self.playing {
            Playing::Expression(_) => moment(2.0 * COMING + STAYING),
            Playing::Score(score) => score.end(),
        }
    }

    fn still(&self) -> Timestamp {
        match &self.playing {
            Playing::Expression(_) => moment(COMING + STAYING / 2.0),
            Playing::Score(score) => score.end(),
        }
    }

    fn moments(&self) -> Vec<Timestamp> {
        match &self.playing {
            Playing::Expression(_) => vec![self.still()],
            Playing::Score(score) => {
                (0..MOMENTS).map(|k| Timestamp(score.end().0 * k / (MOMENTS - 1))).collect()
            }
        }
    }
}

fn moment(seconds: f64) -> Timestamp {
    Timestamp((seconds * 1e9).round() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_expression_comes_stays_and_goes() {
        let mut weights = ActionWeights::default();
        weights.set_text("17=0.8").unwrap();
        let playing = Playing::Expression(weights.clone());
        let at =
            |seconds: f64| playing.at(Timestamp((seconds * 1e9) as i64)).iter().map(|e| e.1).sum::<f64>();
        assert!(at(0.0).abs() < 1e-12 && at(2.0 * COMING + STAYING).abs() < 1e-9);
        assert!((at(0.3) - 0.4).abs() < 1e-9 && (at(1.0) - 0.8).abs() < 1e-12);
        assert_eq!(playing.at(moment(COMING + STAYING / 2.0)), weights);
    }
}
