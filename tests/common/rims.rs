//! The two rims of an opening, and how far apart they are.

use nalgebra::{Point3, Vector3};
use understudy::anatomy::Mouth;

use super::sound::distance;

/// Two rims from one end of an opening to the other, and the directions across and along it.
#[derive(Debug, Clone)]
pub struct Rims {
    pub upper: Vec<Point3<f64>>,
    pub lower: Vec<Point3<f64>>,
    pub up: Vector3<f64>,
    pub along: Vector3<f64>,
}

impl Rims {
    /// The lips of a mesh whose vertices are at `positions`; they part along `up`.
    pub fn of_mouth(
        mouth: &Mouth,
        up: Vector3<f64>,
        positions: &[Point3<f64>],
        rest: &[Point3<f64>],
    ) -> Self {
        let [upper, lower] =
            [&mouth.rims[0], &mouth.rims[1]].map(|rim| rim.iter().map(|&v| positions[v as usize]).collect());
        let (first, last) = (mouth.rims[0][0] as usize, mouth.rims[0][mouth.rims[0].len() - 1] as usize);
        let straight = rest[last] - rest[first];
        let along = (straight - up * straight.dot(&up)).normalize();
        Self { upper, lower, up, along }
    }

    /// For each pair how far the upper one lies above the lower, millimetres.
    pub fn pairs(&self) -> Vec<f64> {
        self.upper.iter().zip(&self.lower).map(|(u, l)| (u - l).dot(&self.up)).collect()
    }

    /// For each place of either rim how far the other rim is on the other side of it, straight across, millimetres.
    /// Below zero they cross.
    pub fn across(&self) -> Vec<f64> {
        let above = self.upper.iter().filter_map(|p| self.height_over(p, &self.lower));
        let below = self.lower.iter().filter_map(|p| self.height_over(p, &self.upper).map(|height| -height));
        above.chain(below).collect()
    }

    /// For each place of either rim that the other has not reached the way there, seen from the front, millimetres.
    pub fn gaps(&self) -> Vec<f64> {
        let away = |place: &Point3<f64>, rim: &[Point3<f64>]| {
            let flat = |p: &Point3<f64>| Point3::new(p.coords.dot(&self.along), p.coords.dot(&self.up), 0.0);
            let to = |pair: &[Point3<f64>]| distance(&flat(place), &flat(&pair[0]), &flat(&pair[1]));
            rim.windows(2).map(to).fold(f64::INFINITY, f64::min)
        };
        let is_open = |height: Option<f64>, side: f64| height.is_some_and(|height| side * height > 0.0);
        let above = self.upper.iter().filter(|p| is_open(self.height_over(p, &self.lower), 1.0));
        let below = self.lower.iter().filter(|p| is_open(self.height_over(p, &self.upper), -1.0));
        above.map(|p| away(p, &self.lower)).chain(below.map(|p| away(p, &self.upper))).collect()
    }

    /// How far a place lies above a rim, where the rim passes it nearest.
    fn height_over(&self, place: &Point3<f64>, rim: &[Point3<f64>]) -> Option<f64> {
        let x = place.coords.dot(&self.along);
        let crossings = rim.windows(2).filter_map(|pair| {
            let (a, b) = (pair[0].coords.dot(&self.along), pair[1].coords.dot(&self.along));
            let t = (x - a) / (b - a);
            (0.0..=1.0).contains(&t).then(|| pair[0] + (pair[1] - pair[0]) * t)
        });
        let nearest = crossings.min_by(|p, q| (p - place).norm().total_cmp(&(q - place).norm()))?;
        Some((place - nearest).dot(&self.up))
    }
}

/// The largest and the smallest.
pub fn range(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)))
}
