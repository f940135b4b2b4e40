//! Living skin: texture volumes on the device, composed into one map of the shared frame, and shown on a model.
//!
//! After 002 §V.iii: every region's layers are a real three-dimensional texture, which the device blends between layers
//! as between pixels; an alpha ramp of ten pixels leads to the neutral.

mod draw;
mod map;
mod model;
mod programs;

pub use map::SkinMode;
pub use model::LivingModel;

pub(super) use programs::SkinPrograms;
