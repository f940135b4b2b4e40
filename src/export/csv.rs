//! The motion table: one CSV row a frame, in the columns of OpenFace's output.
//!
//! `frame, face_id, timestamp, confidence, success, pose_Tx … pose_Rz, x_0 …, y_0 …, z_0 …, state, gaze_angle_x,
//! gaze_angle_y, closure_right, closure_left, AU01_r …`, separated by bare commas as OpenFace 2 writes them, so that scripts for
//! OpenFace's files find these columns by name. Differences: the landmarks are ours in number and order; `z_i` is the
//! landmark's depth hint in pixels; `state` and the closures are added, and the gaze stands at the end; the timestamp
//! has nine decimals, which hold the integer nanoseconds exactly; and a cell without a value is empty where OpenFace
//! writes 0, because 0 is also a place.

use std::path::Path;

use super::decimal::{push_fixed, push_integer, push_nanoseconds};
use super::{Draft, ExportError};
use crate::capture::Timestamp;

/// Decimals of landmarks in pixels and of translations in millimetres.
const LENGTH_DECIMALS: usize = 3;
/// Decimals of angles in radians.
const ANGLE_DECIMALS: usize = 6;
/// Decimals of the confidence.
const CONFIDENCE_DECIMALS: usize = 4;
/// Decimals of the lids' closures.
const CLOSURE_DECIMALS: usize = 4;
/// Decimals of action units.
const ACTION_DECIMALS: usize = 2;

pub(super) const POSE_COLUMNS: [&str; 6] = ["pose_Tx", "pose_Ty", "pose_Tz", "pose_Rx", "pose_Ry", "pose_Rz"];
pub(super) const EYE_COLUMNS: [&str; 4] = ["gaze_angle_x", "gaze_angle_y", "closure_right", "closure_left"];

/// One frame's motion, as it is written. NaN stands for an absent value wherever there is a number.
#[derive(Debug, Clone, Copy)]
pub struct MotionRow<'a> {
    /// The frame's number, counted from 1 as OpenFace does.
    pub frame: u64,
    /// When it is shown.
    pub timestamp: Timestamp,
    /// How sure the tracker is, 0..=1.
    pub confidence: f64,
    /// Whether the face was found in this very frame.
    pub success: bool,
    /// Head translation in millimetres, OpenCV's camera frame (x right, y down, z away from the camera).
    pub translation: [f64; 3],
    /// Head rotation in radians, same frame, in the three-angle form that the caller states; OpenFace's is R = Rx·Ry·Rz.
    pub rotation: [f64; 3],
    /// L × 3: x, y in image pixels (x right, y down) and the depth hint in pixels; empty when the face is lost.
    pub landmarks: &'a [[f64; 3]],
    /// `tracking`, `held`, `easing`, `blending`, `lost`, …: printable ASCII without commas or quotes.
    pub state: &'a str,
    /// Where the eyes look, radians in the camera's frame as OpenFace has them: to the picture's right (the subject's
    /// left), then down.
    pub gaze: [f64; 2],
    /// How far the right and the left eye have closed: 0 as in the neutral, 1 shut, below 0 opened wider.
    pub closure: [f64; 2],
    /// A value for each of the table's columns of action units.
    pub actions: &'a [f64],
}

/// Writes a motion table row by row.
#[derive(Debug)]
pub struct MotionCsvWriter {
    draft: Draft,
    landmarks: usize,
    actions: usize,
    line: Vec<u8>,
}

impl MotionCsvWriter {
    /// Starts a table at `path` with columns for `landmarks` points, and at the end those of `actions`.
    pub fn create(path: &Path, landmarks: usize, actions: &[String]) -> Result<Self, ExportError> {
        let mut draft = Draft::create(path)?;
        let mut line = b"frame,face_id,timestamp,confidence,success".to_vec();
        for name in POSE_COLUMNS {
            line.push(b',');
            line.extend_from_slice(name.as_bytes());
        }
        for axis in [b'x', b'y', b'z'] {
            for index in 0..landmarks {
                line.extend_from_slice(&[b',', axis, b'_']);
                push_integer(&mut line, index as u64);
            }
        }
        line.extend_from_slice(b",state");
        for name in EYE_COLUMNS {
            line.push(b',');
            line.extend_from_slice(name.as_bytes());
        }
        for name in actions {
            line.push(b',');
            line.extend_from_slice(name.as_bytes());
        }
        line.push(b'\n');
        draft.append(&line)?;
        Ok(Self { draft, landmarks, actions: actions.len(), line })
    }

    /// Appends one row.
    ///
    /// Refuses infinite numbers, a number of landmarks that is neither 0 nor the table's, and a state that would
    /// break the row.
    pub fn write_row(&mut self, row: &MotionRow) -> Result<(), ExportError> {
        let refuse = |reason, remedy| Err(ExportError::refused(self.draft.destination(), reason, remedy));
        if !row.landmarks.is_empty() && row.landmarks.len() != self.landmarks {
            return refuse(
                format!("frame {} has {} landmarks, not {}", row.frame, row.landmarks.len(), self.landmarks),
                "Give every row the table's landmarks, or none",
            );
        }
        if row.actions.len() != self.actions {
            return refuse(
                format!("frame {} has {} action units, not {}", row.frame, row.actions.len(), self.actions),
                "Give every row a value for each of the table's action units",
            );
        }
        let poses = row.translation.iter().chain(&row.rotation);
        let mut single =
            poses.chain([&row.confidence]).chain(&row.gaze).chain(&row.closure).chain(row.actions);
        if single.any(|value| value.is_infinite())
            || row.landmarks.as_flattened().iter().any(|value| value.is_infinite())
        {
            return refuse(
                format!("frame {} holds an infinite number", row.frame),
                "Mark what is absent with NaN",
            );
        }
        if !row.state.bytes().all(|byte| matches!(byte, b' '..=b'~') && byte != b',' && byte != b'"') {
            return refuse(
                format!("the state {:?} of frame {} does not fit a cell", row.state, row.frame),
                "Use a plain word",
            );
        }
        let line = &mut self.line;
        line.clear();
        push_integer(line, row.frame);
        line.extend_from_slice(b",0,");
        push_nanoseconds(line, row.timestamp.0);
        push_cell(line, row.confidence, CONFIDENCE_DECIMALS);
        line.extend_from_slice(if row.success { b",1" } else { b",0" });
        for value in row.translation {
            push_cell(line, value, LENGTH_DECIMALS);
        }
        for value in row.rotation {
            push_cell(line, value, ANGLE_DECIMALS);
        }
        for axis in 0..3 {
            if row.landmarks.is_empty() {
                line.resize(line.len() + self.landmarks, b',');
            }
            for landmark in row.landmarks {
                push_cell(line, landmark[axis], LENGTH_DECIMALS);
            }
        }
        line.push(b',');
        line.extend_from_slice(row.state.as_bytes());
        for value in row.gaze {
            push_cell(line, value, ANGLE_DECIMALS);
        }
        for value in row.closure {
            push_cell(line, value, CLOSURE_DECIMALS);
        }
        for &value in row.actions {
            push_cell(line, value, ACTION_DECIMALS);
        }
        line.push(b'\n');
        self.draft.append(&self.line)
    }

    /// Puts the file in place.
    pub fn commit(self) -> Result<(), ExportError> {
        self.draft.commit()
    }
}

fn push_cell(line: &mut Vec<u8>, value: f64, decimals: usize) {
    line.push(b',');
    if !value.is_nan() {
        push_fixed(line, value, decimals);
    }
}
