//! The look of the skin, which landmarks do not tell: wrinkles and lids, after 002 §V.
//!
//! `docs/appearance.md` shows it, `docs/benchmarks/appearance.md` says how well it is told.

mod area;
mod classifier;
mod composition;
mod cues;
mod error;
mod face_chart;
mod face_frame;
mod face_image;
pub mod haar;
mod learn;
mod lids;
mod picture;
mod plane;
mod ratio;
mod ratio_mask;
mod region;
mod relief;
mod sample;
mod sampler;
mod skin;
mod srgb;
mod states;
mod states_csv;
mod template;
mod volume;

pub use area::Area;
pub use classifier::{Classifier, Match};
pub use composition::{ALPHA_RAMP, Composition};
pub use cues::{muscles, request};
pub use error::AppearanceError;
pub use face_chart::FaceChart;
pub use face_frame::{Anchor, FACE_WIDTH, FRAME_SIZE, FaceFrame};
pub use face_image::{DARKEST, FaceImage};
pub use learn::{Lesson, Look, MOST_AVERAGED, Stage, Unlearnt, learn, learn_from};
pub use lids::{CLOSED_LID, lid_state};
pub use picture::Picture;
pub use ratio::{RatioFilter, RatioImage, RatioOptions, TRANSFER_GAIN};
pub use region::{Detail, REGION_COUNT, Region};
pub use relief::{Relief, ReliefOptions};
pub use sample::{FINE_SIDE, OFFSETS, Sample};
pub use sampler::{Absence, LEARNT_NARROWER, Sampler, Samples, face_width};
pub use skin::{Exemplar, RegionSkin, Skin};
pub use states::AppearanceStates;
pub use states_csv::{AppearanceFrame, columns, read_appearance_csv};
pub use template::{KEPT, Template};
pub use volume::{FEWEST_LAYERS, Layer, MOST_LAYERS, Patch, TextureVolume};
