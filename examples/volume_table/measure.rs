//! What the skin does at landmarks, against what the performer's landmarks ask of it.

use std::error::Error;

use nalgebra::{Point3, Rotation3, Vector3};
use understudy::{
    anatomy::{LOWER_INNER, Lip, SidedSkin, SkinPlace, UPPER_INNER},
    pipeline::Target,
    rig::{Rig, SourceFace, TRACKED_18, TargetFace, Transfer, TransferRule},
    tracking::{IBUG_68, Region, SKIN_LANDMARK_COUNT, is_outline, landmark_table},
};

use super::{EVERY, Take};

/// Parts of the face by the regions of their landmarks.
pub const PARTS: [(&str, &[Region]); 5] = [
    ("brows, forehead", &[Region::Brows, Region::Other]),
    ("nose", &[Region::Nose]),
    ("cheeks", &[Region::Cheeks]),
    ("lips", &[Region::Lips]),
    ("chin, jaw", &[Region::Jaw]),
];
/// Motion of this size is subtle, millimetres in the picture's plane.
const SUBTLE: std::ops::Range<f64> = 0.5..2.0;
/// A vertex farther than this from all landmarks is off the face, outer canthal distances.
const OFF: f64 = 0.3;

/// Where landmarks sit on the skin, and how the performer's motion comes there.
pub struct HeldOut {
    level: Rotation3<f64>,
    transfer: Transfer,
    /// Landmark, place, part; of those that are no centres.
    free: Vec<(usize, SkinPlace, usize)>,
    /// Of the 18 those on skin that the morph alone moves.
    centres: Vec<(usize, SkinPlace)>,
}

impl HeldOut {
    /// Left out are the lids, which have shapes of their own, the inner lips, which open as the lips' drive says, and the
    /// outline, which slides.
    pub fn new(take: &Take, target: &Target, face: &TargetFace) -> Result<Self, Box<dyn Error>> {
        let anatomy = &target.anatomy;
        let skin = &anatomy.parts[0];
        let positions = &anatomy.mesh.positions[..anatomy.skin_vertices()];
        let triangles = &anatomy.mesh.triangles[skin.triangles.clone()];
        let sided = SidedSkin::new(positions, triangles, &anatomy.lower_side).ok_or("no surface")?;
        let place = |i: usize| sided.nearest(Lip::of(i), face.landmarks[i]?);
        let is_free = |i: usize| {
            landmark_table()[i].region != Region::Lids
                && !UPPER_INNER.contains(&i)
                && !LOWER_INNER.contains(&i)
        };
        let part = |i: usize| PARTS.iter().position(|part| part.1.contains(&landmark_table()[i].region));
        let free = (0..SKIN_LANDMARK_COUNT)
            .filter(|&i| is_free(i) && !is_outline(i) && !IBUG_68.contains(&i) && !TRACKED_18.contains(&i))
            .filter_map(|i| Some((i, place(i)?, part(i)?)))
            .collect();
        let centres =
            TRACKED_18.into_iter().filter(|&i| is_free(i)).filter_map(|i| Some((i, place(i)?))).collect();
        let source = SourceFace::performer(&take.motion.performer);
        let transfer = Transfer::new(&source, face, TransferRule::default())?;
        Ok(Self { level: face.level, transfer, free, centres })
    }

    pub fn count(&self) -> usize {
        self.free.len()
    }
}

/// Sums of squares and products.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: f64,
    error: f64,
    wanted: f64,
    along: f64,
}

impl Sums {
    fn add(&mut self, wanted: &Vector3<f64>, found: &Vector3<f64>) {
        let (wanted, found) = (wanted.xy(), found.xy());
        self.count += 1.0;
        self.error += (found - wanted).norm_squared();
        self.wanted += wanted.norm_squared();
        self.along += wanted.dot(&found);
    }

    fn rms(&self) -> f64 {
        (self.error / self.count.max(1.0)).sqrt()
    }

    /// The share of the wanted motion that is there.
    fn kept(&self) -> f64 {
        self.along / self.wanted.max(f64::MIN_POSITIVE)
    }
}

/// What one way to drive does.
#[derive(Default)]
pub struct Figures {
    all: Sums,
    parts: [Sums; PARTS.len()],
    subtle: Sums,
    centres: Sums,
}

impl Figures {
    /// Over the take; without a rig nothing moves.
    pub fn of(held_out: &HeldOut, take: &Take, rig: Option<&Rig>) -> Result<Self, Box<dyn Error>> {
        let mut figures = Self::default();
        let mut posed = rig.map(Rig::new_frame);
        for frame in take.motion.frames.iter().step_by(EVERY) {
            let mut moved: Option<Vec<Point3<f64>>> = None;
            if let (Some(rig), Some(posed)) = (rig, &mut posed) {
                rig.pose(&frame.expression, posed)?;
                moved = Some(posed.positions.iter().map(|p| Point3::from(p.map(f64::from))).collect());
            }
            let vectors = &frame.expression.displacements.vectors;
            let pair = |i: usize, place: &SkinPlace| {
                let wanted = held_out.level * held_out.transfer.vector(i, &vectors[i]);
                let now = moved.as_ref().and_then(|moved| place.on(moved)).unwrap_or(place.position);
                (wanted, held_out.level * (now - place.position))
            };
            for (i, place, part) in &held_out.free {
                let (wanted, found) = pair(*i, place);
                figures.all.add(&wanted, &found);
                figures.parts[*part].add(&wanted, &found);
                if SUBTLE.contains(&wanted.xy().norm()) {
                    figures.subtle.add(&wanted, &found);
                }
            }
            for (i, place) in &held_out.centres {
                let (wanted, found) = pair(*i, place);
                figures.centres.add(&wanted, &found);
            }
        }
        Ok(figures)
    }

    /// Root mean squares: all, then part by part.
    pub fn errors(&self) -> String {
        let cells = std::iter::once(&self.all).chain(&self.parts).map(|sums| format!("{:.2}", sums.rms()));
        cells.collect::<Vec<_>>().join(" | ")
    }

    pub fn kept(&self) -> f64 {
        self.all.kept()
    }

    pub fn kept_of_subtle(&self) -> f64 {
        self.subtle.kept()
    }

    pub fn kept_at_centres(&self) -> f64 {
        self.centres.kept()
    }
}

/// How much of independent noise at the centres reaches the skin: millimetres for each millimetre, root mean square.
pub fn noise(held_out: &HeldOut, rig: &Rig) -> f64 {
    let share = |place: &SkinPlace, control: usize| -> f64 {
        let column = rig.warp().column(control);
        place
            .vertices
            .iter()
            .zip(place.weights)
            .map(|(&v, weight)| f64::from(column[v as usize]) * weight)
            .sum()
    };
    let controls = rig.controls().rest.len();
    let squares = |place: &SkinPlace| (0..controls).map(|control| share(place, control).powi(2)).sum::<f64>();
    let sum: f64 = held_out.free.iter().map(|(_, place, _)| squares(place)).sum();
    (sum / held_out.count().max(1) as f64).sqrt()
}

/// The farthest that anything goes off the face, millimetres, where the head should move as a whole.
pub fn edge(take: &Take, target: &Target, face: &TargetFace, rig: &Rig) -> Result<f64, Box<dyn Error>> {
    let landmarks: Vec<_> = face.landmarks[..SKIN_LANDMARK_COUNT].iter().flatten().collect();
    let off = OFF * face.outer_canthal_distance();
    let positions = &target.anatomy.mesh.positions[..target.anatomy.scan_vertices];
    let outside: Vec<usize> = (0..positions.len())
        .filter(|&v| landmarks.iter().all(|p| (positions[v] - **p).norm() > off))
        .collect();
    let mut posed = rig.new_frame();
    let mut farthest = 0.0_f64;
    for frame in take.motion.frames.iter().step_by(EVERY) {
        rig.pose(&frame.expression, &mut posed)?;
        for &v in &outside {
            let now = Point3::from(posed.positions[v].map(f64::from));
            farthest = farthest.max((now - Point3::from(rig.rest()[v].map(f64::from))).norm());
        }
    }
    Ok(farthest)
}
