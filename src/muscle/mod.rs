//! Muscle actuation: the basis, its synthesis, analysis and refinement (Choe & Ko, file 001).

mod basis;
mod bow;
mod box_solver;
mod camera_solver;
mod channel;
mod error;
mod face_basis;
mod lift;
mod motor;
mod sixteen;

pub use basis::{Element, MuscleBasis, Part};
pub use bow::JawBow;
pub use box_solver::BoxSolver;
pub use camera_solver::{CameraFit, CameraSolver};
pub use channel::Channel;
pub use error::MuscleError;
pub use face_basis::{FaceBasis, Muscle};
pub use lift::{Lifted, MuscleLift};
pub use motor::MuscleMotor;
