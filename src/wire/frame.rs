//! What one moment looks like to whoever sends it and whoever receives it.

use super::HeadMove;
use crate::{
    appearance::AppearanceStates,
    capture::Timestamp,
    lift::FaceState,
    muscle::{ARKIT_SHAPES, FaceAngles},
};

/// Contractions that are sent: ARKit's shapes in the order of `ARKIT_SHAPES`, but the last of them, `tongueOut`, which a
/// surface cannot show.
pub const MUSCLE_COUNT: usize = ARKIT_SHAPES.len() - 1;

/// One moment of a performance, free of the performer.
#[derive(Debug, Clone, PartialEq)]
pub struct WireFrame {
    /// Since the performance's first frame; what arrives is rounded to a tenth of a millisecond.
    pub time: Timestamp,
    /// How it came about.
    pub state: FaceState,
    /// 0 relaxed, 1 contracted. Blinks, widened eyes and `eyeLook…` hold lids and gaze.
    pub contractions: [f64; MUSCLE_COUNT],
    /// The head since the neutral.
    pub head: HeadMove,
    /// How the skin looks; `None` where nobody tells, which costs next to nothing.
    pub appearance: Option<AppearanceStates>,
}

impl WireFrame {
    /// The neutral face.
    pub fn neutral(time: Timestamp) -> Self {
        Self {
            time,
            state: FaceState::Waiting,
            contractions: [0.0; MUSCLE_COUNT],
            head: HeadMove::default(),
            appearance: None,
        }
    }

    /// A row of the 52 curves of ARKit.
    pub fn row(&self) -> Vec<f64> {
        self.contractions.iter().copied().chain([0.0]).collect()
    }

    /// `share` of the way from `self` to `other`, at `time`. State and appearance are those of the nearer one; a region
    /// that both tell goes with the rest.
    #[must_use]
    pub fn towards(&self, other: &Self, share: f64, time: Timestamp) -> Self {
        let nearer = if share < 0.5 { self } else { other };
        let mut appearance = nearer.appearance;
        if let (Some(mixed), Some(from), Some(to)) = (&mut appearance, &self.appearance, &other.appearance) {
            for (region, state) in from.iter() {
                if let (Some(a), Some(b)) = (state, to.get(region)) {
                    mixed.set(region, Some(a + (b - a) * share as f32));
                }
            }
        }
        Self {
            time,
            state: nearer.state,
            contractions: std::array::from_fn(|k| {
                let (from, to) = (self.contractions[k], other.contractions[k]);
                from + (to - from) * share
            }),
            head: self.head.towards(&other.head, share),
            appearance,
        }
    }

    /// The head's angles as Live Link Face counts them.
    pub fn angles(&self) -> FaceAngles {
        FaceAngles { head: self.head.angles, ..FaceAngles::default() }
    }
}
