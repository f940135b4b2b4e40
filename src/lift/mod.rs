//! From 2D landmarks to the motion of the performer's face in three dimensions.
//!
//! Follows 002 §III: pose from rigid points first, then what is left over goes back onto the neutral face. What a
//! single camera cannot see, motion along its axis, comes from the network's depth hint and counts as inferred.

mod closure;
mod displacements;
mod error;
mod eye_measure;
mod eye_motion;
mod eyes;
mod gaze;
mod neutral;
mod performer;
mod presence;
mod repair;
mod steady;

pub use closure::{LidRange, WIDEST as WIDEST_CLOSURE};
pub use displacements::Displacements;
pub use error::LiftError;
pub use eye_measure::{EyeMeasure, NeutralEyes, measure_eyes};
pub use eye_motion::{CausalEyes, EyeRun, eyes_of_recording};
pub use eyes::{EyeState, Eyes, Side};
pub use neutral::{Candidate, NeutralSearch, NeutralStretch, NotNeutral};
pub use performer::{Performer, upright};
pub use presence::{Expression, FaceState, Presence, frontal_pose};
pub use repair::Repair;
pub use steady::{CausalSteadier, Smoothing, steady_recording};
