//! A face as a regular grid of depths: cleaned, resampled, brought to an average face, averaged over many faces.
//!
//! Sections 5.3 and 5.4 of the thesis (000): its faces are 150 × 150 grids, normalised by an affine map to the average
//! face model of the database, which itself is a mean of depths after a thin-plate morph to consensus landmarks.
//!
//! Everything here is in millimetres and in axes that look out of the face: x to the subject's left, y up, z towards the
//! viewer. Pure: no files, no clock, no threads, no random numbers. `docs/preprocessing.md` has the figures.
//!
//! | to | use | thesis |
//! |---|---|---|
//! | drop background, other parts and spikes | [`clean`] | 5.4, first step |
//! | sample depth on a grid, with a mask | [`Raster`], [`FaceGrid`] | 5.4, first step |
//! | carry a face to the average face | [`Normalisation`] | eq. 5.1–5.4 |
//! | keep the way back | [`TransformRecord`] | |
//! | find consensus landmarks | [`Consensus`] | 5.3 |
//! | morph and average | [`morph`], [`DepthAverage`] | 5.3 |
//!
//! # Deliberately different from the thesis
//! - It interpolates over a triangulation of all points, holes included; here only what the scan's own triangles cover
//!   has a depth, and everything else is masked.
//! - Beside its affine map there is a similarity over all landmarks, which does not shear the face.

mod average;
mod clean;
mod consensus;
mod error;
mod face_grid;
mod normalise;
mod raster;
mod similarity;
mod spikes;
mod transform_record;
mod weld;

pub use average::{AverageDepth, DepthAverage, morph};
pub use clean::{Cleaned, FaceBox, clean};
pub use consensus::Consensus;
pub use error::GridError;
pub use face_grid::FaceGrid;
pub use normalise::{CHINS, Normalisation};
pub use raster::{Raster, Sample};
pub use similarity::similarity_between;
pub use transform_record::TransformRecord;
