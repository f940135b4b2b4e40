//! Frames with their time: video files and image sequences now, a camera through the same trait later.

mod time;

pub use time::{FrameRate, Timestamp};
