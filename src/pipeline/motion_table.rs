//! A take as a table: head pose and landmarks of every frame, smoothed or as the networks gave them.

use std::path::Path;

use nalgebra::{Rotation3, Vector3};

use super::{Motion, MotionFrame, Performance, PipelineError, action_columns::ActionColumns};
use crate::{
    actions::ActionLibrary,
    export::{MotionCsvWriter, MotionRow},
    head::{HeadPose, true_turn},
    lift::{Eyes, FaceState, Performer, upright},
    tracking::{LANDMARK_COUNT, LandmarkState, Landmarks},
};

/// Writes a motion table row by row.
pub struct MotionTable {
    writer: MotionCsvWriter,
    landmarks: Vec<[f64; 3]>,
    columns: ActionColumns,
    actions: Vec<f64>,
}

impl MotionTable {
    /// Starts a table of one performer's takes, whose action units are measured by `library`; nothing appears at `path`
    /// before [`MotionTable::commit`].
    pub fn create(
        path: &Path,
        library: &ActionLibrary,
        performer: &Performer,
    ) -> Result<Self, PipelineError> {
        let columns = ActionColumns::new(library, performer)?;
        let writer = MotionCsvWriter::create(path, LANDMARK_COUNT, &columns.names())?;
        Ok(Self { writer, landmarks: Vec::new(), columns, actions: Vec::new() })
    }

    /// A frame of the solved motion: landmarks as the avatar follows them, projected into the picture.
    pub fn write(&mut self, motion: &Motion, frame: &MotionFrame) -> Result<(), PipelineError> {
        let expression = &frame.expression;
        let pose = &expression.pose;
        // Depth in pixels about the head's origin, the unit and sense of the network's own hint.
        let pixels_per_millimetre = motion.performer.camera().focal / pose.translation.z;
        self.landmarks.clear();
        self.landmarks.extend(
            motion
                .performer
                .project(&expression.displacements, pose)
                .iter()
                .map(|p| [p.x, p.y, (p.z - pose.translation.z) * pixels_per_millimetre]),
        );
        self.row(motion, frame, pose)
    }

    /// A frame as the networks gave it, with the pose of those very landmarks.
    pub fn write_raw(
        &mut self,
        motion: &Motion,
        frame: &MotionFrame,
        landmarks: Option<&Landmarks>,
    ) -> Result<(), PipelineError> {
        self.landmarks.clear();
        let mut pose = frame.expression.pose;
        if let Some(landmarks) = landmarks {
            pose = motion.performer.pose(landmarks, Some(&pose))?;
            self.landmarks.extend(landmarks.points.iter().zip(&landmarks.states).map(|(p, state)| {
                if *state == LandmarkState::Absent { [f64::NAN; 3] } else { [p.x, p.y, p.z] }
            }));
        }
        self.row(motion, frame, &pose)
    }

    fn row(&mut self, motion: &Motion, frame: &MotionFrame, pose: &HeadPose) -> Result<(), PipelineError> {
        let rest = motion.performer.rest().rotation.inverse();
        let turn = true_turn(&(upright() * pose.rotation * rest * upright()));
        let eyes = &frame.expression.eyes;
        self.columns.fill(&frame.expression, &mut self.actions);
        let row = MotionRow {
            frame: frame.index + 1,
            timestamp: frame.timestamp,
            confidence: frame.confidence,
            success: matches!(frame.state, FaceState::Tracking | FaceState::Blending),
            translation: pose.translation.into(),
            rotation: euler_xyz(&true_turn(&(pose.rotation * upright()))).into(),
            landmarks: &self.landmarks,
            state: frame.state.name(),
            gaze: gaze_angles(eyes, &turn),
            closure: [eyes.right.closure, eyes.left.closure],
            actions: &self.actions,
        };
        Ok(self.writer.write_row(&row)?)
    }

    /// Puts the finished table in its place.
    pub fn commit(self) -> Result<(), PipelineError> {
        Ok(self.writer.commit()?)
    }
}

/// Writes the whole take, its action units measured by `library`; with `raw`, the unfiltered landmarks of that
/// performance.
pub fn write_motion(
    path: &Path,
    motion: &Motion,
    library: &ActionLibrary,
    raw: Option<&Performance>,
) -> Result<(), PipelineError> {
    let mut table = MotionTable::create(path, library, &motion.performer)?;
    for (i, frame) in motion.frames.iter().enumerate() {
        match raw {
            Some(performance) => table.write_raw(motion, frame, performance.frames[i].landmarks.as_ref())?,
            None => table.write(motion, frame)?,
        }
    }
    table.commit()
}

/// OpenFace's angles: R = Rx · Ry · Rz, radians; a head that looks into the camera has none.
fn euler_xyz(rotation: &Rotation3<f64>) -> Vector3<f64> {
    let r = rotation.matrix();
    Vector3::new(
        (-r[(1, 2)]).atan2(r[(2, 2)]),
        r[(0, 2)].clamp(-1.0, 1.0).asin(),
        (-r[(0, 1)]).atan2(r[(0, 0)]),
    )
}

/// OpenFace's gaze angles: the mean of both eyes' directions in the camera's frame, to the picture's right and down.
/// `turn` is the head's since the neutral, level frame; in the neutral the eyes look along the camera's axis.
fn gaze_angles(eyes: &Eyes, turn: &Rotation3<f64>) -> [f64; 2] {
    let gaze = turn * (eyes.right.direction() + eyes.left.direction());
    [gaze.x.atan2(gaze.z), (-gaze.y).atan2(gaze.z)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lift::EyeState;

    #[test]
    fn angles_are_those_of_the_product() {
        let turn = |axis: Vector3<f64>, angle: f64| Rotation3::new(axis * angle);
        let rotation = turn(Vector3::x(), 0.3) * turn(Vector3::y(), -0.5) * turn(Vector3::z(), 0.2);
        assert!((euler_xyz(&rotation) - Vector3::new(0.3, -0.5, 0.2)).norm() < 1e-12);
    }

    #[test]
    fn gaze_is_that_of_head_and_eyes_together_with_the_signs_of_openface() {
        let eye = |yaw, pitch| EyeState { closure: 0.0, yaw, pitch };
        let eyes = |inwards: f64| Eyes { right: eye(0.2 + inwards, 0.1), left: eye(0.2 - inwards, 0.1) };
        let still = Rotation3::identity();
        let [x, y] = gaze_angles(&eyes(0.05), &still);
        // To the subject's left, which is the picture's right, and up.
        assert!((x - 0.2).abs() < 1e-9 && (y + 0.1).abs() < 3e-3, "{x} {y}");
        // The head turned to the subject's left, the eyes back at the camera.
        let turned = Rotation3::new(Vector3::y() * 0.2);
        let back = Eyes { right: eye(-0.2, 0.0), left: eye(-0.2, 0.0) };
        assert!(gaze_angles(&back, &turned).iter().all(|angle| angle.abs() < 1e-12));
        assert!(gaze_angles(&Eyes::default(), &turned)[0] > 0.19);
    }
}
