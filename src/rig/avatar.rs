//! The rig of one performer on one target: displacements in, vertices out, nothing allocated in between.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3, center};

use super::{
    ActionRig, ActionSolver, AvatarFrame, Bones, Controls, Drive, LipDrive, Method, Motor, RigError,
    SourceFace, TargetFace, VolumeMorph, WarpKind,
    motor::{ActionMotor, LandmarkMotor, VolumeMotor},
    target::PIVOT_DEPTH,
};
use crate::{
    actions::{ActionLibrary, ActionWeights, Merge},
    anatomy::Anatomy,
    head::{HeadPose, true_turn},
    lift::{Expression, Performer, upright},
    scan::Surface,
    spline::Warp,
    tracking::index,
};

/// What of the performer drives the target.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum DriveMode {
    /// The landmarks' own displacements, and the folds of the actions that they show.
    #[default]
    Landmarks,
    /// Action units: their magnitudes are measured, and the library moves the target by them.
    Actions,
    /// Some of the landmarks' displacements through a volume morph, which takes the place of the method's warp.
    Volume(VolumeMorph),
}

/// Everything that stays the same from frame to frame.
#[derive(Debug, Clone)]
pub struct Rig {
    motor: Arc<dyn Motor>,
    solver: Arc<ActionSolver>,
    head: HeadFollow,
}

impl Rig {
    /// Ties a performer to a target. `anatomy` is the target's mesh, opened or as scanned, `surface` the scan's own, both
    /// in the scan frame and millimetres.
    pub fn new(
        performer: &Performer,
        target: &TargetFace,
        anatomy: &Anatomy,
        surface: &Surface,
        method: Method,
    ) -> Result<Self, RigError> {
        Self::driven_by(
            DriveMode::Landmarks,
            ActionLibrary::built_in(),
            performer,
            target,
            anatomy,
            surface,
            method,
        )
    }

    /// The same, driven as `mode` says, with a library of action units.
    pub fn driven_by(
        mode: DriveMode,
        library: &ActionLibrary,
        performer: &Performer,
        target: &TargetFace,
        anatomy: &Anatomy,
        surface: &Surface,
        method: Method,
    ) -> Result<Self, RigError> {
        let source = SourceFace::performer(performer);
        let solver = Arc::new(ActionSolver::new(library, &source)?);
        let own = Arc::clone(&solver);
        let motor: Arc<dyn Motor> = match mode {
            DriveMode::Landmarks => {
                let drive = Drive::new(&source, target, anatomy, surface, method)?;
                Arc::new(LandmarkMotor::new(drive, &source, library, own)?)
            }
            DriveMode::Volume(morph) => {
                let method = Method { warp: WarpKind::Volume(morph), ..method };
                Arc::new(VolumeMotor { drive: Drive::new(&source, target, anatomy, surface, method)? })
            }
            // What was solved as a sum is shown as a sum.
            DriveMode::Actions => {
                let rig = ActionRig::new(library, target, anatomy, surface, method, Merge::Sum)?;
                Arc::new(ActionMotor { rig, solver: own })
            }
        };
        Ok(Self { motor, solver, head: HeadFollow::new(performer, target) })
    }

    /// The same, moved by something else; `library` measures the performer's action units.
    pub fn moved_by(
        motor: Arc<dyn Motor>,
        library: &ActionLibrary,
        performer: &Performer,
        target: &TargetFace,
    ) -> Result<Self, RigError> {
        let solver = Arc::new(ActionSolver::new(library, &SourceFace::performer(performer))?);
        Ok(Self { motor, solver, head: HeadFollow::new(performer, target) })
    }

    /// The precomputed matrix: soft vertices × columns.
    pub fn warp(&self) -> &Warp {
        self.puppet().warp()
    }

    /// The control points.
    pub fn controls(&self) -> &Controls {
        self.puppet().controls()
    }

    /// The lips' drive, where the target's lips part.
    pub fn lips(&self) -> Option<&LipDrive> {
        self.motor.lips()
    }

    fn puppet(&self) -> &super::Puppet {
        self.motor.puppet()
    }

    /// The action units of one expression.
    pub fn action_weights(&self, expression: &Expression) -> ActionWeights {
        self.solver.measure(expression)
    }

    /// The target's own vertices.
    pub fn rest(&self) -> &[[f32; 3]] {
        self.puppet().rest()
    }

    /// A frame to hand to [`Rig::pose`] again and again.
    pub fn new_frame(&self) -> AvatarFrame {
        self.puppet().new_frame()
    }

    /// Moves controls and bones only; enough for exports that work in control space. Of `frame` the positions stay.
    pub fn pose_controls(&self, expression: &Expression, frame: &mut AvatarFrame) -> Bones {
        frame.head = self.head_motion(&expression.pose);
        self.motor.pose_controls(expression, &self.head.camera(&expression.pose), frame)
    }

    /// The avatar for one expression; `frame` comes from [`Rig::new_frame`].
    pub fn pose(&self, expression: &Expression, frame: &mut AvatarFrame) -> Result<(), RigError> {
        self.pose_controls(expression, frame);
        self.puppet().place(frame)
    }

    /// How the head has moved from the neutral, in the target's scan frame, millimetres.
    pub fn head_motion(&self, pose: &HeadPose) -> Isometry3<f64> {
        self.head.motion(pose)
    }
}

/// The performer's head motion, carried to the target.
#[derive(Debug, Clone)]
struct HeadFollow {
    rest: HeadPose,
    performer_eyes: Point3<f64>,
    target_eyes: Point3<f64>,
    performer_pivot: Point3<f64>,
    target_pivot: Point3<f64>,
    level: Rotation3<f64>,
    scale: f64,
}

impl HeadFollow {
    fn new(performer: &Performer, target: &TargetFace) -> Self {
        let (scale_performer, scale_target) =
            (performer.outer_canthal_distance(), target.outer_canthal_distance());
        let neutral = performer.neutral();
        let performer_eyes = center(&neutral[index::RIGHT_EYE_OUTER], &neutral[index::LEFT_EYE_OUTER]);
        Self {
            rest: *performer.rest(),
            performer_eyes,
            target_eyes: target.eyes(),
            performer_pivot: performer_eyes - Vector3::z() * (PIVOT_DEPTH * scale_performer),
            target_pivot: target.pivot(),
            level: target.level,
            scale: scale_target / scale_performer.max(f64::MIN_POSITIVE),
        }
    }

    /// Where the performer's camera stands about the target's unmoved head: scan frame, millimetres.
    fn camera(&self, pose: &HeadPose) -> Point3<f64> {
        let level = upright() * self.rest.rotation;
        let away = level * (pose.to_scan(&Point3::origin()) - self.performer_eyes);
        self.target_eyes + self.level.inverse() * away * self.scale
    }

    /// How the head has turned and moved from the neutral, in the target's scan frame.
    fn motion(&self, pose: &HeadPose) -> Isometry3<f64> {
        let turn = true_turn(&(upright() * pose.rotation * self.rest.rotation.inverse() * upright()));
        let shift = upright()
            * (pose.to_camera(&self.performer_pivot) - self.rest.to_camera(&self.performer_pivot))
            * self.scale;
        let turn = UnitQuaternion::from_rotation_matrix(&(self.level.inverse() * turn * self.level));
        let pivot = self.target_pivot.coords;
        let translation = pivot - turn * pivot + self.level.inverse() * shift;
        Isometry3::from_parts(Translation3::from(translation), turn)
    }
}
