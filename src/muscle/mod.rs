//! Muscle actuation: the basis, its synthesis, analysis and refinement (Choe & Ko, file 001).

mod channel;
mod curves;
mod curves_csv;
mod edit;
mod error;
mod live_link;
mod moments;
mod names;
mod take;
mod timecode;

pub use channel::Channel;
pub use curves::{CHANNEL_SUFFIX, CurveFrame, MuscleCurves, RESERVED as RESERVED_COLUMNS};
pub use edit::{CurveEdits, MuscleEdit};
pub use error::MuscleError;
pub use live_link::{ARKIT_SHAPES, FaceAngles, LIVE_LINK_ANGLES, LiveLinkExtras};
pub use moments::different_moments;
pub use names::{FaceRegion, find_muscle, other_side};
pub use take::CurveTake;
pub use timecode::TimecodeBase;
