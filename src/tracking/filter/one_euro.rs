//! The One-Euro filter (Casiez, Roussel and Vogel, CHI 2012): a low-pass whose cutoff rises with speed.

use nalgebra::SVector;

use crate::capture::Timestamp;

/// Cutoff of the speed's own low-pass, hertz; the value its authors recommend.
const SPEED_CUTOFF: f64 = 1.0;

/// Where to stand between steady and quick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OneEuroSettings {
    /// Cutoff at rest, hertz: lower is steadier.
    pub minimum_cutoff: f64,
    /// Hertz gained per unit of speed (signal units per second): higher lags less.
    pub beta: f64,
}

/// The filter of one signal of `N` channels that move together: one cutoff from their joint speed.
#[derive(Debug, Clone)]
pub struct OneEuro<const N: usize> {
    settings: OneEuroSettings,
    state: Option<State<N>>,
}

#[derive(Debug, Clone)]
struct State<const N: usize> {
    time: Timestamp,
    value: SVector<f64, N>,
    velocity: SVector<f64, N>,
}

impl<const N: usize> OneEuro<N> {
    /// A filter without history: the first value passes unchanged.
    pub fn new(settings: OneEuroSettings) -> Self {
        Self { settings, state: None }
    }

    /// Forgets the past.
    pub fn reset(&mut self) {
        self.state = None;
    }

    /// The steadied value at `time`; a time that does not advance returns the last value.
    pub fn filter(&mut self, time: Timestamp, value: SVector<f64, N>) -> SVector<f64, N> {
        let Some(state) = &mut self.state else {
            self.state = Some(State { time, value, velocity: SVector::zeros() });
            return value;
        };
        let interval = Timestamp(time.0 - state.time.0).seconds();
        if interval <= 0.0 {
            return state.value;
        }
        let velocity = (value - state.value) / interval;
        state.velocity += (velocity - state.velocity) * smoothing(SPEED_CUTOFF, interval);
        let cutoff = self.settings.minimum_cutoff + self.settings.beta * state.velocity.norm();
        state.value += (value - state.value) * smoothing(cutoff, interval);
        state.time = time;
        state.value
    }
}

/// The share of the new sample in a first-order low-pass.
pub(super) fn smoothing(cutoff: f64, interval: f64) -> f64 {
    let ratio = std::f64::consts::TAU * cutoff * interval;
    ratio / (ratio + 1.0)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector1;

    use super::*;

    #[test]
    fn at_rest_it_is_the_closed_form_of_a_first_order_low_pass() {
        // With beta = 0 a unit step approaches 1 as 1 - (1 - a)^n.
        let mut filter = OneEuro::<1>::new(OneEuroSettings { minimum_cutoff: 2.0, beta: 0.0 });
        filter.filter(Timestamp(0), Vector1::new(0.0));
        let a = smoothing(2.0, 0.04);
        for n in 1..50 {
            let value = filter.filter(Timestamp(n * 40_000_000), Vector1::new(1.0)).x;
            assert!((value - (1.0 - (1.0 - a).powi(n as i32))).abs() < 1e-12);
        }
    }

    #[test]
    fn quick_motion_lags_less_with_beta() {
        let lag = |beta| {
            let mut filter = OneEuro::<1>::new(OneEuroSettings { minimum_cutoff: 1.0, beta });
            (0..60)
                .map(|n| filter.filter(Timestamp(n * 33_333_333), Vector1::new(n as f64)).x)
                .last()
                .unwrap()
                - 59.0
        };
        assert!(lag(0.5).abs() < lag(0.0).abs() / 4.0);
    }
}
