//! Muscle actuation: the basis, its synthesis, analysis and refinement (Choe & Ko, file 001).

mod box_solver;
mod channel;
mod error;

pub use box_solver::BoxSolver;
pub use channel::Channel;
pub use error::MuscleError;
