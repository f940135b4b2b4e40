//! This program's own landmark file: JSON, one landmark a line.

use std::fmt::Write as _;

use nalgebra::Point3;
use serde::Deserialize;

use super::error::Fault;
use super::landmark_file::{LandmarkFile, MAX_LANDMARKS, decimal};
use super::landmark_ljson;
use crate::tracking::LandmarkState;

const FORMAT: &str = "understudy landmarks 1";

#[derive(Deserialize)]
struct Document {
    format: String,
    #[serde(default)]
    scan: String,
    count: usize,
    #[serde(default = "three")]
    dimensions: usize,
    points: Vec<Entry>,
}

#[derive(Deserialize)]
struct Entry {
    index: usize,
    x: Option<f64>,
    y: Option<f64>,
    z: Option<f64>,
    state: LandmarkState,
    confidence: Option<f64>,
}

fn three() -> usize {
    3
}

/// Landmarks that the file leaves out are absent.
pub(super) fn parse(text: &str) -> Result<LandmarkFile, Fault> {
    let document: Document = match serde_json::from_str(text) {
        Ok(document) => document,
        // menpo's files are JSON too, and some carry its extension.
        Err(error) => return landmark_ljson::parse(text).map_err(|_| Fault::corrupt(error.to_string())),
    };
    if document.format != FORMAT {
        let reason = format!("its format is {:?}, not {FORMAT:?}", document.format);
        return Err(Fault::new(reason, "Write it again with this version"));
    }
    if document.count > MAX_LANDMARKS {
        return Err(Fault::corrupt(format!("it announces {} landmarks", document.count)));
    }
    let mut file = LandmarkFile::new(document.scan, vec![None; document.count]);
    file.dimensions = if document.dimensions == 2 { 2 } else { 3 };
    let mut seen = vec![false; document.count];
    for entry in document.points {
        let Some(seen) = seen.get_mut(entry.index) else {
            return Err(Fault::corrupt(format!(
                "landmark {} of {} is out of range",
                entry.index, document.count
            )));
        };
        if std::mem::replace(seen, true) {
            return Err(Fault::corrupt(format!("landmark {} stands there twice", entry.index)));
        }
        file.states[entry.index] = entry.state;
        if entry.state == LandmarkState::Absent {
            continue;
        }
        let (Some(x), Some(y), Some(z)) = (entry.x, entry.y, entry.z) else {
            return Err(Fault::corrupt(format!("landmark {} lacks x, y or z", entry.index)));
        };
        file.points[entry.index] = Some(Point3::new(x, y, z));
        file.confidences[entry.index] = entry.confidence.unwrap_or(1.0);
    }
    Ok(file)
}

pub(super) fn format(file: &LandmarkFile) -> String {
    let scan = serde_json::Value::from(file.scan.as_str());
    let mut out = format!("{{\"format\":\"{FORMAT}\",\"scan\":{scan},\"count\":{},", file.points.len());
    if file.dimensions == 2 {
        out.push_str("\"dimensions\":2,");
    }
    out.push_str("\"points\":[\n");
    for (i, point) in file.points.iter().enumerate() {
        // Writing to a String cannot fail.
        let _ = match (point, file.states[i]) {
            (Some(p), state) => write!(
                out,
                "{{\"index\":{i},\"x\":{},\"y\":{},\"z\":{},\"state\":\"{}\",\"confidence\":{}}}",
                decimal(p.x),
                decimal(p.y),
                decimal(p.z),
                if state == LandmarkState::Inferred { "inferred" } else { "observed" },
                decimal(file.confidences[i]),
            ),
            (None, _) => write!(out, "{{\"index\":{i},\"state\":\"absent\",\"confidence\":0.0}}"),
        };
        out.push_str(if i + 1 < file.points.len() { ",\n" } else { "\n" });
    }
    out.push_str("]}\n");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_it_writes() {
        let mut file = LandmarkFile::new("a \"scan\"\n", vec![Some(Point3::new(0.1, -2.0, 3e-7)), None]);
        file.states[0] = LandmarkState::Inferred;
        file.confidences[0] = 0.25;
        let text = format(&file);
        let wanted =
            "{\"index\":0,\"x\":0.1,\"y\":-2.0,\"z\":3e-7,\"state\":\"inferred\",\"confidence\":0.25},\n";
        assert!(text.contains(wanted), "{text}");
        assert_eq!(parse(&text).unwrap(), file);
    }

    #[test]
    fn says_what_is_wrong() {
        let of = |count: &str, points: &str| {
            parse(&format!("{{\"format\":\"{FORMAT}\",\"count\":{count},\"points\":[{points}]}}"))
                .unwrap_err()
                .reason
        };
        assert!(of("99999999999", "").contains("announces"));
        let one = "{\"index\":0,\"x\":1,\"y\":2,\"z\":3,\"state\":\"observed\"}";
        assert!(of("1", &format!("{one},{one}")).contains("twice"));
        assert!(of("0", one).contains("out of range"));
        assert!(of("1", "{\"index\":0,\"x\":1,\"state\":\"observed\"}").contains("lacks"));
        let other = "{\"format\":\"else\",\"count\":0,\"points\":[]}";
        assert!(parse(other).unwrap_err().reason.contains("\"else\""));
        assert!(parse("{").is_err());
    }
}
