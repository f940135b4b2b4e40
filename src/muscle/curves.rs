//! Contractions over time: what an analysis gives and an animator edits.

use std::collections::BTreeSet;

use super::{Channel, MuscleError};
use crate::{
    capture::{FrameRate, Timestamp},
    lift::FaceState,
};

/// Names that the table of curves gives to other columns.
pub const RESERVED: [&str; 5] = ["frame", "timestamp", "state", "error_upper_mm", "error_lower_mm"];
/// What the column of a muscle's channel has after the muscle's name.
pub const CHANNEL_SUFFIX: &str = "_s";
/// More muscles than this are a mistake.
const MOST_MUSCLES: usize = 1000;
/// Contractions beyond this, and errors of more millimetres, are mistakes.
const MOST: f64 = 1000.0;

/// One moment's contractions.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveFrame {
    /// When it is shown, since the take's first frame; 0 or more.
    pub time: Timestamp,
    /// How it came about; `Tracking` throughout for marker captures.
    pub state: FaceState,
    /// One a muscle: 0 relaxed, 1 fully contracted; beyond 1 exaggerated (001 §4.1), below 0 only through edits.
    pub contractions: Vec<f64>,
    /// Mean distance of the markers from where the contractions put them, upper and lower face, millimetres
    /// (001 fig. 5). None where nothing was measured.
    pub error: Option<[f64; 2]>,
}

/// The contractions of a take: `muscles` × frames.
#[derive(Debug, Clone, PartialEq)]
pub struct MuscleCurves {
    muscles: Vec<String>,
    channels: Vec<Channel>,
    rate: FrameRate,
    frames: Vec<CurveFrame>,
}

impl MuscleCurves {
    /// Checks that there are muscles and frames; that names are different, not those of other columns, and printable
    /// ASCII without commas, quotes or `#`; that every muscle has a channel and every frame a finite contraction of
    /// each; that times ascend from 0 on, and errors are lengths.
    pub fn new(
        muscles: Vec<String>,
        channels: Vec<Channel>,
        rate: FrameRate,
        frames: Vec<CurveFrame>,
    ) -> Result<Self, MuscleError> {
        let wrong = |reason: String| Err(MuscleError::Curves { reason });
        if muscles.is_empty() || frames.is_empty() {
            return wrong(format!("{} muscles and {} frames", muscles.len(), frames.len()));
        }
        check_names(&muscles).map_err(|reason| MuscleError::Curves { reason })?;
        if channels.len() != muscles.len() {
            return wrong(format!("{} channels for {} muscles", channels.len(), muscles.len()));
        }
        if rate.numerator == 0 || rate.denominator == 0 {
            return wrong(format!("a rate of {}/{}", rate.numerator, rate.denominator));
        }
        let mut before = Timestamp(-1);
        for (number, frame) in (1..).zip(&frames) {
            if frame.contractions.len() != muscles.len() {
                let found = frame.contractions.len();
                return wrong(format!(
                    "frame {number} has {found} contractions for {} muscles",
                    muscles.len()
                ));
            }
            if let Some(at) = frame.contractions.iter().position(|value| !(-MOST..=MOST).contains(value)) {
                return wrong(format!("{} is {} in frame {number}", muscles[at], frame.contractions[at]));
            }
            if frame.time <= before {
                let (this, last) = (frame.time.seconds(), before.seconds());
                return wrong(if number == 1 {
                    format!("the first frame is at {this} s, before 0")
                } else {
                    format!("frame {number} at {this} s does not come after the {last} s of the one before")
                });
            }
            before = frame.time;
            let is_length = |value: &f64| (0.0..=MOST).contains(value);
            if !frame.error.iter().flatten().all(is_length) {
                return wrong(format!("a marker error in frame {number} is no length"));
            }
        }
        Ok(Self { muscles, channels, rate, frames })
    }

    /// Their names, in the order of the contractions.
    pub fn muscles(&self) -> &[String] {
        &self.muscles
    }

    /// How far each muscle can be believed.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// The nominal rate; frames have their own times.
    pub fn rate(&self) -> FrameRate {
        self.rate
    }

    /// By ascending time; at least one.
    pub fn frames(&self) -> &[CurveFrame] {
        &self.frames
    }

    /// One muscle's contractions, a value a frame.
    pub fn track(&self, muscle: usize) -> impl Iterator<Item = f64> + '_ {
        self.frames.iter().map(move |frame| frame.contractions[muscle])
    }

    /// The frame that is shown at `time`, from 0; before the first frame the first.
    pub fn frame_at(&self, time: Timestamp) -> usize {
        self.frames.partition_point(|frame| frame.time <= time).saturating_sub(1)
    }

    /// The same take with contractions that `change` has been at, under other channels, one a muscle.
    pub(super) fn edited(
        mut self,
        channels: Vec<Channel>,
        mut change: impl FnMut(&mut [f64]),
    ) -> Result<Self, MuscleError> {
        for frame in &mut self.frames {
            change(&mut frame.contractions);
        }
        Self::new(self.muscles, channels, self.rate, self.frames)
    }
}

/// Refuses names that the columns of a table cannot have.
pub(super) fn check_names(muscles: &[String]) -> Result<(), String> {
    if muscles.len() > MOST_MUSCLES {
        return Err(format!("{} muscles; {MOST_MUSCLES} are allowed", muscles.len()));
    }
    let mut seen = BTreeSet::new();
    for name in muscles {
        let fits = |byte: u8| matches!(byte, b' '..=b'~') && !matches!(byte, b',' | b'"' | b'#');
        if name.is_empty() || name.trim() != name || !name.bytes().all(fits) {
            return Err(format!("the muscle's name {name:?} cannot name a column"));
        }
        if RESERVED.contains(&name.as_str()) {
            return Err(format!("a muscle is named {name}, as another column is"));
        }
        if !seen.insert(name.as_str()) {
            return Err(format!("the muscle {name} is there twice"));
        }
    }
    let clash = |name: &&String| name.strip_suffix(CHANNEL_SUFFIX).is_some_and(|stem| seen.contains(stem));
    match muscles.iter().find(clash) {
        Some(name) => Err(format!("the muscle {name} is named as the channel of another")),
        None => Ok(()),
    }
}

/// The rate that frames at these times, ascending, have on average; 25 of fewer than two.
pub(super) fn mean_rate(times: &[Timestamp]) -> FrameRate {
    match times {
        [first, .., last] => {
            FrameRate::nearest((times.len() - 1) as f64 / (last.seconds() - first.seconds()))
        }
        _ => FrameRate::nearest(f64::NAN),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// 25 frames a second.
    pub fn curves(muscles: &[&str], rows: &[&[f64]]) -> MuscleCurves {
        let rate = FrameRate { numerator: 25, denominator: 1 };
        let frames = (0..).zip(rows).map(|(k, row)| CurveFrame {
            time: rate.tick(k),
            state: FaceState::Tracking,
            contractions: row.to_vec(),
            error: None,
        });
        let names = muscles.iter().map(|name| (*name).to_owned()).collect();
        MuscleCurves::new(names, vec![Channel::Measured; muscles.len()], rate, frames.collect()).unwrap()
    }

    fn said(change: impl FnOnce(&mut MuscleCurves)) -> String {
        let mut made = curves(&["jawOpen", "cheekPuff"], &[&[0.0, 1.0], &[0.5, 1.5]]);
        change(&mut made);
        MuscleCurves::new(made.muscles, made.channels, made.rate, made.frames).unwrap_err().to_string()
    }

    #[test]
    fn what_does_not_fit_together_is_refused() {
        assert!(said(|c| c.frames.clear()).contains("2 muscles and 0 frames"));
        assert!(said(|c| c.muscles[1] = "jawOpen".into()).contains("jawOpen is there twice"));
        assert!(said(|c| c.muscles[1] = "jawOpen_s".into()).contains("jawOpen_s"));
        assert!(said(|c| c.muscles[1] = "state".into()).contains("state"));
        for name in ["", " a", "a,b", "a\"", "a#", "é", "a\n"] {
            assert!(said(|c| c.muscles[1] = name.into()).contains("cannot name a column"), "{name}");
        }
        assert!(said(|c| c.channels.truncate(1)).contains("1 channels for 2 muscles"));
        assert!(said(|c| c.rate.denominator = 0).contains("25/0"));
        assert!(said(|c| c.frames[1].contractions.truncate(1)).contains("frame 2 has 1 contractions"));
        assert!(said(|c| c.frames[1].contractions[0] = f64::NAN).contains("jawOpen is NaN in frame 2"));
        assert!(said(|c| c.frames[1].time = Timestamp(0)).contains("frame 2 at 0 s"));
        assert!(said(|c| c.frames[0].time = Timestamp(-5)).contains("before 0"));
        assert!(said(|c| c.frames[0].error = Some([1.0, -1.0])).contains("no length"));
    }

    #[test]
    fn frames_are_found_by_their_times() {
        let made = curves(&["jawOpen"], &[&[0.0], &[0.5], &[1.0]]);
        let found = [-1, 0, 39_999_999, 40_000_000, i64::MAX].map(|time| made.frame_at(Timestamp(time)));
        assert_eq!(found, [0, 0, 0, 1, 2]);
        assert_eq!(made.track(0).collect::<Vec<_>>(), [0.0, 0.5, 1.0]);
    }

    #[test]
    fn the_mean_rate_is_the_fraction_it_stands_for() {
        let rate = FrameRate { numerator: 30000, denominator: 1001 };
        let times: Vec<_> = (0..9).map(|k| rate.tick(k)).collect();
        assert_eq!(mean_rate(&times), rate);
        assert_eq!(mean_rate(&times[..1]), FrameRate { numerator: 25, denominator: 1 });
    }
}
