//! menpo's `.ljson`, versions 1 to 3.
//!
//! Version 3 holds named groups of `landmarks.points`, version 2 one such set, version 1 a list of labelled groups
//! whose points follow one another. Connectivity is passed over; labels serve to bring 68 points into iBUG's order, since
//! files differ in which part of the face comes first. menpo keeps image landmarks as
//! (row, column); they become x, y here, and go back on the way out.

use nalgebra::Point3;
use serde_json::{Value, json};

use super::error::Fault;
use super::landmark_file::{LandmarkFile, MAX_LANDMARKS, decimal};

pub(super) fn parse(text: &str) -> Result<LandmarkFile, Fault> {
    let document: Value = serde_json::from_str(text).map_err(|e| Fault::corrupt(e.to_string()))?;
    let no_points = || Fault::corrupt("it holds no landmarks.points");
    match document.get("version").and_then(Value::as_u64) {
        Some(1) => {
            let groups = document.get("groups").and_then(Value::as_array).ok_or_else(no_points)?;
            let listed = groups.iter().filter_map(|g| g.get("landmarks")?.as_array()).flatten();
            points(listed.filter_map(|l| l.get("point")))
        }
        Some(2) => group(&document).ok_or_else(no_points)?,
        Some(3) => {
            let groups = document.get("groups").and_then(Value::as_object).ok_or_else(no_points)?;
            if groups.len() > 1 {
                let names: Vec<&str> = groups.keys().map(String::as_str).collect();
                tracing::warn!(
                    ?names,
                    "the ljson file has several groups of landmarks; the first by name is used"
                );
            }
            let first = groups.values().next().ok_or_else(no_points)?;
            group(first).ok_or_else(no_points)?
        }
        found => Err(Fault::new(
            format!("its version is {found:?}, and 1 to 3 are read"),
            "Import it into menpo and export it again",
        )),
    }
}

/// The parts of iBUG's 68 points in their order, by the names that menpo's importers give them (left is the viewer's).
const IBUG_PARTS: [(&[&str], usize); 7] = [
    (&["jaw", "chin"], 17),
    (&["left_eyebrow", "leyebrow"], 5),
    (&["right_eyebrow", "reyebrow"], 5),
    (&["nose"], 9),
    (&["left_eye", "leye"], 6),
    (&["right_eye", "reye"], 6),
    (&["mouth"], 20),
];

fn group(group: &Value) -> Option<Result<LandmarkFile, Fault>> {
    let values = points_of(group)?;
    Some(match ibug_order(group, values.len()) {
        Some(order) => points(order.iter().map(|&i| &values[i])),
        None => points(values.iter()),
    })
}

/// Where each of iBUG's 68 points stands among `count` points; `None` unless the labels name every part.
fn ibug_order(group: &Value, count: usize) -> Option<Vec<usize>> {
    let labels = group.get("labels")?.as_array()?;
    let mut order = Vec::new();
    for (names, length) in IBUG_PARTS {
        let is_part = |label: &&Value| {
            label.get("label").and_then(Value::as_str).is_some_and(|name| names.contains(&name))
        };
        let mask = labels.iter().find(is_part)?.get("mask")?.as_array()?;
        let indices: Vec<usize> = mask.iter().filter_map(Value::as_u64).map(|i| i as usize).collect();
        if indices.len() != length || indices.iter().any(|&i| i >= count) {
            return None;
        }
        order.extend(indices);
    }
    (order.len() == count).then_some(order)
}

fn points_of(group: &Value) -> Option<&Vec<Value>> {
    group.get("landmarks")?.get("points")?.as_array()
}

fn points<'a>(values: impl Iterator<Item = &'a Value>) -> Result<LandmarkFile, Fault> {
    let mut dimensions = None;
    let mut out = Vec::new();
    for (i, value) in values.enumerate() {
        let fault = || Fault::corrupt(format!("landmark {i} is not two or three numbers, like the others"));
        let numbers = value.as_array().ok_or_else(fault)?;
        let n = numbers.len();
        if !(n == 2 || n == 3) || dimensions.is_some_and(|d| d != n) || i == MAX_LANDMARKS {
            return Err(fault());
        }
        dimensions = Some(n);
        if numbers.iter().any(Value::is_null) {
            out.push(None);
            continue;
        }
        let at = |k: usize| numbers[k].as_f64().ok_or_else(fault);
        out.push(Some(match n {
            2 => Point3::new(at(1)?, at(0)?, 0.0),
            _ => Point3::new(at(0)?, at(1)?, at(2)?),
        }));
    }
    let mut file = LandmarkFile::new("", out);
    file.dimensions = dimensions.unwrap_or(3);
    Ok(file)
}

pub(super) fn format(file: &LandmarkFile) -> String {
    let rows: Vec<String> = file
        .points
        .iter()
        .map(|point| {
            let numbers = match point {
                None => vec!["null".to_owned(); file.dimensions.clamp(2, 3)],
                Some(p) if file.dimensions == 2 => vec![decimal(p.y), decimal(p.x)],
                Some(p) => p.iter().map(|c| decimal(*c)).collect(),
            };
            format!("[{}]", numbers.join(","))
        })
        .collect();
    let mask: Vec<usize> = (0..file.points.len()).collect();
    let labels = json!([{ "label": "all", "mask": mask }]);
    format!(
        "{{\"version\":3,\"groups\":{{\"LJSON\":{{\"labels\":{labels},\
         \"landmarks\":{{\"connectivity\":[],\"points\":[\n{}\n]}}}}}}}}\n",
        rows.join(",\n")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_versions() {
        let wanted = [Some(Point3::new(1.0, 2.0, 3.0)), None];
        let points = "[[1,2.0,3],[null,null,null]]";
        for text in [
            "{\"version\":1,\"groups\":[{\"label\":\"a\",\"landmarks\":[{\"point\":[1,2,3]}]},\
             {\"label\":\"b\",\"landmarks\":[{\"point\":[null,null,null]}]}]}"
                .to_owned(),
            format!("{{\"version\":2,\"labels\":[],\"landmarks\":{{\"points\":{points}}}}}"),
            format!("{{\"version\":3,\"groups\":{{\"LJSON\":{{\"landmarks\":{{\"points\":{points}}}}}}}}}"),
        ] {
            let file = parse(&text).unwrap();
            assert_eq!(file.points, wanted);
            assert_eq!(parse(&format(&file)).unwrap(), file);
        }
    }

    #[test]
    fn image_landmarks_are_row_then_column() {
        let file = parse("{\"version\":2,\"landmarks\":{\"points\":[[10,20]]}}").unwrap();
        assert_eq!((file.dimensions, file.points[0]), (2, Some(Point3::new(20.0, 10.0, 0.0))));
        assert_eq!(parse(&format(&file)).unwrap(), file);
    }

    #[test]
    fn labels_bring_68_points_into_ibug_order() {
        // The eyes come before the brows, as in menpo3d's own james.ljson.
        let parts = [
            ("chin", 17),
            ("leye", 6),
            ("reye", 6),
            ("leyebrow", 5),
            ("nose", 9),
            ("reyebrow", 5),
            ("mouth", 20),
        ];
        let mut next = 0;
        let labels: Vec<_> = parts
            .iter()
            .map(|(label, length)| {
                let mask: Vec<usize> = (next..next + length).collect();
                next += length;
                json!({ "label": label, "mask": mask })
            })
            .collect();
        let points: Vec<_> = (0..68).map(|i| [i, 0, 0]).collect();
        let file = json!({ "version": 2, "labels": labels, "landmarks": { "points": points } }).to_string();
        let read = parse(&file).unwrap().points;
        let xs: Vec<f64> = read.iter().map(|p| p.unwrap().x).collect();
        assert_eq!(
            (xs[0], xs[17], xs[22], xs[27], xs[36], xs[42], xs[48]),
            (0.0, 29.0, 43.0, 34.0, 17.0, 23.0, 48.0)
        );
    }

    #[test]
    fn says_what_is_wrong() {
        let reason = |text: &str| parse(text).unwrap_err().reason;
        assert!(reason("{\"version\":4}").contains("Some(4)"));
        assert!(reason("{\"version\":3,\"groups\":{}}").contains("no landmarks.points"));
        assert!(reason("{\"version\":2,\"landmarks\":{\"points\":[[1,2],[1,2,3]]}}").contains("landmark 1"));
        assert!(reason("{\"version\":2,\"landmarks\":{\"points\":[[1,\"a\"]]}}").contains("landmark 0"));
        assert!(parse("[]").is_err());
    }
}
