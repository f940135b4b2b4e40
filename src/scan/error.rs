//! What can go wrong with a scan.

use std::path::{Path, PathBuf};

use super::{placement::PlacementError, validate::MeshFault};

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
    /// The file could not be written.
    #[error("cannot write {path}: {source}. Check that the folder exists, is writable and has room")]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's own reason.
        source: std::io::Error,
    },
    /// The file name's extension is none that is read or written here.
    #[error(
        "{path} ends in {found}, but wanted one of: {supported}. Convert it, for instance in Blender or MeshLab"
    )]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The extension found, in quotes, or words for its absence.
        found: String,
        /// The extensions that would do.
        supported: &'static str,
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
    /// The mesh was read but cannot be worked with.
    #[error("{path}: {source}")]
    Mesh {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: MeshFault,
    },
    /// The scan cannot be placed.
    #[error("{path}: {source}")]
    Placement {
        /// The file.
        path: PathBuf,
        /// Why.
        source: PlacementError,
    },
}

impl ScanError {
    /// The extension of `path` is not among `supported`.
    pub(super) fn unsupported(path: &Path, supported: &'static str) -> Self {
        let found = path
            .extension()
            .map_or_else(|| "no extension".to_owned(), |e| format!("\".{}\"", e.to_string_lossy()));
        Self::Unsupported { path: path.to_owned(), found, supported }
    }
}

/// A reader's complaint, before the file's name and format are attached to it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fault {
    /// What was found.
    pub reason: String,
    /// What the user can do.
    pub remedy: &'static str,
}

impl Fault {
    /// The remedy for files that are cut off or corrupt.
    pub const EXPORT_AGAIN: &'static str = "Copy or export the file again";
    /// The remedy for files that are too large.
    pub const DECIMATE: &'static str = "Decimate the mesh first, for instance in MeshLab (Quadric Edge Collapse Decimation) or Blender (Decimate)";

    /// A complaint with its own remedy.
    pub fn new(reason: impl Into<String>, remedy: &'static str) -> Self {
        Self { reason: reason.into(), remedy }
    }

    /// The file is cut off or corrupt.
    pub fn corrupt(reason: impl Into<String>) -> Self {
        Self::new(reason, Self::EXPORT_AGAIN)
    }

    /// Attaches the file.
    pub fn at(self, path: &Path, format: &'static str) -> ScanError {
        ScanError::Malformed { path: path.to_owned(), format, reason: self.reason, remedy: self.remedy }
    }
}

impl From<MeshFault> for Fault {
    fn from(fault: MeshFault) -> Self {
        Self::new(fault.to_string(), fault.remedy())
    }
}
