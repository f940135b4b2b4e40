//! The networks, loaded once from verified files.

use crate::{
    assets::Assets,
    pipeline::PipelineError,
    tracking::{
        BlendshapeNetwork, Detector, FULL_RANGE, LandmarkNetwork, Runtime, SHORT_RANGE, Tracker,
        TrackerOptions,
    },
};

/// What finds and judges faces, in clips and on renderings of scans alike.
pub struct Networks {
    /// Follows a face.
    pub tracker: Tracker,
    /// Judges a neutral.
    pub blendshapes: BlendshapeNetwork,
}

impl Networks {
    /// Verifies and loads everything.
    pub fn load(assets: &Assets, options: TrackerOptions) -> Result<Self, PipelineError> {
        let runtime = Runtime::load(&assets.verified("onnxruntime")?)?;
        let short_range = Detector::open(&runtime, &assets.verified("face_detector")?, SHORT_RANGE)?;
        let full_range = Detector::open(&runtime, &assets.verified("face_detector_full_range")?, FULL_RANGE)?;
        let network = LandmarkNetwork::open(&runtime, &assets.verified("face_landmarks")?)?;
        let blendshapes = BlendshapeNetwork::open(&runtime, &assets.verified("face_blendshapes")?)?;
        Ok(Self { tracker: Tracker::new(short_range, full_range, network, options), blendshapes })
    }
}
