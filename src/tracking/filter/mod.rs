//! Steadying a signal: causally for a live performer, without lag for a recorded one.
//!
//! The filters know nothing of faces. They are applied to what pose leaves over (`lift`) and to the pose itself, not to
//! raw pixels: filtered pixels would smear head motion into expression.

mod one_euro;
mod settle;
mod zero_phase;

pub use one_euro::{OneEuro, OneEuroSettings};
pub use settle::{Settle, settle_recording};
pub use zero_phase::ZeroPhase;
