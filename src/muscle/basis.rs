//! The actuation basis on an average face (001 §3): what each muscle, fully contracted, does to the face's handles.
//!
//! Different from the paper: it sculpts 1,500 vertices of one subject; here an element is a vector for each of the
//! handles of the average face (the network's landmarks and the control points of `actions`), which the landmark spline
//! carries to any face and the warp to every vertex.

use std::{path::Path, sync::LazyLock};

use nalgebra::{DMatrix, Point3, Vector3};
use serde::{Deserialize, Serialize};

use super::{Channel, MuscleError};
use crate::{
    actions::{ActionLibrary, Catalogue},
    lift::Side,
    rows::read_text,
};

const FORMAT: &str = "understudy muscles 1";
/// A basis is some 500 kB; far beyond that it is something else.
const MOST_BYTES: u64 = 64 << 20;
/// Shorter vectors are left out of files, millimetres.
const LEAST: f64 = 0.02;
/// An element of which the others leave less than this share unexplained depends on them.
const DEPENDENT: f64 = 0.02;
/// An element that closes an eye by more is that eye's blink.
const BLINK: f64 = 0.8;
/// One that closes it by less than this widens it.
const WIDE: f64 = -0.15;

/// The half of the face in which a muscle is sought (001 §4.1.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Part {
    /// Forehead, brows and lids.
    Upper,
    /// All below.
    Lower,
}

/// One muscle, or several that act as one, at full contraction.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// `zygomatic_major_left`, `mouthSmileLeft`.
    pub name: String,
    /// Where it is sought.
    pub part: Part,
    /// How far it can be believed.
    pub channel: Channel,
    /// How far it closes the right and the left eye: 1 shuts, below 0 opens wider.
    pub closure: [f64; 2],
    /// One for each handle, in the frame of the basis' face, millimetres: eᵢ of eq. 1.
    pub vectors: Vec<Vector3<f64>>,
}

/// The neutral face E₀ and the elements eᵢ.
#[derive(Debug, Clone, PartialEq)]
pub struct MuscleBasis {
    /// What messages call it.
    pub name: String,
    /// The face's handles, counted as `Catalogue::place` does. Scan frame, millimetres.
    pub face: Vec<Point3<f64>>,
    /// The muscles.
    pub elements: Vec<Element>,
    /// Whether `jaw_rotation` or `jawOpen` turns about the condyles between rest and full (`JawBow`); sculpted and
    /// measured shapes that are mixed in straight lines do not.
    pub turns_jaw: bool,
}

#[derive(Serialize, Deserialize)]
struct Document {
    format: String,
    name: String,
    turns_jaw: bool,
    points: Vec<String>,
    face: Vec<[f64; 3]>,
    elements: Vec<Entry>,
}

#[derive(Serialize, Deserialize)]
struct Entry {
    name: String,
    part: Part,
    channel: String,
    closure: [f64; 2],
    vectors: Vec<(usize, f64, f64, f64)>,
}

#[allow(clippy::expect_used, reason = "compile-time data; a test reads all of it")]
static ARKIT: LazyLock<MuscleBasis> = LazyLock::new(|| {
    MuscleBasis::parse(include_str!("../../models/arkit_muscles.json")).expect("the built-in basis is valid")
});

static SIXTEEN: LazyLock<MuscleBasis> =
    LazyLock::new(|| super::sixteen::of_actions(ActionLibrary::built_in()).0);

impl MuscleBasis {
    /// 51 elements with the names of ARKit's blend shapes, all but `tongueOut`: ICT-FaceKit's shapes, measured on its mean
    /// face (`docs/muscles.md`).
    pub fn arkit() -> &'static Self {
        &ARKIT
    }

    /// The sixteen of 001 figure 1, made of the built-in action units.
    pub fn sixteen() -> &'static Self {
        &SIXTEEN
    }

    /// The names of all elements.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.elements.iter().map(|element| element.name.as_str())
    }

    /// Which element has this name.
    pub fn index(&self, name: &str) -> Option<usize> {
        self.elements.iter().position(|element| element.name == name)
    }

    /// The elements that shut and that widen the eye of one side.
    pub fn lids(&self, side: Side) -> [Option<usize>; 2] {
        let eye = usize::from(side == Side::Left);
        let closures = || self.elements.iter().map(|element| element.closure[eye]).enumerate();
        let blink = closures().max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, closure)| *closure > BLINK);
        let wide = closures().min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, closure)| *closure < WIDE);
        [blink, wide].map(|found| found.map(|(k, _)| k))
    }

    /// The elements that a predicate keeps.
    #[must_use]
    pub fn only(&self, keep: impl Fn(&Element) -> bool) -> Self {
        let elements = self.elements.iter().filter(|element| keep(element)).cloned().collect();
        Self { name: self.name.clone(), face: self.face.clone(), elements, turns_jaw: self.turns_jaw }
    }

    /// Reads a file that [`MuscleBasis::format`] wrote.
    pub fn read(path: &Path) -> Result<Self, MuscleError> {
        let fault = |reason: String| MuscleError::File {
            path: path.into(),
            reason,
            remedy: "Write it with `understudy muscles` or `understudy refine`",
        };
        let text = read_text(path, MOST_BYTES, "basis").map_err(fault)?;
        Self::parse(&text).map_err(fault)
    }

    /// Reads a basis' text; the error is a reason.
    pub fn parse(text: &str) -> Result<Self, String> {
        let document: Document = serde_json::from_str(text).map_err(|error| error.to_string())?;
        if document.format != FORMAT {
            return Err(format!("its format is {:?}, not {FORMAT:?}", document.format));
        }
        let handles = Catalogue::get().handles();
        if document.points != Catalogue::get().point_names() || document.face.len() != handles {
            return Err("it was made with other control points than this version's".to_owned());
        }
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        if !document.face.iter().all(|p| finite(p)) {
            return Err("the face has numbers that are not finite".to_owned());
        }
        let mut elements: Vec<Element> = Vec::new();
        for entry in document.elements {
            let Entry { name, part, channel, closure, vectors: sparse } = entry;
            if name.is_empty() || elements.iter().any(|known| known.name == name) {
                return Err(format!("muscle {name:?} stands there twice or has no name"));
            }
            let channel =
                channel.parse().map_err(|()| format!("{name} is {channel:?}, which is no state"))?;
            let mut vectors = vec![Vector3::zeros(); handles];
            for (handle, x, y, z) in sparse {
                if handle >= handles || !finite(&[x, y, z]) {
                    return Err(format!(
                        "{name} moves handle {handle}, which is not there or not by a number"
                    ));
                }
                vectors[handle] = Vector3::new(x, y, z);
            }
            if !finite(&closure) {
                return Err(format!("{name} closes the eyes by what is not a number"));
            }
            elements.push(Element { name, part, channel, closure, vectors });
        }
        if elements.is_empty() {
            return Err("it has no muscles".to_owned());
        }
        let face = document.face.iter().map(|p| Point3::from(*p)).collect();
        Ok(Self { name: document.name, face, elements, turns_jaw: document.turns_jaw })
    }

    /// The basis as text.
    pub fn format(&self) -> String {
        let rounded = |value: f64| (value * 1e3).round() / 1e3;
        let elements = self.elements.iter().map(|element| Entry {
            name: element.name.clone(),
            part: element.part,
            channel: element.channel.name().to_owned(),
            closure: element.closure.map(rounded),
            vectors: (0..)
                .zip(&element.vectors)
                .filter(|(_, v)| v.norm() >= LEAST)
                .map(|(handle, v)| (handle, rounded(v.x), rounded(v.y), rounded(v.z)))
                .collect(),
        });
        let document = Document {
            format: FORMAT.to_owned(),
            name: self.name.clone(),
            turns_jaw: self.turns_jaw,
            points: Catalogue::get().point_names(),
            face: self.face.iter().map(|p| [rounded(p.x), rounded(p.y), rounded(p.z)]).collect(),
            elements: elements.collect(),
        };
        // Strings and finite numbers always have a text.
        let mut text = serde_json::to_string(&document).unwrap_or_default();
        text = text.replace("{\"name\"", "\n{\"name\"");
        text.push('\n');
        text
    }

    /// Refuses a basis in which a muscle does nothing or can be made of the others: its contractions would mean nothing.
    pub fn check(&self) -> Result<(), MuscleError> {
        for element in &self.elements {
            if element.vectors.iter().all(|v| v.norm() < LEAST) {
                return Err(MuscleError::Idle { basis: self.name.clone(), muscle: element.name.clone() });
            }
        }
        if let Some((muscle, of)) = self.dependent() {
            return Err(MuscleError::Dependent { basis: self.name.clone(), muscle, of });
        }
        Ok(())
    }

    /// An element that the others make up, with those of them that do most of it.
    fn dependent(&self) -> Option<(String, String)> {
        let rows = 3 * self.face.len();
        let unit: Vec<_> = self
            .elements
            .iter()
            .map(|element| {
                let flat = nalgebra::DVector::from_iterator(
                    rows,
                    element.vectors.iter().flat_map(|v| v.iter().copied()),
                );
                let length = flat.norm().max(f64::MIN_POSITIVE);
                flat / length
            })
            .collect();
        let matrix = DMatrix::from_columns(&unit);
        let gram = matrix.tr_mul(&matrix);
        for k in 0..unit.len() {
            let others: Vec<usize> = (0..unit.len()).filter(|&i| i != k).collect();
            let mut block = gram.select_rows(&others).select_columns(&others);
            for i in 0..others.len() {
                block[(i, i)] += 1e-9;
            }
            let right = gram.column(k).select_rows(&others);
            let Some(weights) = block.cholesky().map(|c| c.solve(&right)) else { continue };
            let mut left = unit[k].clone();
            for (&i, weight) in others.iter().zip(&weights) {
                left -= &unit[i] * *weight;
            }
            if left.norm() < DEPENDENT {
                let mut by_weight: Vec<(usize, f64)> =
                    others.iter().copied().zip(weights.iter().map(|w| w.abs())).collect();
                by_weight.sort_by(|a, b| b.1.total_cmp(&a.1));
                let names: Vec<&str> = by_weight
                    .iter()
                    .take(3)
                    .filter(|(_, weight)| *weight > 0.05)
                    .map(|(i, _)| self.elements[*i].name.as_str())
                    .collect();
                return Some((self.elements[k].name.clone(), names.join(", ")));
            }
        }
        None
    }
}
