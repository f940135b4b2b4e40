//! Where the appearance samples of a frame are, and what is seen there (002 §V.i).

use nalgebra::{Point3, Vector2, Vector3};

use super::{
    Anchor, Area, FaceFrame, Picture, REGION_COUNT, Region,
    sample::{FINE_SIDE, Sample},
};
use crate::{
    head::HeadPose,
    lift::{Displacements, Expression, Performer},
};

/// Cheek to cheek.
const CHEEKS: [usize; 2] = [234, 454];
/// Cosine between a region's normal and the way to the camera below which it has turned away.
const TURNED_AWAY: f64 = 0.30;
/// A face that moves nearer and farther around the limit of a region does not make it flicker: what has been learnt on a face that
/// is wide enough is told on one that is narrower by this factor.
const NARROWER: f64 = 0.9;
/// The same for learning: how wide a face is depends on the guess of its camera.
pub const LEARNT_NARROWER: f64 = 0.97;
/// Shares of that area; the first that lies wholly on the face is taken.
const COVERED: [f64; 7] = [1.0, 0.92, 0.84, 0.76, 0.68, 0.6, 0.52];

/// Why a region cannot be told in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Absence {
    /// No face is seen, or it has just been lost.
    NoFace,
    /// The face is this many pixels wide, too narrow for the region's details.
    Narrow(f64),
    /// The region faces away from the camera.
    TurnedAway,
    /// A part of it lies beyond the picture.
    OutOfPicture,
}

/// What is seen of every region in one frame, in the order of [`Region::ALL`].
pub type Samples = [Result<Sample, Absence>; REGION_COUNT];

/// The template area of one region.
#[derive(Debug, Clone)]
struct Place {
    /// 34×34 places on the face, row by row.
    anchors: Vec<Anchor>,
    /// Normal of the performer's neutral there, scan frame.
    normal: Vector3<f64>,
    /// Its middle on the performer's neutral, scan frame.
    middle: Point3<f64>,
}

/// The template areas of all regions on one performer.
#[derive(Debug, Clone)]
pub struct Sampler {
    places: Vec<Place>,
}

impl Sampler {
    /// `None` if a region does not lie on the frame's face.
    pub fn new(frame: &FaceFrame, performer: &Performer) -> Option<Self> {
        let place = |region| {
            let anchors = anchors(region, frame)?;
            let neutral = performer.neutral();
            let mut normal = Vector3::zeros();
            let mut middle = Vector3::zeros();
            for anchor in &anchors {
                let [a, b, c] = anchor.corners.map(|corner| neutral[usize::from(corner)]);
                normal += (b - a).cross(&(c - a)).try_normalize(1e-9).unwrap_or_default();
                middle += anchor.in_space(neutral).coords / anchors.len() as f64;
            }
            Some(Place { normal: normal.try_normalize(1e-9)?, middle: middle.into(), anchors })
        };
        Some(Self { places: Region::ALL.into_iter().map(place).collect::<Option<_>>()? })
    }

    /// Cosine between a region's normal and the way from it to the camera: 1 facing it, 0 edge-on.
    pub fn facing(&self, region: Region, pose: &HeadPose) -> f64 {
        let place = &self.places[region.index()];
        let seen = pose.to_camera(&place.middle).coords;
        -(pose.rotation * place.normal).dot(&seen) / seen.norm()
    }

    /// The look of every region in a picture.
    ///
    /// Eyes are found by the pose alone: the mesh follows the lids and would show the same eye at every moment. `limit` says whether
    /// regions are refused for which the face is too narrow.
    pub fn sample(
        &self,
        picture: Picture<'_>,
        performer: &Performer,
        shown: &Expression,
        limit: bool,
    ) -> Samples {
        let pixels = |displacements: &Displacements| performer.pixels(displacements, &shown.pose);
        let (moving, rigid) = (pixels(&shown.displacements), pixels(&Displacements::neutral()));
        let width = face_width(performer, &shown.pose);
        Region::ALL.map(|region| {
            if limit && width < region.detail().narrowest_face() * NARROWER {
                return Err(Absence::Narrow(width));
            }
            if self.facing(region, &shown.pose) < TURNED_AWAY {
                return Err(Absence::TurnedAway);
            }
            let landmarks = if region.is_eye() { &rigid } else { &moving };
            self.sample_one(picture, region, landmarks).ok_or(Absence::OutOfPicture)
        })
    }

    fn sample_one(&self, picture: Picture<'_>, region: Region, landmarks: &[Vector2<f64>]) -> Option<Sample> {
        let anchors = &self.places[region.index()].anchors;
        let luma: Option<Box<[u8]>> = anchors
            .iter()
            .map(|anchor| Some(picture.luma(anchor.in_plane(landmarks).cast())?.round() as u8))
            .collect();
        Sample::new(luma?)
    }

    /// Where the middle of a region is in the picture, pixels.
    pub fn middle(&self, region: Region, performer: &Performer, pose: &HeadPose) -> Vector2<f64> {
        performer.camera().project(&pose.to_camera(&self.places[region.index()].middle))
    }
}

/// Pixels from cheek to cheek as if the face were turned to the camera: how finely the picture shows it.
pub fn face_width(performer: &Performer, pose: &HeadPose) -> f64 {
    let [right, left] = CHEEKS.map(|cheek| performer.neutral()[cheek]);
    let depth = pose.to_camera(&nalgebra::center(&right, &left)).z;
    (right - left).norm() * performer.camera().focal / depth.max(1.0)
}

/// The part of a region's area that its template covers ("a small area for the templates", 002 §III): left, right, top, bottom
/// of −1..=1. Brows, hair and what lies behind the face would outweigh the wrinkles.
fn part(region: Region) -> [f64; 4] {
    match region {
        Region::Forehead => [-0.85, 0.85, -0.85, 0.3],
        // Outside is on the picture's left of the right eye.
        Region::CrowsFeetRight => [-0.3, 0.9, -0.9, 0.7],
        Region::CrowsFeetLeft => [-0.9, 0.3, -0.9, 0.7],
        _ => [-0.92, 0.92, -0.92, 0.92],
    }
}

/// The fine grid on a region's template area, as large as fits on the face.
fn anchors(region: Region, frame: &FaceFrame) -> Option<Vec<Anchor>> {
    let area = Area::of(region, frame);
    let [left, right, top, bottom] = part(region);
    let along = |low: f64, high: f64, at: usize, covered: f64| {
        let (middle, half) = (f64::midpoint(low, high), (high - low) / 2.0 * covered);
        middle + half * ((at as f64 + 0.5) / FINE_SIDE as f64 * 2.0 - 1.0)
    };
    COVERED.into_iter().find_map(|covered| {
        (0..FINE_SIDE * FINE_SIDE)
            .map(|at| {
                let x = along(left, right, at % FINE_SIDE, covered);
                let y = along(top, bottom, at / FINE_SIDE, covered);
                frame.anchor(&area.place(&Vector2::new(x, y)))
            })
            .collect()
    })
}
