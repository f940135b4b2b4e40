//! The face that others are normalised to.

use std::path::Path;

use nalgebra::Point3;

use super::{PipelineError, canonical::read_canonical_face, target::network_scheme};
use crate::{
    scan::{LandmarkFormat, read_landmarks},
    tracking::LANDMARK_COUNT,
};

/// The landmarks of an average face.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceFace {
    /// What it is called in messages and records.
    pub name: String,
    /// 478, millimetres, looking along +z.
    pub landmarks: Vec<Option<Point3<f64>>>,
}

impl ReferenceFace {
    /// MediaPipe's average face, whose file `path` is.
    pub fn canonical(path: &Path) -> Result<Self, PipelineError> {
        let mut landmarks: Vec<_> = read_canonical_face(path)?.into_iter().map(Some).collect();
        landmarks.resize(LANDMARK_COUNT, None);
        Ok(Self { name: "MediaPipe's canonical face".into(), landmarks })
    }

    /// An average face as `understudy average` writes it: its OBJ with `NAME.landmarks.json` beside it, of which the
    /// landmarks are read, or a landmark file itself; millimetres.
    pub fn read(path: &Path) -> Result<Self, PipelineError> {
        let file = if LandmarkFormat::from_path(path).is_some() {
            path.to_path_buf()
        } else {
            path.with_extension("landmarks.json")
        };
        let landmarks = network_scheme(&file, &read_landmarks(&file)?)?;
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        Ok(Self { name, landmarks })
    }
}
