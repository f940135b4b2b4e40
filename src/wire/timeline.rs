//! A face at any moment, from the frames that arrived.
//!
//! Between two frames it goes straight from one to the other. After the last one, and in long gaps, what was moving runs
//! on for a moment and comes to rest, is held, and then goes to neutral, as where a tracker loses a face.

use super::{HeadMove, MUSCLE_COUNT, WireFrame};
use crate::{capture::Timestamp, lift::FaceState};

/// Gaps up to this long are bridged straight, seconds.
const BRIDGE: f64 = 0.4;
/// Motion without news slows down within this, seconds.
const RUN_ON: f64 = 0.06;
/// Two frames further apart tell of no speed, seconds.
const SPEED: f64 = 0.1;
/// A face without news is held for this long, seconds.
const HOLD: f64 = 0.5;
/// And has then lost two thirds within this, seconds.
const EASE: f64 = 0.4;
/// Before the next frame it is blended into it, seconds.
const BLEND: f64 = 0.25;
/// Frames that are kept: ten hours.
const MOST: usize = 1 << 20;

/// Frames in the order of their times.
#[derive(Debug, Clone, Default)]
pub struct Timeline {
    frames: Vec<WireFrame>,
}

impl Timeline {
    /// Adds a frame, wherever it belongs. Of two at one time the first counts; what is beyond ten hours is left out.
    pub fn add(&mut self, frame: WireFrame) {
        let place = self.frames.partition_point(|other| other.time < frame.time);
        let is_there = self.frames.get(place).is_some_and(|other| other.time == frame.time);
        if !is_there && self.frames.len() < MOST {
            self.frames.insert(place, frame);
        }
    }

    /// Forgets frames that are not needed to show any moment from `time` on.
    pub fn forget_before(&mut self, time: Timestamp) {
        let place = self.frames.partition_point(|frame| frame.time < time);
        self.frames.drain(..place.saturating_sub(2));
    }

    /// By ascending time.
    pub fn frames(&self) -> &[WireFrame] {
        &self.frames
    }

    /// What to show at a moment. Nothing later than that is looked at where nothing later arrived.
    pub fn show(&self, time: Timestamp) -> WireFrame {
        let next = self.frames.partition_point(|frame| frame.time <= time);
        let Some(place) = next.checked_sub(1) else { return WireFrame::neutral(time) };
        let before = &self.frames[place];
        let since = seconds(before.time, time);
        let Some(after) = self.frames.get(next) else { return self.conceal(place, since, time) };
        let gap = seconds(before.time, after.time);
        if gap <= BRIDGE {
            return before.towards(after, since / gap, time);
        }
        let hidden = self.conceal(place, since, time);
        let left = gap - since;
        if left >= BLEND { hidden } else { hidden.towards(after, 1.0 - left / BLEND, time) }
    }

    /// `since` seconds after a frame of which nothing more is known.
    fn conceal(&self, place: usize, since: f64, time: Timestamp) -> WireFrame {
        let last = &self.frames[place];
        let mut shown = WireFrame { time, ..last.clone() };
        let before = place.checked_sub(1).map(|before| &self.frames[before]);
        if let Some(before) = before.filter(|before| seconds(before.time, last.time) <= SPEED) {
            // x + v ∫₀ᵗ e^(−s/τ) ds
            let reach = RUN_ON * (1.0 - (-since / RUN_ON).exp()) / seconds(before.time, last.time);
            let run_on = |from: f64, to: f64| to + (to - from) * reach;
            shown.contractions = std::array::from_fn::<f64, MUSCLE_COUNT, _>(|k| {
                let (from, to) = (before.contractions[k], last.contractions[k]);
                // A muscle does not push; edits alone go below 0.
                run_on(from, to).max(to.min(0.0))
            });
            shown.head = HeadMove {
                angles: std::array::from_fn(|k| run_on(before.head.angles[k], last.head.angles[k])),
                shift: std::array::from_fn(|k| run_on(before.head.shift[k], last.head.shift[k])),
            };
        }
        if since <= HOLD {
            return shown;
        }
        let mut neutral = WireFrame::neutral(time);
        neutral.appearance = shown.appearance;
        let mut eased = shown.towards(&neutral, 1.0 - (-(since - HOLD) / EASE).exp(), time);
        eased.state = FaceState::Easing;
        eased
    }
}

impl Extend<WireFrame> for Timeline {
    fn extend<T: IntoIterator<Item = WireFrame>>(&mut self, frames: T) {
        for frame in frames {
            self.add(frame);
        }
    }
}

fn seconds(from: Timestamp, to: Timestamp) -> f64 {
    (to.0.saturating_sub(from.0)) as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(milliseconds: i64, value: f64) -> WireFrame {
        let mut frame = WireFrame::neutral(Timestamp(milliseconds * 1_000_000));
        frame.state = FaceState::Tracking;
        frame.contractions[3] = value;
        frame.head.angles[1] = -value;
        frame
    }

    fn shown(timeline: &Timeline, milliseconds: i64) -> f64 {
        let frame = timeline.show(Timestamp(milliseconds * 1_000_000));
        assert!((frame.contractions[3] + frame.head.angles[1]).abs() < 1e-12);
        frame.contractions[3]
    }

    #[test]
    fn frames_find_their_place_and_count_once() {
        let mut timeline = Timeline::default();
        assert_eq!(timeline.show(Timestamp(5)).state, FaceState::Waiting);
        for (time, value) in [(100, 1.0), (0, 0.0), (200, 2.0), (100, 9.0)] {
            timeline.add(frame(time, value));
        }
        assert_eq!(timeline.frames().len(), 3);
        for (time, wanted) in [(0, 0.0), (50, 0.5), (100, 1.0), (150, 1.5), (200, 2.0)] {
            assert!((shown(&timeline, time) - wanted).abs() < 1e-9, "{time}");
        }
        timeline.forget_before(Timestamp(250_000_000));
        assert_eq!(timeline.frames().len(), 2);
        assert!((shown(&timeline, 200) - 2.0).abs() < 1e-9);
    }

    #[test]
    fn without_news_motion_runs_on_rests_and_eases() {
        let mut timeline = Timeline::default();
        timeline.add(frame(0, 0.40));
        timeline.add(frame(40, 0.44));
        // At 1 a second, 60 ms of it are left.
        assert!((shown(&timeline, 70) - (0.44 + 0.06 * (1.0 - (-0.5_f64).exp()))).abs() < 1e-9);
        assert!((shown(&timeline, 500) - 0.50).abs() < 1e-3);
        let late = timeline.show(Timestamp(2_940_000_000));
        assert!(late.contractions[3].abs() < 0.01 && late.state == FaceState::Easing);
        // What goes out does not go on below 0.
        let mut timeline = Timeline::default();
        timeline.add(frame(0, 0.44));
        timeline.add(frame(40, 0.01));
        assert!(timeline.show(Timestamp(200_000_000)).contractions[3] >= 0.0);
    }

    #[test]
    fn long_gaps_are_held_and_blended_into_what_follows() {
        let mut timeline = Timeline::default();
        for (time, value) in [(0, 1.0), (40, 1.0), (3040, 0.5), (3080, 0.5)] {
            timeline.add(frame(time, value));
        }
        assert!((shown(&timeline, 400) - 1.0).abs() < 1e-9);
        assert!(shown(&timeline, 2700) < 0.02);
        assert!((shown(&timeline, 3039) - 0.5).abs() < 0.01);
        let steps: Vec<f64> = (0..308).map(|k| shown(&timeline, 10 * k)).collect();
        assert!(steps.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.04), "it jumps");
    }
}
