//! The unit of a file that does not say it.
//!
//! Only glTF states its unit. For the rest a length of known size on a human face decides; the guess is always
//! shown to the user, who may overrule it.

use std::fmt;

/// A face from chin to hairline, in millimetres: the range that is taken for human.
const FACE_HEIGHT: (f64, f64) = (150.0, 300.0);
/// The distance of the outer eye corners (exocanthion to exocanthion) of an adult, in millimetres.
const OUTER_CANTHAL: f64 = 90.0;
/// The units that a distance between landmarks is held against.
const GUESSED: [LengthUnit; 5] = [
    LengthUnit::Micrometre,
    LengthUnit::Millimetre,
    LengthUnit::Centimetre,
    LengthUnit::Inch,
    LengthUnit::Metre,
];

/// A unit of length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LengthUnit {
    /// 0.001 mm; averaged faces come in it.
    Micrometre,
    /// 1 mm, the unit of the scan frame.
    Millimetre,
    /// 10 mm.
    Centimetre,
    /// 25.4 mm.
    Inch,
    /// 1,000 mm, glTF's unit.
    Metre,
    /// This many millimetres; positive and finite.
    Custom(f64),
}

impl LengthUnit {
    /// How many millimetres one such unit is.
    pub fn millimetres_per_unit(self) -> f64 {
        match self {
            Self::Micrometre => 0.001,
            Self::Millimetre => 1.0,
            Self::Centimetre => 10.0,
            Self::Inch => 25.4,
            Self::Metre => 1000.0,
            Self::Custom(millimetres) => millimetres,
        }
    }

    /// The unit that `text` names: `um`, `mm`, `cm`, `m`, `in`, or a number of millimetres.
    pub fn parse(text: &str) -> Option<Self> {
        match text.trim().to_ascii_lowercase().as_str() {
            "um" => Some(Self::Micrometre),
            "mm" => Some(Self::Millimetre),
            "cm" => Some(Self::Centimetre),
            "m" => Some(Self::Metre),
            "in" | "inch" => Some(Self::Inch),
            other => other.parse().ok().filter(|mm: &f64| mm.is_normal() && *mm > 0.0).map(Self::Custom),
        }
    }
}

impl fmt::Display for LengthUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Micrometre => f.write_str("micrometres"),
            Self::Millimetre => f.write_str("millimetres"),
            Self::Centimetre => f.write_str("centimetres"),
            Self::Inch => f.write_str("inches"),
            Self::Metre => f.write_str("metres"),
            Self::Custom(millimetres) => write!(f, "units of {millimetres} mm"),
        }
    }
}

/// Guesses the unit from the height of the face, chin to hairline, in the file's own unit: 0.15 to 0.30 means
/// metres, 15 to 30 centimetres, 150 to 300 millimetres, 150,000 to 300,000 micrometres. `None` for anything else: then the user must say it, or a
/// landmark distance decide ([`guess_from_outer_canthal_distance`]).
pub fn guess_unit(face_height: f64) -> Option<LengthUnit> {
    let (least, most) = FACE_HEIGHT;
    [LengthUnit::Micrometre, LengthUnit::Millimetre, LengthUnit::Centimetre, LengthUnit::Metre]
        .into_iter()
        .find(|unit| (least..=most).contains(&(face_height * unit.millimetres_per_unit())))
}

/// Guesses the unit from the distance of the outer eye corners in the file's own unit.
///
/// In people it is 75 to 110 mm. The unit among micrometre, millimetre, centimetre, inch and metre that brings it
/// closest to 90 mm, on a logarithmic scale, is taken: so a cartoon's wide-set eyes still find one. `None` only for
/// a distance that is not positive and finite.
pub fn guess_from_outer_canthal_distance(distance: f64) -> Option<LengthUnit> {
    if !(distance.is_normal() && distance > 0.0) {
        return None;
    }
    let off = |unit: &LengthUnit| (distance.ln() + (unit.millimetres_per_unit() / OUTER_CANTHAL).ln()).abs();
    GUESSED.into_iter().min_by(|a, b| off(a).total_cmp(&off(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn face_heights() {
        assert_eq!(guess_unit(0.21), Some(LengthUnit::Metre));
        assert_eq!(guess_unit(21.0), Some(LengthUnit::Centimetre));
        assert_eq!(guess_unit(150.0), Some(LengthUnit::Millimetre));
        assert_eq!(guess_unit(300.0), Some(LengthUnit::Millimetre));
        assert_eq!(guess_unit(210_724.0), Some(LengthUnit::Micrometre));
        for odd in [1.0, 8.0, 2000.0, 0.0, -200.0, f64::NAN, f64::INFINITY] {
            assert_eq!(guess_unit(odd), None, "{odd}");
        }
    }

    #[test]
    fn every_human_eye_distance_finds_its_unit() {
        for mm in [75.0, 82.0, 90.0, 100.0, 110.0] {
            for unit in GUESSED {
                let own = mm / unit.millimetres_per_unit();
                assert_eq!(guess_from_outer_canthal_distance(own), Some(unit), "{mm} mm in {unit}");
            }
        }
        assert_eq!(guess_from_outer_canthal_distance(f64::NAN), None);
        assert_eq!(guess_from_outer_canthal_distance(0.0), None);
    }

    #[test]
    fn names() {
        assert_eq!(LengthUnit::parse(" CM "), Some(LengthUnit::Centimetre));
        assert_eq!(LengthUnit::parse("12.5"), Some(LengthUnit::Custom(12.5)));
        assert_eq!(LengthUnit::parse("-1"), None);
        assert_eq!(LengthUnit::parse("furlong"), None);
        assert_eq!(LengthUnit::Custom(12.5).to_string(), "units of 12.5 mm");
    }
}
