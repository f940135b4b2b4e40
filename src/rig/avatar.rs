//! The rig of one performer on one target: displacements in, vertices out, nothing allocated in between.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::{
    Controls, Driver, LipDrive, RigError, TargetFace, Transfer, TransferRule, regions::split_warp, skin::SkinWarp,
};
use crate::{
    anatomy::{Anatomy, CHIN, Jaw, Part, PartKind, eye_landmarks},
    head::{HeadPose, true_turn},
    lift::{Expression, EyeState, Performer, Side, upright},
    scan::Surface,
    spline::Warp,
    tracking::index,
};

/// Numbers in the vertex × column matrix; 1 GiB of f32.
const MOST_SHARES: usize = 1 << 28;
/// How much of the jaw's motion the tongue follows.
const TONGUE: f64 = 0.85;
/// The head turns about a point this many outer canthal distances behind the eyes.
const PIVOT_DEPTH: f64 = 0.9;

/// The avatar in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct AvatarFrame {
    /// V × 3: vertices before the head moves. Target's scan frame, millimetres.
    pub positions: Vec<[f32; 3]>,
    /// C × 3: how far each control is from its rest, in the same frame; then what jaw and lids put into the warp.
    pub controls: Vec<[f32; 3]>,
    /// The head's motion from the target's own pose, in the same frame.
    pub head: Isometry3<f64>,
    /// How the rigid parts move within the head, in the same frame.
    pub bones: Bones,
}

/// The motions of what does not bend, within the head. Target's scan frame, millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bones {
    /// The jaw with its teeth.
    pub jaw: Isometry3<f64>,
    /// The tongue.
    pub tongue: Isometry3<f64>,
    /// The eyes, right and left.
    pub eyes: [Isometry3<f64>; 2],
}

impl Bones {
    /// Everything at rest.
    pub fn rest() -> Self {
        let still = Isometry3::identity();
        Self { jaw: still, tongue: still, eyes: [still; 2] }
    }

    /// The motion of one part; what bends does not move as a whole.
    pub fn of(&self, kind: PartKind) -> Isometry3<f64> {
        match kind {
            PartKind::Skin | PartKind::Cavity | PartKind::UpperTeeth => Isometry3::identity(),
            PartKind::LowerTeeth => self.jaw,
            PartKind::Tongue => self.tongue,
            PartKind::Eye(Side::Right) => self.eyes[0],
            PartKind::Eye(Side::Left) => self.eyes[1],
        }
    }
}

/// Everything that stays the same from frame to frame.
#[derive(Debug, Clone)]
pub struct Rig {
    transfer: Transfer,
    controls: Controls,
    skin: SkinWarp,
    lips: Option<LipDrive>,
    jaw: Option<Jaw>,
    /// The chin's controls.
    chin: [Option<usize>; CHIN.len()],
    /// From the face's axes: outwards, scan frame.
    out: Vector3<f64>,
    eyes: [Option<Point3<f64>>; 2],
    parts: Vec<Part>,
    rest: Vec<[f32; 3]>,
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
        let controls = Controls::new(target, &transfer, anatomy, surface);
        let (vertices, most) = (anatomy.soft_vertices(), MOST_SHARES / controls.rest.len().max(1));
        if vertices > most {
            return Err(RigError::TooManyVertices { vertices, most });
        }
        let skin = match rule {
            TransferRule::Spline => SkinWarp::new(target, &controls, anatomy)?,
            TransferRule::Thesis => {
                let positions = &anatomy.mesh.positions[..vertices];
                SkinWarp::plain(split_warp(target, &controls, positions)?)
            }
        };
        let width = target.distance(index::MOUTH_RIGHT, index::MOUTH_LEFT);
        let lips = anatomy.mouth.as_ref().map(|mouth| LipDrive::new(performer, mouth, width));
        Ok(Self {
            transfer,
            skin,
            lips,
            jaw: anatomy.jaw,
            chin: CHIN.map(|landmark| controls.of_landmark(landmark)),
            out: anatomy.frame.map_or_else(Vector3::z, |frame| frame.leave_vector(&Vector3::z())),
            eyes: [0, 1].map(|eye| anatomy.eyes[eye].as_ref().map(|eye| eye.centre)),
            parts: anatomy.parts.clone(),
            rest: anatomy.mesh.positions_f32(),
            head: HeadFollow::new(performer, target),
            controls,
        })
    }

    /// The precomputed matrix: soft vertices × columns.
    pub fn warp(&self) -> &Warp {
        &self.skin.warp
    }

    /// The control points.
    pub fn controls(&self) -> &Controls {
        &self.controls
    }

    /// The lips' drive, where the target's lips part.
    pub fn lips(&self) -> Option<&LipDrive> {
        self.lips.as_ref()
    }

    /// The target's own vertices.
    pub fn rest(&self) -> &[[f32; 3]] {
        &self.rest
    }

    /// A frame to hand to [`Rig::pose`] again and again.
    pub fn new_frame(&self) -> AvatarFrame {
        AvatarFrame {
            positions: self.rest.clone(),
            controls: vec![[0.0; 3]; self.skin.warp.controls()],
            head: Isometry3::identity(),
            bones: Bones::rest(),
        }
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
            Driver::EyeRim { side, share } => {
                let eye = eye_landmarks(side);
                let corner = |landmark| self.transfer.displacement(landmark, displacements);
                corner(eye.outer) * (1.0 - share) + corner(eye.inner) * share
            }
        };
        let mut bones = Bones::rest();
        let jaw = self.jaw.filter(|_| self.skin.has_jaw());
        if let Some(jaw) = jaw {
            let chin = self.chin.map(|control| {
                let rest = control.map_or_else(Point3::origin, |control| self.controls.rest[control]);
                control.map(|control| (rest, moved(self.controls.drivers[control])))
            });
            let pose = jaw.solve(chin.into_iter().flatten());
            bones.jaw = jaw.motion(&pose, 1.0);
            bones.tongue = jaw.motion(&pose, TONGUE);
        }
        let controls = self.controls.drivers.iter().zip(&self.controls.rest).zip(&self.skin.jaw_shares);
        for (to, ((driver, rest), &share)) in out.iter_mut().zip(controls) {
            let mut vector = moved(*driver);
            if jaw.is_some() {
                let rigid = (bones.jaw * rest - rest) * share;
                // Depth is the network's guess: where the bone carries the skin, the bone knows better.
                vector += self.out * ((rigid - vector).dot(&self.out) * share) - rigid;
            }
            *to = vector.map(|v| v as f32).into();
        }
        self.skin.drive(&bones.jaw, &expression.eyes, out);
        for ((bone, centre), side) in bones.eyes.iter_mut().zip(self.eyes).zip(Side::BOTH) {
            if let Some(centre) = centre {
                *bone = self.head.eye(expression.eyes.of(side), &centre);
            }
        }
        bones
    }

    /// The avatar for one expression; `frame` comes from [`Rig::new_frame`].
    pub fn pose(&self, expression: &Expression, frame: &mut AvatarFrame) -> Result<(), RigError> {
        frame.bones = self.pose_controls(expression, &mut frame.controls);
        let soft = self.skin.warp.vertices();
        self.skin
            .warp
            .apply(&frame.controls, &mut frame.positions[..soft])
            .map_err(|source| RigError::Spline { what: "this frame", source })?;
        for (position, rest) in frame.positions[..soft].iter_mut().zip(&self.rest) {
            for axis in 0..3 {
                position[axis] += rest[axis];
            }
        }
        for part in self.parts.iter().filter(|part| part.vertices.start >= soft) {
            let motion = frame.bones.of(part.kind).cast::<f32>();
            let vertices = part.vertices.clone();
            for (position, rest) in frame.positions[vertices.clone()].iter_mut().zip(&self.rest[vertices]) {
                *position = (motion * Point3::from(*rest)).coords.into();
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

    /// How an eye turns about its centre, in the target's scan frame.
    fn eye(&self, state: &EyeState, centre: &Point3<f64>) -> Isometry3<f64> {
        let gaze = Rotation3::from_axis_angle(&Vector3::y_axis(), state.yaw)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), -state.pitch);
        let turn = UnitQuaternion::from_rotation_matrix(&(self.level.inverse() * gaze * self.level));
        Isometry3::from_parts((centre.coords - turn * centre.coords).into(), turn)
    }
}
