//! Action units over time: keys of each action, and what lies between them.
//!
//! 000 eq. 5.10 moves a face by the magnitudes of one moment; a score gives them for every moment. Two files can be read
//! (`docs/formats.md`): keyframes that an animator writes, and tables of intensities with OpenFace's columns.

use std::{collections::BTreeMap, path::Path};

use super::{ActionError, ActionKey, ActionWeights, score_read};
use crate::capture::Timestamp;

/// When an action is on, and how strongly.
#[derive(Debug, Clone, PartialEq)]
pub struct Score {
    /// By ascending key; none is empty.
    tracks: Vec<(ActionKey, Track)>,
    start: Timestamp,
    end: Timestamp,
    frames: Option<usize>,
    ignored: Vec<String>,
}

/// Times and magnitudes of one action, times ascending, none twice.
pub(super) type Track = Vec<(Timestamp, f64)>;

impl Score {
    /// Reads keyframes or a table; the header tells which.
    pub fn read(path: &Path) -> Result<Self, ActionError> {
        score_read::read(path)
    }

    /// Magnitudes in 0..=1, times ascending; `start` and `end` are those of the rows.
    pub(super) fn new(
        tracks: BTreeMap<ActionKey, Track>,
        [start, end]: [Timestamp; 2],
        frames: Option<usize>,
        ignored: Vec<String>,
    ) -> Self {
        let tracks = tracks.into_iter().filter(|(_, track)| !track.is_empty()).collect();
        Self { tracks, start, end, frames, ignored }
    }

    /// What is on at `time`. Each action goes straight from one of its keys to the next; before its first key it is as
    /// there, after its last as there. Actions at 0 are left out.
    pub fn at(&self, time: Timestamp) -> ActionWeights {
        let value = |track: &Track| {
            let after = track.partition_point(|key| key.0 <= time);
            let before = track[after.saturating_sub(1)];
            let next = track.get(after).copied().unwrap_or(before);
            if next.0 <= before.0 {
                return before.1;
            }
            let share = (time.0 - before.0.0) as f64 / (next.0.0 - before.0.0) as f64;
            (before.1 + (next.1 - before.1) * share).clamp(0.0, 1.0)
        };
        let on = self.tracks.iter().map(|(key, track)| (*key, value(track)));
        ActionWeights::ascending(on.filter(|(_, magnitude)| *magnitude > 0.0).collect())
    }

    /// The time of the first key or row.
    pub fn start(&self) -> Timestamp {
        self.start
    }

    /// The time of the last key or row.
    pub fn end(&self) -> Timestamp {
        self.end
    }

    /// How many rows a table has; `None` for keyframes, which have no frames of their own.
    pub fn frames(&self) -> Option<usize> {
        self.frames
    }

    /// Actions that are on at some time, by ascending key.
    pub fn actions(&self) -> impl Iterator<Item = ActionKey> + '_ {
        let on = |track: &Track| track.iter().any(|key| key.1 > 0.0);
        self.tracks.iter().filter(move |(_, track)| on(track)).map(|(key, _)| *key)
    }

    /// Columns of a table that name action units which a surface cannot show, as they were written.
    pub fn ignored(&self) -> &[String] {
        &self.ignored
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn score(tracks: &[(&str, &[(i64, f64)])]) -> Score {
        let mut all = BTreeMap::new();
        for (unit, keys) in tracks {
            for key in ActionKey::parse(unit).unwrap() {
                all.insert(key, keys.iter().map(|&(t, m)| (Timestamp(t), m)).collect());
            }
        }
        Score::new(all, [Timestamp(0), Timestamp(100)], None, Vec::new())
    }

    fn at(score: &Score, time: i64) -> String {
        let weights = score.at(Timestamp(time));
        let on: Vec<_> = weights.iter().map(|(key, m)| format!("{key}={m}")).collect();
        on.join(" ")
    }

    #[test]
    fn each_action_goes_straight_between_its_own_keys_and_stays_outside_them() {
        let score = score(&[("12L", &[(20, 0.25), (60, 0.75)]), ("17", &[(0, 1.0), (100, 0.0)])]);
        assert_eq!(at(&score, -5), "12L=0.25 17=1");
        assert_eq!(at(&score, 20), "12L=0.25 17=0.8");
        assert_eq!(at(&score, 30), "12L=0.375 17=0.7");
        assert_eq!(at(&score, 50), "12L=0.625 17=0.5");
        assert_eq!(at(&score, 60), "12L=0.75 17=0.4");
        assert_eq!(at(&score, 100), "12L=0.75");
        assert_eq!(at(&score, i64::MAX), "12L=0.75");
    }

    #[test]
    fn one_key_holds_for_ever_and_actions_that_stay_off_are_not_listed() {
        let score = score(&[("4", &[(50, 0.5)]), ("26", &[(0, 0.0), (9, 0.0)])]);
        for time in [i64::MIN, 0, 50, 51] {
            assert_eq!(at(&score, time), "4R=0.5 4L=0.5");
        }
        assert_eq!(score.actions().map(|key| key.to_string()).collect::<Vec<_>>(), ["4R", "4L"]);
    }

    proptest! {
        #[test]
        fn between_two_keys_lies_between_their_magnitudes(
            a in 0.0..=1.0_f64, b in 0.0..=1.0_f64, gap in 1..i64::MAX, part in 0.0..=1.0_f64,
        ) {
            let score = score(&[("17", &[(0, a), (gap, b)])]);
            let time = Timestamp((gap as f64 * part) as i64);
            let value = score.at(time).of(ActionKey { au: 17, side: None });
            prop_assert!(value >= a.min(b) - 1e-12 && value <= a.max(b) + 1e-12);
            let wanted = a + (b - a) * (time.0 as f64 / gap as f64);
            prop_assert!((value - wanted).abs() < 1e-9);
        }
    }
}
