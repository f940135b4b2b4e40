//! Curves from a file, whichever of the two kinds it is.

use std::path::Path;

use super::{CurveEdits, LiveLinkExtras, MuscleCurves, MuscleError, curves_csv, live_link};
use crate::rows::Lines;

/// What a file of curves holds.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveTake {
    /// The contractions.
    pub curves: MuscleCurves,
    /// What a recording of Live Link Face has beside them; None of a table of contractions.
    pub live_link: Option<LiveLinkExtras>,
}

impl CurveTake {
    /// Reads a table of contractions or a recording of Live Link Face; the header tells which.
    ///
    /// Blanks around cells, empty lines, CRLF, a byte-order mark and quotes around a cell are accepted, `#` begins a
    /// comment.
    pub fn read(path: &Path) -> Result<Self, MuscleError> {
        let mut lines = Lines::open(path)?;
        let header: Vec<String> = match lines.next()? {
            Some(cells) => cells.into_iter().map(str::to_owned).collect(),
            None => {
                return Err(lines
                    .whole_fault("it is empty".into(), "Give a file with a header and rows")
                    .into());
            }
        };
        if live_link::is_header(&header) {
            let (curves, extras) = live_link::read(lines, &header)?;
            Ok(Self { curves, live_link: Some(extras) })
        } else {
            Ok(Self { curves: curves_csv::read(lines, &header)?, live_link: None })
        }
    }

    /// Whether the header is one of curves, and not that of a table of action units or of keys.
    pub fn is_in(path: &Path) -> Result<bool, MuscleError> {
        let mut lines = Lines::open(path)?;
        let header: Vec<String> = lines.next()?.unwrap_or_default().into_iter().map(str::to_owned).collect();
        let is_unit = |name: &String| {
            name.strip_prefix("AU").is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
        };
        let has_times = header.iter().any(|name| name == "timestamp");
        Ok(live_link::is_header(&header) || (has_times && !header.iter().any(is_unit)))
    }

    /// The take with edits; a mirror turns head and eyes as well.
    pub fn edited(self, edits: &CurveEdits) -> Result<Self, MuscleError> {
        let mut live_link = self.live_link;
        if let Some(extras) = live_link.as_mut().filter(|_| edits.mirror) {
            for angles in &mut extras.angles {
                *angles = angles.mirrored();
            }
        }
        Ok(Self { curves: edits.apply(self.curves)?, live_link })
    }
}

#[cfg(test)]
#[path = "take_tests.rs"]
mod tests;
