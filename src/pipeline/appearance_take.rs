//! The states of a performer's skin in every frame of a take.

use super::{Motion, PipelineError, appearance_observer::observe};
use crate::{
    appearance::{AppearanceFrame, AppearanceStates, FaceFrame, Region, Skin, lid_state},
    capture::FrameSource,
    lift::Side,
};

/// Classifies a take: a frame of states for each frame of the motion. `source` is the clip from its start.
///
/// Wrinkles are the median of three frames, this one and the two before it, so that a live performer is told the same; lids,
/// whose blinks are short, stay as they are, and go together with their aperture ([`lid_state`]).
pub fn classify_take(
    source: Box<dyn FrameSource>,
    motion: &Motion,
    skin: &Skin,
    frame: &FaceFrame,
    mut progress: impl FnMut(u64),
) -> Result<Vec<AppearanceFrame>, PipelineError> {
    let mut last = [AppearanceStates::default(); 2];
    let mut done = 0;
    observe(source, motion, frame, true, |observed| {
        done += 1;
        progress(done);
        let raw = skin.classify(&observed.samples);
        let mut states = steadied(&last, &raw);
        last = [last[1], raw];
        for (region, side) in [(Region::EyeRight, Side::Right), (Region::EyeLeft, Side::Left)] {
            let closure = observed.motion.expression.eyes.of(side).closure;
            states.set(region, raw.get(region).map(|lid| lid_state(closure as f32, lid)));
        }
        AppearanceFrame { time: observed.motion.timestamp, state: observed.motion.state, states }
    })
}

/// The median of what the last frames show of each region that this one shows.
fn steadied(last: &[AppearanceStates; 2], now: &AppearanceStates) -> AppearanceStates {
    let mut states = AppearanceStates::default();
    for (region, state) in now.iter() {
        let median = state.map(|state| match last.map(|frame| frame.get(region)) {
            [Some(a), Some(b)] => a.min(b).max(a.max(b).min(state)),
            _ => state,
        });
        states.set(region, median);
    }
    states
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_frames_do_not_count_and_steps_come_one_frame_late() {
        let mut last = [AppearanceStates::default(); 2];
        let shown: Vec<Option<f32>> =
            [Some(0.1), Some(0.1), Some(0.9), Some(0.2), None, Some(0.8), Some(0.7), Some(0.9)]
                .into_iter()
                .map(|state| {
                    let mut now = AppearanceStates::default();
                    now.set(Region::Chin, state);
                    let steady = steadied(&last, &now);
                    last = [last[1], now];
                    steady.get(Region::Chin)
                })
                .collect();
        let wanted = [Some(0.1), Some(0.1), Some(0.1), Some(0.2), None, Some(0.8), Some(0.7), Some(0.8)];
        assert_eq!(shown, wanted);
    }
}
