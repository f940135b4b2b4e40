//! The stages joined: offline, in order.

mod animation;
mod canonical;
mod error;
mod glb_take;
mod inspection;
mod motion;
mod motion_table;
mod networks;
mod performance;
mod performer_scan;
mod performer_view;
mod photographer;
mod preview;
mod scan_landmarks;
mod schedule;
mod stage;
mod stopwatch;
mod target;

pub use animation::{Animation, VideoPlan};
pub use canonical::read_canonical_face;
pub use error::PipelineError;
pub use glb_take::{GlbReport, write_take_glb};
pub use inspection::inspection_picture;
pub use motion::{Motion, MotionFrame, SolveOptions};
pub use motion_table::{MotionTable, write_motion};
pub use networks::Networks;
pub use performance::{Performance, TrackedFrame};
pub use performer_scan::performer_face;
pub use photographer::{Photographer, Portrait};
pub use preview::preview_sheet;
pub use scan_landmarks::ScanFace;
pub use schedule::constant_rate;
pub use stage::{HeadMode, Stage};
pub use stopwatch::Stopwatch;
pub use target::{Target, TargetOptions};
