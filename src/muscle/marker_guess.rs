//! Where markers sit, by their names first and by their places then.
//!
//! Names say roughly where; studios differ by a centimetre. The take is brought to the average face by what names say,
//! stretched locally by the mean of what remains (a long nose is not a marker in another place), and each marker then
//! takes the landmark that is near to it and near to its name.

use std::collections::BTreeSet;

use nalgebra::{Point3, Similarity3, Vector3};

use super::{
    MarkerMap, MarkerPlace, MuscleError,
    marker_names::{Named, place_by_name},
    marker_sides::{Known, mirrored, swapped},
};
use crate::{
    actions::ActionLibrary,
    capture::MarkerTake,
    grid::similarity_between,
    lift::Side,
    tracking::{SKIN_LANDMARK_COUNT, landmark_table},
};

/// So many known markers place the others.
const FEWEST: usize = 6;
/// Markers that lie farther from their named place than this, and than twice the median, do not count for the fit,
/// millimetres.
const ASTRAY: f64 = 10.0;
/// How far around a marker others tell how the face differs there, millimetres (a Gaussian's deviation).
const AROUND: f64 = 25.0;
/// A landmark's distance from the named one counts so much of its distance from the marker, where studios agree what the
/// name means and where they do not.
const FIRM: f64 = 0.5;
const LOOSE: f64 = 0.1;
/// A marker without a name that tells is off the face where no landmark is this near, millimetres.
const ON_FACE: f64 = 25.0;

/// Places every marker of `take`. `neutral` has M places of the neutral face, in the take's own frame and unit; `given` is
/// what the user says, which counts as it is and may leave markers out. Markers whose names tell nothing are placed by
/// where they are, or are off where that is not on the face.
///
/// Refuses a `given` name that the take has not, a take that is mirrored or has sides exchanged, and too few names that
/// tell.
pub fn place_markers(
    take: &MarkerTake,
    neutral: &[Option<Point3<f64>>],
    given: &MarkerMap,
) -> Result<MarkerMap, MuscleError> {
    let strangers: Vec<&str> =
        given.places.keys().filter(|name| take.index(name).is_none()).map(String::as_str).collect();
    if !strangers.is_empty() {
        return Err(MuscleError::File {
            path: take.path.clone(),
            reason: format!("it has no marker called {}", strangers.join(", ")),
            remedy: "Spell the names of the mapping as the take does",
        });
    }
    let face = &ActionLibrary::built_in().face[..SKIN_LANDMARK_COUNT];
    let hints: Vec<Hint> = take.names.iter().map(|name| Hint::of(name, given)).collect();
    let known: Vec<Known> = hints
        .iter()
        .enumerate()
        .filter_map(|(marker, hint)| {
            let seen = neutral.get(marker).copied().flatten()?;
            Some(Known { marker, place: hint.place(face)?, named: hint.named().cloned(), seen })
        })
        .collect();
    let fit = fit(take, &known, &hints)?;
    let pulls = fit.map(|fit| (fit, pulls(&firm(&known), &fit)));

    let mut wishes = Vec::new();
    for (marker, hint) in hints.iter().enumerate() {
        let place = neutral.get(marker).copied().flatten();
        let (Some(place), Some((fit, pulls))) = (place, &pulls) else { continue };
        let place = fit * place;
        let place = place + pulled(pulls, &place);
        for (landmark, point) in face.iter().enumerate().filter(|(l, p)| hint.allows(*l, p.x)) {
            let near = (point - place).norm();
            match hint {
                Hint::Named(named) => {
                    let pull = if named.firm { FIRM } else { LOOSE };
                    wishes.push((near + pull * (point - face[named.landmark]).norm(), marker, landmark));
                }
                Hint::Unknown if near <= ON_FACE => wishes.push((near, marker, landmark)),
                _ => {}
            }
        }
    }
    wishes.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut taken = BTreeSet::new();
    let mut chosen: Vec<Option<usize>> = vec![None; hints.len()];
    for (_, marker, landmark) in wishes {
        if chosen[marker].is_none() && taken.insert(landmark) {
            chosen[marker] = Some(landmark);
        }
    }
    let places = hints.into_iter().zip(chosen).map(|(hint, chosen)| match (hint, chosen) {
        (Hint::Given(place), _) => place,
        (_, Some(landmark)) => MarkerPlace::Landmarks(vec![landmark]),
        // Not in the neutral, or nothing to compare with: the name has to do.
        (Hint::Named(named), None) => MarkerPlace::Landmarks(vec![named.landmark]),
        (Hint::Unknown, None) => MarkerPlace::Off,
    });
    Ok(MarkerMap { places: take.names.iter().cloned().zip(places).collect() })
}

/// What is known of a marker before it is looked at.
#[derive(Debug, Clone)]
enum Hint {
    Given(MarkerPlace),
    Named(Named),
    Unknown,
}

impl Hint {
    fn of(name: &str, given: &MarkerMap) -> Self {
        if let Some(place) = given.places.get(name) {
            return Self::Given(place.clone());
        }
        match place_by_name(name) {
            Some(named) if named.exact => Self::Given(MarkerPlace::Landmarks(vec![named.landmark])),
            Some(named) => Self::Named(named),
            None => Self::Unknown,
        }
    }

    fn named(&self) -> Option<&Named> {
        if let Self::Named(named) = self { Some(named) } else { None }
    }

    fn place(&self, face: &[Point3<f64>]) -> Option<Point3<f64>> {
        match self {
            Self::Given(place) => mean(place.landmarks(), |landmark| face.get(landmark).copied()),
            Self::Named(named) => face.get(named.landmark).copied(),
            Self::Unknown => None,
        }
    }

    /// A name says on which side a marker is, or that it is on neither. `x` is the landmark's, to the subject's left.
    fn allows(&self, landmark: usize, x: f64) -> bool {
        let Self::Named(named) = self else { return true };
        let middle = |landmark: usize| landmark_table()[landmark].mirror == landmark;
        match named.side {
            Some(Side::Left) => !middle(landmark) && x > 0.0,
            Some(Side::Right) => !middle(landmark) && x < 0.0,
            None => middle(landmark) || !middle(named.landmark),
        }
    }
}

/// The mean of those landmarks' points that are there.
pub(super) fn mean(landmarks: &[usize], point: impl Fn(usize) -> Option<Point3<f64>>) -> Option<Point3<f64>> {
    let points: Vec<Vector3<f64>> =
        landmarks.iter().filter_map(|landmark| Some(point(*landmark)?.coords)).collect();
    (!points.is_empty()).then(|| Point3::from(points.iter().sum::<Vector3<f64>>() / points.len() as f64))
}

/// From the take to the average face; `None` where too few are known and no other has to be placed.
fn fit(take: &MarkerTake, known: &[Known], hints: &[Hint]) -> Result<Option<Similarity3<f64>>, MuscleError> {
    let unknown: Vec<&str> = take
        .names
        .iter()
        .zip(hints)
        .filter(|(_, hint)| matches!(hint, Hint::Unknown))
        .map(|(name, _)| name.as_str())
        .collect();
    if known.len() < FEWEST {
        if unknown.is_empty() {
            return Ok(None);
        }
        let places = unknown.iter().map(|name| ((*name).to_owned(), MarkerPlace::Off)).collect();
        return Err(MuscleError::Unplaced {
            path: take.path.clone(),
            known: known.len(),
            names: unknown.join(", "),
            example: MarkerMap { places }.format(),
        });
    }
    let sides = |markers| MuscleError::Sides { path: take.path.clone(), markers };
    if let Some(markers) = mirrored(known, &take.names) {
        return Err(sides(markers));
    }
    let fit = trimmed(&firm(known)).ok_or_else(|| MuscleError::Alignment {
        reason: format!("the {} markers that are known lie in one place", known.len()),
        remedy: "Export the take with its markers' places",
    })?;
    match swapped(known, &take.names, &fit) {
        Some(markers) => Err(sides(markers)),
        None => Ok(Some(fit)),
    }
}

/// Those whose place is agreed upon or given; all where these are too few.
fn firm(known: &[Known]) -> Vec<&Known> {
    let firm: Vec<&Known> =
        known.iter().filter(|k| k.named.as_ref().is_none_or(|named| named.firm)).collect();
    if firm.len() < FEWEST { known.iter().collect() } else { firm }
}

/// A fit in which markers far from where their names say do not count.
fn trimmed(known: &[&Known]) -> Option<Similarity3<f64>> {
    const ROUNDS: usize = 5;
    let mut used: Vec<&Known> = known.to_vec();
    let mut fit = None;
    for _ in 0..ROUNDS {
        let (seen, places): (Vec<_>, Vec<_>) = used.iter().map(|k| (k.seen, k.place)).unzip();
        let now = similarity_between(&seen, &places)?;
        fit = Some(now);
        let mut errors: Vec<f64> = known.iter().map(|k| (now * k.seen - k.place).norm()).collect();
        let each = errors.clone();
        errors.sort_by(f64::total_cmp);
        let limit = (2.0 * errors[errors.len() / 2]).max(ASTRAY);
        used = known.iter().zip(&each).filter(|(_, error)| **error <= limit).map(|(k, _)| *k).collect();
    }
    fit
}

/// Where known markers lie on the average face, and what remains between that and their named places.
fn pulls(known: &[&Known], fit: &Similarity3<f64>) -> Vec<(Point3<f64>, Vector3<f64>)> {
    known.iter().map(|k| (fit * k.seen, k.place - fit * k.seen)).collect()
}

/// The mean of what remains around a place.
fn pulled(pulls: &[(Point3<f64>, Vector3<f64>)], place: &Point3<f64>) -> Vector3<f64> {
    let weight = |at: &Point3<f64>| (-0.5 * (at - place).norm_squared() / (AROUND * AROUND)).exp();
    let total: f64 = pulls.iter().map(|(at, _)| weight(at)).sum();
    if total < f64::EPSILON {
        return Vector3::zeros();
    }
    pulls.iter().map(|(at, pull)| pull * weight(at)).sum::<Vector3<f64>>() / total
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::capture::Timestamp;

    type P = Point3<f64>;

    /// The names of a face rig that is published, and where they were put on the average face for these tests.
    const MARKERS: &[(&str, usize)] = &[
        ("ForeHead_M", 151),
        ("ForeHead_L", 333),
        ("ForeHead_R", 104),
        ("Leyebrow_M", 334),
        ("Leyebrow_Inside", 336),
        ("Leyebrow_Outside", 300),
        ("Reyebrow_M", 105),
        ("Reyebrow_Inside", 107),
        ("Reyebrow_Outside", 70),
        ("NoseTop", 168),
        ("NoseHead", 4),
        ("NoseHead_L", 358),
        ("NoseHead_R", 129),
        ("Leye_Outside", 263),
        ("Reye_Outside", 33),
        ("Lcheek_Up", 280),
        ("Rcheek_Up", 50),
        ("Mouth_Up", 0),
        ("Mouth_Down", 17),
        ("Mouth_Lend", 291),
        ("Mouth_Rend", 61),
        ("Chin", 199),
    ];

    fn face() -> &'static [P] {
        &ActionLibrary::built_in().face[..SKIN_LANDMARK_COUNT]
    }

    /// Metres, turned and moved.
    fn away(p: &P) -> P {
        let turn = UnitQuaternion::from_euler_angles(-1.2, 0.5, 2.0);
        Similarity3::from_parts(Vector3::new(3.0, 1.0, -2.0).into(), turn, 0.001) * p
    }

    fn take(markers: &[(&str, P)]) -> MarkerTake {
        let names = markers.iter().map(|(name, _)| (*name).to_owned()).collect();
        let frame = markers.iter().map(|(_, p)| Some(away(p))).collect();
        MarkerTake::new("take.csv".as_ref(), names, vec![Timestamp(0)], vec![frame]).unwrap()
    }

    fn at_landmarks(markers: &[(&'static str, usize)]) -> Vec<(&'static str, P)> {
        markers.iter().map(|(name, landmark)| (*name, face()[*landmark])).collect()
    }

    fn guess(markers: &[(&str, P)]) -> Result<MarkerMap, MuscleError> {
        let take = take(markers);
        place_markers(&take, &take.mean(0..1), &MarkerMap::default())
    }

    fn of(map: &MarkerMap, name: &str) -> Vec<usize> {
        map.places[name].landmarks().to_vec()
    }

    #[test]
    fn names_and_places_that_agree_stay() {
        let map = guess(&at_landmarks(MARKERS)).unwrap();
        for (name, landmark) in MARKERS {
            assert_eq!(of(&map, name), [*landmark], "{name}");
        }
    }

    #[test]
    fn a_marker_beside_its_name_takes_the_landmark_it_is_at() {
        let mut markers = at_landmarks(MARKERS);
        // A cheek's marker may be anywhere on the cheek, a mouth's corner is one place.
        markers[15].1 = face()[425];
        markers[19].1 += Vector3::new(4.0, 3.0, 0.0);
        let map = guess(&markers).unwrap();
        assert_eq!((of(&map, "Lcheek_Up"), of(&map, "Mouth_Lend")), (vec![425], vec![291]));
    }

    #[test]
    fn names_that_tell_nothing_are_placed_by_where_they_are() {
        let mut markers = at_landmarks(MARKERS);
        markers.extend([("M07", face()[205]), ("wand", P::new(0.0, -400.0, 0.0))]);
        let map = guess(&markers).unwrap();
        assert_eq!(of(&map, "M07"), [205]);
        assert_eq!(map.places["wand"], MarkerPlace::Off);
    }

    #[test]
    fn sides_exchanged_are_named() {
        let error = |markers: &[(&str, P)]| guess(markers).unwrap_err().to_string();
        let mut markers = at_landmarks(MARKERS);
        let (left, right) = (markers[19].1, markers[20].1);
        (markers[19].1, markers[20].1) = (right, left);
        let said = error(&markers);
        assert!(
            said.starts_with("take.csv: Mouth_Lend and Mouth_Rend have left and right exchanged. Left"),
            "{said}"
        );
        // Side by side.
        let mut near = at_landmarks(MARKERS);
        near.extend([("upper lip inner L", face()[37]), ("upper lip inner R", face()[267])]);
        let said = error(&near);
        assert!(said.contains(": upper lip inner L and upper lip inner R have left"), "{said}");
        // Alone, without its partner.
        let mut alone = at_landmarks(MARKERS);
        alone.remove(20);
        alone[19].1 = right;
        let said = error(&alone);
        assert!(said.contains("Mouth_Lend belongs to the left and lies on the right."), "{said}");
        // The whole take.
        let mut mirrored = at_landmarks(MARKERS);
        for (_, p) in &mut mirrored {
            p.x = -p.x;
        }
        let said = error(&mirrored);
        assert!(said.contains("throughout") && said.contains("Leyebrow_M and Reyebrow_M"), "{said}");
        assert!(said.contains("mirror the take back"), "{said}");
    }

    #[test]
    fn a_mapping_counts_as_it_is() {
        let markers = at_landmarks(MARKERS);
        let take = take(&markers);
        let neutral = take.mean(0..1);
        let given = MarkerMap::parse("[markers]\nChin = [199, 200]\nMouth_Up = \"off\"").unwrap();
        let map = place_markers(&take, &neutral, &given).unwrap();
        assert_eq!(
            (of(&map, "Chin"), of(&map, "Mouth_Up"), of(&map, "Mouth_Down")),
            (vec![199, 200], vec![], vec![17])
        );
        let stranger = MarkerMap::parse("[markers]\nchin = 199").unwrap();
        let said = place_markers(&take, &neutral, &stranger).unwrap_err().to_string();
        assert!(said.contains("no marker called chin"), "{said}");
        // A mapping may have the sides wrong as well.
        let wrong = MarkerMap::parse("[markers]\nMouth_Lend = 61").unwrap();
        let said = place_markers(&take, &neutral, &wrong).unwrap_err().to_string();
        assert!(said.contains("Mouth_Lend belongs to the right and lies on the left"), "{said}");
    }

    #[test]
    fn a_marker_that_the_neutral_lacks_goes_by_its_name() {
        let markers = at_landmarks(MARKERS);
        let take = take(&markers);
        let mut neutral = take.mean(0..1);
        neutral[21] = None;
        let map = place_markers(&take, &neutral, &MarkerMap::default()).unwrap();
        assert_eq!(of(&map, "Chin"), [199]);
        assert_eq!(of(&map, "NoseHead"), [4]);
    }

    #[test]
    fn too_few_names_are_refused_with_the_file_to_write() {
        let mut markers = at_landmarks(&MARKERS[..5]);
        assert_eq!(of(&guess(&markers).unwrap(), "ForeHead_L"), [333]);
        markers.extend([("M1", face()[50]), ("M 2", face()[280])]);
        let said = guess(&markers).unwrap_err().to_string();
        assert!(said.contains("take.csv: 5 markers") && said.contains("place M1, M 2."), "{said}");
        let example = said.split_once("\"off\":\n").unwrap().1;
        assert_eq!(MarkerMap::parse(example).unwrap().places.len(), 2);
        let same: Vec<_> = MARKERS.iter().map(|(name, _)| (*name, P::new(1.0, 2.0, 3.0))).collect();
        assert!(guess(&same).unwrap_err().to_string().contains("lie in one place"));
    }
}
