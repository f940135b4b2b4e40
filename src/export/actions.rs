//! Libraries of action units as files.

use std::path::Path;

use super::{Draft, ExportError};
use crate::actions::ActionLibrary;

/// Writes a library beside its place, then renames.
pub fn write_library(path: &Path, library: &ActionLibrary) -> Result<(), ExportError> {
    let mut draft = Draft::create(path)?;
    draft.append(library.format().as_bytes())?;
    draft.commit()
}
