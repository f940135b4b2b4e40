//! Which curve moves which muscle of a basis, the lids and the gaze: both ways, so that a take can be written, edited and
//! played again.
//!
//! Lids are measured better than a fit of skin tells them, and the gaze is no muscle of the skin at all. The curves of a
//! blink and of a widened eye therefore hold the lids themselves, those of ARKit's `eyeLook…` the turn of the eyes.

use super::{ARKIT_SHAPES, Channel, MuscleBasis, MuscleError};
use crate::lift::{EyeState, Eyes, Side, WIDEST_CLOSURE};

/// How far an eye is closed where it is fully widened, as on the face of ARKit's basis.
const FULL_WIDE: f64 = -0.35;
/// The turn of an eye at an `eyeLook…` of 1, radians.
const FULL_LOOK: f64 = 30.0 * std::f64::consts::PI / 180.0;
/// A surface cannot show it.
const TONGUE: &str = "tongueOut";
/// What eyes look at, as they turn: down, in, out, up; the right eye's, the left eye's.
const LOOKS: [[&str; 4]; 2] = [
    ["eyeLookDownRight", "eyeLookInRight", "eyeLookOutRight", "eyeLookUpRight"],
    ["eyeLookDownLeft", "eyeLookInLeft", "eyeLookOutLeft", "eyeLookUpLeft"],
];

/// The places of a basis' muscles, of lids and gaze among the curves of a take.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveMap {
    curves: usize,
    /// One for each element of the basis.
    places: Vec<Option<usize>>,
    /// Right and left eye.
    eyes: [EyePlaces; 2],
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct EyePlaces {
    blink: Option<usize>,
    wide: Option<usize>,
    /// As in `LOOKS`.
    look: [Option<usize>; 4],
}

impl CurveMap {
    /// The names and channels of the curves that a take lifted by `basis` has: its muscles; of muscles that all have
    /// ARKit's names, the 52 in their order.
    pub fn columns(basis: &MuscleBasis) -> (Vec<String>, Vec<Channel>) {
        let lids: Vec<usize> = Side::BOTH.into_iter().flat_map(|side| basis.lids(side)).flatten().collect();
        let channel =
            |k: usize| if lids.contains(&k) { Channel::Measured } else { basis.elements[k].channel };
        if !Self::is_arkit(basis) {
            return (
                basis.names().map(String::from).collect(),
                (0..basis.elements.len()).map(channel).collect(),
            );
        }
        let of_shape = |shape: &&str| match basis.index(shape) {
            Some(k) => channel(k),
            None if LOOKS.as_flattened().contains(shape) => Channel::Measured,
            None => Channel::Absent,
        };
        (ARKIT_SHAPES.map(String::from).to_vec(), ARKIT_SHAPES.iter().map(of_shape).collect())
    }

    /// Whether all its muscles are ARKit's.
    pub fn is_arkit(basis: &MuscleBasis) -> bool {
        basis.names().all(|name| ARKIT_SHAPES.contains(&name))
    }

    /// The built-in basis that knows most of these muscles.
    pub fn built_in_basis(muscles: &[String]) -> &'static MuscleBasis {
        let known = |basis: &MuscleBasis| muscles.iter().filter(|name| basis.index(name).is_some()).count();
        let (arkit, sixteen) = (MuscleBasis::arkit(), MuscleBasis::sixteen());
        if known(sixteen) > known(arkit) { sixteen } else { arkit }
    }

    /// For curves of these names and channels, one a muscle. Refuses curves of muscles that neither the basis nor the
    /// eyes have, unless nothing tells of them.
    pub fn new(muscles: &[String], channels: &[Channel], basis: &MuscleBasis) -> Result<Self, MuscleError> {
        let foreign: Vec<&str> = muscles
            .iter()
            .zip(channels)
            .filter(|(name, channel)| {
                let is_known = basis.index(name).is_some()
                    || LOOKS.as_flattened().contains(&name.as_str())
                    || *name == TONGUE;
                !is_known && **channel != Channel::Absent
            })
            .map(|(name, _)| name.as_str())
            .collect();
        if !foreign.is_empty() {
            return Err(MuscleError::Foreign { basis: basis.name.clone(), muscles: foreign.join(", ") });
        }
        let place = |name: &str| {
            let place = muscles.iter().position(|muscle| muscle == name)?;
            (channels[place] != Channel::Absent).then_some(place)
        };
        let places: Vec<Option<usize>> = basis.names().map(place).collect();
        let eyes = [0, 1].map(|eye| {
            let [blink, wide] = basis.lids(Side::BOTH[eye]).map(|element| element.and_then(|k| places[k]));
            EyePlaces { blink, wide, look: LOOKS[eye].map(place) }
        });
        Ok(Self { curves: muscles.len(), places, eyes })
    }

    /// A frame's curves: of `contractions` one for each element of the basis, none where nothing was solved.
    pub fn row(&self, contractions: &[f64], eyes: &Eyes) -> Vec<f64> {
        let mut row = vec![0.0; self.curves];
        for (place, contraction) in self.places.iter().zip(contractions) {
            if let Some(place) = place {
                row[*place] = *contraction;
            }
        }
        for (places, (side, inwards)) in self.eyes.iter().zip(Side::BOTH.into_iter().zip([1.0, -1.0])) {
            let eye = eyes.of(side);
            if let Some(blink) = places.blink {
                row[blink] = eye.closure.max(0.0);
            }
            if let Some(wide) = places.wide {
                row[wide] = (eye.closure / FULL_WIDE).max(0.0);
            }
            let [across, up] = [eye.yaw * inwards, eye.pitch].map(|angle| angle / FULL_LOOK);
            for (place, value) in places.look.into_iter().zip([-up, across, -across, up]) {
                if let Some(place) = place {
                    row[place] = value.max(0.0);
                }
            }
        }
        row
    }

    /// What a frame's curves contract, one for each element of the basis.
    pub fn contractions(&self, row: &[f64]) -> Vec<f64> {
        self.places.iter().map(|place| place.map_or(0.0, |place| row[place])).collect()
    }

    /// What a frame's curves tell of the eyes; `otherwise` is where they do not.
    pub fn eyes(&self, row: &[f64], otherwise: &Eyes) -> Eyes {
        let eye = |eye: usize, inwards: f64| {
            let (places, otherwise) = (self.eyes[eye], otherwise.of(Side::BOTH[eye]));
            let at = |place: Option<usize>| place.map_or(0.0, |place| row[place]);
            let closure = match (places.blink, places.wide) {
                (None, None) => otherwise.closure,
                (Some(blink), None) if row[blink] == 0.0 => otherwise.closure.min(0.0),
                (blink, wide) => at(blink) + at(wide) * FULL_WIDE,
            };
            let [yaw, pitch] = if places.look.iter().all(Option::is_none) {
                [otherwise.yaw, otherwise.pitch]
            } else {
                let [down, across, back, up] = places.look.map(|place| at(place) * FULL_LOOK);
                [(across - back) * inwards, up - down]
            };
            EyeState { closure: closure.clamp(WIDEST_CLOSURE, 1.0), yaw, pitch }
        };
        Eyes { right: eye(0, 1.0), left: eye(1, -1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::muscle::MuscleLift;

    fn eyes(right: [f64; 3], left: [f64; 3]) -> Eyes {
        let eye = |[closure, yaw, pitch]: [f64; 3]| EyeState { closure, yaw, pitch };
        Eyes { right: eye(right), left: eye(left) }
    }

    fn map_of(basis: &MuscleBasis) -> (Vec<String>, CurveMap) {
        let (muscles, channels) = CurveMap::columns(basis);
        let map = CurveMap::new(&muscles, &channels, basis).unwrap();
        (muscles, map)
    }

    #[test]
    fn arkits_curves_come_in_its_order_and_tell_all_of_the_eyes() {
        let basis = MuscleLift::lifting(MuscleBasis::arkit());
        let (muscles, channels) = CurveMap::columns(&basis);
        assert_eq!(muscles, ARKIT_SHAPES);
        let map = CurveMap::new(&muscles, &channels, &basis).unwrap();
        let at = |name: &str| muscles.iter().position(|muscle| muscle == name).unwrap();
        assert_eq!(channels[at("tongueOut")], Channel::Absent);
        assert!(
            ["eyeLookInLeft", "eyeBlinkRight"].iter().all(|name| channels[at(name)] == Channel::Measured)
        );

        let contractions: Vec<f64> = (0..basis.elements.len()).map(|k| 0.01 * k as f64).collect();
        // The right eye shut and turned to the subject's left, which is inwards; the left wide, outwards and up.
        let shown = eyes([0.8, FULL_LOOK / 2.0, 0.0], [-0.175, FULL_LOOK, FULL_LOOK / 4.0]);
        let row = map.row(&contractions, &shown);
        let close = |name: &str, wanted: f64| {
            assert!((row[at(name)] - wanted).abs() < 1e-12, "{name}: {} is not {wanted}", row[at(name)]);
        };
        close("jawOpen", contractions[basis.index("jawOpen").unwrap()]);
        for (name, wanted) in [
            ("eyeBlinkRight", 0.8),
            ("eyeWideRight", 0.0),
            ("eyeBlinkLeft", 0.0),
            ("eyeWideLeft", 0.5),
            ("eyeLookInRight", 0.5),
            ("eyeLookOutRight", 0.0),
            ("eyeLookOutLeft", 1.0),
            ("eyeLookInLeft", 0.0),
            ("eyeLookUpLeft", 0.25),
            ("eyeLookDownLeft", 0.0),
            ("tongueOut", 0.0),
        ] {
            close(name, wanted);
        }
        let back = map.eyes(&row, &Eyes::default());
        for side in Side::BOTH {
            let (was, is) = (shown.of(side), back.of(side));
            let far =
                (was.closure - is.closure).abs() + (was.yaw - is.yaw).abs() + (was.pitch - is.pitch).abs();
            assert!(far < 1e-12, "{was:?} {is:?}");
        }
        let jaw = basis.index("jawOpen").unwrap();
        assert!((map.contractions(&row)[jaw] - contractions[jaw]).abs() < 1e-12);
    }

    #[test]
    fn what_the_sixteen_do_not_tell_of_eyes_stays() {
        let (muscles, map) = map_of(MuscleBasis::sixteen());
        assert!(muscles.iter().map(String::as_str).eq(MuscleBasis::sixteen().names()));
        let shown = eyes([0.6, 0.1, 0.2], [-0.2, 0.1, 0.2]);
        let row = map.row(&[0.5; 16], &shown);
        assert_eq!(map.eyes(&row, &shown), shown);
        let blink = muscles.iter().position(|muscle| muscle == "orbicularis_oculi_right").unwrap();
        assert!((row[blink] - 0.6).abs() < 1e-12);
    }

    #[test]
    fn names_tell_the_basis_and_strangers_are_named() {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let few = names(&["jaw_rotation", "frontalis_left", "jawOpen"]);
        assert_eq!(CurveMap::built_in_basis(&few).name, MuscleBasis::sixteen().name);
        let channels = [Channel::Measured; 3];
        let said = CurveMap::new(&few, &channels, MuscleBasis::arkit()).unwrap_err().to_string();
        assert!(said.contains("jaw_rotation, frontalis_left are none of the basis ARKit"), "{said}");
        let absent = [Channel::Absent, Channel::Absent, Channel::Weak];
        let map = CurveMap::new(&few, &absent, MuscleBasis::arkit()).unwrap();
        let shown = eyes([0.3, 0.1, 0.0], [0.2, 0.1, 0.0]);
        assert_eq!(map.eyes(&[0.0, 0.0, 0.7], &shown), shown);
    }
}
