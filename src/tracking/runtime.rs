//! ONNX Runtime, loaded from the verified library and never from anywhere else.

use std::path::Path;

use ort::{
    environment::Environment,
    session::{Session, builder::GraphOptimizationLevel},
};

use super::TrackingError;

/// The loaded library; sessions are opened through it.
pub struct Runtime {
    environment: Environment,
}

impl Runtime {
    /// Loads `library`, which the caller has verified.
    pub fn load(library: &Path) -> Result<Self, TrackingError> {
        let failed = |reason: String| TrackingError::Runtime { path: library.into(), reason };
        if !library.is_file() {
            return Err(failed("there is no such file".into()));
        }
        let environment = ort::init_from(library)
            .map_err(|error| failed(error.to_string()))?
            .with_name("understudy")
            .with_telemetry(false)
            .build()
            .map_err(|error| failed(error.to_string()))?;
        Ok(Self { environment })
    }

    /// Opens a network on one thread: more threads gain little on nets this small, suffer from busy neighbours, and
    /// would let the thread count into the results.
    pub fn open(&self, model: &Path) -> Result<Session, TrackingError> {
        let failed = |reason: String| TrackingError::Network { path: model.into(), reason };
        let builder = || -> Result<Session, String> {
            Session::builder(&self.environment)
                .map_err(|error| error.to_string())?
                .with_intra_threads(1)
                .map_err(|error| error.to_string())?
                .with_inter_threads(1)
                .map_err(|error| error.to_string())?
                .with_optimization_level(GraphOptimizationLevel::All)
                .map_err(|error| error.to_string())?
                .commit_from_file(model)
                .map_err(|error| error.to_string())
        };
        builder().map_err(failed)
    }
}
