//! A comparison as a table for other programs.

use std::{fmt::Write as _, path::Path};

use super::Comparison;
use crate::export::{Draft, ExportError};

const HEADER: &str = "region,distance,vertices,mean_mm,rms_mm,p95_mm,max_mm,motion_rms_mm,share\n";

/// Writes one row for each row of the comparison: lengths in millimetres with six decimals, `share` empty where nothing
/// should move.
pub fn write_comparison(path: &Path, comparison: &Comparison) -> Result<(), ExportError> {
    let mut text = HEADER.to_owned();
    for row in &comparison.rows {
        let share = row.share().map_or_else(String::new, |share| format!("{share:.6}"));
        let kind = comparison.kind.name();
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{},{kind},{},{:.6},{:.6},{:.6},{:.6},{:.6},{share}",
            row.name, row.vertices, row.mean, row.rms, row.p95, row.max, row.motion_rms
        );
    }
    let mut draft = Draft::create(path)?;
    draft.append(text.as_bytes())?;
    draft.commit()
}
