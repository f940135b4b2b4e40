//! Which landmark each marker sits at, in memory and in a small file.

use std::{collections::BTreeMap, path::Path};

use super::MuscleError;
use crate::{rows::read_text, tracking::SKIN_LANDMARK_COUNT};

/// A file of names is small.
const MOST_BYTES: u64 = 1 << 20;
const REMEDY: &str = "Write [markers] and below it NAME = LANDMARK, NAME = [LANDMARK, ...] or NAME = \"off\"";

/// Where one marker sits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MarkerPlace {
    /// On no place of the face that matters.
    Off,
    /// At the mean of these skin landmarks (one at least, each below 468).
    Landmarks(Vec<usize>),
}

impl MarkerPlace {
    /// The landmarks; none where it is off.
    pub fn landmarks(&self) -> &[usize] {
        match self {
            Self::Off => &[],
            Self::Landmarks(landmarks) => landmarks,
        }
    }
}

/// Markers' names and where they sit.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct MarkerMap {
    /// By name, as the take spells it.
    pub places: BTreeMap<String, MarkerPlace>,
}

impl MarkerMap {
    /// Reads a mapping file.
    pub fn read(path: &Path) -> Result<Self, MuscleError> {
        let fault = |reason: String| MuscleError::File { path: path.into(), reason, remedy: REMEDY };
        let text = read_text(path, MOST_BYTES, "list of markers").map_err(fault)?;
        Self::parse(&text).map_err(fault)
    }

    /// Reads a mapping's text; the error is a reason.
    pub fn parse(text: &str) -> Result<Self, String> {
        let document: toml::Table =
            text.parse().map_err(|error: toml::de::Error| error.message().to_owned())?;
        if let Some(other) = document.keys().find(|key| *key != "markers") {
            return Err(format!("it has {other:?} beside [markers]"));
        }
        let Some(markers) = document.get("markers").and_then(toml::Value::as_table) else {
            return Err("it has no table [markers]".to_owned());
        };
        let mut places = BTreeMap::new();
        for (name, value) in markers {
            let place = place(value).map_err(|reason| format!("{name} is {reason}"))?;
            places.insert(name.clone(), place);
        }
        Ok(Self { places })
    }

    /// The mapping as a file.
    pub fn format(&self) -> String {
        let markers: toml::Table = self
            .places
            .iter()
            .map(|(name, place)| {
                let value = match place {
                    MarkerPlace::Off => toml::Value::from("off"),
                    MarkerPlace::Landmarks(landmarks) => match landmarks[..] {
                        [landmark] => toml::Value::from(landmark as i64),
                        _ => landmarks.iter().map(|l| *l as i64).collect::<Vec<_>>().into(),
                    },
                };
                (name.clone(), value)
            })
            .collect();
        toml::Table::from_iter([("markers".to_owned(), markers.into())]).to_string()
    }

    /// The landmarks of each of `names`; none for those that are off or unknown.
    pub fn landmarks<'a>(&'a self, names: &'a [String]) -> impl Iterator<Item = &'a [usize]> {
        names.iter().map(|name| self.places.get(name).map_or(&[][..], MarkerPlace::landmarks))
    }
}

fn place(value: &toml::Value) -> Result<MarkerPlace, String> {
    let one = |value: &toml::Value| {
        let landmark = value.as_integer().and_then(|n| usize::try_from(n).ok());
        landmark
            .filter(|n| *n < SKIN_LANDMARK_COUNT)
            .ok_or_else(|| format!("{value}, and landmarks of the skin are 0 to {}", SKIN_LANDMARK_COUNT - 1))
    };
    match value {
        toml::Value::String(text) if text == "off" => Ok(MarkerPlace::Off),
        toml::Value::Array(list) if !list.is_empty() => {
            Ok(MarkerPlace::Landmarks(list.iter().map(one).collect::<Result<_, _>>()?))
        }
        _ => Ok(MarkerPlace::Landmarks(vec![one(value)?])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_and_back() {
        let text = "[markers]\nLmouth = 291\nForehead_M = \"off\"\n\"a b\" = [61, 291] # between\n";
        let map = MarkerMap::parse(text).unwrap();
        assert_eq!(map.places["a b"], MarkerPlace::Landmarks(vec![61, 291]));
        assert_eq!(map.places["Forehead_M"], MarkerPlace::Off);
        assert_eq!(MarkerMap::parse(&map.format()).unwrap(), map);
        let names = ["Lmouth", "Forehead_M", "none"].map(str::to_owned);
        let landmarks: Vec<_> = map.landmarks(&names).collect();
        assert_eq!(landmarks, [&[291][..], &[], &[]]);
    }

    #[test]
    fn says_what_is_wrong() {
        let reason = |text: &str| MarkerMap::parse(text).unwrap_err();
        assert!(reason("").contains("no table [markers]"));
        assert!(reason("markers = 3").contains("no table [markers]"));
        assert!(reason("[markers]\na = 468").contains("a is 468"));
        assert!(reason("[markers]\na = -1").contains("a is -1"));
        assert!(reason("[markers]\na = []").contains("a is []"));
        assert!(reason("[markers]\na = \"of\"").contains("\"of\""));
        assert!(reason("[marker]\na = 1").contains("\"marker\" beside"));
        assert!(!reason("[markers\n").is_empty());
        let error = MarkerMap::read(Path::new("/nowhere/map.toml")).unwrap_err().to_string();
        assert!(error.starts_with("/nowhere/map.toml: ") && error.contains("NAME = LANDMARK"), "{error}");
    }
}
