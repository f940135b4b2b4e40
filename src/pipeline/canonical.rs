//! The average face: MediaPipe's canonical mesh, whose 468 vertices are the network's landmarks.

use std::path::Path;

use nalgebra::Point3;
use serde::Deserialize;

use super::PipelineError;
use crate::{
    appearance::FaceFrame,
    scan::{Mesh, Surface},
    tracking::SKIN_LANDMARK_COUNT,
};

const MILLIMETRES_PER_CENTIMETRE: f64 = 10.0;

#[derive(Deserialize)]
struct CanonicalFile {
    positions_cm: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl CanonicalFile {
    /// Millimetres.
    fn points(&self) -> Vec<Point3<f64>> {
        self.positions_cm.iter().map(|p| Point3::from(*p) * MILLIMETRES_PER_CENTIMETRE).collect()
    }
}

/// 468 points in the scan frame, millimetres. The file's frame is the scan frame: x to the subject's left, y up, z out
/// of the face.
pub fn read_canonical_face(path: &Path) -> Result<Vec<Point3<f64>>, PipelineError> {
    Ok(read(path)?.points())
}

/// The skin between the landmarks of a `face` (468 of them first, any frame and unit), with eyes and mouth covered.
pub fn canonical_skin(path: &Path, face: &[Point3<f64>]) -> Result<Surface, PipelineError> {
    let triangles = read(path)?.triangles;
    let positions = face.iter().take(SKIN_LANDMARK_COUNT).copied().collect();
    Surface::new(&Mesh { positions, triangles, ..Mesh::default() })
        .map_err(|fault| PipelineError::CanonicalFace { path: path.into(), reason: fault.to_string() })
}

/// The same points, and the frame of skins that is made of them.
pub(super) fn read_framed_face(path: &Path) -> Result<(Vec<Point3<f64>>, FaceFrame), PipelineError> {
    let file = read(path)?;
    let points = file.points();
    let frame = FaceFrame::new(&points, &file.triangles).ok_or_else(|| PipelineError::CanonicalFace {
        path: path.into(),
        reason: "it has no width".into(),
    })?;
    Ok((points, frame))
}

fn read(path: &Path) -> Result<CanonicalFile, PipelineError> {
    let unusable = |reason: String| PipelineError::CanonicalFace { path: path.into(), reason };
    let text = std::fs::read_to_string(path).map_err(|error| unusable(error.to_string()))?;
    let file: CanonicalFile = serde_json::from_str(&text).map_err(|error| unusable(error.to_string()))?;
    if file.positions_cm.len() == SKIN_LANDMARK_COUNT {
        Ok(file)
    } else {
        Err(unusable(format!("it has {} points, not {SKIN_LANDMARK_COUNT}", file.positions_cm.len())))
    }
}
