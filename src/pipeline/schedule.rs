//! Which frame a constant-rate output shows at each of its ticks.
//!
//! A video file and a point cache have one rate, a clip may not. Each tick shows the frame whose time is nearest, so a
//! clip of constant rate is passed through frame by frame.

use crate::capture::{FrameRate, Timestamp};

/// For each tick the index into `times`, which ascend.
pub fn constant_rate(times: &[Timestamp], rate: FrameRate) -> Vec<usize> {
    let Some(last) = times.last() else { return Vec::new() };
    let last_tick = (last.seconds() * rate.per_second()).round() as u64;
    let mut shown = 0;
    (0..=last_tick)
        .map(|tick| {
            let distance = |i: usize| (times[i].0 - rate.tick(tick).0).abs();
            while shown + 1 < times.len() && distance(shown + 1) <= distance(shown) {
                shown += 1;
            }
            shown
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_constant_rate_passes_through_even_when_times_are_rounded() {
        let rate = FrameRate { numerator: 30000, denominator: 1001 };
        let times: Vec<_> =
            (0..500).map(|i| Timestamp((rate.tick(i).0 as f64 / 1e6).round() as i64 * 1_000_000)).collect();
        assert_eq!(constant_rate(&times, rate), (0..500).collect::<Vec<_>>());
        assert!(constant_rate(&[], rate).is_empty());
        assert_eq!(constant_rate(&[Timestamp(0)], rate), [0]);
    }

    proptest! {
        #[test]
        fn a_variable_rate_keeps_its_length_and_order(steps in prop::collection::vec(1_i64..200_000_000, 1..80)) {
            let times: Vec<_> = steps
                .iter()
                .scan(0, |now, step| { let time = Timestamp(*now); *now += step; Some(time) })
                .collect();
            let rate = FrameRate { numerator: 25, denominator: 1 };
            let shown = constant_rate(&times, rate);
            prop_assert!(shown.windows(2).all(|pair| pair[0] <= pair[1]));
            prop_assert_eq!(shown[0], 0);
            let length = rate.tick(shown.len() as u64 - 1).0 - times[times.len() - 1].0;
            prop_assert!(length.abs() <= rate.tick(1).0);
        }
    }
}
