//! What can go wrong with a scan.

use std::path::PathBuf;

/// Every variant names the file, what was found, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ScanError {
    /// The file could not be opened or read.
    #[error("cannot read {path}: {source}. Check the path and its permissions")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's own reason.
        source: std::io::Error,
    },
    /// The file is not what its format promises.
    #[error("{path} is not a usable {format} file: {reason}. {remedy}")]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The format it was read as.
        format: &'static str,
        /// What was found, with line or byte where known.
        reason: String,
        /// What the user can do.
        remedy: &'static str,
    },
}
