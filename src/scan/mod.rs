//! Meshes in and out, landmarks on a scan. Pure: no clock, no threads, no I/O but files.

mod error;
mod mesh;
mod validate;

mod bnt;
mod glb;
mod glb_buffers;
mod mtl;
mod obj;
mod ply;
mod read;
mod stl;
mod texture;

mod placement;
mod scanned;
mod unit;

mod normals;
mod surface;
mod tessellate;

mod landmark_file;
mod landmark_json;
mod landmark_ljson;
mod landmark_lm3;
mod landmark_pts;

pub use error::ScanError;
pub use glb::Morph;
pub use landmark_file::{
    LandmarkFile, LandmarkFormat, LandmarkScheme, MAX_LANDMARKS, read_landmarks, read_landmarks_bytes,
    write_landmarks,
};
pub use landmark_lm3::NAMES as BOSPHORUS_LANDMARKS;
pub use mesh::{Material, Mesh, Texture, TextureFormat};
pub use normals::{NormalSolver, vertex_normals};
pub use placement::{Placement, PlacementError};
pub use read::{MAX_FILE_BYTES, MeshFormat, read_mesh, read_mesh_bytes, read_morphs};
pub use scanned::Scan;
pub use surface::{Anchor, Surface, SurfacePoint};
pub use tessellate::tessellate;
pub use unit::{LengthUnit, guess_from_outer_canthal_distance, guess_unit};
pub use validate::{MAX_COORDINATE, MAX_TRIANGLES, MAX_VERTICES, MeshFault};
