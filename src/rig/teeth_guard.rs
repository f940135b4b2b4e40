//! Skin lies on teeth and does not go through them.
//!
//! A library's smile, measured on a face with its own teeth, presses lips and chin back; on a target the teeth stand where
//! they were put. How far back each control may go from where the jaw takes it is settled once.

use nalgebra::{Point3, Vector3};

use super::TargetFace;
use crate::{anatomy::Anatomy, tracking::index};

/// Millimetres between skin and teeth that it may take up.
const ROOM: f64 = 1.2;
/// Half the width of the dental arch's front, and how far it reaches above and below the lips' line, mouth widths.
const FRONT: f64 = 0.28;
const ABOVE: f64 = 0.28;
const BELOW: f64 = 0.42;
/// Beyond these, so many millimetres more for each mouth width: the arch curves away.
const EASE: f64 = 60.0;

/// For each control the millimetres that it may go back; infinite without teeth.
pub(super) fn room_before_teeth(target: &TargetFace, anatomy: &Anatomy, rest: &[Point3<f64>]) -> Vec<f64> {
    let corners = target.landmarks[index::MOUTH_RIGHT].zip(target.landmarks[index::MOUTH_LEFT]);
    let Some((mouth, frame, (right, left))) =
        anatomy.mouth.as_ref().zip(anatomy.frame).zip(corners).map(|((m, f), c)| (m, f, c))
    else {
        return vec![f64::INFINITY; rest.len()];
    };
    let width = (left - right).norm().max(f64::MIN_POSITIVE);
    let middle = nalgebra::center(&right, &left);
    let aside = frame.leave_vector(&Vector3::x());
    rest.iter()
        .map(|place| {
            let (across, up) =
                ((place - middle).dot(&aside).abs() / width, (place - middle).dot(&mouth.up) / width);
            let beyond = (across - FRONT).max(0.0) + (up - ABOVE).max(0.0) + (-up - BELOW).max(0.0);
            ROOM + EASE * beyond
        })
        .collect()
}
