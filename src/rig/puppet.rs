//! A target that can be moved, whoever moves it: skin, jaw, lids, eyes.

use nalgebra::{Isometry3, Point3, Rotation3, UnitQuaternion, Vector3};

use super::{
    Controls, Driver, RigError, TargetFace, WarpKind, regions::split_warp, skin::SkinWarp,
    teeth_guard::room_before_teeth, volume::phantoms,
};
use crate::{
    anatomy::{Anatomy, CHIN, Jaw, JawPose, Part, PartKind},
    lift::{EyeState, Eyes, Side},
    scan::{Mesh, Surface},
    spline::Warp,
};

/// Numbers in the vertex × column matrix; 1 GiB of f32.
const MOST_SHARES: usize = 1 << 28;
/// A jaw opened by so much, radians, settles the depth of what it carries.
const OPENED: f64 = 0.1;
/// How much of the jaw's motion the tongue follows.
const TONGUE: f64 = 0.85;

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
    /// Room for the source's vectors, so that a frame allocates nothing.
    pub(crate) scratch: Vec<Vector3<f64>>,
}

impl AvatarFrame {
    /// A mesh that nothing moves.
    pub fn at_rest(mesh: &Mesh) -> Self {
        Self {
            positions: mesh.positions_f32(),
            controls: Vec::new(),
            head: Isometry3::identity(),
            bones: Bones::rest(),
            scratch: Vec::new(),
        }
    }
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

/// Everything about a target that stays the same from frame to frame.
#[derive(Debug, Clone)]
pub struct Puppet {
    controls: Controls,
    skin: SkinWarp,
    jaw: Option<Jaw>,
    /// The chin's controls.
    chin: [Option<usize>; CHIN.len()],
    /// Out of the face, scan frame.
    out: Vector3<f64>,
    /// How far back each control may go, millimetres.
    room: Vec<f64>,
    level: Rotation3<f64>,
    eyes: [Option<Point3<f64>>; 2],
    parts: Vec<Part>,
    rest: Vec<[f32; 3]>,
}

impl Puppet {
    /// `anatomy` is the target's mesh, opened or as scanned, `surface` the scan's own, both in the scan frame and
    /// millimetres. `carried` says where a landmark lies that was not found on the target; `points` are the catalogue's
    /// control points on it.
    pub fn new(
        target: &TargetFace,
        anatomy: &Anatomy,
        surface: &Surface,
        carried: &dyn Fn(usize) -> Option<Point3<f64>>,
        points: &[Option<Point3<f64>>],
        warp: WarpKind,
    ) -> Result<Self, RigError> {
        let controls = match warp {
            WarpKind::Volume(morph) => {
                let taken = |landmark| morph.points.contains(landmark);
                let mut controls = Controls::new(target, carried, &[], anatomy, surface, &taken);
                controls.anchors =
                    phantoms(|landmark| target.landmarks[landmark].or_else(|| carried(landmark)));
                controls
            }
            _ => Controls::new(target, carried, points, anatomy, surface, &|_| true),
        };
        let (vertices, most) = (anatomy.soft_vertices(), MOST_SHARES / controls.rest.len().max(1));
        if vertices > most {
            return Err(RigError::TooManyVertices { vertices, most });
        }
        let skin = match warp {
            WarpKind::Surface | WarpKind::Spline | WarpKind::Volume(_) => {
                SkinWarp::new(target, &controls, anatomy, warp)?
            }
            WarpKind::Regions => {
                let positions = &anatomy.mesh.positions[..vertices];
                SkinWarp::plain(split_warp(target, &controls, positions)?)
            }
        };
        Ok(Self {
            jaw: anatomy.jaw.filter(|_| skin.has_jaw()),
            skin,
            chin: CHIN.map(|landmark| controls.of_landmark(landmark)),
            out: anatomy.frame.map_or_else(Vector3::z, |frame| frame.leave_vector(&Vector3::z())),
            room: room_before_teeth(target, anatomy, &controls.rest),
            level: target.level,
            eyes: [0, 1].map(|eye| anatomy.eyes[eye].as_ref().map(|eye| eye.centre)),
            parts: anatomy.parts.clone(),
            rest: anatomy.mesh.positions_f32(),
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

    /// The target's own vertices.
    pub fn rest(&self) -> &[[f32; 3]] {
        &self.rest
    }

    /// A frame to be posed again and again.
    pub fn new_frame(&self) -> AvatarFrame {
        AvatarFrame {
            positions: self.rest.clone(),
            controls: vec![[0.0; 3]; self.skin.warp.controls()],
            head: Isometry3::identity(),
            bones: Bones::rest(),
            scratch: Vec::new(),
        }
    }

    /// Moves jaw and eyes alone: the skin goes with them, and all controls stay where jaw and skull put them.
    pub fn act(&self, jaw: &JawPose, eyes: &Eyes, frame: &mut AvatarFrame) -> Result<(), RigError> {
        frame.controls.fill([0.0; 3]);
        frame.bones = self.bones(jaw, eyes);
        self.skin.drive(&frame.bones.jaw, eyes, &mut frame.controls);
        self.place(frame)
    }

    /// Fills the warp's columns for controls that move by `moved`, target's scan frame, millimetres, and tells how the
    /// bones move. The jaw is where the chin says that it is; what it does not explain is left to the splines. `freedom`
    /// tells of each control how far, 0..=1, its depth may be the jaw's; `camera` is where they were seen from, unless they
    /// were measured in space.
    pub(super) fn fill(
        &self,
        moved: impl Fn(Driver) -> Vector3<f64>,
        freedom: impl Fn(Driver) -> f64,
        eyes: &Eyes,
        camera: Option<&Point3<f64>>,
        out: &mut [[f32; 3]],
    ) -> Bones {
        let pose = self.jaw.map_or_else(JawPose::default, |jaw| {
            let chin = self.chin.map(|control| {
                control.map(|control| (self.controls.rest[control], moved(self.controls.drivers[control])))
            });
            jaw.solve(chin.into_iter().flatten(), camera)
        });
        let bones = self.bones(&pose, eyes);
        let opened = (pose.opening / OPENED).clamp(0.0, 1.0);
        let controls = self.controls.drivers.iter().zip(&self.controls.rest).zip(&self.skin.jaw_shares);
        for ((to, ((driver, rest), &share)), room) in out.iter_mut().zip(controls).zip(&self.room) {
            let mut vector = moved(*driver);
            if self.jaw.is_some() {
                let rigid = (bones.jaw * rest - rest) * share;
                // Depth is the network's guess: where an opening jaw carries the skin, the bone knows better. What was
                // seen stays in the picture, since it moves along its ray.
                if let Some(camera) = camera {
                    let bony = opened * share * freedom(*driver);
                    let ray = rest + vector - camera;
                    vector += ray * ((rigid - vector).dot(&self.out) * bony / ray.dot(&self.out));
                }
                vector -= rigid;
            }
            // What a camera saw stays where it was seen; what was measured on another face meets this one's teeth.
            if camera.is_none() {
                vector += self.out * (-room - vector.dot(&self.out)).max(0.0);
            }
            *to = vector.map(|v| v as f32).into();
        }
        self.skin.drive(&bones.jaw, eyes, out);
        bones
    }

    /// Places all vertices by the frame's columns and bones.
    pub fn place(&self, frame: &mut AvatarFrame) -> Result<(), RigError> {
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
        Ok(())
    }

    fn bones(&self, pose: &JawPose, eyes: &Eyes) -> Bones {
        let mut bones = Bones::rest();
        if let Some(jaw) = self.jaw {
            bones.jaw = jaw.motion(pose, 1.0);
            bones.tongue = jaw.motion(pose, TONGUE);
        }
        for ((bone, centre), side) in bones.eyes.iter_mut().zip(self.eyes).zip(Side::BOTH) {
            if let Some(centre) = centre {
                *bone = self.eye(eyes.of(side), &centre);
            }
        }
        bones
    }

    /// How an eye turns about its centre, in the target's scan frame.
    fn eye(&self, state: &EyeState, centre: &Point3<f64>) -> Isometry3<f64> {
        let gaze = Rotation3::from_axis_angle(&Vector3::y_axis(), state.yaw)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), -state.pitch);
        let turn = UnitQuaternion::from_rotation_matrix(&(self.level.inverse() * gaze * self.level));
        Isometry3::from_parts((centre.coords - turn * centre.coords).into(), turn)
    }
}
