//! Frames as whole numbers, and back: how coarsely each channel is told.

use std::{ops::Range, sync::LazyLock};

use sha2::{Digest, Sha256};

use super::{HeadMove, MUSCLE_COUNT, WireFrame};
use crate::{
    appearance::{AppearanceStates, REGION_COUNT, Region},
    capture::Timestamp,
    lift::FaceState,
    muscle::ARKIT_SHAPES,
};

/// The channels of the head's angles and shift.
pub const HEAD_CHANNELS: Range<usize> = HEAD..APPEARANCE;
const HEAD_COUNT: usize = 6;
const HEAD: usize = MUSCLE_COUNT;
const APPEARANCE: usize = HEAD + HEAD_COUNT;
/// The frame's [`FaceState`].
const STATE: usize = APPEARANCE + REGION_COUNT;
/// Values of a frame: 51 contractions, 6 of the head, 11 states of the skin, and how the frame came about.
pub const CHANNEL_COUNT: usize = STATE + 1;
/// A frame in whole numbers.
pub type Levels = [i32; CHANNEL_COUNT];
/// A frame before it is rounded.
pub type Steps = [f64; CHANNEL_COUNT];

/// No level is further from 0.
pub const MOST_LEVEL: i32 = 1 << 16;
/// Levels of a skin state: 0 is none, 1 to 16 are 0..=1.
const SKIN_LEVELS: f32 = 15.0;
/// A step is counted in 2⁻²⁰.
const UNIT: f64 = (1 << 20) as f64;
/// A value keeps its level until it is this many steps away: less flicker, fewer bits.
const HYSTERESIS: f64 = 0.6;
/// A value between two frames that are told lies where they put it, unless it is this many steps away.
const DEAD_ZONE: f64 = 1.0;

/// How far each muscle, fully contracted, moves the handles of the average face: µm, root mean square, both sides alike.
#[rustfmt::skip]
const REACH: [u32; MUSCLE_COUNT] = [
    797, 716, 420, 417, 398, 619, 317, 797, 716, 420, 417, 398, 619, 317, 4026, 3394, 3394, 14322, 10428, 4166, 4587,
    7299, 7299, 3828, 3828, 1154, 1154, 1724, 1724, 2015, 2015, 2472, 2405, 3117, 1132, 1018, 1018, 1039, 1039, 2013,
    2013, 1165, 1165, 1409, 1566, 1566, 6196, 1424, 1424, 3087, 3087,
];
/// The same for the head: µm a radian, and a canthal distance.
const HEAD_REACH: u32 = 90_000;
/// What moves little skin is still seen: lids and gaze (a degree) are told in steps of this at most, in 2⁻²⁰.
const MOST_STEP_EYES: u32 = (1 << 20) / 32;
/// All others in steps of this at most.
const MOST_STEP: u32 = (1 << 20) / 10;

/// Names every channel, its reach and its limits: two ends with different ones do not understand each other.
static CHANNELS: LazyLock<u32> = LazyLock::new(|| {
    let mut hash = Sha256::new();
    for (name, reach) in ARKIT_SHAPES.iter().zip(REACH) {
        hash.update(name.as_bytes());
        hash.update(reach.to_be_bytes());
    }
    for number in [HEAD_REACH, MOST_STEP_EYES, MOST_STEP, SKIN_LEVELS as u32] {
        hash.update(number.to_be_bytes());
    }
    for region in Region::ALL {
        hash.update(region.name().as_bytes());
    }
    let digest = hash.finalize();
    u32::from_be_bytes([digest[0], digest[1], digest[2], digest[3]])
});

/// The number that stands for this table of channels.
pub fn channels() -> u32 {
    *CHANNELS
}

/// Turns frames into levels; `precision` is what a step moves the face by, µm, root mean square.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quantiser {
    steps: [u32; APPEARANCE],
}

impl Quantiser {
    /// A precision of 0 counts as 1.
    pub fn new(precision: u16) -> Self {
        let wanted = |reach: u32| ((u64::from(precision.max(1)) << 20) / u64::from(reach)).max(1);
        let step = |channel: usize| {
            let (reach, most) = match REACH.get(channel) {
                Some(reach) if ARKIT_SHAPES[channel].starts_with("eye") => (*reach, MOST_STEP_EYES),
                Some(reach) => (*reach, MOST_STEP),
                None => (HEAD_REACH, MOST_STEP),
            };
            wanted(reach).min(u64::from(most)) as u32
        };
        Self { steps: std::array::from_fn(step) }
    }

    /// A frame's values, in steps.
    pub fn steps(&self, frame: &WireFrame) -> Steps {
        let mut steps = [0.0; CHANNEL_COUNT];
        let values = frame.contractions.iter().chain(&frame.head.angles).chain(&frame.head.shift);
        for ((to, value), step) in steps.iter_mut().zip(values).zip(self.steps) {
            let exact = value * UNIT / f64::from(step);
            if exact.is_finite() {
                *to = exact.clamp(f64::from(-MOST_LEVEL), f64::from(MOST_LEVEL));
            }
        }
        if let Some(states) = &frame.appearance {
            for (to, (_, state)) in steps[APPEARANCE..STATE].iter_mut().zip(states.iter()) {
                *to = state.map_or(0.0, |state| f64::from(1.0 + (state * SKIN_LEVELS).round()));
            }
        }
        steps[STATE] = STATES.iter().position(|state| *state == frame.state).unwrap_or(0) as f64;
        steps
    }

    /// The frame that levels stand for.
    pub fn frame(&self, time: Timestamp, levels: &Levels) -> WireFrame {
        let value = |channel: usize| f64::from(levels[channel]) * f64::from(self.steps[channel]) / UNIT;
        let mut states = AppearanceStates::default();
        for (region, level) in Region::ALL.into_iter().zip(&levels[APPEARANCE..STATE]) {
            states.set(region, (*level > 0).then(|| (*level - 1) as f32 / SKIN_LEVELS));
        }
        let some = levels[APPEARANCE..STATE].iter().any(|level| *level > 0);
        WireFrame {
            time,
            state: STATES[levels[STATE].clamp(0, STATES.len() as i32 - 1) as usize],
            contractions: std::array::from_fn(value),
            head: HeadMove {
                angles: std::array::from_fn(|k| value(HEAD + k)),
                shift: std::array::from_fn(|k| value(HEAD + 3 + k)),
            },
            appearance: some.then_some(states),
        }
    }
}

/// The levels of a frame. They stay at those of the frame before where they hardly leave them; what is relaxed is so
/// exactly.
pub fn levels_after(steps: &Steps, before: Option<&Levels>) -> Levels {
    std::array::from_fn(|k| match before.map(|before| before[k]) {
        Some(kept) if steps[k] != 0.0 && (steps[k] - f64::from(kept)).abs() <= HYSTERESIS => kept,
        _ => steps[k].round() as i32,
    })
}

/// The levels of a frame between two that are told, which put it at `between`.
pub fn levels_between(steps: &Steps, between: &Levels) -> Levels {
    std::array::from_fn(|k| {
        let slack = if k < APPEARANCE { DEAD_ZONE } else { 0.0 };
        let is_near = (steps[k] - f64::from(between[k])).abs() <= slack;
        if is_near { between[k] } else { steps[k].round() as i32 }
    })
}

/// In the order of their levels.
const STATES: [FaceState; 5] =
    [FaceState::Tracking, FaceState::Holding, FaceState::Easing, FaceState::Blending, FaceState::Waiting];

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::muscle::{FaceBasis, MuscleBasis};

    #[test]
    fn the_reach_is_that_of_the_basis() {
        let basis = MuscleBasis::arkit();
        let reach = |name: &str| {
            let vectors = &basis.elements[basis.index(name).unwrap()].vectors;
            (vectors.iter().map(nalgebra::Matrix::norm_squared).sum::<f64>() / vectors.len() as f64).sqrt()
                * 1000.0
        };
        assert_eq!(FaceBasis::own(basis).count(), MUSCLE_COUNT);
        for (name, table) in ARKIT_SHAPES.iter().zip(REACH) {
            let other = crate::muscle::other_side(name).unwrap_or_else(|| (*name).to_owned());
            let wanted = f64::midpoint(reach(name), reach(&other));
            assert!((f64::from(table) - wanted).abs() < 2.0, "{name}: {table} is {wanted}");
        }
    }

    #[test]
    fn a_level_stays_until_it_is_left() {
        let quantiser = Quantiser::new(100);
        let jaw = ARKIT_SHAPES.iter().position(|name| *name == "jawOpen").unwrap();
        let mut frame = WireFrame::neutral(Timestamp(0));
        let step = f64::from(quantiser.steps[jaw]) / UNIT;
        let mut before = None;
        let mut seen = Vec::new();
        for steps in [1.0, 1.55, 0.45, 0.39, 1.59, 1.61, 0.0] {
            frame.contractions[jaw] = steps * step;
            let levels = levels_after(&quantiser.steps(&frame), before.as_ref());
            seen.push(levels[jaw]);
            before = Some(levels);
        }
        assert_eq!(seen, [1, 1, 1, 0, 2, 2, 0]);
    }

    #[test]
    fn what_is_no_number_is_relaxed_and_what_is_too_large_is_held() {
        let mut frame = WireFrame::neutral(Timestamp(0));
        frame.contractions[0] = f64::NAN;
        frame.contractions[1] = 1e300;
        frame.contractions[2] = f64::NEG_INFINITY;
        let levels = levels_after(&Quantiser::new(0).steps(&frame), None);
        assert_eq!(levels[..3], [0, MOST_LEVEL, 0]);
    }

    proptest! {
        #[test]
        fn frames_come_back_within_a_step(
            values in prop::collection::vec(-0.5_f64..1.5, MUSCLE_COUNT + 6),
            skin in prop::collection::vec(prop::option::of(0.0_f32..=1.0), REGION_COUNT),
            state in 0_usize..5,
            precision in 10_u16..1000,
        ) {
            let mut frame = WireFrame::neutral(Timestamp(7));
            frame.contractions.copy_from_slice(&values[..MUSCLE_COUNT]);
            frame.head.angles.copy_from_slice(&values[HEAD..HEAD + 3]);
            frame.head.shift.copy_from_slice(&values[HEAD + 3..]);
            frame.state = STATES[state];
            let mut states = AppearanceStates::default();
            for (region, state) in Region::ALL.into_iter().zip(&skin) {
                states.set(region, *state);
            }
            frame.appearance = Some(states);
            let quantiser = Quantiser::new(precision);
            let levels = levels_after(&quantiser.steps(&frame), None);
            let back = quantiser.frame(frame.time, &levels);
            for k in 0..MUSCLE_COUNT {
                let step = f64::from(quantiser.steps[k]) / UNIT;
                prop_assert!((back.contractions[k] - frame.contractions[k]).abs() <= 0.5001 * step);
                prop_assert!(step <= 0.1);
            }
            prop_assert_eq!(back.state, frame.state);
            match back.appearance {
                None => prop_assert!(skin.iter().all(Option::is_none)),
                Some(back) => for ((region, got), wanted) in back.iter().zip(&skin) {
                    prop_assert_eq!(got.is_some(), wanted.is_some(), "{:?}", region);
                    prop_assert!((got.unwrap_or(0.0) - wanted.unwrap_or(0.0)).abs() < 0.04);
                },
            }
            // And once more, they are the same levels.
            prop_assert_eq!(levels_after(&quantiser.steps(&back), None), levels);
        }
    }
}
