//! The look of the skin, which landmarks do not tell: wrinkles and lids, after 002 §V.
//!
//! `docs/appearance.md` shows it, `docs/benchmarks/appearance.md` says how well it is told.

mod area;
mod composition;
mod face_chart;
mod face_frame;
mod region;
mod states;
mod volume;

pub use area::Area;
pub use composition::{ALPHA_RAMP, Composition};
pub use face_chart::FaceChart;
pub use face_frame::{Anchor, FACE_WIDTH, FRAME_SIZE, FaceFrame};
pub use region::{Detail, REGION_COUNT, Region};
pub use states::AppearanceStates;
pub use volume::{FEWEST_LAYERS, Layer, MOST_LAYERS, Patch, TextureVolume};
