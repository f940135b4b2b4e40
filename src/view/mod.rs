//! Pictures of a model: drawn with wgpu without a window, on a graphics card or on the CPU, and drawn over on the
//! CPU for inspection. `docs/view.md` shows them and says how long they take.

mod camera;
mod error;
mod gpu;
mod look;
mod model;
mod pipelines;
mod readback;
mod renderer;
mod texture;

pub use camera::{Projection, ViewCamera};
pub use error::ViewError;
pub use gpu::Gpu;
pub use look::{Background, Lighting, Look};
pub use model::Model;
pub use renderer::{Renderer, Smoothing};
