//! Where the eyes look: both together, and the little by which they converge.
//!
//! The network places each iris by itself, to about half a degree on a webcam picture. Eyes turn together, so what they
//! share is the mean of both, what separates them may only converge, and changes slowly. All angles in degrees here.

use nalgebra::{Vector1, Vector2};

use super::{EyeMeasure, EyeState, Eyes, NeutralEyes};
use crate::{
    capture::Timestamp,
    tracking::filter::{OneEuro, OneEuroSettings, ZeroPhase, settle_recording},
};

/// Above this closure the iris is a guess of the network: it sinks by 3° at once and by 10° while the eye is shut.
const HIDDEN: f64 = 0.55;
/// How far each eye turns inwards at most.
const CONVERGENCE: f64 = 8.0;
/// Farther than this is no reading.
const FARTHEST: f64 = 90.0;
/// Farthest yaw and pitch that are shown.
const YAW: f64 = 40.0;
const PITCH: f64 = 30.0;
/// Causal smoothing, degrees and degrees a second: a saccade of 10° passes by four fifths in its first frame.
const GAZE: OneEuroSettings = OneEuroSettings { minimum_cutoff: 1.5, beta: 0.35 };
const VERGENCE: OneEuroSettings = OneEuroSettings { minimum_cutoff: 0.3, beta: 0.0 };
/// Standard deviations of the zero-phase pass, seconds.
const GAZE_BANDWIDTH: f64 = 0.04;
const VERGENCE_BANDWIDTH: f64 = 0.4;
/// Beyond this off its smoothed self the gaze moves, and is not smoothed.
const GAZE_TOLERANCE: f64 = 2.0;

/// What both eyes do, degrees since the neutral.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Gaze {
    /// Mean yaw and pitch.
    shared: Vector2<f64>,
    /// Half the difference of the yaws: how far each eye turns inwards.
    inwards: f64,
}

impl Gaze {
    /// With the lids' closures, as it is shown.
    pub(super) fn eyes(&self, closures: [f64; 2]) -> Eyes {
        let inwards = self.inwards.clamp(0.0, CONVERGENCE);
        let eye = |closure: f64, yaw: f64| EyeState {
            closure,
            yaw: yaw.clamp(-YAW, YAW).to_radians(),
            pitch: self.shared.y.clamp(-PITCH, PITCH).to_radians(),
        };
        Eyes {
            right: eye(closures[0], self.shared.x + inwards),
            left: eye(closures[1], self.shared.x - inwards),
        }
    }
}

/// Reads the gaze off those eyes whose iris is seen, and keeps the last where neither is.
#[derive(Debug, Clone)]
pub(super) struct GazeHold {
    last: Gaze,
    /// What separates the eyes in the long run.
    usual: f64,
    usually_inwards: OneEuro<1>,
}

impl Default for GazeHold {
    fn default() -> Self {
        Self { last: Gaze::default(), usual: 0.0, usually_inwards: OneEuro::new(VERGENCE) }
    }
}

impl GazeHold {
    pub(super) fn apply(
        &mut self,
        time: Timestamp,
        neutral: &NeutralEyes,
        measures: &[EyeMeasure; 2],
        closures: [f64; 2],
    ) -> Gaze {
        let [right, left] = neutral
            .turns(measures)
            .map(|turn| Vector2::from(turn).map(|angle| angle.to_degrees().clamp(-FARTHEST, FARTHEST)));
        let shows = |side: usize| measures[side].seen && closures[side] <= HIDDEN;
        let both = [shows(0), shows(1)];
        if both == [true, true] {
            let inwards = (right.x - left.x) / 2.0;
            self.last = Gaze { shared: (right + left) / 2.0, inwards };
            // What one eye alone is read with must not be the last frame's noise.
            self.usual = self.usually_inwards.filter(time, Vector1::new(inwards)).x;
            return self.last;
        }
        self.last.inwards = self.usual;
        match both {
            [true, false] => self.last.shared = right - Vector2::x() * self.usual,
            [false, true] => self.last.shared = left + Vector2::x() * self.usual,
            _ => (),
        }
        self.last
    }
}

/// The causal filters.
#[derive(Debug, Clone)]
pub(super) struct CausalGaze {
    shared: OneEuro<2>,
    inwards: OneEuro<1>,
}

impl Default for CausalGaze {
    fn default() -> Self {
        Self { shared: OneEuro::new(GAZE), inwards: OneEuro::new(VERGENCE) }
    }
}

impl CausalGaze {
    pub(super) fn apply(&mut self, time: Timestamp, gaze: Gaze) -> Gaze {
        Gaze {
            shared: self.shared.filter(time, gaze.shared),
            inwards: self.inwards.filter(time, Vector1::new(gaze.inwards)).x,
        }
    }
}

/// Steadies an unbroken stretch of a recording, without lag.
pub(super) fn steady_gaze(times: &[Timestamp], gazes: &mut [Gaze]) {
    let shared: Vec<_> = gazes.iter().map(|gaze| gaze.shared).collect();
    let shared = settle_recording(times, &shared, GAZE_BANDWIDTH, GAZE_TOLERANCE);
    let inwards: Vec<_> = gazes.iter().map(|gaze| Vector1::new(gaze.inwards)).collect();
    let inwards = ZeroPhase::new(times, VERGENCE_BANDWIDTH).apply(&inwards);
    for (gaze, (shared, inwards)) in gazes.iter_mut().zip(shared.into_iter().zip(inwards)) {
        *gaze = Gaze { shared, inwards: inwards.x };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn eye(yaw: f64, pitch: f64) -> EyeMeasure {
        EyeMeasure { aperture: 0.35, yaw: yaw.to_radians(), pitch: pitch.to_radians(), seen: true }
    }

    fn neutral() -> NeutralEyes {
        NeutralEyes::new(&[[eye(0.0, 0.0); 2]])
    }

    /// Yaws of the right and the left eye and their pitch, degrees.
    fn shown(gaze: &Gaze) -> [f64; 3] {
        let eyes = gaze.eyes([0.0; 2]);
        [eyes.right.yaw, eyes.left.yaw, eyes.left.pitch].map(f64::to_degrees)
    }

    fn close(found: [f64; 3], wanted: [f64; 3]) -> bool {
        found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-9)
    }

    #[test]
    fn eyes_turn_together_converge_a_little_and_never_diverge() {
        let read = |right, left| {
            let gaze = GazeHold::default().apply(Timestamp(0), &neutral(), &[right, left], [0.0; 2]);
            shown(&gaze)
        };
        assert!(close(read(eye(13.0, 4.0), eye(7.0, 6.0)), [13.0, 7.0, 5.0]));
        assert!(close(read(eye(7.0, 5.0), eye(13.0, 5.0)), [10.0, 10.0, 5.0]));
        assert!(close(read(eye(20.0, 0.0), eye(-20.0, 0.0)), [8.0, -8.0, 0.0]));
        assert!(close(read(eye(70.0, 50.0), eye(60.0, 60.0)), [40.0, 40.0, 30.0]));
    }

    #[test]
    fn a_shut_eye_follows_the_other_and_two_keep_the_last() {
        let mut hold = GazeHold::default();
        let mut read =
            |right, left, closures| shown(&hold.apply(Timestamp(0), &neutral(), &[right, left], closures));
        assert!(close(read(eye(9.0, 2.0), eye(7.0, 2.0), [0.1, 0.1]), [9.0, 7.0, 2.0]));
        assert!(close(read(eye(50.0, -20.0), eye(12.0, 3.0), [1.0, 0.2]), [14.0, 12.0, 3.0]));
        assert!(close(read(eye(50.0, -20.0), eye(-50.0, -20.0), [1.0, 1.0]), [14.0, 12.0, 3.0]));
    }

    #[test]
    fn a_saccade_keeps_its_edge() {
        let times: Vec<_> = (0..40).map(|i| Timestamp(i * 40_000_000)).collect();
        let step =
            |i: usize| Gaze { shared: Vector2::new(if i < 20 { 0.0 } else { 12.0 }, 0.0), inwards: 0.0 };
        let mut recorded: Vec<_> = (0..40).map(step).collect();
        steady_gaze(&times, &mut recorded);
        assert!(recorded[19].shared.x.abs() < 0.5 && recorded[20].shared.x > 11.5, "{recorded:?}");
        let mut causal = CausalGaze::default();
        let causal: Vec<f64> = (0..40).map(|i| causal.apply(times[i], step(i)).shared.x).collect();
        assert!(causal[20] > 0.75 * 12.0 && causal[21] > 0.93 * 12.0, "{:?}", &causal[20..23]);
    }
}
