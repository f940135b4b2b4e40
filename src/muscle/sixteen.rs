//! The sixteen elements of 001 figure 1 out of action units.

use nalgebra::Vector3;

use super::{Channel, Element, MuscleBasis, Part};
use crate::{
    actions::{ActionKey, ActionLibrary},
    lift::Side,
};

/// A muscle and the action units that it makes, with their shares. Muscles that act together are one (001 §3).
struct Recipe {
    name: &'static str,
    sides: bool,
    part: Part,
    channel: Channel,
    units: &'static [(u8, f64)],
}

const fn recipe(
    name: &'static str,
    sides: bool,
    part: Part,
    channel: Channel,
    units: &'static [(u8, f64)],
) -> Recipe {
    Recipe { name, sides, part, channel, units }
}

/// In the paper's order. Of the orbicularis oculi only the gentle closing of the lids, as there; Levator labii
/// superioris stands for the three sneering muscles; Orbicularis oris is /u/, Lips pressor the upset mouth.
const RECIPES: [Recipe; 10] = [
    recipe("frontalis", true, Part::Upper, Channel::Measured, &[(1, 1.0), (2, 1.0)]),
    recipe("corrugator", true, Part::Upper, Channel::Measured, &[(4, 1.0)]),
    recipe("orbicularis_oculi", true, Part::Upper, Channel::Weak, &[(45, 1.0)]),
    recipe(
        "levator_labii_superioris",
        true,
        Part::Lower,
        Channel::Measured,
        &[(9, 0.6), (10, 0.6), (11, 0.3)],
    ),
    recipe("zygomatic_major", true, Part::Lower, Channel::Measured, &[(12, 1.0)]),
    recipe("risorius", true, Part::Lower, Channel::Inferred, &[(20, 1.0)]),
    recipe("depressor_anguli_oris", false, Part::Lower, Channel::Inferred, &[(15, 1.0)]),
    recipe("orbicularis_oris", false, Part::Lower, Channel::Weak, &[(18, 1.0)]),
    recipe("lips_pressor", false, Part::Lower, Channel::Inferred, &[(17, 0.8), (24, 0.6)]),
    recipe("jaw_rotation", false, Part::Lower, Channel::Measured, &[(27, 1.0)]),
];

/// The basis of a library of action units, and the action units that it lacks.
pub(super) fn of_actions(library: &ActionLibrary) -> (MuscleBasis, Vec<String>) {
    let mut elements = Vec::new();
    let mut missing = Vec::new();
    for recipe in &RECIPES {
        let versions: &[(Option<Side>, &str)] = if recipe.sides {
            &[(Some(Side::Left), "_left"), (Some(Side::Right), "_right")]
        } else {
            &[(None, "")]
        };
        for (side, suffix) in versions {
            let mut vectors = vec![Vector3::zeros(); library.face.len()];
            let mut closure = [0.0; 2];
            for action in &library.actions {
                let ActionKey { au, side: acts } = action.key;
                let Some((_, share)) = recipe.units.iter().find(|(unit, _)| *unit == au) else { continue };
                if side.is_some() && acts != *side {
                    continue;
                }
                for moved in &action.vectors {
                    vectors[moved.handle] += moved.vector * *share;
                }
                for (sum, own) in closure.iter_mut().zip(action.closure) {
                    *sum += own * share;
                }
            }
            for (unit, _) in recipe.units {
                if !library.actions.iter().any(|action| action.key.au == *unit) {
                    missing.push(format!("{}{suffix} lacks AU{unit}", recipe.name));
                }
            }
            let name = format!("{}{suffix}", recipe.name);
            elements.push(Element { name, part: recipe.part, channel: recipe.channel, closure, vectors });
        }
    }
    let name = format!("sixteen muscles of {}", library.name);
    (MuscleBasis { name, face: library.face.clone(), elements, turns_jaw: true }, missing)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracking::index;

    #[test]
    fn the_built_in_library_gives_the_sixteen_of_figure_one() {
        let (basis, missing) = of_actions(ActionLibrary::built_in());
        assert!(missing.is_empty(), "{missing:?}");
        assert_eq!(basis.elements.len(), 16);
        assert_eq!(basis.elements.iter().filter(|e| e.part == Part::Upper).count(), 6);
        basis.check().unwrap();
        let moved =
            |name: &str, landmark: usize| basis.elements[basis.index(name).unwrap()].vectors[landmark];
        // Left is the subject's: +x.
        assert!(moved("zygomatic_major_left", index::MOUTH_LEFT).x > 4.0);
        assert!(moved("zygomatic_major_left", index::MOUTH_RIGHT).norm() < 2.0);
        assert!(moved("jaw_rotation", index::CHIN).y < -25.0);
        assert!(moved("frontalis_right", 105).y > 4.0);
    }
}
