//! The rig of one performer on one target: displacements in, vertices out, nothing allocated in between.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3, center};

use super::{
    AvatarFrame, Bones, Controls, Driver, LipDrive, Puppet, RigError, TargetFace, Transfer, TransferRule,
};
use crate::{
    anatomy::Anatomy,
    head::{HeadPose, true_turn},
    lift::{Expression, Performer, upright},
    scan::Surface,
    spline::Warp,
    tracking::index,
};

/// The head turns about a point this many outer canthal distances behind the eyes.
const PIVOT_DEPTH: f64 = 0.9;

/// Everything that stays the same from frame to frame.
#[derive(Debug, Clone)]
pub struct Rig {
    puppet: Puppet,
    transfer: Transfer,
    lips: Option<LipDrive>,
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
        rule: TransferRule,
    ) -> Result<Self, RigError> {
        let transfer = Transfer::new(performer, target, rule)?;
        let carried = |landmark: usize| Some(transfer.place(landmark));
        let puppet = Puppet::new(target, anatomy, surface, &carried, rule)?;
        let lips = anatomy.mouth.as_ref().map(|mouth| LipDrive::new(performer, target, mouth));
        Ok(Self { puppet, transfer, lips, head: HeadFollow::new(performer, target) })
    }

    /// The precomputed matrix: soft vertices × columns.
    pub fn warp(&self) -> &Warp {
        self.puppet.warp()
    }

    /// The control points.
    pub fn controls(&self) -> &Controls {
        self.puppet.controls()
    }

    /// The lips' drive, where the target's lips part.
    pub fn lips(&self) -> Option<&LipDrive> {
        self.lips.as_ref()
    }

    /// The target's own vertices.
    pub fn rest(&self) -> &[[f32; 3]] {
        self.puppet.rest()
    }

    /// A frame to hand to [`Rig::pose`] again and again.
    pub fn new_frame(&self) -> AvatarFrame {
        self.puppet.new_frame()
    }

    /// Moves controls and bones only; enough for exports that work in control space. `out` has one entry for each of the
    /// warp's columns.
    pub fn pose_controls(&self, expression: &Expression, out: &mut [[f32; 3]]) -> Bones {
        let displacements = &expression.displacements;
        let wishes = self.lips.as_ref().map(|lips| lips.wishes(&self.transfer, displacements));
        let moved = |driver: Driver| match driver {
            Driver::Landmark(landmark) => self.transfer.displacement(landmark, displacements),
            Driver::Rim { node, lower } => self
                .lips
                .as_ref()
                .zip(wishes.as_ref())
                .map_or_else(Vector3::zeros, |(lips, wishes)| lips.rims(node, wishes)[usize::from(lower)]),
            Driver::Skull => Vector3::zeros(),
        };
        let freedom = |driver: Driver| match driver {
            Driver::Rim { node, .. } => self
                .lips
                .as_ref()
                .zip(wishes.as_ref())
                .map_or(1.0, |(lips, wishes)| lips.freedom(node, wishes)),
            Driver::Landmark(_) | Driver::Skull => 1.0,
        };
        self.puppet.fill(moved, freedom, &expression.eyes, &self.head.camera(&expression.pose), out)
    }

    /// The avatar for one expression; `frame` comes from [`Rig::new_frame`].
    pub fn pose(&self, expression: &Expression, frame: &mut AvatarFrame) -> Result<(), RigError> {
        frame.bones = self.pose_controls(expression, &mut frame.controls);
        frame.head = self.head_motion(&expression.pose);
        self.puppet.place(frame)
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
        let back = |scale: f64| Vector3::new(0.0, 0.0, -PIVOT_DEPTH * scale);
        let corners = [index::RIGHT_EYE_OUTER, index::LEFT_EYE_OUTER];
        let [a, b] = corners.map(|corner| performer.neutral()[corner]);
        let [c, d] = corners.map(|corner| target.landmarks[corner].unwrap_or_else(Point3::origin));
        let (performer_eyes, target_eyes) = (center(&a, &b), center(&c, &d));
        Self {
            rest: *performer.rest(),
            performer_eyes,
            target_eyes,
            performer_pivot: performer_eyes + back(scale_performer),
            target_pivot: target_eyes + target.level.inverse() * back(scale_target),
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
