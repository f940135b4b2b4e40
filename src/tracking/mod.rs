//! From a picture to 478 landmarks in its pixels.
//!
//! The recipe is MediaPipe's Face Landmarker: a face detector gives a box, a landmark network looks at a rotated crop
//! of it, and the next frame's crop follows from this frame's landmarks. `docs/tracking.md` compares the two.

mod blendshapes;
mod detector;
mod error;
pub mod filter;
mod ibug;
mod input;
mod landmarks;
mod network;
mod region;
mod runtime;
mod table;
mod tracker;

pub use blendshapes::{BlendshapeNetwork, ShapeScores};
pub use detector::{Detection, Detector, DetectorLayout, FULL_RANGE, SHORT_RANGE};
pub use error::TrackingError;
pub use ibug::{IBUG_68, IBUG_REGIONS};
pub use landmarks::{LANDMARK_COUNT, LandmarkState, Landmarks, SKIN_LANDMARK_COUNT, index};
pub use network::LandmarkNetwork;
pub use region::FaceRegion;
pub use runtime::Runtime;
pub use table::{LandmarkFacts, Region, is_outline, is_still, landmark_table};
pub use tracker::{Tracker, TrackerOptions};
