//! Meshes in and out, landmarks on a scan. Pure: no clock, no threads, no I/O but files.

mod error;
mod mesh;

pub use error::ScanError;
pub use mesh::{Material, Mesh, Texture, TextureFormat};
