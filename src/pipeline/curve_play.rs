//! Contraction curves played on a target: a take's own, edited ones, or those of any ARKit capture.

use nalgebra::Rotation3;

use super::{HeadMode, PipelineError, Play, Target};
use crate::{
    capture::{FrameRate, Timestamp},
    lift::Eyes,
    muscle::{
        CurveMap, CurveTake, FaceAngles, MuscleBasis, MuscleCurves, MuscleLift, MuscleMotor,
        different_moments,
    },
    rig::{AvatarFrame, Method, Motor as _, Puppet, TargetFace, facing},
};

/// Moments on the sheet.
const MOMENTS: usize = 8;

/// A target's muscles, as seen when the average face of their basis is.
pub fn muscle_motor(
    basis: &MuscleBasis,
    target: &Target,
    method: Method,
) -> Result<(MuscleMotor, TargetFace), PipelineError> {
    let face = TargetFace::new(target.landmarks.clone(), facing(&basis.face, &target.landmarks))?;
    let motor = MuscleMotor::new(basis, &face, &target.anatomy, &target.surface, method)?;
    Ok((motor, face))
}

/// Curves tied to a target.
pub struct CurvePlay {
    motor: MuscleMotor,
    face: TargetFace,
    map: CurveMap,
    curves: MuscleCurves,
    /// One for each frame of the curves; none where only contractions are known.
    angles: Option<Vec<FaceAngles>>,
}

impl CurvePlay {
    /// `target` is moved by the muscles of `basis` and by the eyes that the curves have: lids by its blinks and widened
    /// eyes, gaze by `eyeLook…`, without those by the angles of Live Link Face, and by those angles the head. Refuses
    /// curves of other muscles.
    pub fn new(
        take: CurveTake,
        basis: &MuscleBasis,
        target: &Target,
        method: Method,
    ) -> Result<Self, PipelineError> {
        let basis = MuscleLift::lifting(basis);
        let CurveTake { curves, live_link } = take;
        let map = CurveMap::new(curves.muscles(), curves.channels(), &basis)?;
        let (motor, face) = muscle_motor(&basis, target, method)?;
        Ok(Self { motor, face, map, curves, angles: live_link.map(|extras| extras.angles) })
    }

    /// The curves' nominal rate.
    pub fn rate(&self) -> FrameRate {
        self.curves.rate()
    }

    /// How the target is turned to face the camera.
    pub fn level(&self) -> &Rotation3<f64> {
        &self.face.level
    }
}

impl Play for CurvePlay {
    fn puppet(&self) -> &Puppet {
        self.motor.puppet()
    }

    fn pose_controls(&self, time: Timestamp, frame: &mut AvatarFrame) {
        let frames = self.curves.frames();
        let before = self.curves.frame_at(time);
        let after = (before + 1).min(frames.len() - 1);
        let step = (frames[after].time.0 - frames[before].time.0).max(1);
        let share = ((time.0 - frames[before].time.0) as f64 / step as f64).clamp(0.0, 1.0);
        let pairs = frames[before].contractions.iter().zip(&frames[after].contractions);
        let row: Vec<f64> = pairs.map(|(from, to)| from + (to - from) * share).collect();
        let angles = self.angles.as_ref().map(|angles| angles[before].towards(&angles[after], share));
        let otherwise = angles.map_or_else(Eyes::default, |angles| angles.eyes());
        let eyes = self.map.eyes(&row, &otherwise);
        self.motor.pose_contractions(&self.map.contractions(&row), &eyes, frame);
        if let Some(angles) = angles {
            frame.head = self.face.turned(&angles.head_turn());
        }
    }

    fn end(&self) -> Timestamp {
        self.curves.frames().last().map_or(Timestamp(0), |frame| frame.time)
    }

    fn still(&self) -> Timestamp {
        self.end()
    }

    fn moments(&self) -> Vec<Timestamp> {
        let frames = different_moments(&self.curves, MOMENTS);
        frames.into_iter().map(|frame| self.curves.frames()[frame].time).collect()
    }

    fn head(&self) -> HeadMode {
        if self.angles.is_some() { HeadMode::Follow } else { HeadMode::Still }
    }
}
