//! The look of the skin, which landmarks do not tell: wrinkles and lids, after 002 §V.
//!
//! `docs/appearance.md` shows it, `docs/benchmarks/appearance.md` says how well it is told.

mod area;
mod classifier;
mod face_frame;
pub mod haar;
mod picture;
mod region;
mod sample;
mod sampler;
mod states;
mod template;
mod volume;

pub use area::Area;
pub use classifier::{Classifier, Match};
pub use face_frame::{Anchor, FACE_WIDTH, FRAME_SIZE, FaceFrame};
pub use picture::Picture;
pub use region::{Detail, REGION_COUNT, Region};
pub use sample::{FINE_SIDE, OFFSETS, Sample};
pub use sampler::{Absence, Sampler, Samples, face_width};
pub use states::AppearanceStates;
pub use template::{KEPT, Template};
pub use volume::{FEWEST_LAYERS, Layer, MOST_LAYERS, Patch, TextureVolume};
