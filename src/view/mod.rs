//! Pictures of a model: drawn with wgpu without a window, on a graphics card or on the CPU, and drawn over on the
//! CPU for inspection. `docs/view.md` shows them and says how long they take.

mod camera;
mod chart;
mod edges;
mod error;
mod facing;
mod frame_uniform;
mod gpu;
mod heat_map;
mod living;
mod look;
mod model;
mod overlay;
mod pipelines;
mod readback;
mod renderer;
mod save;
mod sheet;
mod text;
mod texture;

pub use camera::{Projection, ViewCamera};
pub use chart::{Chart, Moment};
pub use error::ViewError;
pub use gpu::Gpu;
pub use heat_map::heat_map;
pub use living::{LivingModel, SkinMode};
pub use look::{Background, Lighting, Look};
pub use model::Model;
pub use overlay::{cross, dot, line};
pub use readback::as_picture;
pub use renderer::{Renderer, Smoothing};
pub use save::save_png;
pub use sheet::{beside, contact_sheet};
pub use text::{text, text_size};
pub(crate) use texture::decode as decode_texture;
