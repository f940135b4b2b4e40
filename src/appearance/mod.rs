//! The look of the skin, which landmarks do not tell: wrinkles and lids, after 002 §V.
//!
//! `docs/appearance.md` shows it, `docs/benchmarks/appearance.md` says how well it is told.

mod area;
mod face_frame;
mod face_image;
mod plane;
mod ratio;
mod ratio_mask;
mod region;
mod relief;
mod srgb;
mod states;
mod volume;

pub use area::Area;
pub use face_frame::{Anchor, FACE_WIDTH, FRAME_SIZE, FaceFrame};
pub use face_image::{DARKEST, FaceImage};
pub use ratio::{RatioFilter, RatioImage, RatioOptions, TRANSFER_GAIN};
pub use region::{Detail, REGION_COUNT, Region};
pub use relief::{Relief, ReliefOptions};
pub use states::AppearanceStates;
pub use volume::{FEWEST_LAYERS, Layer, MOST_LAYERS, Patch, TextureVolume};
