//! A solved take as contraction curves, and what edited curves make of it.

use std::path::Path;

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::{Motion, PipelineError, constant_rate};
use crate::{
    export::write_live_link,
    head::HeadPose,
    muscle::{CurveFrame, CurveMap, FaceAngles, MuscleBasis, MuscleCurves, MuscleError, TimecodeBase},
};

impl Motion {
    /// The contractions of every frame at its own time: those of the basis; of one whose muscles are all ARKit's the 52
    /// shapes, with the gaze. Blinks and widened eyes are those of the lids, which are measured by themselves. Where no
    /// face is seen, curves go as the avatar does. Refused of a take that was lifted without muscles.
    pub fn curves(&self) -> Result<MuscleCurves, PipelineError> {
        let (muscles, channels) = CurveMap::columns(self.muscles()?);
        let map = CurveMap::new(&muscles, &channels, self.muscles()?)?;
        let frames = self.frames.iter().map(|frame| CurveFrame {
            time: frame.timestamp,
            state: frame.state,
            contractions: map.row(&frame.expression.contractions, &frame.expression.eyes),
            error: frame.marker_error,
        });
        Ok(MuscleCurves::new(muscles, channels, self.info.rate, frames.collect())?)
    }

    /// Lets curves of this take, perhaps edited, show in place of what was solved: contractions, lids and gaze. In a
    /// mirrored take the head turns and moves to the other side as well.
    pub fn follow(&mut self, curves: &MuscleCurves, mirrored: bool) -> Result<(), PipelineError> {
        let map = CurveMap::new(curves.muscles(), curves.channels(), self.muscles()?)?;
        let rest = *self.performer.rest();
        for (frame, curve) in self.frames.iter_mut().zip(curves.frames()) {
            let shown = &mut frame.expression;
            if mirrored {
                shown.pose = mirrored_pose(&shown.pose, &rest);
                shown.eyes = shown.eyes.mirrored();
            }
            shown.eyes = map.eyes(&curve.contractions, &shown.eyes);
            shown.contractions = map.contractions(&curve.contractions);
        }
        Ok(())
    }

    /// Writes curves of this take as Live Link Face does, at the clip's nominal rate, with the angles of head and eyes
    /// as the take shows them.
    pub fn write_live_link(&self, path: &Path, curves: &MuscleCurves) -> Result<(), PipelineError> {
        let times: Vec<_> = self.frames.iter().map(|frame| frame.timestamp).collect();
        let rate = curves.rate();
        let (mut frames, mut angles) = (Vec::new(), Vec::new());
        for (tick, shown) in (0..).zip(constant_rate(&times, rate)) {
            frames.push(CurveFrame { time: rate.tick(tick), ..curves.frames()[shown].clone() });
            let expression = &self.frames[shown].expression;
            angles.push(FaceAngles::of(&expression.pose, &expression.eyes));
        }
        let (muscles, channels) = (curves.muscles().to_vec(), curves.channels().to_vec());
        let steady = MuscleCurves::new(muscles, channels, rate, frames)?;
        Ok(write_live_link(path, &steady, &angles, TimecodeBase::from_midnight(rate))?)
    }

    fn muscles(&self) -> Result<&MuscleBasis, MuscleError> {
        let reason = || MuscleError::Curves { reason: "the take was lifted without muscles".into() };
        self.basis.as_ref().ok_or_else(reason)
    }
}

/// Turned and moved from the rest to the other side of the picture.
fn mirrored_pose(pose: &HeadPose, rest: &HeadPose) -> HeadPose {
    let mirror = Vector3::new(-1.0, 1.0, 1.0);
    let flip = Matrix3::from_diagonal(&mirror);
    let turn = pose.rotation * rest.rotation.inverse();
    let turn = Rotation3::from_matrix_unchecked(flip * turn.matrix() * flip);
    let shift = (pose.translation - rest.translation).component_mul(&mirror);
    HeadPose { rotation: turn * rest.rotation, translation: rest.translation + shift, ..*pose }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lift::frontal_pose;

    #[test]
    fn a_mirrored_pose_turns_to_the_other_side_and_back() {
        let rest = frontal_pose();
        let rotation = Rotation3::from_euler_angles(0.1, 0.3, -0.2) * rest.rotation;
        let pose =
            HeadPose { rotation, translation: rest.translation + Vector3::new(9.0, 5.0, -3.0), ..rest };
        let there = mirrored_pose(&pose, &rest);
        assert!((there.translation - rest.translation - Vector3::new(-9.0, 5.0, -3.0)).norm() < 1e-12);
        let (x, y, z) = (there.rotation * rest.rotation.inverse()).euler_angles();
        assert!((x - 0.1).abs() + (y + 0.3).abs() + (z - 0.2).abs() < 1e-12, "{x} {y} {z}");
        let back = mirrored_pose(&there, &rest);
        assert!((back.translation - pose.translation).norm() < 1e-12);
        assert!(back.rotation.angle_to(&pose.rotation) < 1e-7);
    }
}
