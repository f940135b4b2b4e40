//! Bosphorus' `.lm3`: up to 24 named landmarks of a scan.
//!
//! A line `22 landmarks:`, then for each landmark a line with its name and one with `x y z`; `#` begins a comment. The
//! names are carried to the network's 478 by [`NAMES`]. Left and right may be the subject's or the viewer's in such a
//! file: taken is whichever makes the nose point out of the face.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::error::Fault;
use super::landmark_file::{LandmarkFile, MAX_LANDMARKS};
use crate::tracking::{LANDMARK_COUNT, landmark_table};

/// Bosphorus' landmarks and the network's nearest, left being the subject's. "Of" and "the" count for nothing. On the
/// lobes of the ears the network has no landmark.
pub const NAMES: [(&str, Option<usize>); 24] = [
    ("outer left eyebrow", Some(300)),
    ("middle left eyebrow", Some(334)),
    ("inner left eyebrow", Some(336)),
    ("inner right eyebrow", Some(107)),
    ("middle right eyebrow", Some(105)),
    ("outer right eyebrow", Some(70)),
    ("outer left eye corner", Some(263)),
    ("inner left eye corner", Some(362)),
    ("inner right eye corner", Some(133)),
    ("outer right eye corner", Some(33)),
    ("nose saddle left", Some(417)),
    ("nose saddle right", Some(193)),
    ("left nose peak", Some(331)),
    ("nose tip", Some(4)),
    ("right nose peak", Some(102)),
    ("left mouth corner", Some(291)),
    ("upper lip outer middle", Some(0)),
    ("right mouth corner", Some(61)),
    ("upper lip inner middle", Some(13)),
    ("lower lip inner middle", Some(14)),
    ("lower lip outer middle", Some(17)),
    ("chin middle", Some(199)),
    ("left ear lobe", None),
    ("right ear lobe", None),
];

pub(super) fn parse(text: &str) -> Result<LandmarkFile, Fault> {
    let mut points = vec![None; LANDMARK_COUNT];
    let (mut found, mut announced) = (BTreeMap::new(), None);
    let mut waiting: Option<(usize, String)> = None;
    for (number, line) in (1..).zip(text.trim_start_matches('\u{feff}').lines()) {
        let line = line.trim();
        let fault = |what: String| Fault::corrupt(format!("line {number}: {what}"));
        if line.is_empty() || line.starts_with(['#', '%']) || line.starts_with("//") {
            continue;
        }
        let words: Vec<&str> = line.split(|c: char| c.is_whitespace() || c == ',').collect();
        let words: Vec<&str> = words.into_iter().filter(|word| !word.is_empty()).take(16).collect();
        let numbers: Option<Vec<f64>> = words.iter().map(|word| word.parse().ok()).collect();
        if let Some(values) = numbers {
            let Some((_, name)) = waiting.take() else {
                return Err(fault("numbers without a landmark's name before them".into()));
            };
            let &[x, y, z] = &values[..] else {
                return Err(fault(format!("{name:?} has {} numbers, not x y z", values.len())));
            };
            let place = Point3::new(x, y, z);
            if found.len() == MAX_LANDMARKS {
                return Err(fault("too many landmarks".into()));
            }
            let place = (!place.iter().any(|c| c.is_nan())).then_some(place);
            if found.insert(name.clone(), place).is_some() {
                return Err(fault(format!("{name:?} has a place already")));
            }
        } else if let Some(count) = count_line(&words) {
            announced = Some(count);
        } else if let Some((earlier, name)) = waiting.replace((number, plain(&words))) {
            return Err(Fault::corrupt(format!("line {earlier}: {name:?} is followed by no x y z")));
        }
    }
    if let Some((earlier, name)) = waiting {
        return Err(Fault::corrupt(format!("line {earlier}: {name:?} is followed by no x y z")));
    }
    if let Some(count) = announced.filter(|count| *count != found.len()) {
        tracing::warn!(
            announced = count,
            found = found.len(),
            "the .lm3 file announces another number of landmarks"
        );
    }
    for (name, place) in found {
        match NAMES.iter().find(|(known, _)| *known == name) {
            Some((_, Some(landmark))) => points[*landmark] = place,
            Some((_, None)) => tracing::info!(name, "passed over: the network has no such landmark"),
            None => tracing::warn!(name, "passed over: not a landmark of Bosphorus"),
        }
    }
    if points.iter().all(Option::is_none) {
        return Err(Fault::new(
            "none of Bosphorus' landmarks stands in it",
            "Name them as Bosphorus does, such as \"Nose tip\"",
        ));
    }
    if is_the_viewers(&points) == Some(true) {
        points = (0..LANDMARK_COUNT).map(|i| points[landmark_table()[i].mirror]).collect();
    }
    Ok(LandmarkFile::new("", points))
}

/// `22 landmarks:`
fn count_line(words: &[&str]) -> Option<usize> {
    let [count, what] = words else { return None };
    what.trim_end_matches(':').eq_ignore_ascii_case("landmarks").then(|| count.parse().ok()).flatten()
}

/// A landmark's name in lower case, without what writers of such files differ in.
fn plain(words: &[&str]) -> String {
    let words = words.iter().map(|word| word.trim_end_matches(':').to_lowercase());
    words.filter(|word| word != "of" && word != "the" && !word.is_empty()).collect::<Vec<_>>().join(" ")
}

/// Whether "left" is the viewer's left: then the nose, which stands out of the face, would point into it. `None` where
/// too little is known.
fn is_the_viewers(points: &[Option<Point3<f64>>]) -> Option<bool> {
    let pair = |left: usize, right: usize| Some((points[left]?, points[right]?));
    let (left, right) = pair(263, 33).or_else(|| pair(362, 133)).or_else(|| pair(291, 61))?;
    let nose = points[4]?;
    let below = points[199].or(points[17]).or(points[0])?;
    let above = pair(263, 33).or_else(|| pair(362, 133)).map(|(l, r)| nalgebra::center(&l, &r));
    let above = above.or(points[334]).or(points[336])?;
    let out = (left - right).cross(&(above - below));
    let middle = nalgebra::center(&above, &below);
    Some(out.dot(&(nose - middle)) < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FACE: &str = "# 3D Facial Landmarks of bs000_N_N_0\r\n\r\n22 landmarks:\r\n\
        Outer left eye corner\r\n45 30 30\r\nOuter right eye corner\r\n-45 30 30\r\n\
        Nose tip\r\n0 -5 75.5\r\nChin middle\r\n0 -80 50\r\nMiddle of the left eyebrow\r\n40 50 45\r\n\
        Left ear lobe\r\n-80 0 -20\r\n";

    #[test]
    fn names_lead_to_the_networks_landmarks() {
        let file = parse(FACE).unwrap();
        assert_eq!(file.points.len(), LANDMARK_COUNT);
        assert_eq!(file.points[263], Some(Point3::new(45.0, 30.0, 30.0)));
        assert_eq!(file.points[4], Some(Point3::new(0.0, -5.0, 75.5)));
        assert_eq!(file.points[334], Some(Point3::new(40.0, 50.0, 45.0)));
        assert_eq!(file.points.iter().flatten().count(), 5);
    }

    #[test]
    fn a_viewers_left_is_the_subjects_right() {
        let swapped = FACE.replace("left", "LEFT").replace("right", "left").replace("LEFT", "right");
        assert_eq!(parse(&swapped).unwrap(), parse(FACE).unwrap());
    }

    #[test]
    fn the_table_mirrors_itself() {
        for (name, landmark) in NAMES {
            let other = if name.contains("left") {
                name.replace("left", "right")
            } else {
                name.replace("right", "left")
            };
            let (_, mirror) = NAMES.iter().find(|(n, _)| *n == other).unwrap();
            assert_eq!(landmark.map(|i| landmark_table()[i].mirror), *mirror, "{name}");
        }
    }

    #[test]
    fn says_what_is_wrong() {
        let reason = |text: &str| parse(text).unwrap_err().reason;
        assert!(
            reason("Nose tip\nChin middle\n1 2 3").contains("line 1: \"nose tip\" is followed by no x y z")
        );
        assert!(reason("Nose tip\n").contains("line 1"));
        assert!(reason("1 2 3\n").contains("line 1: numbers without"));
        assert!(reason("Nose tip\n1 2\n").contains("line 2: \"nose tip\" has 2 numbers"));
        assert!(reason("Nose tip\n1 2 3\nnose  tip\n1 2 3").contains("a place already"));
        assert!(reason("Elbow\n1 2 3").contains("none of Bosphorus"));
        assert!(reason("").contains("none of Bosphorus"));
        assert_eq!(parse("Nose tip\n1 nan 3\nChin middle\n1,2,3").unwrap().points[4], None);
    }
}
