//! The face from which motion comes: a performer's neutral, or the average face of a library of action units.

use nalgebra::{Point3, Rotation3};

use crate::{
    actions::{ActionLibrary, Catalogue},
    lift::Performer,
    tracking::index::{self, LOWER_INNER, UPPER_INNER},
};

/// A neutral face whose motion is known.
#[derive(Debug, Clone)]
pub struct SourceFace {
    /// Its handles: the 468 skin landmarks, then the catalogue's control points. Its scan frame, millimetres.
    pub points: Vec<Point3<f64>>,
    /// From its scan frame to the level frame.
    pub level: Rotation3<f64>,
    /// Gaps of the inner lips' pairs that count as closed, millimetres in the level frame.
    pub closed_lips: [f64; UPPER_INNER.len()],
    /// Whether depth was measured; a single camera only infers it.
    pub has_depth: bool,
}

impl SourceFace {
    /// A performer before a camera.
    pub fn performer(performer: &Performer) -> Self {
        Self {
            points: Catalogue::get().place_between(performer.neutral()),
            level: performer.level(),
            closed_lips: *performer.closed_lips(),
            has_depth: false,
        }
    }

    /// A library's average face.
    pub fn library(library: &ActionLibrary) -> Self {
        Self::average(&library.face)
    }

    /// An average face, which was measured in space. `points` has its handles, scan frame, millimetres.
    pub fn average(points: &[Point3<f64>]) -> Self {
        // Lips that press and roll seem to part a little where their rims are a few points; they part beyond this.
        const TOUCHING: f64 = 0.9;
        let gap = |pair: usize| points[UPPER_INNER[pair]].y - points[LOWER_INNER[pair]].y;
        Self {
            points: points.to_vec(),
            level: Rotation3::identity(),
            closed_lips: std::array::from_fn(|pair| gap(pair).max(0.0) + TOUCHING),
            has_depth: true,
        }
    }

    /// Millimetres between two landmarks.
    pub fn distance(&self, a: usize, b: usize) -> f64 {
        (self.points[a] - self.points[b]).norm()
    }

    /// Millimetres between the outer eye corners.
    pub fn outer_canthal_distance(&self) -> f64 {
        self.distance(index::RIGHT_EYE_OUTER, index::LEFT_EYE_OUTER)
    }
}
