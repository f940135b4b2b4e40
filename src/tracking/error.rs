//! What can go wrong while a face is tracked.

use std::path::PathBuf;

/// Every variant names the network or file, what was found, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum TrackingError {
    /// ONNX Runtime's library did not load.
    #[error(
        "ONNX Runtime did not load from {path}: {reason}. Run `make setup` to fetch the version this program is built for"
    )]
    Runtime {
        /// The shared library.
        path: PathBuf,
        /// The loader's own reason.
        reason: String,
    },
    /// A network file did not load, or is another network.
    #[error("{path} is not the network that was expected: {reason}. Remove it and run `make setup`")]
    Network {
        /// The model file.
        path: PathBuf,
        /// What differs.
        reason: String,
    },
    /// A network failed while running.
    #[error("the {network} network failed: {source}")]
    Inference {
        /// Which.
        network: &'static str,
        /// The runtime's own reason.
        source: ort::Error,
    },
    /// The image library failed while cutting a region out.
    #[error("cutting the face out of the picture failed: {0}")]
    Crop(#[from] opencv::Error),
}
