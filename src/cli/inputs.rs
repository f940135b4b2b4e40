//! What a command reads is never what it writes.

use std::{fs, path::Path};

/// Refuses an output that would replace one of the files the command reads.
pub fn spare(output: &Path, inputs: &[&Path]) -> Result<(), String> {
    let Ok(place) = fs::canonicalize(output) else { return Ok(()) };
    match inputs.iter().find(|input| fs::canonicalize(input).is_ok_and(|input| input == place)) {
        None => Ok(()),
        Some(input) => Err(format!(
            "{} would be written over {}, which is read here. Give the output another name",
            output.display(),
            input.display()
        )),
    }
}

/// Whether two paths lead to one file.
pub fn same(one: &Path, other: &Path) -> bool {
    fs::canonicalize(one).is_ok_and(|one| fs::canonicalize(other).is_ok_and(|other| one == other))
}
