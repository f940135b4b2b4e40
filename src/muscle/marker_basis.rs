//! What each muscle does to each marker: dᵢⱼ of 001 §4.1.2.

use nalgebra::{Point3, SMatrix, SVector, Vector3};

use super::{FaceBasis, JawBow, MarkerMap, Muscle, Part};
use crate::{
    scan::Anchor,
    tracking::{SKIN_LANDMARK_COUNT, index},
};

/// Markers this far below the lower lids still belong to the lids, millimetres.
const LID_MARGIN: f64 = 1.0;

/// Where a marker sits: shares of the face's handles, together 1. Handles are those of the basis' face, of which the first
/// 468 are the network's landmarks.
#[derive(Debug, Clone, PartialEq)]
pub struct MarkerSeat(Vec<(usize, f64)>);

impl MarkerSeat {
    /// At the mean of landmarks; `None` for none.
    pub fn mean(landmarks: &[usize]) -> Option<Self> {
        let share = 1.0 / landmarks.len() as f64;
        (!landmarks.is_empty()).then(|| Self(landmarks.iter().map(|landmark| (*landmark, share)).collect()))
    }

    /// Within a triangle of a mesh whose vertices are the landmarks (001: "triangle index and the relative position").
    pub fn anchored(anchor: &Anchor, triangles: &[[u32; 3]]) -> Option<Self> {
        let corners = triangles.get(anchor.triangle as usize)?;
        Some(Self(
            corners.iter().zip(anchor.barycentric).map(|(corner, share)| (*corner as usize, share)).collect(),
        ))
    }

    /// M seats of the markers `names` where `map` puts them; `None` for those that are off.
    pub fn mapped(map: &MarkerMap, names: &[String]) -> Vec<Option<Self>> {
        map.landmarks(names).map(Self::mean).collect()
    }

    /// All 468 landmarks, each a marker.
    pub fn landmarks() -> Vec<Option<Self>> {
        (0..SKIN_LANDMARK_COUNT).map(|landmark| Self::mean(&[landmark])).collect()
    }

    /// Where that is among `points`.
    pub fn place(&self, points: &[Point3<f64>]) -> Point3<f64> {
        Point3::from(
            self.0.iter().map(|(handle, share)| points[*handle].coords * *share).sum::<Vector3<f64>>(),
        )
    }

    /// What it makes of one vector for each handle.
    pub fn vector(&self, vectors: &[Vector3<f64>]) -> Vector3<f64> {
        self.0.iter().map(|(handle, share)| vectors[*handle] * *share).sum()
    }
}

/// How much of a point a marker is to the jaw: Σsp and Σs of its handles, which a bend moves by A·Σsp + b·Σs.
type Follower = (Vector3<f64>, f64);

/// How far the jaw is off its straight line: a matrix and a vector.
pub(super) type Bend = SVector<f64, 12>;

/// A basis at the markers of a take, in the frame of the basis' face, millimetres.
#[derive(Debug, Clone)]
pub struct MarkerBasis {
    /// M muscles; each is sought with the markers of its own part.
    pub muscles: Vec<Muscle>,
    /// J places of the neutral face; `None` where a marker is off.
    pub rest: Vec<Option<Point3<f64>>>,
    /// J parts of the face (001 fig. 2): [`Part::Upper`] from the lower lids upwards; `None` where a marker is off.
    pub parts: Vec<Option<Part>>,
    /// M × J: dᵢⱼ; zero where a marker is off.
    pub vectors: Vec<Vec<Vector3<f64>>>,
    /// The jaw's muscle, its arc, and what each marker is to it.
    bow: Option<(usize, JawBow, Vec<Follower>)>,
}

impl MarkerBasis {
    /// A face's basis at J `seats` on it.
    pub fn new(face: &FaceBasis, seats: &[Option<MarkerSeat>]) -> Self {
        let at = |vectors: &Vec<Vector3<f64>>| {
            let one =
                |seat: &Option<MarkerSeat>| seat.as_ref().map_or_else(Vector3::zeros, |s| s.vector(vectors));
            seats.iter().map(one).collect()
        };
        let rest: Vec<_> =
            seats.iter().map(|seat| seat.as_ref().map(|seat| seat.place(&face.points))).collect();
        let lid = |landmark: usize| face.points[landmark].y;
        let border = lid(index::RIGHT_LID_LOWER).min(lid(index::LEFT_LID_LOWER)) - LID_MARGIN;
        let part = |p: &Point3<f64>| if p.y >= border { Part::Upper } else { Part::Lower };
        let bow = face.bow().map(|(jaw, bow)| (jaw, bow.clone(), followers(bow, seats)));
        Self {
            muscles: face.muscles.clone(),
            parts: rest.iter().map(|p| p.as_ref().map(part)).collect(),
            vectors: face.vectors.iter().map(at).collect(),
            rest,
            bow,
        }
    }

    /// The same with all muscles sought with all markers.
    #[must_use]
    pub fn undivided(mut self) -> Self {
        self.muscles.iter_mut().for_each(|muscle| muscle.part = Part::Lower);
        self.parts.iter_mut().flatten().for_each(|part| *part = Part::Lower);
        self
    }

    /// How many markers, those that are off among them.
    pub fn markers(&self) -> usize {
        self.rest.len()
    }

    /// Bends by the arc of another full opening, which every handle of `face` is known to make.
    pub(super) fn bend_by(
        &mut self,
        face: &FaceBasis,
        opening: &[Vector3<f64>],
        seats: &[Option<MarkerSeat>],
    ) {
        if let Some((_, own, by)) = &mut self.bow
            && let Some(bow) = JawBow::new(&face.points, opening)
        {
            *by = followers(&bow, seats);
            *own = bow;
        }
    }

    /// The muscle that moves on an arc.
    pub(super) fn jaw(&self) -> Option<usize> {
        self.bow.as_ref().map(|(jaw, ..)| *jaw)
    }

    /// What the jaw's arc differs by from the straight line at its contraction: A, column by column, and b, of
    /// [`MarkerBasis::bend_at`].
    pub(super) fn bend(&self, contraction: f64) -> Bend {
        let mut bend = Bend::zeros();
        if let Some((_, bow, _)) = &self.bow
            && contraction != 0.0
        {
            let (turn, shift) = bow.affine(contraction);
            bend.fixed_rows_mut::<9>(0).copy_from(&SVector::<f64, 9>::from_column_slice(turn.as_slice()));
            bend.fixed_rows_mut::<3>(9).copy_from(&shift);
        }
        bend
    }

    /// What a bend is to a marker: 3 × 12, which makes millimetres of it.
    pub(super) fn bending(&self, marker: usize) -> SMatrix<f64, 3, 12> {
        let mut matrix = SMatrix::zeros();
        if let Some((_, _, followers)) = &self.bow {
            let (place, share) = &followers[marker];
            for axis in 0..3 {
                for k in 0..3 {
                    matrix[(axis, 3 * k + axis)] = place[k];
                }
                matrix[(axis, 9 + axis)] = *share;
            }
        }
        matrix
    }

    /// The difference at a marker, millimetres.
    pub(super) fn bend_at(&self, bend: &Bend, marker: usize) -> Vector3<f64> {
        self.bending(marker) * bend
    }

    /// The displacements that contractions make, J, with the jaw on its arc (eq. 1).
    pub fn synthesize(&self, contractions: &[f64], out: &mut Vec<Vector3<f64>>) {
        out.clear();
        out.resize(self.markers(), Vector3::zeros());
        for (vectors, contraction) in self.vectors.iter().zip(contractions) {
            for (out, vector) in out.iter_mut().zip(vectors) {
                *out += vector * *contraction;
            }
        }
        if let Some(jaw) = self.jaw() {
            let bend = self.bend(contractions[jaw]);
            for (marker, out) in out.iter_mut().enumerate() {
                *out += self.bend_at(&bend, marker);
            }
        }
    }
}

/// What [`MarkerBasis::bend_at`] needs of each marker.
fn followers(bow: &JawBow, seats: &[Option<MarkerSeat>]) -> Vec<Follower> {
    let follower = |seat: &Option<MarkerSeat>| {
        let (mut place, mut share) = (Vector3::zeros(), 0.0);
        for (handle, own) in seat.iter().flat_map(|seat| &seat.0) {
            let (follows, p) = bow.follower(*handle);
            place += p.coords * (follows * own);
            share += follows * own;
        }
        (place, share)
    };
    seats.iter().map(follower).collect()
}
