//! Steadying what rests and leaving alone what moves.
//!
//! A blink or a saccade is over in two frames, and any low-pass that calms a resting lid would swallow it. Here the
//! smoothing gives way as a value leaves its smoothed self, and beyond `tolerance` the value passes unchanged.

use nalgebra::SVector;

use super::{ZeroPhase, one_euro::smoothing};
use crate::capture::Timestamp;

/// Bandwidths within which a recorded value is beside a motion.
const BESIDE: f64 = 1.5;

/// The causal filter of one signal of `N` channels.
#[derive(Debug, Clone)]
pub struct Settle<const N: usize> {
    cutoff: f64,
    tolerance: f64,
    last: Option<(Timestamp, SVector<f64, N>)>,
}

impl<const N: usize> Settle<N> {
    /// `cutoff` at rest in hertz; `tolerance` in the signal's unit, above 0.
    pub fn new(cutoff: f64, tolerance: f64) -> Self {
        Self { cutoff, tolerance, last: None }
    }

    /// Forgets the past: the next value passes unchanged.
    pub fn reset(&mut self) {
        self.last = None;
    }

    /// The steadied value at `time`; a time that does not advance returns the last value.
    pub fn filter(&mut self, time: Timestamp, value: SVector<f64, N>) -> SVector<f64, N> {
        let settled = match self.last {
            None => value,
            Some((then, last)) if time.0 <= then.0 => return last,
            Some((then, last)) => {
                let step = value - last;
                let at_rest = smoothing(self.cutoff, Timestamp(time.0 - then.0).seconds());
                last + step * (at_rest + (1.0 - at_rest) * freedom(step.norm(), self.tolerance))
            }
        };
        self.last = Some((time, settled));
        settled
    }
}

/// The same for a recording, without lag: local parabolas of `bandwidth` seconds where the signal rests. Beside a
/// motion the parabolas lean, so what moves counts as moving for a moment before and after.
pub fn settle_recording<const N: usize>(
    times: &[Timestamp],
    signal: &[SVector<f64, N>],
    bandwidth: f64,
    tolerance: f64,
) -> Vec<SVector<f64, N>> {
    let smooth = ZeroPhase::new(times, bandwidth).apply(signal);
    let away: Vec<_> = smooth.iter().zip(signal).map(|(smooth, value)| value - smooth).collect();
    let near = |i: usize, j: usize| Timestamp(times[i].0 - times[j].0).seconds().abs() <= BESIDE * bandwidth;
    let settled = (0..signal.len()).map(|i| {
        let before = (0..=i).rev().take_while(|&j| near(i, j));
        let beside = before.chain((i + 1..signal.len()).take_while(|&j| near(i, j)));
        let farthest = beside.map(|j| away[j].norm()).fold(0.0, f64::max);
        smooth[i] + away[i] * freedom(farthest, tolerance)
    });
    settled.collect()
}

/// The share of a value's distance from its smoothed self that is kept: little while small, all from `tolerance` on.
fn freedom(distance: f64, tolerance: f64) -> f64 {
    (distance / tolerance).min(1.0).powi(2)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector1;

    use super::*;

    fn times(count: i64) -> Vec<Timestamp> {
        (0..count).map(|i| Timestamp(i * 40_000_000)).collect()
    }

    /// Noise of ±0.01 around 0, then a step to 1 that lasts one frame.
    fn spike() -> Vec<Vector1<f64>> {
        let noise = |i: i64| 0.01 * (i as f64 * 2.3).sin();
        (0..40).map(|i| Vector1::new(if i == 30 { 1.0 } else { noise(i) })).collect()
    }

    fn spread(values: &[Vector1<f64>]) -> f64 {
        (values.iter().map(|v| v.x * v.x).sum::<f64>() / values.len() as f64).sqrt()
    }

    #[test]
    fn noise_shrinks_and_one_frame_of_motion_passes_whole() {
        let (times, signal) = (times(40), spike());
        let mut filter = Settle::new(2.0, 0.06);
        let causal: Vec<_> = times.iter().zip(&signal).map(|(&t, &v)| filter.filter(t, v)).collect();
        let recorded = settle_recording(&times, &signal, 0.06, 0.06);
        for settled in [causal, recorded] {
            assert!((settled[30].x - 1.0).abs() < 1e-12);
            assert!(settled[29].x.abs() < 0.02 && settled[31].x.abs() < 0.02, "{}", settled[31].x);
            assert!(spread(&settled[5..25]) < 0.7 * spread(&signal[5..25]));
        }
    }

    #[test]
    fn a_slow_ramp_is_followed_within_a_third_of_the_tolerance() {
        let mut filter = Settle::new(2.0, 0.06);
        for (i, &time) in times(25).iter().enumerate() {
            let value = 0.04 * i as f64;
            let lag = value - filter.filter(time, Vector1::new(value)).x;
            assert!((-1e-12..0.02).contains(&lag), "{lag}");
        }
    }

    #[test]
    fn after_a_reset_the_first_value_passes() {
        let mut filter = Settle::new(1.0, 1.0);
        filter.filter(Timestamp(0), Vector1::new(0.0));
        filter.reset();
        assert!((filter.filter(Timestamp(1), Vector1::new(0.5)).x - 0.5).abs() < 1e-15);
    }
}
