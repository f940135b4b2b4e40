//! Texts as files: libraries of action units, bases of muscles.

use std::path::Path;

use super::{Draft, ExportError};
use crate::{actions::ActionLibrary, muscle::MuscleBasis};

/// Writes a library beside its place, then renames.
pub fn write_library(path: &Path, library: &ActionLibrary) -> Result<(), ExportError> {
    write_text(path, &library.format())
}

/// Writes a basis of muscles beside its place, then renames.
pub fn write_basis(path: &Path, basis: &MuscleBasis) -> Result<(), ExportError> {
    write_text(path, &basis.format())
}

/// Writes a text beside its place, then renames.
pub fn write_text(path: &Path, text: &str) -> Result<(), ExportError> {
    let mut draft = Draft::create(path)?;
    draft.append(text.as_bytes())?;
    draft.commit()
}
