//! A scan made a quad grid: cleaned, seen from the front, with its colours and landmarks (000 section 5.4).

use std::path::PathBuf;

use nalgebra::{Matrix4, Point3};

use super::{PipelineError, Target, baked_texture::bake};
use crate::{
    anatomy::FaceFrame,
    grid::{Cleaned, FaceBox, FaceGrid, GridError, Raster, Sample, clean},
    scan::{LandmarkFile, Material, Mesh},
    view::Gpu,
};

/// A landmark farther than this from the grid's nearest vertex is on no place of the grid, millimetres.
const BESIDE: f64 = 10.0;

/// How a face is gridded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridOptions {
    /// Grid points across.
    pub columns: usize,
    /// Grid points down.
    pub rows: usize,
    /// Millimetres around the landmarks' bounding rectangle.
    pub margin: f64,
    /// Pixels of the baked texture's longer side.
    pub texture: u32,
}

impl Default for GridOptions {
    /// The thesis's 150 × 150.
    fn default() -> Self {
        Self { columns: 150, rows: 150, margin: 10.0, texture: 1024 }
    }
}

/// A face on a grid.
pub struct GriddedFace {
    /// The grid in the face's own axes (x along the eyes, y up, z out of the face), millimetres.
    pub grid: FaceGrid,
    /// The grid as a mesh, **scan's own frame and unit** until [`GriddedFace::transform`].
    pub mesh: Mesh,
    /// Its four-cornered faces, by the mesh's vertices.
    pub quads: Vec<[u32; 4]>,
    /// 478 grid vertices, the nearest to each landmark, in the mesh's frame.
    pub landmarks: Vec<Option<Point3<f64>>>,
    /// Mean and largest distance by which the landmarks moved to their vertices, millimetres.
    pub snapped: [f64; 2],
    /// Landmarks that lie on no place of the grid and were left out.
    pub beside: usize,
    /// What was taken away.
    pub cleaned: Cleaned,
}

impl Target {
    /// The scan as a quad grid.
    pub fn grid(&self, gpu: &Gpu, options: &GridOptions) -> Result<GriddedFace, PipelineError> {
        let GridOptions { columns, rows, margin, .. } = *options;
        let FaceView { frame, cleaned, landmarks } = self.face_view(margin)?;
        let raster = Raster::around(landmarks.iter().flatten().copied(), margin, columns, rows)
            .map_err(|source| self.no_grid(source))?;
        let samples = raster.sample(&cleaned.positions, cleaned.triangles(&self.mesh().triangles));
        let grid = FaceGrid::of_samples(raster, &samples).map_err(|source| self.no_grid(source))?;

        let to_own = |p: &Point3<f64>| self.scan.placement.to_own(frame.leave(p));
        let (mut mesh, quads) = grid.mesh(to_own);
        if let Some(texture) = bake(gpu, self.mesh(), &cleaned, &grid.raster, options.texture)? {
            mesh.materials = vec![Material {
                name: "face".into(),
                base_colour: [1.0; 4],
                texture: Some(texture),
                gloss: 0.0,
            }];
        } else {
            mesh.colours = colours(self.mesh(), &grid, &samples);
        }
        let snapped: Vec<_> = landmarks.iter().map(|l| l.and_then(|l| grid.nearest(&l))).collect();
        let on_the_grid: Vec<_> = snapped.iter().map(|s| s.filter(|(_, off)| *off <= BESIDE)).collect();
        let distances: Vec<f64> = on_the_grid.iter().flatten().map(|(_, off)| *off).collect();
        Ok(GriddedFace {
            mesh,
            quads,
            landmarks: on_the_grid.iter().map(|s| s.map(|(p, _)| to_own(&p))).collect(),
            snapped: [
                distances.iter().sum::<f64>() / distances.len().max(1) as f64,
                distances.iter().copied().fold(0.0, f64::max),
            ],
            beside: snapped.iter().flatten().count() - distances.len(),
            grid,
            cleaned,
        })
    }

    /// The scan cleaned and seen in the face's own axes.
    pub(super) fn face_view(&self, margin: f64) -> Result<FaceView, PipelineError> {
        let no_axes = || self.no_grid(GridError::NoAxes);
        let frame = FaceFrame::of(&self.landmarks).ok_or_else(no_axes)?;
        let landmarks: Vec<_> = self.landmarks.iter().map(|p| p.map(|p| frame.enter(&p))).collect();
        let seeds: Vec<u32> = self
            .landmarks
            .iter()
            .flatten()
            .filter_map(|p| Some(self.surface.nearest(*p)?.triangle))
            .collect();
        let present: Vec<_> = landmarks.iter().flatten().copied().collect();
        let face = FaceBox::around(&present, frame.eyes, margin).ok_or_else(no_axes)?;
        let positions = self.mesh().positions.iter().map(|p| frame.enter(p)).collect();
        let cleaned = clean(positions, &self.mesh().triangles, &seeds, &face);
        Ok(FaceView { frame, cleaned, landmarks })
    }

    /// The scan's name before what went wrong with its grid.
    pub(super) fn no_grid(&self, source: GridError) -> PipelineError {
        let scan = self.scan.path.clone().unwrap_or_else(|| PathBuf::from(&self.scan.name));
        PipelineError::Grid { scan, source }
    }
}

/// A cleaned scan in the face's own axes, millimetres.
pub(super) struct FaceView {
    pub frame: FaceFrame,
    pub cleaned: Cleaned,
    /// 478.
    pub landmarks: Vec<Option<Point3<f64>>>,
}

impl GriddedFace {
    /// Brings mesh and landmarks to another frame.
    pub fn transform(&mut self, matrix: &Matrix4<f64>) {
        for p in self.mesh.positions.iter_mut().chain(self.landmarks.iter_mut().flatten()) {
            *p = matrix.transform_point(p);
        }
    }

    /// The landmarks, ready to be written beside the mesh.
    pub fn landmark_file(&self, name: &str) -> LandmarkFile {
        LandmarkFile::new(name, self.landmarks.clone())
    }
}

/// The scan's vertex colours at the grid's vertices; none where it has none.
fn colours(mesh: &Mesh, grid: &FaceGrid, samples: &[Option<Sample>]) -> Vec<[f32; 3]> {
    if mesh.colours.is_empty() {
        return Vec::new();
    }
    let colour = |sample: &Sample| {
        let corners = mesh.triangles[sample.triangle as usize].map(|v| mesh.colours[v as usize]);
        std::array::from_fn(|channel| {
            let mixed: f64 = (0..3).map(|k| sample.barycentric[k] * f64::from(corners[k][channel])).sum();
            mixed.clamp(0.0, 1.0) as f32
        })
    };
    grid.points
        .iter()
        .zip(samples)
        .filter_map(|(point, sample)| point.and(sample.as_ref()))
        .map(colour)
        .collect()
}
