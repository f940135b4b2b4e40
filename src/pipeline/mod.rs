//! The stages joined: offline, in order.

mod canonical;
mod error;
mod inspection;
mod motion;
mod motion_table;
mod networks;
mod performance;
mod photographer;
mod scan_landmarks;
mod stopwatch;
mod target;

pub use canonical::read_canonical_face;
pub use error::PipelineError;
pub use inspection::inspection_picture;
pub use motion::{Motion, MotionFrame, SolveOptions};
pub use motion_table::{MotionTable, write_motion};
pub use networks::Networks;
pub use performance::{Performance, TrackedFrame};
pub use photographer::{Photographer, Portrait};
pub use scan_landmarks::ScanFace;
pub use stopwatch::Stopwatch;
pub use target::{Target, TargetOptions};
