//! ONNX Runtime, loaded from the verified library and never from anywhere else.

use std::{
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use ort::{
    environment::Environment,
    session::{Session, builder::GraphOptimizationLevel},
};

use super::TrackingError;

/// A process has one library and one environment; whoever asks again shares them.
static LOADED: Mutex<Option<(PathBuf, Environment)>> = Mutex::new(None);

/// The loaded library; sessions are opened through it.
pub struct Runtime {
    environment: Environment,
}

impl Runtime {
    /// Loads `library`, which the caller has verified. A second call shares what the first one loaded, and is refused
    /// if it names another file.
    pub fn load(library: &Path) -> Result<Self, TrackingError> {
        let failed = |reason: String| TrackingError::Runtime { path: library.into(), reason };
        if !library.is_file() {
            return Err(failed("there is no such file".into()));
        }
        let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((path, environment)) = &*loaded {
            if path != library {
                return Err(failed(format!("this process already uses {}", path.display())));
            }
            return Ok(Self { environment: environment.clone() });
        }
        let environment = ort::init_from(library)
            .map_err(|error| failed(error.to_string()))?
            .with_name("understudy")
            .with_telemetry(false)
            .build()
            .map_err(|error| failed(error.to_string()))?;
        *loaded = Some((library.into(), environment.clone()));
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
