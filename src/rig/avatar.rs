//! The rig of one performer on one target: displacements in, vertices out, nothing allocated in between.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::{Controls, RigError, TargetFace, Transfer, TransferRule, regions::split_warp};
use crate::{
    head::{HeadPose, true_turn},
    lift::{Displacements, Expression, Performer, upright},
    scan::{Mesh, Surface},
    spline::{Kernel, Options, Regularisation, Warp},
    tracking::index,
};

/// λ of the warp over the outer canthal distance: enough that two landmarks on one pixel do no harm, too little to
/// take more than a hundredth off a lip's gap.
const LAMBDA: f64 = 1e-4;
/// Numbers in the vertex × control matrix; 1 GiB of f32.
const MOST_SHARES: usize = 1 << 28;
/// The head turns about a point this many outer canthal distances behind the eyes.
const PIVOT_DEPTH: f64 = 0.9;

/// The avatar in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct AvatarFrame {
    /// V × 3: vertices before the head moves. Target's scan frame, millimetres.
    pub positions: Vec<[f32; 3]>,
    /// C × 3: how far each control is from its rest, in the same frame.
    pub controls: Vec<[f32; 3]>,
    /// The head's motion from the target's own pose, in the same frame.
    pub head: Isometry3<f64>,
}

/// Everything that stays the same from frame to frame.
#[derive(Debug, Clone)]
pub struct Rig {
    transfer: Transfer,
    controls: Controls,
    warp: Warp,
    rest: Vec<[f32; 3]>,
    head: HeadFollow,
}

impl Rig {
    /// Ties a performer to a target. `mesh` is the target's, in the scan frame and millimetres.
    pub fn new(
        performer: &Performer,
        target: &TargetFace,
        mesh: &Mesh,
        surface: &Surface,
        rule: TransferRule,
    ) -> Result<Self, RigError> {
        let transfer = Transfer::new(performer, target, rule)?;
        let controls = Controls::new(target, &transfer, mesh, surface);
        let most = MOST_SHARES / controls.rest.len().max(1);
        if mesh.positions.len() > most {
            return Err(RigError::TooManyVertices { vertices: mesh.positions.len(), most });
        }
        let warp = match rule {
            TransferRule::Spline => {
                let lambda = LAMBDA * target.outer_canthal_distance();
                let options =
                    Options { regularisation: Regularisation::Absolute(lambda), ..Options::default() };
                Warp::new(Kernel::Linear, &controls.rest, &controls.anchors, &mesh.positions, options)
                    .map_err(|source| RigError::Spline { what: "the target's control points", source })?
            }
            TransferRule::Thesis => split_warp(target, &controls, &mesh.positions)?,
        };
        let rest = mesh.positions_f32();
        Ok(Self { transfer, controls, warp, rest, head: HeadFollow::new(performer, target) })
    }

    /// The precomputed vertex × control matrix.
    pub fn warp(&self) -> &Warp {
        &self.warp
    }

    /// The control points.
    pub fn controls(&self) -> &Controls {
        &self.controls
    }

    /// The target's own vertices.
    pub fn rest(&self) -> &[[f32; 3]] {
        &self.rest
    }

    /// A frame to hand to [`Rig::pose`] again and again.
    pub fn new_frame(&self) -> AvatarFrame {
        AvatarFrame {
            positions: self.rest.clone(),
            controls: vec![[0.0; 3]; self.controls.rest.len()],
            head: Isometry3::identity(),
        }
    }

    /// Moves the controls only; enough for exports that work in control space.
    pub fn pose_controls(&self, displacements: &Displacements, out: &mut [[f32; 3]]) {
        for (control, &landmark) in out.iter_mut().zip(&self.controls.landmarks) {
            *control = self.transfer.displacement(landmark, displacements).map(|v| v as f32).into();
        }
    }

    /// The avatar for one expression; `frame` comes from [`Rig::new_frame`].
    pub fn pose(&self, expression: &Expression, frame: &mut AvatarFrame) -> Result<(), RigError> {
        self.pose_controls(&expression.displacements, &mut frame.controls);
        self.warp
            .apply(&frame.controls, &mut frame.positions)
            .map_err(|source| RigError::Spline { what: "this frame", source })?;
        for (position, rest) in frame.positions.iter_mut().zip(&self.rest) {
            for axis in 0..3 {
                position[axis] += rest[axis];
            }
        }
        frame.head = self.head_motion(&expression.pose);
        Ok(())
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
    performer_pivot: Point3<f64>,
    target_pivot: Point3<f64>,
    level: Rotation3<f64>,
    scale: f64,
}

impl HeadFollow {
    fn new(performer: &Performer, target: &TargetFace) -> Self {
        let middle = |a: Point3<f64>, b: Point3<f64>| nalgebra::center(&a, &b);
        let (scale_performer, scale_target) =
            (performer.outer_canthal_distance(), target.outer_canthal_distance());
        let back = |scale: f64| Vector3::new(0.0, 0.0, -PIVOT_DEPTH * scale);
        let eyes = |landmark: usize| performer.neutral()[landmark];
        let target_eyes = |landmark: usize| target.landmarks[landmark].unwrap_or_else(Point3::origin);
        Self {
            rest: *performer.rest(),
            performer_pivot: middle(eyes(index::RIGHT_EYE_OUTER), eyes(index::LEFT_EYE_OUTER))
                + back(scale_performer),
            target_pivot: middle(target_eyes(index::RIGHT_EYE_OUTER), target_eyes(index::LEFT_EYE_OUTER))
                + target.level.inverse() * back(scale_target),
            level: target.level,
            scale: scale_target / scale_performer.max(f64::MIN_POSITIVE),
        }
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
