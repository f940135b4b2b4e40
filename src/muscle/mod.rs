//! Muscle actuation: the basis, its synthesis, analysis and refinement (Choe & Ko, file 001).

mod align;
mod channel;
mod error;
mod marker_guess;
mod marker_map;
mod marker_motion;
mod marker_names;
mod marker_sides;
mod own_take;

pub use align::{Alignment, OTHER_FACE_REACH, align, virtual_markers};
pub use channel::Channel;
pub use error::MuscleError;
pub use marker_guess::place_markers;
pub use marker_map::{MarkerMap, MarkerPlace};
pub use marker_motion::{MarkerMotion, still_weights};
pub use own_take::own_take;
