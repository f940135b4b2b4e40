//! What the eyes do: how far each lid has closed, and where each eye looks.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::closure::WIDEST;

/// The subject's side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Side {
    /// The subject's right.
    Right,
    /// The subject's left.
    Left,
}

impl Side {
    /// Both, the right first, as the landmarks have them.
    pub const BOTH: [Self; 2] = [Self::Right, Self::Left];
}

/// One eye in one frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EyeState {
    /// How far the lids have closed: 0 as in the neutral, 1 shut, below 0 opened wider.
    pub closure: f64,
    /// Turn to the subject's left since the neutral, radians.
    pub yaw: f64,
    /// Turn upwards since the neutral, radians.
    pub pitch: f64,
}

impl EyeState {
    /// An eye that several actions close or open: of those that close it the strongest counts, and so of those that open
    /// it.
    pub fn closed_by(closures: impl Iterator<Item = f64>) -> Self {
        let most = |(shut, wide): (f64, f64), own| (shut.max(own), wide.min(own));
        let (shut, wide) = closures.fold((0.0, 0.0), most);
        Self { closure: (shut + wide).clamp(WIDEST, 1.0), ..Self::default() }
    }

    /// Where it looks: a unit vector in the level frame, +Z in the neutral.
    pub fn direction(&self) -> Vector3<f64> {
        let (across, ahead) = self.yaw.sin_cos();
        let (up, level) = self.pitch.sin_cos();
        Vector3::new(level * across, up, level * ahead)
    }
}

/// Both eyes in one frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Eyes {
    /// The subject's right eye.
    pub right: EyeState,
    /// The subject's left eye.
    pub left: EyeState,
}

impl Eyes {
    /// One of the two.
    pub fn of(&self, side: Side) -> &EyeState {
        match side {
            Side::Right => &self.right,
            Side::Left => &self.left,
        }
    }

    /// As a mirror shows them: left and right exchanged.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let eye = |eye: &EyeState| EyeState { yaw: -eye.yaw, ..*eye };
        Self { right: eye(&self.left), left: eye(&self.right) }
    }

    /// `share` of the way from `self` to `other`.
    pub(super) fn towards(&self, other: &Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * share;
        let eye = |a: &EyeState, b: &EyeState| EyeState {
            closure: mix(a.closure, b.closure),
            yaw: mix(a.yaw, b.yaw),
            pitch: mix(a.pitch, b.pitch),
        };
        Self { right: eye(&self.right, &other.right), left: eye(&self.left, &other.left) }
    }
}
