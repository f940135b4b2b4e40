//! A model that wears living skin.

use std::{ops::Range, sync::Arc};

use nalgebra::Vector4;

use super::super::{
    Gpu, Model, ViewError,
    facing::facing_first,
    look::Lighting,
    model::{MovingVertex, filled},
    pipelines::Pipelines,
};
use super::{
    map::{SkinMap, SkinMode},
    programs::SkinPrograms,
};
use crate::appearance::{AppearanceStates, FRAME_SIZE, FaceChart, FaceFrame, TextureVolume};

/// A stretch of the triangles of one material.
#[derive(Debug)]
struct Run {
    /// Which of the model's parts.
    part: usize,
    indices: Range<u32>,
    /// Whether regions of living skin may lie on it.
    alive: bool,
}

/// A model, where its vertices lie in the shared frame, and what is shown there.
#[derive(Debug)]
pub struct LivingModel {
    model: Arc<Model>,
    pub(super) map: SkinMap,
    charted: wgpu::Buffer,
    runs: Vec<Run>,
    /// The model's triangles, within each material those first on which skin may change.
    triangles: Vec<[u32; 3]>,
}

impl LivingModel {
    /// Puts `volumes` on the device, for a model whose mesh vertices lie in `frame` as `chart` says. `gain` multiplies the
    /// logarithms of ratios; it does not matter to [`SkinMode::Own`].
    pub fn new(
        gpu: &Gpu,
        model: Arc<Model>,
        frame: &FaceFrame,
        chart: &FaceChart,
        volumes: &[TextureVolume],
        mode: SkinMode,
        gain: f32,
    ) -> Result<Self, ViewError> {
        let (wanted, found) = (model.vertices(), chart.places().len());
        if wanted != found {
            return Err(ViewError::Vertices { what: "places in the shared frame", wanted, found });
        }
        let map = SkinMap::upload(gpu, frame, volumes, mode, gain)?;
        let at = |vertex: u32| chart.places()[vertex as usize];
        let attributes: Vec<[f32; 3]> = model
            .source()
            .iter()
            .map(|&vertex| {
                let [u, v]: [f32; 2] =
                    std::array::from_fn(|axis| (at(vertex)[axis] + 0.5) / FRAME_SIZE[axis] as f32);
                [u, v, chart.covers()[vertex as usize]]
            })
            .collect();
        let is_alive = |triangle: &[u32; 3]| {
            let corners = triangle.map(|corner| model.source()[corner as usize]);
            corners.iter().any(|&corner| chart.covers()[corner as usize] > 0.0)
                && volumes.iter().any(|volume| meets(volume, corners.map(at)))
        };
        let (mut runs, mut triangles) = (Vec::new(), Vec::with_capacity(model.triangles()));
        for (part, own) in model.parts.iter().enumerate() {
            let own = model.triangles_of(&own.indices);
            let skin = !model.parts[part].glossy;
            let (alive, rest): (Vec<[u32; 3]>, Vec<[u32; 3]>) =
                own.iter().copied().partition(|triangle| skin && is_alive(triangle));
            for (alive, stretch) in [(true, alive), (false, rest)] {
                let start = 3 * triangles.len() as u32;
                triangles.extend(stretch);
                let indices = start..3 * triangles.len() as u32;
                if !indices.is_empty() {
                    runs.push(Run { part, indices, alive });
                }
            }
        }
        let usage = wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST;
        let charted = filled(gpu, "places in the shared frame", usage, bytemuck::cast_slice(&attributes));
        gpu.check()?;
        Ok(Self { model, map, charted, runs, triangles })
    }

    /// The model.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// What the next picture shows; a region without a state is neutral.
    pub fn show(&mut self, states: &AppearanceStates) {
        self.map.show(states);
    }

    /// Whether the next picture is that of the model alone.
    pub fn is_neutral(&self) -> bool {
        self.map.is_neutral()
    }

    /// Brings the map up to date.
    pub(in super::super) fn compose(&mut self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder) {
        self.map.compose(gpu, encoder);
    }

    /// [`Model::facing_first`] over runs.
    pub(in super::super) fn facing_first(
        &self,
        vertices: &[MovingVertex],
        eye: Vector4<f32>,
        out: &mut Vec<[u32; 3]>,
    ) {
        facing_first(&self.triangles, self.runs.iter().map(|run| &run.indices), vertices, eye, out);
    }
}

impl LivingModel {
    /// Draws every run; the model's own buffers are bound already.
    pub(in super::super) fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        bare: &Pipelines,
        programs: &SkinPrograms,
        lighting: Lighting,
    ) {
        pass.set_vertex_buffer(2, self.charted.slice(..));
        for run in &self.runs {
            let part = &self.model.parts[run.part];
            if run.alive {
                pass.set_pipeline(programs.part(lighting, part));
                pass.set_bind_group(2, &self.map.group, &[]);
            } else {
                pass.set_pipeline(bare.part(lighting, part));
            }
            pass.set_bind_group(1, &part.material, &[]);
            pass.draw_indexed(run.indices.clone(), 0, 0..1);
        }
    }
}

/// Whether the box around a triangle's corners in the frame meets a volume's patch.
fn meets(volume: &TextureVolume, corners: [[f32; 2]; 3]) -> bool {
    let patch = volume.patch();
    (0..2).all(|axis| {
        let places = corners.map(|corner| corner[axis]);
        let (low, high) = places.iter().fold((f32::MAX, f32::MIN), |(l, h), p| (l.min(*p), h.max(*p)));
        let start = f32::from(patch.origin[axis]);
        low <= start + f32::from(patch.size[axis]) && high >= start - 1.0
    })
}
