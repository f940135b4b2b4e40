//! Markers whose names and places disagree about the subject's left and right.

use nalgebra::{Point3, Similarity3};

use crate::{grid::similarity_between, lift::Side};

use super::marker_names::Named;

/// A mirrored take fits the face's mirror image at less than this share of the error at which it fits the face.
const MIRRORED: f64 = 0.75;
/// Farther than this beyond the middle a marker lies on the other side, millimetres.
const BEYOND: f64 = 8.0;
/// A pair is exchanged when its markers lie apart by at least this share of what they should, the other way round.
const EXCHANGED: f64 = 0.5;

/// What is known of one marker.
#[derive(Debug)]
pub(super) struct Known {
    /// Its index in the take.
    pub marker: usize,
    /// What its name says; `None` for one whose place was given.
    pub named: Option<Named>,
    /// Its place on the average face, scan frame, millimetres.
    pub place: Point3<f64>,
    /// Its place in the take.
    pub seen: Point3<f64>,
}

impl Known {
    fn side(&self) -> Option<Side> {
        match &self.named {
            Some(named) if named.side.is_some() => named.side,
            _ if self.place.x > BEYOND => Some(Side::Left),
            _ if self.place.x < -BEYOND => Some(Side::Right),
            _ => None,
        }
    }
}

/// Whether the whole take is a mirror image of a face: what to say of it.
pub(super) fn mirrored(known: &[Known], names: &[String]) -> Option<String> {
    let seen: Vec<_> = known.iter().map(|k| k.seen).collect();
    let places: Vec<_> = known.iter().map(|k| k.place).collect();
    let flipped: Vec<_> = places.iter().map(|p| Point3::new(-p.x, p.y, p.z)).collect();
    let as_named = error(&similarity_between(&seen, &places)?, &seen, &places);
    let as_mirrored = error(&similarity_between(&seen, &flipped)?, &seen, &flipped);
    let pairs = pairs(known);
    if pairs.is_empty() || as_mirrored >= MIRRORED * as_named {
        return None;
    }
    let all: Vec<String> = pairs.iter().map(|(a, b)| both(names, a, b)).collect();
    Some(format!(
        "left and right are exchanged throughout, or the take is a mirror image: {}",
        all.join(", ")
    ))
}

/// Which markers lie on the other side than they are said to, by a fit that brings the take to the average face: what to
/// say of them.
pub(super) fn swapped(known: &[Known], names: &[String], fit: &Similarity3<f64>) -> Option<String> {
    let x = |k: &Known| (fit * k.seen).x;
    let pairs = pairs(known);
    let other_way =
        |(left, right): &&(&Known, &Known)| x(left) - x(right) < -EXCHANGED * (left.place.x - right.place.x);
    let exchanged: Vec<_> = pairs.iter().filter(other_way).collect();
    let mut said = Vec::new();
    if !exchanged.is_empty() {
        let all: Vec<String> = exchanged.iter().map(|(left, right)| both(names, left, right)).collect();
        said.push(format!("{} have left and right exchanged", all.join(", ")));
    }
    for k in known {
        let (across, side) = match k.side() {
            Some(Side::Left) => (-x(k), ["left", "right"]),
            Some(Side::Right) => (x(k), ["right", "left"]),
            None => continue,
        };
        let in_pair = exchanged.iter().any(|(a, b)| a.marker == k.marker || b.marker == k.marker);
        if across > BEYOND && !in_pair {
            let [named, lies] = side;
            said.push(format!("{} belongs to the {named} and lies on the {lies}", names[k.marker]));
        }
    }
    (!said.is_empty()).then(|| said.join(", "))
}

fn both(names: &[String], a: &Known, b: &Known) -> String {
    format!("{} and {}", names[a.marker], names[b.marker])
}

/// Left and right of each place that names say twice.
fn pairs(known: &[Known]) -> Vec<(&Known, &Known)> {
    let of = |side: Side| {
        known
            .iter()
            .filter_map(move |k| Some((k, k.named.as_ref().filter(|named| named.side == Some(side))?)))
    };
    of(Side::Left)
        .filter_map(|(left, named)| {
            let (right, _) = of(Side::Right).find(|(_, other)| named.mirrors(other))?;
            Some((left, right))
        })
        .collect()
}

/// Root mean square distance, millimetres.
fn error(fit: &Similarity3<f64>, seen: &[Point3<f64>], places: &[Point3<f64>]) -> f64 {
    let squares: f64 = seen.iter().zip(places).map(|(a, b)| (fit * a - b).norm_squared()).sum();
    (squares / seen.len().max(1) as f64).sqrt()
}
