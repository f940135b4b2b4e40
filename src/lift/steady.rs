//! Smoothing of pose and expression, causal for a performer who waits for it, zero-phase for a recording.
//!
//! What pose leaves over is filtered, not pixels, so that a turning head is not smeared into the face. Lids are left
//! almost alone: a blink is over in a tenth of a second and does not survive a filter made for cheeks.

use nalgebra::{Rotation3, SVector, Vector3, Vector6};

use super::{Displacements, Expression};
use crate::{
    capture::Timestamp,
    head::HeadPose,
    tracking::{
        Region,
        filter::{OneEuro, OneEuroSettings, ZeroPhase},
        landmark_table,
    },
};

/// How much to smooth, and whether the future may be looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Smoothing {
    /// Nothing is smoothed.
    Off,
    /// One-Euro filters: each frame needs only those before it.
    Causal,
    /// Local parabolas over a finished recording: no lag.
    #[default]
    ZeroPhase,
}

/// Displacements, millimetres: cutoff at rest and gain per millimetre a second.
const FACE: OneEuroSettings = OneEuroSettings { minimum_cutoff: 1.5, beta: 0.15 };
/// Lids and irises.
const LIDS: OneEuroSettings = OneEuroSettings { minimum_cutoff: 4.0, beta: 0.6 };
/// Contractions, from 0 to 1 (`docs/benchmarks/muscles.md` has jitter and lag).
const MUSCLES: OneEuroSettings = OneEuroSettings { minimum_cutoff: 3.0, beta: 4.0 };
/// Contractions of the lids.
const LID_MUSCLES: OneEuroSettings = OneEuroSettings { minimum_cutoff: 4.0, beta: 6.0 };
/// Rotation in degrees and translation in millimetres, which are of like size.
const HEAD: OneEuroSettings = OneEuroSettings { minimum_cutoff: 1.2, beta: 0.08 };

/// Gaussian standard deviations of the zero-phase pass, seconds.
const FACE_BANDWIDTH: f64 = 0.055;
const LIDS_BANDWIDTH: f64 = 0.022;
const HEAD_BANDWIDTH: f64 = 0.08;

fn is_quick(region: Region) -> bool {
    matches!(region, Region::Lids | Region::Iris)
}

/// The causal filters of one performer.
#[derive(Debug, Clone)]
pub struct CausalSteadier {
    head: OneEuro<6>,
    face: Vec<OneEuro<3>>,
    muscles: Vec<OneEuro<1>>,
}

impl CausalSteadier {
    /// `quick` tells of each contraction whether it moves the lids.
    pub fn new(quick: &[bool]) -> Self {
        let face = landmark_table()
            .iter()
            .map(|facts| OneEuro::new(if is_quick(facts.region) { LIDS } else { FACE }))
            .collect();
        let muscles = quick.iter().map(|&quick| OneEuro::new(if quick { LID_MUSCLES } else { MUSCLES }));
        Self { head: OneEuro::new(HEAD), face, muscles: muscles.collect() }
    }

    /// Steadies one frame in place.
    pub fn apply(&mut self, time: Timestamp, reference: &Rotation3<f64>, expression: &mut Expression) {
        let head = self.head.filter(time, head_vector(&expression.pose, reference));
        set_head(&mut expression.pose, &head, reference);
        for (filter, vector) in self.face.iter_mut().zip(&mut expression.displacements.vectors) {
            *vector = filter.filter(time, *vector);
        }
        for (filter, contraction) in self.muscles.iter_mut().zip(&mut expression.contractions) {
            *contraction = filter.filter(time, SVector::from([*contraction])).x.clamp(0.0, 1.0);
        }
    }
}

/// Steadies an unbroken stretch of a recording in place, without lag. `quick` tells of each contraction whether it moves
/// the lids.
pub fn steady_recording(
    times: &[Timestamp],
    reference: &Rotation3<f64>,
    quick: &[bool],
    expressions: &mut [Expression],
) {
    let head: Vec<_> = expressions.iter().map(|e| head_vector(&e.pose, reference)).collect();
    let head = ZeroPhase::new(times, HEAD_BANDWIDTH).apply(&head);
    for (expression, head) in expressions.iter_mut().zip(&head) {
        set_head(&mut expression.pose, head, reference);
    }
    let (face, lids) = (ZeroPhase::new(times, FACE_BANDWIDTH), ZeroPhase::new(times, LIDS_BANDWIDTH));
    for (landmark, facts) in landmark_table().iter().enumerate() {
        let vector = |e: &mut Displacements| e.vectors[landmark];
        let signal: Vec<SVector<f64, 3>> =
            expressions.iter_mut().map(|e| vector(&mut e.displacements)).collect();
        let filter = if is_quick(facts.region) { &lids } else { &face };
        for (expression, value) in expressions.iter_mut().zip(filter.apply(&signal)) {
            expression.displacements.vectors[landmark] = value;
        }
    }
    for (muscle, &quick) in quick.iter().enumerate() {
        let signal: Vec<_> = expressions.iter().map(|e| SVector::from([e.contractions[muscle]])).collect();
        let filter = if quick { &lids } else { &face };
        for (expression, value) in expressions.iter_mut().zip(filter.apply(&signal)) {
            expression.contractions[muscle] = value.x.clamp(0.0, 1.0);
        }
    }
}

/// Rotation from `reference` as a vector in degrees, then translation in millimetres.
fn head_vector(pose: &HeadPose, reference: &Rotation3<f64>) -> Vector6<f64> {
    let turn = (pose.rotation * reference.inverse()).scaled_axis().map(f64::to_degrees);
    Vector6::new(turn.x, turn.y, turn.z, pose.translation.x, pose.translation.y, pose.translation.z)
}

fn set_head(pose: &mut HeadPose, vector: &Vector6<f64>, reference: &Rotation3<f64>) {
    let turn: Vector3<f64> = vector.fixed_rows::<3>(0).map(f64::to_radians);
    pose.rotation = Rotation3::new(turn) * reference;
    pose.translation = vector.fixed_rows::<3>(3).into_owned();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lift::frontal_pose;

    #[test]
    fn a_still_face_stays_exactly_and_a_blink_keeps_its_depth() {
        let reference = frontal_pose().rotation;
        let times: Vec<_> = (0..60).map(|i| Timestamp(i * 33_333_333)).collect();
        let blink = |i: i64| -9.0 * (-((i - 30) as f64 / 1.6).powi(2)).exp();
        let mut expressions: Vec<_> = (0..60)
            .map(|i| {
                let mut displacements = Displacements::neutral();
                displacements.vectors[159].y = blink(i);
                Expression { displacements, ..Expression::neutral(frontal_pose()) }
            })
            .collect();
        steady_recording(&times, &reference, &[], &mut expressions);
        assert!(expressions.iter().all(|e| e.pose.rotation.angle_to(&reference) < 1e-12));
        assert!(expressions.iter().all(|e| e.displacements.vectors[61].norm() < 1e-12));
        let deepest = expressions.iter().map(|e| e.displacements.vectors[159].y).fold(0.0, f64::min);
        assert!(deepest < -8.5, "{deepest}");
    }
}
