//! Lids and gaze of a whole take or frame by frame: their own way past the smoother of the face.

use nalgebra::Vector1;

use super::{
    EyeMeasure, Eyes, LidRange, NeutralEyes,
    closure::Shut,
    gaze::{CausalGaze, GazeHold, steady_gaze},
};
use crate::{
    capture::Timestamp,
    tracking::filter::{Settle, settle_recording},
};

/// Smoothing of lids that hardly move: hertz for a live performer, seconds for a recording.
const LID_CUTOFF: f64 = 2.0;
const LID_BANDWIDTH: f64 = 0.06;
/// A closure that is farther than this off its smoothed self moves, and passes as it is.
const LID_TOLERANCE: f64 = 0.06;

/// The eyes of one live performer, frame by frame.
#[derive(Debug, Clone)]
pub struct CausalEyes {
    neutral: NeutralEyes,
    ranges: [LidRange; 2],
    lids: [Settle<1>; 2],
    state: EyeMemory,
    gaze: CausalGaze,
}

/// What is shown depends on what was shown.
#[derive(Debug, Clone, Default)]
struct EyeMemory {
    shut: Shut,
    hold: GazeHold,
}

impl CausalEyes {
    /// Eyes whose closed aperture is yet to be learnt.
    pub fn new(neutral: NeutralEyes) -> Self {
        let lid = || Settle::new(LID_CUTOFF, LID_TOLERANCE);
        Self {
            neutral,
            ranges: neutral.apertures().map(LidRange::new),
            lids: [lid(), lid()],
            state: EyeMemory::default(),
            gaze: CausalGaze::default(),
        }
    }

    /// Forgets the last frames, as when the face was lost; what has been learnt of the lids stays.
    pub fn reset(&mut self) {
        *self = Self { ranges: self.ranges, ..Self::new(self.neutral) };
    }

    /// What the eyes of one frame show; `measures` of the right and the left.
    pub fn apply(&mut self, time: Timestamp, measures: &[EyeMeasure; 2]) -> Eyes {
        for (range, eye) in self.ranges.iter_mut().zip(measures).filter(|(_, eye)| eye.seen) {
            range.follow(eye.aperture);
        }
        let mut closures = closures(&self.ranges, measures);
        for (closure, lid) in closures.iter_mut().zip(&mut self.lids) {
            *closure = lid.filter(time, Vector1::new(*closure)).x;
        }
        let gaze = self.state.hold.apply(time, &self.neutral, measures, closures);
        self.gaze.apply(time, gaze).eyes(self.state.shut.apply(closures))
    }
}

/// Consecutive frames of a recording in which a face is seen.
#[derive(Debug, Clone, Default)]
pub struct EyeRun {
    /// When.
    pub times: Vec<Timestamp>,
    /// One pair a frame, the right eye first.
    pub measures: Vec<[EyeMeasure; 2]>,
}

/// The eyes of a recording, one a frame for each of its runs. The range of the lids is that of the whole take; with
/// `steady`, resting lids and gaze are smoothed without lag.
pub fn eyes_of_recording(neutral: &NeutralEyes, runs: &[EyeRun], steady: bool) -> Vec<Vec<Eyes>> {
    let ranges = ranges_of_take(neutral, runs);
    runs.iter().map(|run| eyes_of_run(neutral, &ranges, run, steady)).collect()
}

fn ranges_of_take(neutral: &NeutralEyes, runs: &[EyeRun]) -> [LidRange; 2] {
    let lasting: f64 = runs
        .iter()
        .filter_map(|run| Some(Timestamp(run.times.last()?.0 - run.times.first()?.0).seconds()))
        .sum();
    let intervals: usize = runs.iter().map(|run| run.times.len().saturating_sub(1)).sum();
    let interval = lasting / intervals.max(1) as f64;
    let measures = || runs.iter().flat_map(|run| &run.measures);
    let open = neutral.apertures();
    [0, 1].map(|side| {
        let seen: Vec<f64> =
            measures().map(|eyes| eyes[side]).filter(|eye| eye.seen).map(|eye| eye.aperture).collect();
        LidRange::of_take(open[side], &seen, interval)
    })
}

fn eyes_of_run(neutral: &NeutralEyes, ranges: &[LidRange; 2], run: &EyeRun, steady: bool) -> Vec<Eyes> {
    let mut lids: Vec<[f64; 2]> = run.measures.iter().map(|eyes| closures(ranges, eyes)).collect();
    if steady {
        for side in [0, 1] {
            let signal: Vec<_> = lids.iter().map(|closures| Vector1::new(closures[side])).collect();
            let settled = settle_recording(&run.times, &signal, LID_BANDWIDTH, LID_TOLERANCE);
            for (closures, settled) in lids.iter_mut().zip(settled) {
                closures[side] = settled.x;
            }
        }
    }
    let mut state = EyeMemory::default();
    let mut gazes: Vec<_> = (run.times.iter().zip(&run.measures).zip(&lids))
        .map(|((&time, eyes), &closures)| state.hold.apply(time, neutral, eyes, closures))
        .collect();
    if steady {
        steady_gaze(&run.times, &mut gazes);
    }
    gazes.iter().zip(lids).map(|(gaze, closures)| gaze.eyes(state.shut.apply(closures))).collect()
}

/// Closures of both eyes; one outside the picture does as the other.
fn closures(ranges: &[LidRange; 2], measures: &[EyeMeasure; 2]) -> [f64; 2] {
    let own = [0, 1].map(|side| ranges[side].closure(measures[side].aperture));
    [0, 1].map(|side| if measures[side].seen || !measures[1 - side].seen { own[side] } else { own[1 - side] })
}
