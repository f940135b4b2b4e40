//! What can go wrong while an output is written, or read back.

use std::io;
use std::path::{Path, PathBuf};

/// Every variant names the file, what happened, and what to do about it.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The destination cannot hold an output.
    #[error("cannot create {path}: {source}. {remedy}")]
    Create {
        /// The destination.
        path: PathBuf,
        /// The system's own reason.
        source: io::Error,
        /// What the user can do.
        remedy: &'static str,
    },
    /// Writing stopped midway; a file that stood at the destination before is untouched.
    #[error("cannot write {path}: {source}. {remedy}")]
    Write {
        /// The destination.
        path: PathBuf,
        /// The system's own reason.
        source: io::Error,
        /// What the user can do.
        remedy: &'static str,
    },
    /// The data given cannot be expressed in the format.
    #[error("cannot write {path}: {reason}. {remedy}")]
    Refused {
        /// The destination.
        path: PathBuf,
        /// What was found, with its place in the data.
        reason: String,
        /// What the caller or the user can do.
        remedy: &'static str,
    },
    /// A file could not be opened or read.
    #[error("cannot read {path}: {source}. Check the path and its permissions")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's own reason.
        source: io::Error,
    },
    /// A file is not what its format promises.
    #[error("{path} is not a usable {format} file: {reason}. {remedy}")]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The format it was read as.
        format: &'static str,
        /// What was found, with line and column or byte where known.
        reason: String,
        /// What the user can do.
        remedy: &'static str,
    },
    /// A program that the output needs is not installed.
    #[error("cannot write {path}: the program {program} was not found. Install it: apt-get install ffmpeg")]
    ProgramMissing {
        /// The destination.
        path: PathBuf,
        /// The program, as it was called.
        program: PathBuf,
    },
    /// A program that the output needs gave up.
    #[error("cannot write {path}: {program} stopped ({status}) and said: {last_words}. {remedy}")]
    ProgramFailed {
        /// The destination.
        path: PathBuf,
        /// The program, as it was called.
        program: PathBuf,
        /// Its exit status.
        status: String,
        /// The last lines of its messages, joined by " / ".
        last_words: String,
        /// What the user can do.
        remedy: &'static str,
    },
}

impl ExportError {
    pub(super) fn create(path: &Path, source: io::Error) -> Self {
        Self::Create { path: path.into(), remedy: remedy(&source), source }
    }

    pub(super) fn write(path: &Path, source: io::Error) -> Self {
        Self::Write { path: path.into(), remedy: remedy(&source), source }
    }

    pub(super) fn read(path: &Path, source: io::Error) -> Self {
        Self::Read { path: path.into(), source }
    }

    pub(super) fn refused(path: &Path, reason: impl Into<String>, remedy: &'static str) -> Self {
        Self::Refused { path: path.into(), reason: reason.into(), remedy }
    }
}

/// What the user can do about the system's reason.
fn remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "The disk is full: free some space, or name an output on another disk"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "Name an output in a folder that you may write to"
        }
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => {
            "Create the folder first, or correct the path"
        }
        io::ErrorKind::IsADirectory => "Name a file, not a folder",
        io::ErrorKind::FileTooLarge => "The file system does not take files of this size: use another disk",
        _ => "Check the disk and the path",
    }
}
