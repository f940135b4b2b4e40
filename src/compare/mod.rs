//! How far a predicted face is from the true one, part by part. Pure but for the picture and the file it writes.
//!
//! Three faces take part: the neutral, what a method made of it, and what it should have become. All are in one frame
//! and in millimetres. `docs/compare.md` says what the figures mean.

mod colours;
mod error;
mod measure;
mod parts;
mod picture;
mod table;

pub use colours::error_colour;
pub use error::CompareError;
pub use measure::{Comparison, DistanceKind, Row, Whole};
pub use parts::{FacePart, REACH, face_parts};
pub use picture::{Framing, comparison_sheet};
pub use table::write_comparison;
