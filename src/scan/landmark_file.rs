//! Landmark files: which place of a scan is which landmark, in the scan's own frame and unit.
//!
//! Four formats, told apart by extension: this program's own `.json`, iBUG's `.pts`, menpo's `.ljson` and, to read
//! only, Bosphorus' `.lm3`. Only the first keeps states and confidences. Numbers are written with up to 15 significant digits, which every reader
//! gives back alike: writing what was read gives the same bytes.

use std::io::Write as _;
use std::path::Path;

use nalgebra::Point3;

use super::error::{Fault, ScanError};
use super::read::read_limited;
use super::texture::folder_of;
use super::{landmark_json, landmark_ljson, landmark_lm3, landmark_pts};
use crate::tracking::LandmarkState;

/// More landmarks than this are refused.
pub const MAX_LANDMARKS: usize = 100_000;
/// Landmark files larger than this many bytes are refused unread.
const MAX_BYTES: u64 = 64 << 20;

const EXTENSIONS: &str = ".json (understudy), .pts (iBUG), .ljson (menpo), .lm3 (Bosphorus)";
const WRITTEN: &str = ".json (understudy), .pts (iBUG), .ljson (menpo)";

/// Which set of landmarks a file holds; its count tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LandmarkScheme {
    /// The landmark network's 478: 468 on the face and 2 × 5 on the irises.
    Network478,
    /// The landmark network's 468 without irises.
    Network468,
    /// iBUG's 68.
    Ibug68,
    /// Some other number of landmarks.
    Other(usize),
}

impl LandmarkScheme {
    /// The scheme with `count` landmarks.
    pub fn of_count(count: usize) -> Self {
        match count {
            478 => Self::Network478,
            468 => Self::Network468,
            68 => Self::Ibug68,
            n => Self::Other(n),
        }
    }

    /// How many landmarks it has.
    pub fn count(self) -> usize {
        match self {
            Self::Network478 => 478,
            Self::Network468 => 468,
            Self::Ibug68 => 68,
            Self::Other(n) => n,
        }
    }
}

/// The landmarks of one scan. The three arrays are N long and in the scheme's order, counted from 0.
#[derive(Debug, Clone, PartialEq)]
pub struct LandmarkFile {
    /// The scan's name; empty when the format has none.
    pub scan: String,
    /// N places in the scan's own frame and unit; `None` exactly where the state is absent. Of a 2D file: pixels as
    /// the file counts them (iBUG from 1), x right, y down, z = 0.
    pub points: Vec<Option<Point3<f64>>>,
    /// N states.
    pub states: Vec<LandmarkState>,
    /// N confidences in 0..=1; 1 where the format has none, 0 where absent.
    pub confidences: Vec<f64>,
    /// 3, or 2 for landmarks of an image.
    pub dimensions: usize,
}

impl LandmarkFile {
    /// Landmarks in space; those with a place are observed with confidence 1.
    pub fn new(scan: impl Into<String>, points: Vec<Option<Point3<f64>>>) -> Self {
        let states = points
            .iter()
            .map(|p| if p.is_some() { LandmarkState::Observed } else { LandmarkState::Absent })
            .collect();
        let confidences = points.iter().map(|p| if p.is_some() { 1.0 } else { 0.0 }).collect();
        Self { scan: scan.into(), points, states, confidences, dimensions: 3 }
    }

    /// Which set of landmarks these are.
    pub fn scheme(&self) -> LandmarkScheme {
        LandmarkScheme::of_count(self.points.len())
    }

    /// Whether the arrays agree and hold what their documentation says.
    fn check(&self) -> Result<(), Fault> {
        let n = self.points.len();
        let broken = |reason: String| Err(Fault::new(reason, "Place these landmarks again"));
        if n == 0 || n > MAX_LANDMARKS {
            return broken(format!("it has {n} landmarks, not 1 to {MAX_LANDMARKS}"));
        }
        if self.states.len() != n || self.confidences.len() != n {
            let (s, c) = (self.states.len(), self.confidences.len());
            return broken(format!("{n} landmarks stand against {s} states and {c} confidences"));
        }
        for (i, point) in self.points.iter().enumerate() {
            if point.is_some_and(|p| !p.iter().all(|c| c.is_finite())) {
                return broken(format!("landmark {i} is at a place that is not finite"));
            }
            if point.is_none() != (self.states[i] == LandmarkState::Absent) {
                return broken(format!("landmark {i} is {:?} and its place is {point:?}", self.states[i]));
            }
            if !(0.0..=1.0).contains(&self.confidences[i]) {
                return broken(format!("landmark {i} has confidence {}, not 0 to 1", self.confidences[i]));
            }
        }
        Ok(())
    }
}

/// The landmark formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LandmarkFormat {
    /// This program's own.
    Json,
    /// iBUG.
    Pts,
    /// menpo, versions 1 to 3 in, 3 out.
    Ljson,
    /// Bosphorus, read only: its names carried to the network's 478.
    Lm3,
}

impl LandmarkFormat {
    /// The format that the extension of `path` stands for, in either case.
    pub fn from_path(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "json" => Some(Self::Json),
            "pts" => Some(Self::Pts),
            "ljson" => Some(Self::Ljson),
            "lm3" => Some(Self::Lm3),
            _ => None,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Json => "landmark JSON",
            Self::Pts => "iBUG .pts",
            Self::Ljson => "menpo .ljson",
            Self::Lm3 => "Bosphorus .lm3",
        }
    }
}

/// Reads the landmark file at `path`.
pub fn read_landmarks(path: &Path) -> Result<LandmarkFile, ScanError> {
    let Some(format) = LandmarkFormat::from_path(path) else {
        return Err(ScanError::unsupported(path, EXTENSIONS));
    };
    read_landmarks_bytes(&read_limited(path, format.name(), MAX_BYTES)?, format, path)
}

/// Like [`read_landmarks`], from bytes that are already in memory; `path` serves messages.
pub fn read_landmarks_bytes(
    bytes: &[u8],
    format: LandmarkFormat,
    path: &Path,
) -> Result<LandmarkFile, ScanError> {
    let text = std::str::from_utf8(bytes).map_err(|e| Fault::corrupt(format!("it is not UTF-8 text: {e}")));
    match format {
        LandmarkFormat::Json => text.and_then(landmark_json::parse),
        LandmarkFormat::Pts => text.and_then(landmark_pts::parse),
        LandmarkFormat::Ljson => text.and_then(landmark_ljson::parse),
        // Its comments may be in any encoding.
        LandmarkFormat::Lm3 => landmark_lm3::parse(&String::from_utf8_lossy(bytes)),
    }
    .and_then(|file| file.check().map(|()| file))
    .map_err(|fault| fault.at(path, format.name()))
}

/// Writes `landmarks` to `path` in the format of its extension. The file is written beside and then renamed, so
/// that a full disk or a crash leaves the old one whole.
pub fn write_landmarks(path: &Path, landmarks: &LandmarkFile) -> Result<(), ScanError> {
    let Some(format) = LandmarkFormat::from_path(path).filter(|format| *format != LandmarkFormat::Lm3) else {
        return Err(ScanError::unsupported(path, WRITTEN));
    };
    landmarks.check().map_err(|fault| fault.at(path, format.name()))?;
    let text = match format {
        LandmarkFormat::Json | LandmarkFormat::Lm3 => landmark_json::format(landmarks),
        LandmarkFormat::Pts => landmark_pts::format(landmarks),
        LandmarkFormat::Ljson => landmark_ljson::format(landmarks),
    };
    replace_file(path, text.as_bytes()).map_err(|source| ScanError::Write { path: path.to_owned(), source })
}

fn replace_file(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        // As any new file: the umask decides, where tempfile's own default is private to the user.
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.prefix(".landmarks-").tempfile_in(folder_of(path))?;
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}

/// A number with up to 15 significant digits, in a form that JSON takes.
///
/// 15 digits survive any decimal reader, also one that is not correctly rounded for 17.
pub(super) fn decimal(x: f64) -> String {
    let rounded: f64 = format!("{x:.14e}").parse().unwrap_or(x);
    // No "-0.0", which would differ from 0.0 in bytes only.
    format!("{:?}", rounded + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals() {
        assert_eq!(decimal(1.0), "1.0");
        assert_eq!(decimal(-0.0), "0.0");
        assert_eq!(decimal(0.1 + 0.2), "0.3");
        assert_eq!(decimal(-123.456_789_012_345_67), "-123.456789012346");
        assert_eq!(decimal(1e-9), "1e-9");
    }

    #[test]
    fn counts_tell_the_scheme() {
        for count in [478, 468, 68, 5] {
            assert_eq!(LandmarkScheme::of_count(count).count(), count);
        }
        assert_eq!(LandmarkScheme::of_count(68), LandmarkScheme::Ibug68);
    }

    #[test]
    fn disagreeing_arrays_are_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        let good = LandmarkFile::new("x", vec![Some(Point3::new(1.0, 2.0, 3.0)), None]);
        let mut bad = vec![good.clone(), good.clone(), good.clone(), LandmarkFile::new("x", vec![])];
        bad[0].states[1] = LandmarkState::Observed;
        bad[1].confidences[0] = f64::NAN;
        bad[2].points[0] = Some(Point3::new(f64::INFINITY, 0.0, 0.0));
        for file in &bad {
            assert!(write_landmarks(&path, file).is_err());
        }
        assert!(!path.exists());
        write_landmarks(&path, &good).unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
