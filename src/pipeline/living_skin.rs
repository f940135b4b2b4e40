//! Living skin on a target: who wears it, and where on the face.

use std::{path::Path, sync::Arc};

use nalgebra::Point3;

use super::{PipelineError, SkinRelief, Target, canonical::read_framed_face};
use crate::{
    anatomy::PartKind,
    appearance::{AppearanceStates, FaceChart, FaceFrame, TextureVolume},
    scan::NormalSolver,
    view::{Gpu, LivingModel, SkinMode},
};

/// The canonical face and the frame in which skins of different people lie on one another.
#[derive(Debug, Clone)]
pub struct SharedFace {
    points: Vec<Point3<f64>>,
    frame: FaceFrame,
}

impl SharedFace {
    /// Reads the canonical face.
    pub fn read(path: &Path) -> Result<Self, PipelineError> {
        let (points, frame) = read_framed_face(path)?;
        Ok(Self { points, frame })
    }

    /// The frame.
    pub fn frame(&self) -> &FaceFrame {
        &self.frame
    }

    /// Where the vertices of a target's [`Target::anatomy`] lie in the frame: those of the skin, seen from the front.
    pub fn chart(&self, target: &Target) -> Result<FaceChart, PipelineError> {
        let mesh = &target.anatomy.mesh;
        let normals = NormalSolver::once(&mesh.triangles, &mesh.positions_f32());
        let skin = target.anatomy.parts.iter().find(|part| part.kind == PartKind::Skin);
        let skin = skin.map_or(0..mesh.positions.len(), |part| part.vertices.clone());
        Ok(FaceChart::new(&self.frame, &self.points, &target.landmarks, mesh, &normals, &skin)?)
    }
}

/// Texture volumes on a target, for a [`Stage`](super::Stage) to show.
pub struct LivingSkin {
    pub(super) model: LivingModel,
    pub(super) relief: SkinRelief,
    /// What is shown.
    pub(super) states: AppearanceStates,
}

impl LivingSkin {
    /// Lays volumes over a target; `relief` is theirs on it. `gain` multiplies the logarithms of ratios: 1 is as much
    /// light and dark as the performer has shown.
    pub fn new(
        gpu: &Gpu,
        target: &Target,
        face: &SharedFace,
        volumes: &[TextureVolume],
        relief: &SkinRelief,
        mode: SkinMode,
        gain: f32,
    ) -> Result<Self, PipelineError> {
        let chart = face.chart(target)?;
        let model = Arc::clone(target.avatar_model());
        let model = LivingModel::new(gpu, model, &face.frame, &chart, volumes, mode, gain)?;
        Ok(Self { model, relief: relief.clone(), states: AppearanceStates::default() })
    }
}
