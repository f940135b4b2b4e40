//! From the lids' aperture to how far an eye has closed.
//!
//! Open is the performer's neutral. Closed is learnt, because the network hardly ever shows lids that touch: over five
//! clips it left shut eyes 0.02 to 0.36 of their open aperture.

/// Aperture over the open one below which a take's narrowest frames are a closing and not a squint or a look down.
const CLOSING: f64 = 0.45;
/// Seconds that the narrowest frames together last: one frame of a bad track does not set the range.
const NARROWEST: f64 = 0.08;
/// Lids meet above the narrowest aperture by this share of the open one.
const MARGIN: f64 = 0.08;
/// What counts as closed, as a share of the open aperture: the least and the most that is learnt.
const CLOSED: [f64; 2] = [0.25, 0.45];
/// The same where no closing has been seen.
const UNSEEN: f64 = 0.30;
/// Share of the way to a deeper dip that the causal range goes in each of its frames.
const FOLLOW: f64 = 0.5;
/// Closures around 0 up to about this are noise of the tracker.
const DEAD: f64 = 0.05;
/// Opened as wide as it goes, as a closure.
pub const WIDEST: f64 = -0.4;
/// An eye shuts above this closure …
const SHUT: f64 = 0.82;
/// … and stays shut until it is below this.
const OPENED: f64 = 0.74;
/// How much the other eye has to say in that: both nearly always close together, and a wink differs by far more.
const VOTE: f64 = 0.06;

/// The apertures ([`EyeMeasure::aperture`](super::EyeMeasure)) between which one eye of one performer opens and closes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LidRange {
    open: f64,
    closed: f64,
}

impl LidRange {
    /// The range of an eye that has not been seen to close; `open` is its neutral aperture, above 0.
    pub fn new(open: f64) -> Self {
        Self { open, closed: UNSEEN * open }
    }

    /// The range learnt from all apertures of a take, `interval` seconds apart.
    pub fn of_take(open: f64, apertures: &[f64], interval: f64) -> Self {
        let wanted = (NARROWEST / interval.max(1e-3)).round().max(2.0) as usize;
        let mut sorted = apertures.to_vec();
        sorted.sort_by(f64::total_cmp);
        let narrowest = &sorted[..wanted.min(sorted.len())];
        let mean = narrowest.iter().sum::<f64>() / narrowest.len() as f64;
        // NaN of an empty take is no closing either.
        if mean < CLOSING * open { Self { open, closed: closed_above(mean, open) } } else { Self::new(open) }
    }

    /// Learns from one more frame: a dip below what has been seen closes the range further, nothing widens it.
    pub fn follow(&mut self, aperture: f64) {
        let closed = closed_above(aperture, self.open);
        if closed < self.closed {
            self.closed += (closed - self.closed) * FOLLOW;
        }
    }

    /// The aperture at which the eye counts as open.
    pub fn open(&self) -> f64 {
        self.open
    }

    /// The aperture at which the eye counts as closed.
    pub fn closed(&self) -> f64 {
        self.closed
    }

    /// 0 as in the neutral, 1 closed, below 0 opened wider; calm around 0, and never outside −0.4..=1.
    pub fn closure(&self, aperture: f64) -> f64 {
        let closure = ((self.open - aperture) / (self.open - self.closed)).clamp(WIDEST, 1.0);
        closure.powi(3) / (closure.powi(2) + DEAD.powi(2))
    }
}

fn closed_above(narrowest: f64, open: f64) -> f64 {
    (narrowest + MARGIN * open).clamp(CLOSED[0] * open, CLOSED[1] * open)
}

/// Which eyes are shut, with the hysteresis that lets a blink count once.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Shut([bool; 2]);

impl Shut {
    /// The closures of both eyes as shown: exactly 1 while shut.
    pub(super) fn apply(&mut self, closures: [f64; 2]) -> [f64; 2] {
        for side in [0, 1] {
            let (own, other) = (closures[side], closures[1 - side]);
            let agreed = own + ((other - own) / 2.0).clamp(-VOTE, VOTE);
            self.0[side] = agreed > if self.0[side] { OPENED } else { SHUT };
        }
        [0, 1].map(|side| if self.0[side] { 1.0 } else { closures[side].clamp(WIDEST, 1.0) })
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "a shut eye is exactly 1")]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// An eye that is 0.35 wide while open, seen at these shares of it.
    fn range_of(shares: &[f64]) -> LidRange {
        let apertures: Vec<f64> = shares.iter().map(|share| share * 0.35).collect();
        LidRange::of_take(0.35, &apertures, 0.04)
    }

    #[test]
    fn a_take_with_closings_teaches_the_range_and_one_without_does_not() {
        let mut shares = vec![1.0; 100];
        shares[40..44].fill(0.3);
        assert!((range_of(&shares).closed() / 0.35 - 0.38).abs() < 1e-12);
        shares[40..44].fill(0.5);
        assert_eq!(range_of(&shares), LidRange::new(0.35));
        assert_eq!(range_of(&[]), LidRange::new(0.35));
        // One wild frame.
        shares[40..44].fill(1.0);
        shares[42] = 0.02;
        assert_eq!(range_of(&shares), LidRange::new(0.35));
    }

    #[test]
    fn the_causal_range_follows_deeper_dips_only() {
        let mut range = LidRange::new(0.35);
        for share in [1.0, 0.6, 0.3, 1.3] {
            range.follow(share * 0.35);
        }
        assert_eq!(range, LidRange::new(0.35));
        range.follow(0.02);
        let once = range.closed();
        assert!(once < LidRange::new(0.35).closed() && once > CLOSED[0] * 0.35);
        range.follow(0.3);
        assert!((range.closed() - once).abs() < 1e-15 && (range.open() - 0.35).abs() < 1e-15);
    }

    #[test]
    fn noise_around_the_neutral_nearly_vanishes_and_the_ends_are_exact_after_the_snap() {
        let range = LidRange::new(0.35);
        assert!(range.closure(0.35 * 0.985).abs() < 0.005);
        assert!((range.closure(0.35 * 0.65) - 0.5).abs() < 0.01);
        assert!(range.closure(0.35 * 1.2) < -0.25);
        let shown = Shut::default().apply([range.closure(range.closed()), range.closure(0.0)]);
        assert_eq!(shown, [1.0, 1.0]);
    }

    #[test]
    fn a_shut_eye_stays_shut_through_noise_and_a_wink_shuts_one() {
        let mut shut = Shut::default();
        let mut shown = |both: f64| shut.apply([both; 2])[0] >= 1.0;
        assert_eq!(
            [0.81, 0.83, 0.79, 0.83, 0.75, 0.73, 0.8].map(&mut shown),
            [false, true, true, true, true, false, false]
        );
        let mut shut = Shut::default();
        let winking = shut.apply([0.95, 0.35]);
        assert!(winking[0] >= 1.0 && (winking[1] - 0.35).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn closures_stay_in_their_range(
            open in 1e-6..1e6_f64,
            apertures in prop::collection::vec(
                prop_oneof![
                    -1.0..2.0_f64,
                    prop::num::f64::NORMAL | prop::num::f64::ZERO | prop::num::f64::SUBNORMAL
                        | prop::num::f64::INFINITE
                ],
                1..40,
            ),
        ) {
            let (taken, mut causal, mut shut) = (LidRange::of_take(open, &apertures, 0.04), LidRange::new(open), Shut::default());
            for pair in apertures.windows(2) {
                causal.follow(pair[0]);
                for range in [taken, causal] {
                    let closures = [range.closure(pair[0]), range.closure(pair[1])];
                    for closure in closures.into_iter().chain(shut.apply(closures)) {
                        prop_assert!((WIDEST..=1.0).contains(&closure), "{closure}");
                    }
                }
            }
        }
    }
}
