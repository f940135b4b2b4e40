//! Smoothing of a finished recording: at every instant a parabola fitted to its neighbourhood.
//!
//! A local quadratic fit with Gaussian weights in time has no lag, keeps the height of peaks to second order (a blink
//! is a peak), and takes frames at whatever times they have.

use nalgebra::{Matrix3, SVector, Vector3};

use crate::capture::Timestamp;

/// Neighbours beyond this many bandwidths weigh less than 1 % and are left out.
const REACH: f64 = 3.0;

/// The weights of one clip's frames, built once and applied to any number of signals.
#[derive(Debug, Clone)]
pub struct ZeroPhase {
    windows: Vec<Window>,
}

#[derive(Debug, Clone)]
struct Window {
    first: usize,
    weights: Vec<f64>,
}

impl ZeroPhase {
    /// `times` ascend; `bandwidth` is the Gaussian's standard deviation in seconds, and 0 smooths nothing.
    pub fn new(times: &[Timestamp], bandwidth: f64) -> Self {
        let windows = (0..times.len()).map(|centre| Window::new(times, centre, bandwidth)).collect();
        Self { windows }
    }

    /// The smoothed signal; `signal` has one value for each time given to [`ZeroPhase::new`].
    pub fn apply<const N: usize>(&self, signal: &[SVector<f64, N>]) -> Vec<SVector<f64, N>> {
        self.windows
            .iter()
            .map(|window| {
                window
                    .weights
                    .iter()
                    .zip(&signal[window.first..])
                    .map(|(&weight, value)| value * weight)
                    .sum()
            })
            .collect()
    }
}

impl Window {
    fn new(times: &[Timestamp], centre: usize, bandwidth: f64) -> Self {
        let offset = |i: usize| Timestamp(times[i].0 - times[centre].0).seconds();
        let reach = REACH * bandwidth;
        let first = (0..centre).rev().take_while(|&i| -offset(i) <= reach).last().unwrap_or(centre);
        let last = (centre + 1..times.len()).take_while(|&i| offset(i) <= reach).last().unwrap_or(centre);
        if last - first < 3 {
            return Self { first: centre, weights: vec![1.0] };
        }
        let rows: Vec<(Vector3<f64>, f64)> = (first..=last)
            .map(|i| {
                let t = offset(i) / bandwidth;
                (Vector3::new(1.0, t, t * t), (-0.5 * t * t).exp())
            })
            .collect();
        let normal: Matrix3<f64> = rows.iter().map(|(row, weight)| row * row.transpose() * *weight).sum();
        // The value at the centre is the fit's constant term.
        let Some(inverse) = normal.try_inverse() else {
            return Self { first: centre, weights: vec![1.0] };
        };
        let constant = inverse.row(0).transpose();
        Self { first, weights: rows.iter().map(|(row, weight)| constant.dot(row) * weight).collect() }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector1;

    use super::*;

    fn uneven_times() -> Vec<Timestamp> {
        (0..40).map(|i| Timestamp(i * 40_000_000 + (i % 3) * 7_000_000)).collect()
    }

    #[test]
    fn parabolas_pass_unchanged_even_at_uneven_times_and_ends() {
        let times = uneven_times();
        let signal: Vec<_> =
            times.iter().map(|t| Vector1::new(3.0 - 2.0 * t.seconds() + 5.0 * t.seconds().powi(2))).collect();
        for (smooth, value) in ZeroPhase::new(&times, 0.06).apply(&signal).iter().zip(&signal) {
            assert!((smooth - value).norm() < 1e-9);
        }
    }

    #[test]
    fn a_symmetric_peak_stays_where_it_is_and_noise_shrinks() {
        let times: Vec<_> = (0..81).map(|i| Timestamp(i * 40_000_000)).collect();
        let peak: Vec<_> =
            times.iter().map(|t| Vector1::new((-(t.seconds() - 1.6).powi(2) / 0.02).exp())).collect();
        let smooth = ZeroPhase::new(&times, 0.05).apply(&peak);
        let highest = (0..81).max_by(|&a, &b| smooth[a].x.total_cmp(&smooth[b].x)).unwrap();
        assert_eq!(highest, 40);
        let noise: Vec<_> = (0..81).map(|i| Vector1::new(if i % 2 == 0 { 1.0 } else { -1.0 })).collect();
        assert!(ZeroPhase::new(&times, 0.05).apply(&noise)[40].x.abs() < 0.2);
    }

    #[test]
    fn no_bandwidth_or_too_few_frames_change_nothing() {
        let times = uneven_times();
        let signal: Vec<_> = (0..times.len()).map(|i| Vector1::new((i * i % 7) as f64)).collect();
        assert_eq!(ZeroPhase::new(&times, 0.0).apply(&signal), signal);
        assert_eq!(ZeroPhase::new(&times[..2], 1.0).apply(&signal[..2]), signal[..2]);
    }
}
