//! Edits of curves, as an animator writes them in TOML.
//!
//! ```toml
//! mirror = true          # what the left did, the right does
//! [all]
//! scale = 1.1
//! [jawOpen]
//! scale = 0.8
//! offset = 0.05
//! clamp = [0.0, 1.0]
//! [cheekPuff]
//! mute = true
//! ```
//!
//! Mirror comes first, so that names mean what is seen afterwards; then scale, then offset, then clamp; a muted muscle
//! stays at 0. `[all]` and a muscle's own multiply their scales and add their offsets; a muscle's own `clamp` and `mute`
//! replace those of `[all]`, so that `mute = false` below a muted `[all]` leaves that muscle alone to be seen.

use std::{collections::BTreeMap, fs::File, io::Read as _, path::Path};

use serde::Deserialize;

use super::{MuscleCurves, MuscleError, find_muscle, other_side};

/// A file of edits is written by hand.
const MOST_BYTES: u64 = 1 << 20;
/// Of scales and offsets.
const MOST: f64 = 100.0;

/// What is done to one muscle's curve.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MuscleEdit {
    /// Multiplies the contraction; 1 if not given.
    pub scale: Option<f64>,
    /// Is added after that; 0 if not given.
    pub offset: Option<f64>,
    /// The lowest and the highest contraction that are left.
    pub clamp: Option<[f64; 2]>,
    /// Whether it stays at 0.
    pub mute: Option<bool>,
}

/// What is done to the curves of a take.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CurveEdits {
    /// Whether left and right change places, before all else.
    pub mirror: bool,
    /// What is done to every muscle.
    pub all: MuscleEdit,
    /// What is done to single ones, by their names after mirroring.
    pub muscles: BTreeMap<String, MuscleEdit>,
}

impl MuscleEdit {
    fn check(&self, name: &str) -> Result<(), String> {
        let sane = |value: &f64| value.abs() <= MOST;
        if let Some(scale) = self.scale.filter(|scale| !sane(scale)) {
            return Err(format!("[{name}] scale = {scale} is not within {MOST} of 0"));
        }
        if let Some(offset) = self.offset.filter(|offset| !sane(offset)) {
            return Err(format!("[{name}] offset = {offset} is not within {MOST} of 0"));
        }
        match self.clamp {
            Some([low, high]) if !(sane(&low) && sane(&high) && low <= high) => {
                Err(format!("[{name}] clamp = [{low}, {high}] is not a lower and a higher end"))
            }
            _ => Ok(()),
        }
    }

    /// A muscle's own edit after that of all.
    fn below(self, all: Self) -> Self {
        Self {
            scale: Some(all.scale.unwrap_or(1.0) * self.scale.unwrap_or(1.0)),
            offset: Some(all.offset.unwrap_or(0.0) + self.offset.unwrap_or(0.0)),
            clamp: self.clamp.or(all.clamp),
            mute: self.mute.or(all.mute),
        }
    }

    fn apply(&self, contraction: f64) -> f64 {
        if self.mute == Some(true) {
            return 0.0;
        }
        let value = contraction * self.scale.unwrap_or(1.0) + self.offset.unwrap_or(0.0);
        self.clamp.map_or(value, |[low, high]| value.clamp(low, high))
    }
}

impl CurveEdits {
    /// Reads edits from TOML.
    pub fn read(path: &Path) -> Result<Self, MuscleError> {
        let fault = |reason: String, remedy| MuscleError::File { path: path.into(), reason, remedy };
        let mut bytes = Vec::new();
        File::open(path)
            .and_then(|file| file.take(MOST_BYTES + 1).read_to_end(&mut bytes))
            .map_err(|error| fault(error.to_string(), "Name a file that can be read"))?;
        if bytes.len() as u64 > MOST_BYTES {
            return Err(fault("it is larger than 1 MiB".into(), "Give a file of edits"));
        }
        let text =
            String::from_utf8(bytes).map_err(|_| fault("it is not UTF-8 text".into(), "Save it as UTF-8"))?;
        Self::parse(&text).map_err(|reason| {
            fault(reason, "Write tables such as `[jawOpen]` with scale, offset, clamp = [low, high] or mute")
        })
    }

    fn parse(text: &str) -> Result<Self, String> {
        let table: toml::Table = toml::from_str(text).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start.min(text.len()));
            let line = 1 + text.get(..start).unwrap_or_default().matches('\n').count();
            format!("line {line}: {}", in_one_line(error.message()))
        })?;
        let mut edits = Self::default();
        for (name, value) in table {
            let wrong = |error: toml::de::Error| format!("[{name}]: {}", in_one_line(error.message()));
            match name.as_str() {
                "mirror" => edits.mirror = value.as_bool().ok_or("mirror is neither true nor false")?,
                "all" => edits.all = value.try_into().map_err(wrong)?,
                _ => {
                    let edit = value.try_into().map_err(wrong)?;
                    edits.muscles.insert(name, edit);
                }
            }
        }
        edits.all.check("all")?;
        for (name, edit) in &edits.muscles {
            edit.check(name)?;
        }
        Ok(edits)
    }

    /// The edited curves. A muscle keeps its channel, which tells of the measurement, and takes it to its other side.
    ///
    /// Refuses names that the curves do not have, and mirroring where a muscle's other side is missing.
    pub fn apply(&self, curves: MuscleCurves) -> Result<MuscleCurves, MuscleError> {
        let muscles = curves.muscles();
        let mut edits = vec![MuscleEdit::default().below(self.all); muscles.len()];
        for (name, edit) in &self.muscles {
            edits[find_muscle(muscles, name)?] = edit.below(self.all);
        }
        let from = if self.mirror { mirrored(muscles)? } else { (0..muscles.len()).collect() };
        let channels = from.iter().map(|&k| curves.channels()[k]).collect();
        let mut before = vec![0.0; muscles.len()];
        curves.edited(channels, |contractions| {
            before.copy_from_slice(contractions);
            for ((slot, &k), edit) in contractions.iter_mut().zip(&from).zip(&edits) {
                *slot = edit.apply(before[k]);
            }
        })
    }
}

fn in_one_line(message: &str) -> String {
    message.lines().collect::<Vec<_>>().join(", ")
}

/// Where each muscle's values come from when left and right change places.
fn mirrored(muscles: &[String]) -> Result<Vec<usize>, MuscleError> {
    let place = |(k, name): (usize, &String)| match other_side(name) {
        None => Ok(k),
        Some(other) => muscles
            .iter()
            .position(|muscle| *muscle == other)
            .ok_or_else(|| MuscleError::OneSided { name: name.clone(), other }),
    };
    muscles.iter().enumerate().map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{Channel, curves::tests::curves};
    use super::*;
    use proptest::prelude::*;

    fn edited(text: &str) -> Result<Vec<f64>, String> {
        let made = curves(&["jawOpen", "mouthSmileLeft", "mouthSmileRight"], &[&[0.5, 1.0, 0.25]]);
        let edits = CurveEdits::parse(text)?;
        let done = edits.apply(made).map_err(|error| error.to_string())?;
        Ok(done.frames()[0].contractions.clone())
    }

    #[test]
    fn edits_come_in_their_order() {
        assert_eq!(edited(""), Ok(vec![0.5, 1.0, 0.25]));
        assert_eq!(edited("[jawOpen]\nscale = 2\noffset = 0.5"), Ok(vec![1.5, 1.0, 0.25]));
        assert_eq!(edited("[jawOpen]\nscale = 2\noffset = 0.5\nclamp = [0, 1]"), Ok(vec![1.0, 1.0, 0.25]));
        assert_eq!(edited("mirror = true\n[mouthSmileLeft]\nscale = 2.0"), Ok(vec![0.5, 0.5, 1.0]));
        assert_eq!(edited("[all]\nscale = 2\n[jawOpen]\nscale = 0.5\noffset = 0.1"), Ok(vec![0.6, 2.0, 0.5]));
        assert_eq!(edited("[all]\nclamp = [0, 0.4]\n[jawOpen]\nclamp = [0, 1]"), Ok(vec![0.5, 0.4, 0.25]));
        assert_eq!(edited("[mouthSmileLeft]\nmute = true\noffset = 3.0"), Ok(vec![0.5, 0.0, 0.25]));
        assert_eq!(edited("[all]\nmute = true\n[jawOpen]\nmute = false"), Ok(vec![0.5, 0.0, 0.0]));
    }

    #[test]
    fn mistakes_are_named() {
        let said = |text| edited(text).unwrap_err();
        assert!(said("[JawOpen]\nscale = 1").contains("did you mean jawOpen"), "{}", said("[JawOpen]"));
        let misspelt = said("[jawOpen]\nscael = 1");
        assert!(misspelt.contains("[jawOpen]: unknown field `scael`"), "{misspelt}");
        assert!(said("[jawOpen]\nscale = nan").contains("scale = NaN"));
        assert!(said("[jawOpen]\noffset = 1e9").contains("offset"));
        assert!(said("[jawOpen]\nclamp = [1, 0]").contains("clamp = [1, 0]"));
        assert!(said("[jawOpen").contains("line 1"), "{}", said("[jawOpen"));
        assert!(said("[jawOpen]\nscale = 1\nscale = 2").contains("line 3"));
        assert!(said("jawOpen = 2").contains("[jawOpen]"), "{}", said("jawOpen = 2"));
        assert!(said("mirror = 1").contains("neither true nor false"));
        let lame = CurveEdits::parse("mirror = true").unwrap().apply(curves(&["browDown_L"], &[&[1.0]]));
        assert!(lame.unwrap_err().to_string().contains("browDown_L is there without browDown_R"));
    }

    #[test]
    fn channels_change_sides_too() {
        let made = curves(&["a_left", "a_right"], &[&[0.0, 1.0]]);
        let made = made.edited(vec![Channel::Weak, Channel::Absent], |_| {}).unwrap();
        let done = CurveEdits { mirror: true, ..CurveEdits::default() }.apply(made).unwrap();
        assert_eq!(done.channels(), [Channel::Absent, Channel::Weak]);
    }

    proptest! {
        #[test]
        fn mirrored_twice_is_as_before(row in prop::collection::vec(-2.0..2.0_f64, 4)) {
            let made = curves(&["jawOpen", "jawLeft", "jawRight", "tongueOut"], &[&row]);
            let mirror = CurveEdits { mirror: true, ..CurveEdits::default() };
            let twice = mirror.apply(mirror.apply(made.clone()).unwrap()).unwrap();
            prop_assert_eq!(twice, made);
        }

        #[test]
        fn no_text_makes_it_panic(text in "(\\PC|\n){0,60}") {
            let _ = CurveEdits::parse(&text);
        }
    }
}
