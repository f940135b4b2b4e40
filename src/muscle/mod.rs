//! Muscle actuation: the basis, its synthesis, analysis and refinement (Choe & Ko, file 001).

mod align;
mod analysis;
mod basis;
mod bow;
mod box_solver;
mod camera_solver;
mod channel;
mod completion;
mod error;
mod face_basis;
mod lift;
mod marker_basis;
mod marker_guess;
mod marker_map;
mod marker_motion;
mod marker_names;
mod marker_sides;
mod motor;
mod own_take;
mod refine;
mod refit;
mod sixteen;
mod training;

pub use align::{Alignment, OTHER_FACE_REACH, align, virtual_markers};
pub use analysis::{Analyser, FrameFit, PartFit};
pub use basis::{Element, MuscleBasis, Part};
pub use bow::JawBow;
pub use box_solver::BoxSolver;
pub use camera_solver::{CameraFit, CameraSolver};
pub use channel::Channel;
pub use error::MuscleError;
pub use face_basis::{FaceBasis, Muscle};
pub use lift::{Lifted, MuscleLift};
pub use marker_basis::{MarkerBasis, MarkerSeat};
pub use marker_guess::place_markers;
pub use marker_map::{MarkerMap, MarkerPlace};
pub use marker_motion::{MarkerMotion, still_weights};
pub use motor::MuscleMotor;
pub use own_take::own_take;
pub use refine::{
    EXERCISED, IDLE_FRAMES, IDLE_REACH, RefineOptions, Refinement, Round, Stop, TakeError, refine,
};
pub use training::{SeatedTake, Training, join_takes};
