//! What muscles' names tell: the side, the part of the face, and which name was meant.

use super::{MuscleError, Part};

impl Part {
    /// By the name of a muscle of 001 or of an ARKit shape, for curves whose basis is not at hand; a name that says
    /// nothing counts as lower.
    pub fn of_name(muscle: &str) -> Self {
        const UPPER: [&str; 7] = [
            "brow",
            "eye",
            "frontalis",
            "corrugator",
            "orbicularis_oculi",
            "orbicularis oculi",
            "cheeksquint",
        ];
        let name = muscle.to_ascii_lowercase();
        if UPPER.iter().any(|word| name.contains(word)) { Self::Upper } else { Self::Lower }
    }
}

/// The same muscle on the other side: `mouthSmileLeft` of `mouthSmileRight`, `frontalis_left` of `frontalis_right`,
/// `cheekRaiser_R` of `cheekRaiser_L`, `left frontalis` of `right frontalis`. None of a muscle in the middle.
///
/// `jawLeft` and `mouthLeft` are directions; a mirror swaps these too.
pub fn other_side(muscle: &str) -> Option<String> {
    const ENDS: [(&str, &str); 4] =
        [("Left", "Right"), ("_left", "_right"), ("_L", "_R"), (" left", " right")];
    const STARTS: [(&str, &str); 2] = [("left ", "right "), ("left_", "right_")];
    let both = |(a, b)| [(a, b), (b, a)];
    let end = ENDS.into_iter().flat_map(both).find_map(|(this, other)| {
        let stem = muscle.strip_suffix(this).filter(|stem| !stem.is_empty())?;
        Some(format!("{stem}{other}"))
    });
    end.or_else(|| {
        STARTS.into_iter().flat_map(both).find_map(|(this, other)| {
            let stem = muscle.strip_prefix(this).filter(|stem| !stem.is_empty())?;
            Some(format!("{other}{stem}"))
        })
    })
}

/// The place of `name` among `muscles`; the error lists the nearest there are.
pub fn find_muscle(muscles: &[String], name: &str) -> Result<usize, MuscleError> {
    /// Similar names that are listed.
    const NEAR: usize = 4;
    /// Shares of equal letters from which a name is similar.
    const SIMILAR: f64 = 0.75;
    if let Some(place) = muscles.iter().position(|muscle| muscle == name) {
        return Ok(place);
    }
    let wanted = name.to_lowercase();
    let mut near: Vec<(f64, &str)> = muscles
        .iter()
        .map(|muscle| {
            let candidate = muscle.to_lowercase();
            let inside = !wanted.is_empty() && candidate.contains(&wanted);
            (if inside { 1.0 } else { strsim::jaro_winkler(&candidate, &wanted) }, muscle.as_str())
        })
        .collect();
    near.sort_by(|a, b| b.0.total_cmp(&a.0));
    let similar: Vec<&str> =
        near.iter().filter(|(share, _)| *share >= SIMILAR).take(NEAR).map(|(_, muscle)| *muscle).collect();
    let has = if similar.is_empty() {
        format!("the curves have {}", muscles.join(", "))
    } else {
        format!("did you mean {}?", similar.join(", "))
    };
    Err(MuscleError::Unknown { name: name.chars().take(80).collect(), has })
}

#[cfg(test)]
mod tests {
    use super::super::MuscleBasis;
    use super::*;

    #[test]
    fn sides_are_read_from_every_spelling_and_come_back() {
        for (left, right) in [
            ("mouthSmileLeft", "mouthSmileRight"),
            ("jawLeft", "jawRight"),
            ("frontalis_left", "frontalis_right"),
            ("cheekRaiser_L", "cheekRaiser_R"),
            ("left frontalis", "right frontalis"),
            ("left_frontalis", "right_frontalis"),
        ] {
            assert_eq!(other_side(left).as_deref(), Some(right));
            assert_eq!(other_side(right).as_deref(), Some(left));
        }
        for middle in ["jawOpen", "jaw_rotation", "browInnerUp", "Left", "_L", ""] {
            assert_eq!(other_side(middle), None, "{middle}");
        }
    }

    #[test]
    fn names_of_both_bases_tell_part_and_side() {
        for basis in [MuscleBasis::arkit(), MuscleBasis::sixteen()] {
            for element in &basis.elements {
                assert_eq!(Part::of_name(&element.name), element.part, "{}", element.name);
                if let Some(other) = other_side(&element.name) {
                    assert!(basis.index(&other).is_some(), "{} without {other}", element.name);
                }
            }
        }
        for upper in ["eyeLookUpLeft", "cheekRaiser_L eye", "Orbicularis oculi"] {
            assert_eq!(Part::of_name(upper), Part::Upper, "{upper}");
        }
        assert_eq!(Part::of_name("tongueOut"), Part::Lower);
    }

    #[test]
    fn a_wrong_name_is_answered_with_near_ones() {
        let muscles: Vec<String> =
            ["jawOpen", "jawForward", "mouthSmileLeft", "eyeBlinkLeft"].map(String::from).to_vec();
        assert_eq!(find_muscle(&muscles, "mouthSmileLeft").ok(), Some(2));
        let said = |name| find_muscle(&muscles, name).unwrap_err().to_string();
        assert!(said("JawOpen").contains("did you mean jawOpen"), "{}", said("JawOpen"));
        assert!(said("smile").contains("did you mean mouthSmileLeft?"), "{}", said("smile"));
        assert!(said("xyz").contains("the curves have jawOpen, jawForward"), "{}", said("xyz"));
        assert!(said("").contains("the curves have"), "{}", said(""));
    }
}
