//! Something that is played, with given states of living skin.

use super::{HeadMode, Play, action_take::expression_share};
use crate::{
    appearance::{AppearanceStates, Region},
    capture::Timestamp,
    rig::{AvatarFrame, Puppet},
};

/// States over what is played.
pub struct SkinPlay {
    /// What moves the face.
    pub play: Box<dyn Play>,
    /// What the skin shows.
    pub states: AppearanceStates,
    /// Whether the skin comes and goes as a single expression does; otherwise it stays.
    pub comes_and_goes: bool,
}

impl Play for SkinPlay {
    fn puppet(&self) -> &Puppet {
        self.play.puppet()
    }

    fn pose_controls(&self, time: Timestamp, frame: &mut AvatarFrame) {
        self.play.pose_controls(time, frame);
    }

    fn end(&self) -> Timestamp {
        self.play.end()
    }

    fn still(&self) -> Timestamp {
        self.play.still()
    }

    fn moments(&self) -> Vec<Timestamp> {
        self.play.moments()
    }

    fn states(&self, time: Timestamp) -> Option<AppearanceStates> {
        let share = if self.comes_and_goes { expression_share(time) } else { 1.0 };
        let mut states = self.states;
        for region in Region::ALL {
            states.set(region, self.states.get(region).map(|state| state * share as f32));
        }
        Some(states)
    }

    fn head(&self) -> HeadMode {
        self.play.head()
    }
}
