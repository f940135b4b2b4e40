//! Files of text: tables line by line, cut into cells, with faults that name file and line; small ones whole; numbers
//! as they are written.
//!
//! Cells are numbers and names without commas, so that a line is cut at its commas, as `export::read_motion_csv` does;
//! quotes around a whole cell, which R writes, are taken off.

use std::{
    fs::File,
    io::{BufRead as _, BufReader, Read as _},
    path::{Path, PathBuf},
};

use crate::capture::Timestamp;

/// An hour of OpenFace's tables with all their columns is some 150 MB.
const MOST_BYTES: u64 = 256 << 20;
/// Cells are quoted in messages up to this many characters.
const QUOTED: usize = 40;

/// What is wrong with a table, where, and what to do.
#[derive(Debug)]
pub(crate) struct Fault {
    /// The file.
    pub path: PathBuf,
    /// What was found, with its line.
    pub reason: String,
    /// What to do.
    pub remedy: &'static str,
}

/// The whole of a small file of text. The error is a reason, which says of one that is too large that it is no `what`.
pub(crate) fn read_text(path: &Path, most_bytes: u64, what: &str) -> Result<String, String> {
    let size = std::fs::metadata(path).map_err(|error| error.to_string())?.len();
    if size > most_bytes {
        return Err(format!("{size} bytes are no {what}"));
    }
    std::fs::read_to_string(path).map_err(|error| error.to_string())
}

/// The lines of one file that hold something.
pub(crate) struct Lines<'a> {
    path: &'a Path,
    reader: BufReader<std::io::Take<File>>,
    bytes: Vec<u8>,
    read: u64,
    number: usize,
}

impl<'a> Lines<'a> {
    pub(crate) fn open(path: &'a Path) -> Result<Self, Fault> {
        let fault = |reason: String, remedy| Fault { path: path.into(), reason, remedy };
        let unreadable = |error: std::io::Error| fault(error.to_string(), "Name a file that can be read");
        let file = File::open(path).map_err(unreadable)?;
        if file.metadata().map_err(unreadable)?.len() > MOST_BYTES {
            return Err(too_large(path));
        }
        let reader = BufReader::new(file.take(MOST_BYTES + 1));
        Ok(Self { path, reader, bytes: Vec::new(), read: 0, number: 0 })
    }

    /// Of the line that was read last, from 1.
    pub(crate) fn number(&self) -> usize {
        self.number
    }

    /// A fault in the line that was read last.
    pub(crate) fn fault(&self, reason: &str) -> Fault {
        self.whole_fault(format!("line {}: {reason}", self.number), "Correct that line")
    }

    /// A fault of the whole file.
    pub(crate) fn whole_fault(&self, reason: String, remedy: &'static str) -> Fault {
        Fault { path: self.path.into(), reason, remedy }
    }

    /// The next line's cells; empty lines and comments are passed over. `None` at the end.
    pub(crate) fn next(&mut self) -> Result<Option<Vec<&str>>, Fault> {
        loop {
            self.bytes.clear();
            let count = self.reader.read_until(b'\n', &mut self.bytes).map_err(|error| {
                self.whole_fault(format!("it stops at line {}: {error}", self.number + 1), "Copy it again")
            })?;
            if count == 0 {
                return Ok(None);
            }
            self.number += 1;
            self.read += count as u64;
            if self.read > MOST_BYTES {
                return Err(too_large(self.path));
            }
            if self.number == 1 && self.bytes.starts_with(b"\xef\xbb\xbf") {
                self.bytes.drain(..3);
            }
            if self.bytes.contains(&0) {
                return Err(self.fault("it holds a NUL byte, so it is not text"));
            }
            let end = self.bytes.iter().position(|&byte| byte == b'#').unwrap_or(self.bytes.len());
            self.bytes.truncate(end);
            if !self.bytes.iter().all(u8::is_ascii_whitespace) {
                break;
            }
        }
        let text = std::str::from_utf8(&self.bytes)
            .map_err(|_| self.fault("it is not UTF-8 text; save it as UTF-8, not as UTF-16 or Latin-1"))?;
        Ok(Some(text.split(',').map(bare).collect()))
    }
}

fn too_large(path: &Path) -> Fault {
    Fault {
        path: path.into(),
        reason: format!("it is larger than {} MiB", MOST_BYTES >> 20),
        remedy: "Cut it, or leave out the columns of landmarks",
    }
}

fn bare(cell: &str) -> &str {
    let cell = cell.trim();
    let inside = cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"'));
    inside.map_or(cell, str::trim)
}

/// A number to three decimals, without needless zeros.
pub(crate) fn short(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// As much of a cell as a message can take.
pub(crate) fn quoted(cell: &str) -> String {
    let end = cell.char_indices().nth(QUOTED).map(|(end, _)| end);
    end.map_or_else(|| format!("{cell:?}"), |end| format!("{:?}…", &cell[..end]))
}

/// A time in seconds, 0 or more. Decimals are exact to the nanosecond.
pub(crate) fn seconds(cell: &str) -> Result<Timestamp, String> {
    /// Seconds; beyond them, a float is no longer exact to the nanosecond either way.
    const MOST: f64 = 9e9;
    let float = || cell.parse::<f64>().ok().filter(|seconds| (0.0..MOST).contains(seconds));
    Timestamp::from_decimal(cell)
        .or_else(|| float().map(|seconds| Timestamp((seconds * 1e9).round() as i64)))
        .filter(|time| time.0 >= 0)
        .ok_or_else(|| format!("{} is no time in seconds, 0 or more", quoted(cell)))
}
