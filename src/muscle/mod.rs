//! Muscle actuation: the basis, its synthesis, analysis and refinement (Choe & Ko, file 001).

mod basis;
mod bow;
mod box_solver;
mod camera_solver;
mod channel;
mod curves;
mod curves_csv;
mod edit;
mod error;
mod face_basis;
mod lift;
mod live_link;
mod moments;
mod names;
mod sixteen;
mod take;
mod timecode;

pub use basis::{Element, MuscleBasis, Part};
pub use bow::JawBow;
pub use box_solver::BoxSolver;
pub use camera_solver::{CameraFit, CameraSolver};
pub use channel::Channel;
pub use curves::{CHANNEL_SUFFIX, CurveFrame, MuscleCurves, RESERVED as RESERVED_COLUMNS};
pub use edit::{CurveEdits, MuscleEdit};
pub use error::MuscleError;
pub use face_basis::{FaceBasis, Muscle};
pub use lift::{Lifted, MuscleLift};
pub use live_link::{ARKIT_SHAPES, FaceAngles, LIVE_LINK_ANGLES, LiveLinkExtras};
pub use moments::different_moments;
pub use names::{find_muscle, other_side};
pub use take::CurveTake;
pub use timecode::TimecodeBase;
