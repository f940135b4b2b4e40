//! A library of action units: what each does to the handles of an average face.
//!
//! 000 §7.1 names its main weakness: vectors measured on one source face carry that person's way of acting, and proposes
//! to set action units on the average face. Here every pair of scans is measured on its own face, carried to the average
//! one and averaged there, with what the pairs differ by.

use std::{fmt::Write as _, path::Path, sync::LazyLock};

use nalgebra::{Point3, Vector3};
use serde::Deserialize;

use super::{ActionError, ActionKey, Catalogue};
use crate::{
    lift::Side,
    rows::{read_text, short},
};

const FORMAT: &str = "understudy actions 1";
/// A library file is some 200 kB; far beyond that it is something else.
const MOST_BYTES: u64 = 64 << 20;
/// Shorter vectors are left out, millimetres.
const LEAST: f64 = 0.02;

/// What an action does to one handle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActionVector {
    /// Counted as [`Catalogue::place`] does.
    pub handle: usize,
    /// At magnitude 1, in the average face's scan frame, millimetres.
    pub vector: Vector3<f64>,
    /// Root mean square distance of the pairs' vectors from their mean, millimetres.
    pub spread: f64,
}

/// An action unit at magnitude 1 (000 eq. 5.6).
#[derive(Debug, Clone, PartialEq)]
pub struct Action {
    /// Which.
    pub key: ActionKey,
    /// How far it closes the right and the left eye: 1 shuts, below 0 opens wider.
    pub closure: [f64; 2],
    /// How many pairs of scans it was measured from.
    pub pairs: usize,
    /// Where they came from.
    pub source: String,
    /// By ascending handle; handles left out do not move.
    pub vectors: Vec<ActionVector>,
}

impl Action {
    /// A vector for each of `handles` handles, nothing for those that do not move.
    pub fn dense(&self, handles: usize) -> Vec<Vector3<f64>> {
        let mut vectors = vec![Vector3::zeros(); handles];
        for moved in &self.vectors {
            vectors[moved.handle] = moved.vector;
        }
        vectors
    }
}

/// Actions on one face.
#[derive(Debug, Clone, PartialEq)]
pub struct ActionLibrary {
    /// What messages call it.
    pub name: String,
    /// The average face's handles, scan frame, millimetres.
    pub face: Vec<Point3<f64>>,
    /// By ascending key.
    pub actions: Vec<Action>,
}

#[derive(Deserialize)]
struct Document {
    format: String,
    points: Vec<String>,
    face: Vec<[f64; 3]>,
    actions: Vec<Entry>,
}

#[derive(Deserialize)]
struct Entry {
    au: u8,
    side: Option<Side>,
    closure: [f64; 2],
    pairs: usize,
    source: String,
    vectors: Vec<(usize, f64, f64, f64, f64)>,
}

#[allow(clippy::expect_used, reason = "compile-time data; a test reads all of it")]
static BUILT_IN: LazyLock<ActionLibrary> = LazyLock::new(|| {
    let text = include_str!("../../models/actions.json");
    ActionLibrary::parse("built-in", text).expect("the built-in library is valid")
});

impl ActionLibrary {
    /// The program's own, measured on ICT-FaceKit's and MakeHuman's faces (`docs/actions.md`).
    pub fn built_in() -> &'static Self {
        &BUILT_IN
    }

    /// The same face without actions.
    #[must_use]
    pub fn empty(&self, name: &str) -> Self {
        Self { name: name.to_owned(), face: self.face.clone(), actions: Vec::new() }
    }

    /// Reads a library file.
    pub fn read(path: &Path) -> Result<Self, ActionError> {
        let fault = |reason: String| ActionError::File {
            path: path.into(),
            reason,
            remedy: "Write it with `understudy author`",
        };
        let text = read_text(path, MOST_BYTES, "library of action units").map_err(fault)?;
        Self::parse(&path.display().to_string(), &text).map_err(fault)
    }

    /// Reads a library's text; the error is a reason.
    pub fn parse(name: &str, text: &str) -> Result<Self, String> {
        let document: Document = serde_json::from_str(text).map_err(|error| error.to_string())?;
        if document.format != FORMAT {
            return Err(format!("its format is {:?}, not {FORMAT:?}", document.format));
        }
        let catalogue = Catalogue::get();
        let names = catalogue.point_names();
        if document.points != names || document.face.len() != catalogue.handles() {
            return Err("it was made with other control points than this version's".to_owned());
        }
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        if !document.face.iter().all(|p| finite(p)) {
            return Err("the face has numbers that are not finite".to_owned());
        }
        let mut actions = Vec::new();
        for entry in document.actions {
            let key = ActionKey { au: entry.au, side: entry.side };
            let facts = catalogue.action(entry.au).ok_or_else(|| format!("AU{key} is not known"))?;
            if facts.sides != entry.side.is_some() {
                return Err(format!("AU{key} has a side too many or too few"));
            }
            let mut vectors = Vec::new();
            for (handle, x, y, z, spread) in entry.vectors {
                let in_order = vectors.last().is_none_or(|last: &ActionVector| last.handle < handle);
                if handle >= names.len() + crate::tracking::SKIN_LANDMARK_COUNT || !in_order {
                    return Err(format!("AU{key} moves handle {handle}, which is out of order or not there"));
                }
                if !finite(&[x, y, z, spread]) {
                    return Err(format!("AU{key} moves handle {handle} by what is not a number"));
                }
                vectors.push(ActionVector { handle, vector: Vector3::new(x, y, z), spread });
            }
            let Entry { closure, pairs, source, .. } = entry;
            if !finite(&closure) {
                return Err(format!("AU{key} closes the eyes by what is not a number"));
            }
            actions.push(Action { key, closure, pairs, source, vectors });
        }
        actions.sort_by_key(|action| action.key);
        if actions.windows(2).any(|pair| pair[0].key == pair[1].key) {
            return Err("an action stands there twice".to_owned());
        }
        let face = document.face.iter().map(|p| Point3::from(*p)).collect();
        Ok(Self { name: name.to_owned(), face, actions })
    }

    /// The library as text, an action a line.
    pub fn format(&self) -> String {
        let mut text = format!("{{\"format\":\"{FORMAT}\",\"unit\":\"mm\",\"points\":[\n");
        let names: Vec<String> =
            Catalogue::get().point_names().iter().map(|name| format!("{name:?}")).collect();
        text.push_str(&names.join(",\n"));
        text.push_str("],\"face\":[\n");
        let face: Vec<String> =
            self.face.iter().map(|p| format!("[{},{},{}]", short(p.x), short(p.y), short(p.z))).collect();
        for (k, row) in face.chunks(8).enumerate() {
            let _ = write!(text, "{}{}", if k == 0 { "" } else { ",\n" }, row.join(","));
        }
        text.push_str("],\"actions\":[\n");
        for (k, action) in self.actions.iter().enumerate() {
            let side = match action.key.side {
                Some(Side::Right) => "\"Right\"",
                Some(Side::Left) => "\"Left\"",
                None => "null",
            };
            let vectors: Vec<String> = action
                .vectors
                .iter()
                .map(|v| {
                    let [x, y, z] = [v.vector.x, v.vector.y, v.vector.z].map(short);
                    format!("[{},{x},{y},{z},{}]", v.handle, short(v.spread))
                })
                .collect();
            let [right, left] = action.closure.map(short);
            let _ = write!(
                text,
                "{}{{\"au\":{},\"side\":{side},\"closure\":[{right},{left}],\"pairs\":{},\"source\":{},\"vectors\":[{}]}}",
                if k == 0 { "" } else { ",\n" },
                action.key.au,
                action.pairs,
                serde_json::Value::from(action.source.as_str()),
                vectors.join(",")
            );
        }
        text.push_str("\n]}\n");
        text
    }

    /// The action of one key.
    pub fn get(&self, key: ActionKey) -> Result<&Action, ActionError> {
        self.actions.iter().find(|action| action.key == key).ok_or_else(|| ActionError::NotInLibrary {
            library: self.name.clone(),
            unit: key.to_string(),
            has: self.actions.iter().map(|a| a.key.to_string()).collect::<Vec<_>>().join(", "),
        })
    }

    /// Adds what one more pair of scans shows, to what the library has of the same action. `vectors` has one for each
    /// handle that was measured.
    pub fn add(&mut self, key: ActionKey, vectors: &[Option<Vector3<f64>>], closure: [f64; 2], source: &str) {
        let at = match self.actions.binary_search_by_key(&key, |action| action.key) {
            Ok(at) => at,
            Err(at) => {
                let action =
                    Action { key, closure: [0.0; 2], pairs: 0, source: String::new(), vectors: Vec::new() };
                self.actions.insert(at, action);
                at
            }
        };
        let action = &mut self.actions[at];
        let seen = action.pairs as f64;
        let share = 1.0 / (seen + 1.0);
        for (mean, value) in action.closure.iter_mut().zip(closure) {
            *mean += (value - *mean) * share;
        }
        let before: Vec<ActionVector> = std::mem::take(&mut action.vectors);
        let mut before = before.into_iter().peekable();
        for (handle, measured) in vectors.iter().enumerate() {
            let old = before.next_if(|v| v.handle == handle);
            let (mean, spread) = old.map_or((Vector3::zeros(), 0.0), |v| (v.vector, v.spread));
            // A handle that one pair lacks keeps what the others say.
            let Some(measured) = measured else {
                action.vectors.extend(old);
                continue;
            };
            let step = measured - mean;
            let vector = mean + step * share;
            // Welford: the sum of squares grows by (x − old mean)·(x − new mean).
            let squares = spread * spread * seen + step.dot(&(measured - vector));
            action.vectors.push(ActionVector { handle, vector, spread: (squares * share).max(0.0).sqrt() });
        }
        action.pairs += 1;
        if !action.source.split("; ").any(|known| known == source) {
            if !action.source.is_empty() {
                action.source.push_str("; ");
            }
            action.source.push_str(source);
        }
    }

    /// Leaves out vectors too short to matter.
    pub fn prune(&mut self) {
        for action in &mut self.actions {
            action.vectors.retain(|v| v.vector.norm() >= LEAST);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_average_and_their_spread_is_the_root_mean_square_deviation() {
        let mut library = ActionLibrary {
            name: "test".into(),
            face: vec![Point3::origin(); Catalogue::get().handles()],
            actions: Vec::new(),
        };
        let key = ActionKey { au: 17, side: None };
        for (x, source) in [(1.0, "a"), (2.0, "b\u{301}\n\"\u{1f}"), (6.0, "a")] {
            let mut vectors = vec![None; Catalogue::get().handles()];
            vectors[3] = Some(Vector3::new(x, 0.0, -x));
            library.add(key, &vectors, [x / 10.0, 0.0], source);
        }
        let action = library.get(key).unwrap();
        assert_eq!((action.pairs, action.source.as_str()), (3, "a; b\u{301}\n\"\u{1f}"));
        assert!((action.closure[0] - 0.3).abs() < 1e-12);
        let v = action.vectors[0];
        assert!((v.vector - Vector3::new(3.0, 0.0, -3.0)).norm() < 1e-12);
        let variance: f64 = [1.0_f64, 2.0, 6.0].iter().map(|x| 2.0 * (x - 3.0).powi(2)).sum::<f64>() / 3.0;
        assert!((v.spread - variance.sqrt()).abs() < 1e-12);
        let again = ActionLibrary::parse("test", &library.format()).unwrap();
        assert_eq!(again.actions[0].pairs, 3);
        assert!((again.actions[0].vectors[0].vector - v.vector).norm() < 1e-3);
        assert_eq!(ActionLibrary::parse("test", &again.format()).unwrap(), again);
    }
}
