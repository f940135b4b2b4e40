//! Meshes in and out, landmarks on a scan. Pure: no clock, no threads, no I/O but files.

mod error;
mod glb;
mod glb_buffers;
mod mesh;
mod mtl;
mod obj;
mod ply;
mod read;
mod stl;
mod texture;
mod validate;

pub use error::ScanError;
pub use mesh::{Material, Mesh, Texture, TextureFormat};
pub use read::{MAX_FILE_BYTES, MeshFormat, read_mesh, read_mesh_bytes};
pub use validate::{MAX_COORDINATE, MAX_TRIANGLES, MAX_VERTICES, MeshFault};
