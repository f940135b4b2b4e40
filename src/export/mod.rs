//! Outputs: every file that leaves the program, written whole or not at all.
//!
//! | file | writer | opens in | holds | frame, unit |
//! |---|---|---|---|---|
//! | `.mp4` | [`Mp4Writer`] | every player | the pictures, with the clip's sound | sRGB pixels; constant rate |
//! | `.glb` | [`write_glb`] | Blender, three.js, engines | the scan and what was added to it, few morph targets ([`compress`]), motion of head and rigid parts | the scan's axes, metres, seconds |
//! | `.pc2` | [`Pc2Writer`] | Blender's Mesh Cache | every vertex of every frame | as the caller gives them |
//! | `.obj` | [`write_obj`], [`write_quad_obj`] | every 3D program | a mesh with its MTL and textures | the mesh's own |
//! | `.csv` | [`MotionCsvWriter`] | pandas, spreadsheets, OpenFace scripts | landmarks and head pose | pixels; millimetres and radians in OpenCV's camera frame |
//! | `.muscles.csv` | [`write_muscle_csv`] | pandas, spreadsheets | contractions of muscles | 0 relaxed, 1 contracted |
//! | `.appearance.csv` | [`write_appearance_csv`] | pandas, spreadsheets | states of the skin's regions | 0 neutral, 1 most expressive |
//! | `.livelink.csv` | [`write_live_link`] | whatever reads Live Link Face's recordings | ARKit's 52 shapes, turn of head and eyes | 0..1; radians |
//!
//! All of them go through [`Draft`]. `docs/formats.md` describes them for users.

mod actions;
mod appearance_csv;
mod csv;
mod csv_read;
mod decimal;
mod draft;
mod error;

mod glb;
mod glb_buffer;
mod glb_check;
mod glb_image;
mod glb_motion;
mod glb_surface;
mod live_link;
mod morph_basis;
mod mp4;
mod mp4_program;
mod muscle_csv;
mod obj;
mod pc2;

pub use actions::{write_basis, write_library, write_text};
pub use appearance_csv::{write_appearance_csv, write_skin};
pub use csv::{MotionCsvWriter, MotionRow};
pub use csv_read::{MotionRecord, read_motion_csv};
pub use draft::Draft;
pub use error::ExportError;

pub use glb::{GlbAvatar, GlbPart, MorphTarget, NodeKey, write_glb};
pub use live_link::write_live_link;
pub use morph_basis::{MorphBasis, MorphBasisError, compress};
pub use mp4::{Mp4Settings, Mp4Writer, Sound};
pub use muscle_csv::write_muscle_csv;
pub use obj::{obj_files, write_obj, write_quad_obj};
pub use pc2::{Pc2Reader, Pc2Writer};
