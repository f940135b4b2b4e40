//! Takes of markers as what a basis is analysed and refined by: displacements on its face, and where each marker sits there.

use nalgebra::{Point3, Vector3};

use super::{
    Alignment, MarkerMap, MarkerMotion, MarkerSeat, MuscleError, OTHER_FACE_REACH, align, place_markers,
    still_weights, virtual_markers,
};
use crate::{capture::MarkerTake, scan::Surface};

/// The neutral is what a take opens with, seconds.
const NEUTRAL: f64 = 0.5;

/// Displacements of a take.
#[derive(Debug, Clone)]
pub struct Training {
    /// F × J, millimetres in the frame of the basis' face; `None` where a marker was not seen. Of all takes, markers are
    /// the same.
    pub frames: Vec<Vec<Option<Vector3<f64>>>>,
    /// Frames per second.
    pub rate: f64,
}

/// A take that is brought to a basis' face.
#[derive(Debug, Clone)]
pub struct SeatedTake {
    /// J names.
    pub names: Vec<String>,
    /// J seats; `None` for markers that are off.
    pub seats: Vec<Option<MarkerSeat>>,
    /// The displacements of these markers.
    pub training: Training,
    /// How it lies on the face; `None` where it was there already.
    pub alignment: Option<Alignment>,
    /// Whether the head's motion was taken out; a take without markers on the skull must hold its head still, as 001 has it.
    pub stilled: bool,
}

impl SeatedTake {
    /// Places and aligns a take by its first half second. `face` has the basis' handles, `skin` is a mesh whose vertices
    /// are its 468 landmarks, `given` what is said of where markers sit.
    pub fn of(
        take: &MarkerTake,
        given: &MarkerMap,
        face: &[Point3<f64>],
        skin: &Surface,
    ) -> Result<Self, MuscleError> {
        let neutral = take.mean(take.opening(NEUTRAL));
        let own = MarkerMap {
            places: given
                .places
                .iter()
                .filter(|(name, _)| take.index(name).is_some())
                .map(|(n, p)| (n.clone(), p.clone()))
                .collect(),
        };
        let map = place_markers(take, &neutral, &own)?;
        let landmarks: Vec<_> = face.iter().copied().map(Some).collect();
        let alignment =
            align(&neutral, &virtual_markers(&map, &take.names, &landmarks), skin, OTHER_FACE_REACH)?;
        let still = still_weights(take, &map).ok();
        let motion = MarkerMotion::of(take, &alignment, still.as_deref());
        let seat = |anchor: &Option<_>| MarkerSeat::anchored(anchor.as_ref()?, skin.triangles());
        let seconds = take.times.last().map_or(0.0, |time| time.seconds());
        Ok(Self {
            names: take.names.clone(),
            seats: alignment.markers.iter().map(seat).collect(),
            training: Training {
                frames: motion.displacements,
                rate: (take.frames.len() - 1) as f64 / seconds.max(f64::MIN_POSITIVE),
            },
            alignment: Some(alignment),
            stilled: still.is_some(),
        })
    }

    /// Markers that are on the face and were seen in the neutral.
    pub fn placed(&self) -> usize {
        self.seats.iter().flatten().count()
    }
}

/// Several takes with one set of markers: those of one name are one, and sit where the first take has them.
pub fn join_takes(takes: Vec<SeatedTake>) -> (Vec<Option<MarkerSeat>>, Vec<Training>) {
    let (mut names, mut seats): (Vec<String>, Vec<Option<MarkerSeat>>) = Default::default();
    let mut places = Vec::new();
    for take in &takes {
        let mut own = Vec::new();
        for (name, seat) in take.names.iter().zip(&take.seats) {
            let at = names.iter().position(|known| known == name).unwrap_or_else(|| {
                names.push(name.clone());
                seats.push(None);
                names.len() - 1
            });
            if seats[at].is_none() {
                seats[at].clone_from(seat);
            }
            own.push(at);
        }
        places.push(own);
    }
    let spread = |take: SeatedTake, places: Vec<usize>| {
        let frames = take.training.frames.into_iter().map(|frame| {
            let mut row = vec![None; names.len()];
            for (displacement, at) in frame.into_iter().zip(&places) {
                row[*at] = displacement;
            }
            row
        });
        Training { frames: frames.collect(), rate: take.training.rate }
    };
    let joined = takes.into_iter().zip(places).map(|(take, places)| spread(take, places)).collect();
    (seats, joined)
}
