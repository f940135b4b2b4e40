//! Where the avatar performs: a camera before it, and pictures of each frame.

use std::sync::Arc;

use image::RgbaImage;
use nalgebra::{Isometry3, Matrix4, Point3, Rotation3};

use super::{LivingSkin, PipelineError, Target, photographer::Photographer};
use crate::{
    appearance::AppearanceStates,
    rig::AvatarFrame,
    scan::NormalSolver,
    view::{Gpu, Look, Model, Renderer, Smoothing, ViewCamera, as_picture},
};

/// Radius of the framed ball over the outer canthal distance: a head with room to move.
const FRAMING: f64 = 1.7;

/// Whether the avatar's head moves with the performer's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum HeadMode {
    /// It turns and moves as the performer's does.
    #[default]
    Follow,
    /// It stays, and only the face moves.
    Still,
}

impl HeadMode {
    /// The head's motion as this mode shows it.
    pub fn motion(self, head: &Isometry3<f64>) -> Isometry3<f64> {
        match self {
            Self::Follow => *head,
            Self::Still => Isometry3::identity(),
        }
    }

    /// The vertices of a frame where this mode shows them. Target's scan frame, millimetres.
    pub(super) fn place(self, frame: &AvatarFrame, placed: &mut [[f32; 3]]) {
        if self == Self::Still {
            return placed.copy_from_slice(&frame.positions);
        }
        for (to, from) in placed.iter_mut().zip(&frame.positions) {
            let point = frame.head * Point3::from(from.map(f64::from));
            *to = point.coords.map(|v| v as f32).into();
        }
    }
}

/// Draws one target.
pub struct Stage {
    renderer: Renderer,
    model: Arc<Model>,
    solver: NormalSolver,
    normals: Vec<[f32; 3]>,
    camera: ViewCamera,
    look: Look,
    head: HeadMode,
    level: Rotation3<f64>,
    skin: Option<LivingSkin>,
}

impl Stage {
    /// `level` turns the target to face the camera as the performer did while neutral.
    pub fn new(
        gpu: &Gpu,
        target: &Target,
        level: &Rotation3<f64>,
        size: [u32; 2],
        look: Look,
        head: HeadMode,
        smoothing: Smoothing,
    ) -> Result<Self, PipelineError> {
        let mesh = &target.anatomy.mesh;
        let (centre, eyes) = target.centre_and_eyes();
        Ok(Self {
            renderer: Renderer::new(gpu, size[0], size[1], smoothing)?,
            model: Arc::clone(target.avatar_model()),
            solver: NormalSolver::new(&mesh.triangles, mesh.positions.len()),
            normals: vec![[0.0; 3]; mesh.positions.len()],
            camera: Photographer::camera(centre, FRAMING * eyes, level, size),
            look,
            head,
            level: *level,
            skin: None,
        })
    }

    /// Moves the camera before `centre` (scan frame) so that a ball of `radius` millimetres fills the picture, seen from
    /// `yaw` radians to the subject's left.
    pub fn look_at(&mut self, centre: Point3<f64>, radius: f64, yaw: f64) {
        self.camera = Photographer::camera(centre, radius, &self.level, self.renderer.size()).orbit(yaw, 0.0);
    }

    /// The camera before which the target stands.
    pub fn camera(&self) -> &ViewCamera {
        &self.camera
    }

    /// Puts living skin on the target, made for it; until [`Stage::show`] says more it is neutral.
    #[must_use]
    pub fn wearing(self, skin: Option<LivingSkin>) -> Self {
        Self { skin, ..self }
    }

    /// What the skin looks like in the frames from now on; nothing without a skin.
    pub fn show(&mut self, states: &AppearanceStates) {
        if let Some(skin) = &mut self.skin {
            skin.model.show(states);
            skin.states = *states;
        }
    }

    /// Draws a frame and sends its picture on the way.
    pub fn submit(&mut self, frame: &AvatarFrame) -> Result<(), PipelineError> {
        self.solver.update(&frame.positions, &mut self.normals);
        let raised = self.skin.as_ref().filter(|skin| !skin.relief.is_flat());
        let raised = raised.map(|skin| {
            let mut positions = frame.positions.clone();
            skin.relief.apply(&skin.states, &self.normals, &mut positions);
            self.solver.update(&positions, &mut self.normals);
            positions
        });
        let world: Matrix4<f64> = self.head.motion(&frame.head).to_homogeneous();
        let positions = raised.as_ref().unwrap_or(&frame.positions);
        let (normals, camera, look) = (&self.normals, &self.camera, &self.look);
        match &mut self.skin {
            Some(skin) => {
                self.renderer.draw_living(&mut skin.model, positions, normals, &world, camera, look)?;
            }
            None => self.renderer.draw(&self.model, positions, normals, &world, camera, look)?,
        }
        Ok(self.renderer.submit()?)
    }

    /// Waits for the oldest picture that was submitted: RGBA rows.
    pub fn fetch(&mut self, rgba: &mut Vec<u8>) -> Result<(), PipelineError> {
        Ok(self.renderer.fetch(rgba)?)
    }

    /// A frame's picture, waited for. Not while another picture is on its way.
    pub fn picture(&mut self, frame: &AvatarFrame) -> Result<RgbaImage, PipelineError> {
        let mut rgba = Vec::new();
        self.submit(frame)?;
        self.fetch(&mut rgba)?;
        Ok(as_picture(self.size(), rgba)?)
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.renderer.size()
    }
}
