//! What optical capture gives: named markers in space, frame by frame.

use std::{
    fs,
    ops::Range,
    path::{Path, PathBuf},
};

use nalgebra::{Point3, Vector3};

use super::{CaptureError, FrameRate, Timestamp, marker_c3d, marker_csv};

/// Larger files are something else, or were meant to be cut: an hour of 100 markers at 120 Hz is half of it.
const MOST_BYTES: u64 = 1 << 30;
/// Coordinates beyond this are no place in a room, whatever the unit.
const FARTHEST: f64 = 1e9;
/// More markers than these are no markers.
pub(super) const MOST_MARKERS: usize = 4096;

/// Named points in space with their time.
#[derive(Debug, Clone, PartialEq)]
pub struct MarkerTake {
    /// Where it came from.
    pub path: PathBuf,
    /// M names, each once, as the file spells them.
    pub names: Vec<String>,
    /// F times, strictly ascending, the first 0.
    pub times: Vec<Timestamp>,
    /// F × M places in the frame and unit of the file; `None` where the marker was not seen.
    pub frames: Vec<Vec<Option<Point3<f64>>>>,
    /// Names of markers that no frame shows; they are not among `names`.
    pub never_seen: Vec<String>,
}

impl MarkerTake {
    /// A take from its parts: `names` (M), `times` (F) and `frames` (F × M); `path` is for messages. Refuses a take
    /// without frames or markers, names given twice, times that do not ascend and places that are not finite, and moves
    /// markers that are never seen to `never_seen`.
    pub fn new(
        path: &Path,
        names: Vec<String>,
        times: Vec<Timestamp>,
        frames: Vec<Vec<Option<Point3<f64>>>>,
    ) -> Result<Self, CaptureError> {
        let mut take = Self { path: path.into(), names, times, frames, never_seen: Vec::new() };
        take.check().map_err(|fault| fault.at(path))?;
        let first = take.times[0].0;
        take.times.iter_mut().for_each(|time| time.0 = time.0.saturating_sub(first));
        let seen: Vec<bool> =
            (0..take.names.len()).map(|m| take.frames.iter().any(|frame| frame[m].is_some())).collect();
        if !seen.contains(&true) {
            let fault = Fault::new("no frame shows any marker", "Label and export the take again");
            return Err(fault.at(path));
        }
        let (kept, lost): (Vec<_>, Vec<_>) = take.names.drain(..).zip(&seen).partition(|(_, seen)| **seen);
        take.names = kept.into_iter().map(|(name, _)| name).collect();
        take.never_seen = lost.into_iter().map(|(name, _)| name).collect();
        for frame in &mut take.frames {
            let mut seen = seen.iter();
            frame.retain(|_| seen.next().is_some_and(|seen| *seen));
        }
        Ok(take)
    }

    /// Where a marker stands among `names`.
    pub fn index(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }

    /// The mean place of each marker over those of `frames` that show it; M, in the file's own frame and unit.
    pub fn mean(&self, frames: Range<usize>) -> Vec<Option<Point3<f64>>> {
        let rows = self.frames.get(frames.start..frames.end.min(self.frames.len())).unwrap_or_default();
        (0..self.names.len())
            .map(|m| {
                let seen: Vec<Vector3<f64>> = rows.iter().filter_map(|row| Some(row[m]?.coords)).collect();
                let sum: Vector3<f64> = seen.iter().sum();
                (!seen.is_empty()).then(|| Point3::from(sum / seen.len() as f64))
            })
            .collect()
    }

    /// The frames of the first `seconds`, at least one.
    pub fn opening(&self, seconds: f64) -> Range<usize> {
        0..self.times.iter().take_while(|time| time.seconds() <= seconds).count().max(1)
    }

    fn check(&self) -> Result<(), Fault> {
        if self.names.is_empty() {
            return Err(Fault::new("it names no markers", "Export the take with its labelled markers"));
        }
        if self.names.len() > MOST_MARKERS {
            let reason = format!("it names {} markers, and {MOST_MARKERS} are the most", self.names.len());
            return Err(Fault::new(reason, "Export the markers of one face"));
        }
        if self.frames.is_empty() {
            return Err(Fault::new("it has no frame at all", "Export the take again, with its frames"));
        }
        let mut sorted: Vec<&String> = self.names.iter().collect();
        sorted.sort();
        if let Some([name, _]) = sorted.array_windows().find(|[a, b]| a == b) {
            let reason = format!("two markers are called {name}");
            return Err(Fault::new(reason, "Give each marker its own name"));
        }
        if self.times.len() != self.frames.len() {
            let reason = format!("{} times for {} frames", self.times.len(), self.frames.len());
            return Err(Fault::damaged(reason));
        }
        if let Some(at) = (1..self.times.len()).find(|&f| self.times[f] <= self.times[f - 1]) {
            let reason = format!("frame {} is not later than the one before", at + 1);
            return Err(Fault::new(reason, "Export the frames in their order, each once"));
        }
        for (f, frame) in self.frames.iter().enumerate() {
            if frame.len() != self.names.len() {
                let reason = format!("frame {} has {} places", f + 1, frame.len());
                return Err(Fault::damaged(reason));
            }
            let astray = |p: &Option<Point3<f64>>| p.is_some_and(|p| !p.iter().all(|c| c.abs() <= FARTHEST));
            if let Some(m) = frame.iter().position(astray) {
                let reason = format!("frame {} has {} at no place in a room", f + 1, self.names[m]);
                return Err(Fault::damaged(reason));
            }
        }
        Ok(())
    }
}

/// Reads a table of markers (`.csv`) or a C3D file (`.c3d`). `rate` is used where a table has no column of times.
pub fn read_markers(path: &Path, rate: FrameRate) -> Result<MarkerTake, CaptureError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    if !matches!(extension.as_str(), "csv" | "c3d") {
        let reason = if extension.is_empty() {
            "its name has no extension".to_owned()
        } else {
            format!("its name ends in .{extension}")
        };
        return Err(Fault::new(reason, "Export markers as .csv or .c3d").at(path));
    }
    let unreadable = |source| CaptureError::Read { path: path.into(), source };
    let size = fs::metadata(path).map_err(unreadable)?.len();
    if size > MOST_BYTES {
        let reason = format!("it has {size} bytes, and {MOST_BYTES} are the most");
        return Err(Fault::new(reason, "Cut the take into shorter ones").at(path));
    }
    let bytes = fs::read(path).map_err(unreadable)?;
    if bytes.is_empty() {
        return Err(CaptureError::Empty { path: path.into() });
    }
    let read = if extension == "csv" { marker_csv::parse(&bytes, rate) } else { marker_c3d::parse(&bytes) };
    let Table { names, times, frames } = read.map_err(|fault| fault.at(path))?;
    MarkerTake::new(path, names, times, frames)
}

/// What a reader found, before it is checked.
#[derive(Debug, Default)]
pub(super) struct Table {
    /// M.
    pub names: Vec<String>,
    /// F.
    pub times: Vec<Timestamp>,
    /// F × M.
    pub frames: Vec<Vec<Option<Point3<f64>>>>,
}

/// A reader's complaint, before the file's name is attached to it.
#[derive(Debug)]
pub(super) struct Fault {
    pub reason: String,
    pub remedy: &'static str,
}

impl Fault {
    pub fn new(reason: impl Into<String>, remedy: &'static str) -> Self {
        Self { reason: reason.into(), remedy }
    }

    /// The file is cut off or corrupt.
    pub fn damaged(reason: impl Into<String>) -> Self {
        Self::new(reason, "Copy or export the file again")
    }

    pub fn at(self, path: &Path) -> CaptureError {
        CaptureError::Markers { path: path.into(), reason: self.reason, remedy: self.remedy }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn take(names: &[&str], frames: Vec<Vec<Option<Point3<f64>>>>) -> Result<MarkerTake, String> {
        let times = (0..frames.len()).map(|f| Timestamp(500 + f as i64 * 10_000_000)).collect();
        let names = names.iter().map(|name| (*name).to_owned()).collect();
        MarkerTake::new(Path::new("a.csv"), names, times, frames).map_err(|error| error.to_string())
    }

    fn at(x: f64) -> Point3<f64> {
        Point3::new(x, 0.0, 0.0)
    }

    #[test]
    fn markers_never_seen_are_named_and_left_out() {
        let read = take(
            &["a", "b", "c"],
            vec![vec![Some(at(1.0)), None, Some(at(5.0))], vec![None, None, Some(at(7.0))]],
        )
        .unwrap();
        assert_eq!((read.names.join(""), read.never_seen.join("")), ("ac".to_owned(), "b".to_owned()));
        assert_eq!(read.frames[1], [None, Some(at(7.0))]);
        assert_eq!(read.times, [Timestamp(0), Timestamp(10_000_000)]);
        assert_eq!(read.mean(0..9), [Some(at(1.0)), Some(at(6.0))]);
        assert_eq!(read.mean(1..2), [None, Some(at(7.0))]);
        assert_eq!(read.mean(5..9), [None, None]);
        assert_eq!((read.opening(0.0), read.opening(1.0)), (0..1, 0..2));
        assert_eq!(read.index("c"), Some(1));
    }

    #[test]
    fn what_is_no_take_is_refused_with_its_name() {
        let refused = |names: &[&str], frames| take(names, frames).unwrap_err();
        assert!(
            refused(&[], vec![vec![]]).contains("a.csv is not a usable marker file: it names no markers")
        );
        assert!(refused(&["a"], vec![]).contains("no frame at all"));
        assert!(refused(&["a"], vec![vec![None]]).contains("no frame shows any marker"));
        assert!(refused(&["a", "b", "a"], vec![vec![None; 3]]).contains("two markers are called a"));
        assert!(refused(&["a"], vec![vec![Some(at(f64::NAN))]]).contains("frame 1 has a at no place"));
        assert!(refused(&["a"], vec![vec![Some(at(1e10))]]).contains("no place"));
        assert!(refused(&["a", "b"], vec![vec![Some(at(1.0))]]).contains("frame 1 has 1 places"));
        let stuck = MarkerTake::new(
            Path::new("a.c3d"),
            vec!["a".into()],
            vec![Timestamp(3); 2],
            vec![vec![Some(at(1.0))]; 2],
        );
        assert!(stuck.unwrap_err().to_string().contains("frame 2 is not later"));
    }

    #[test]
    fn other_files_and_none_are_refused() {
        let rate = FrameRate::nearest(60.0);
        let refused = |name: &str| read_markers(Path::new(name), rate).unwrap_err().to_string();
        assert!(refused("take.trc").contains(".trc") && refused("take").contains("no extension"));
        assert!(refused("/nowhere/take.csv").starts_with("cannot read /nowhere/take.csv"));
        let folder = tempfile::tempdir().unwrap();
        let empty = folder.path().join("take.C3D");
        fs::write(&empty, b"").unwrap();
        assert!(matches!(read_markers(&empty, rate), Err(CaptureError::Empty { .. })));
    }
}
