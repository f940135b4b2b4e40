//! Muscle actuation: the basis, its synthesis, analysis and refinement (Choe & Ko, file 001).

mod channel;
mod error;

pub use channel::Channel;
pub use error::MuscleError;
