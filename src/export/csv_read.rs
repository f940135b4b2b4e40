//! Reading a motion table back, ours or OpenFace's: columns are found by name, in any order.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use super::ExportError;
use super::csv::{EYE_COLUMNS, POSE_COLUMNS};
use crate::capture::Timestamp;

/// One row as it was read; NaN stands for an empty cell wherever there is a number. Units as in
/// [`MotionRow`](super::MotionRow).
#[derive(Debug, Clone, PartialEq)]
pub struct MotionRecord {
    /// The frame's number, counted from 1.
    pub frame: u64,
    /// When it is shown.
    pub timestamp: Timestamp,
    /// 0..=1.
    pub confidence: f64,
    /// Whether the face was found in this very frame.
    pub success: bool,
    /// Millimetres, OpenCV's camera frame.
    pub translation: [f64; 3],
    /// Radians.
    pub rotation: [f64; 3],
    /// L × 3, pixels; z is NaN in tables without `z_i` columns.
    pub landmarks: Vec<[f64; 3]>,
    /// Empty in tables without this column.
    pub state: String,
    /// Radians, camera frame; NaN in tables without these columns.
    pub gaze: [f64; 2],
    /// Right and left; NaN in tables without these columns.
    pub closure: [f64; 2],
}

/// Reads the whole table at `path`.
///
/// Wanted columns: `frame, timestamp, confidence, success`, the six of the pose, and `x_i, y_i` counted from 0 without
/// gaps. `z_i`, `state`, `gaze_angle_x, gaze_angle_y` and the closures may be missing, others are passed over. Blanks around a cell, a byte-order mark, CRLF and
/// empty lines are accepted. Errors give the line and the column.
pub fn read_motion_csv(path: &Path) -> Result<Vec<MotionRecord>, ExportError> {
    let text = fs::read_to_string(path).map_err(|source| ExportError::read(path, source))?;
    parse(&text).map_err(|reason| ExportError::Malformed {
        path: path.into(),
        format: "motion CSV",
        reason,
        remedy: "Export the motion again, or correct that cell",
    })
}

/// Where each value stands in a row.
struct Columns {
    count: usize,
    frame: usize,
    timestamp: usize,
    confidence: usize,
    success: usize,
    pose: [usize; 6],
    landmarks: Vec<[Option<usize>; 3]>,
    state: Option<usize>,
    eyes: [Option<usize>; 4],
}

impl Columns {
    fn find(header: &str) -> Result<Self, String> {
        let mut places = BTreeMap::new();
        for (place, name) in header.split(',').map(str::trim).enumerate() {
            if places.insert(name, place).is_some() && !name.is_empty() {
                return Err(format!("line 1 names the column {name} twice"));
            }
        }
        let wanted = |name: &str| {
            places.get(name).copied().ok_or_else(|| format!("line 1 does not name the column {name}"))
        };
        let mut pose = [0; 6];
        for (place, name) in pose.iter_mut().zip(POSE_COLUMNS) {
            *place = wanted(name)?;
        }
        let mut landmarks = Vec::new();
        while let Some(&x) = places.get(format!("x_{}", landmarks.len()).as_str()) {
            let index = landmarks.len();
            let y = wanted(&format!("y_{index}"))?;
            landmarks.push([Some(x), Some(y), places.get(format!("z_{index}").as_str()).copied()]);
        }
        Ok(Self {
            count: header.split(',').count(),
            frame: wanted("frame")?,
            timestamp: wanted("timestamp")?,
            confidence: wanted("confidence")?,
            success: wanted("success")?,
            pose,
            landmarks,
            state: places.get("state").copied(),
            eyes: EYE_COLUMNS.map(|name| places.get(name).copied()),
        })
    }
}

fn parse(text: &str) -> Result<Vec<MotionRecord>, String> {
    let mut lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let Some((_, header)) = lines.next() else {
        return Err("it is empty".into());
    };
    let columns = Columns::find(header)?;
    let names: Vec<&str> = header.split(',').map(str::trim).collect();
    let mut cells = Vec::with_capacity(columns.count);
    let mut records = Vec::new();
    for (number, line) in lines {
        if line.trim().is_empty() {
            continue;
        }
        cells.clear();
        cells.extend(line.split(',').map(str::trim));
        let number = number + 1;
        if cells.len() != columns.count {
            return Err(format!(
                "line {number} has {} cells, and the header names {}",
                cells.len(),
                columns.count
            ));
        }
        let fail = |place: usize, wanted: &str| {
            format!("line {number}, column {}: {:?} is not {wanted}", names[place], cells[place])
        };
        let value = |place: usize| match cells[place] {
            "" => Ok(f64::NAN),
            cell => cell
                .parse::<f64>()
                .ok()
                .filter(|value| !value.is_infinite())
                .ok_or_else(|| fail(place, "a number")),
        };
        let frame = cells[columns.frame].parse().map_err(|_| fail(columns.frame, "a frame number"))?;
        let timestamp = Timestamp::from_decimal(cells[columns.timestamp])
            .ok_or_else(|| fail(columns.timestamp, "a time in seconds"))?;
        let success = match cells[columns.success] {
            "1" => true,
            "0" => false,
            _ => return Err(fail(columns.success, "0 or 1")),
        };
        let mut pose = [0.0; 6];
        for (slot, &place) in pose.iter_mut().zip(&columns.pose) {
            *slot = value(place)?;
        }
        let mut landmarks = vec![[f64::NAN; 3]; columns.landmarks.len()];
        for (landmark, places) in landmarks.iter_mut().zip(&columns.landmarks) {
            for (slot, place) in landmark.iter_mut().zip(places) {
                if let &Some(place) = place {
                    *slot = value(place)?;
                }
            }
        }
        let mut eyes = [f64::NAN; 4];
        for (slot, place) in eyes.iter_mut().zip(columns.eyes) {
            if let Some(place) = place {
                *slot = value(place)?;
            }
        }
        let [tx, ty, tz, rx, ry, rz] = pose;
        let [gaze_x, gaze_y, closure_right, closure_left] = eyes;
        records.push(MotionRecord {
            frame,
            timestamp,
            confidence: value(columns.confidence)?,
            success,
            translation: [tx, ty, tz],
            rotation: [rx, ry, rz],
            landmarks,
            state: columns.state.map_or_else(String::new, |place| cells[place].into()),
            gaze: [gaze_x, gaze_y],
            closure: [closure_right, closure_left],
        });
    }
    Ok(records)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPENFACE: &str = "frame, face_id, timestamp, confidence, success, pose_Tx, pose_Ty, pose_Tz, pose_Rx, \
                            pose_Ry, pose_Rz, x_0, x_1, y_0, y_1, AU01_r\r\n\
                            1, 0, 0.033, 0.98, 1, 1, 2, 500, 0.1, 0.2, 0.3, 10, 11, 20, 21, 0.5\r\n\r\n";

    #[test]
    fn an_openface_table_with_blanks_and_other_columns() {
        let records = parse(OPENFACE).unwrap();
        assert_eq!(records.len(), 1);
        assert_eq!(records[0].timestamp, Timestamp(33_000_000));
        assert!(
            records[0].rotation.iter().zip([0.1, 0.2, 0.3]).all(|(got, wanted)| (got - wanted).abs() < 1e-15)
        );
        assert_eq!(records[0].landmarks[1][..2], [11.0, 21.0]);
        assert!(records[0].landmarks[1][2].is_nan() && records[0].state.is_empty());
        assert!(records[0].gaze.iter().chain(&records[0].closure).all(|value| value.is_nan()));
    }

    #[test]
    fn errors_give_line_and_column() {
        let error = |text: &str| parse(text).unwrap_err();
        assert!(error("").contains("empty"));
        assert!(error(&OPENFACE.replace("pose_Ty", "pose")).contains("pose_Ty"));
        assert!(error(&OPENFACE.replace("y_1", "y_2")).contains("y_1"));
        assert!(error(&OPENFACE.replace("y_1", "y_0")).contains("y_0 twice"));
        let cell = error(&OPENFACE.replace(" 500", " far"));
        assert!(cell.contains("line 2, column pose_Tz") && cell.contains("far"), "{cell}");
        assert!(error(&OPENFACE.replace(", 0.5", "")).contains("line 2 has 15 cells"));
        assert!(error(&OPENFACE.replace("0.033", "1e-3")).contains("timestamp"));
        assert!(error(&OPENFACE.replace(" 500", " inf")).contains("pose_Tz"));
    }
}
