//! A scan and what became of it on the grid, for a person to judge (000 figure 5-5).

use std::sync::Arc;

use image::RgbaImage;
use nalgebra::{Matrix4, Point3, Rotation3};

use super::{GriddedFace, PipelineError, Target, photographer::Photographer};
use crate::{
    anatomy::FaceFrame,
    grid::{FaceGrid, GridError},
    scan::{Mesh, NormalSolver},
    view::{Gpu, Lighting, Look, Model, Renderer, Smoothing, ViewCamera, contact_sheet, dot, line},
};

/// Pixels.
const SIDE: u32 = 640;
/// Radius of the framed ball over the outer canthal distance.
const FRAMING: f64 = 1.5;
/// Degrees by which the camera walks for the last picture.
const YAW: f64 = 30.0;
/// Every so many lines of the grid are drawn.
const LINES: usize = 5;
const GRID: [u8; 4] = [40, 70, 120, 130];
const LANDMARK: [u8; 4] = [80, 230, 120, 255];

/// Draws meshes that lie in one frame.
struct Artist<'a> {
    gpu: &'a Gpu,
    renderer: Renderer,
}

impl Artist<'_> {
    fn draw(
        &mut self,
        mesh: &Mesh,
        camera: &ViewCamera,
        lighting: Lighting,
    ) -> Result<RgbaImage, PipelineError> {
        let positions = mesh.positions_f32();
        let normals = NormalSolver::once(&mesh.triangles, &positions);
        let model = Arc::new(Model::upload(self.gpu, mesh)?);
        let look = Look::default().lit_by(lighting);
        self.renderer.draw(&model, &positions, &normals, &Matrix4::identity(), camera, &look)?;
        Ok(self.renderer.read_picture()?)
    }
}

/// The scan, its grid, and the grid with its colours and landmarks; `face` must still be in the scan's own frame.
pub fn grid_picture(gpu: &Gpu, target: &Target, face: &GriddedFace) -> Result<RgbaImage, PipelineError> {
    let frame = FaceFrame::of(&target.landmarks).ok_or_else(|| target.no_grid(GridError::NoAxes))?;
    let (centre, eyes) = target.centre_and_eyes();
    let centre = frame.enter(&centre);
    let camera = Photographer::camera(centre, FRAMING * eyes, &Rotation3::identity(), [SIDE, SIDE]);
    let mut artist = Artist { gpu, renderer: Renderer::new(gpu, SIDE, SIDE, Smoothing::Samples4)? };

    let in_face_axes = |p: &Point3<f64>| frame.enter(&target.scan.placement.to_scan(*p));
    let scan = Mesh {
        positions: target.mesh().positions.iter().map(|p| frame.enter(p)).collect(),
        ..target.mesh().clone()
    };
    let grid =
        Mesh { positions: face.mesh.positions.iter().map(in_face_axes).collect(), ..face.mesh.clone() };
    let before = artist.draw(&scan, &camera, Lighting::Lit)?;
    let mut lines = artist.draw(&grid, &camera, Lighting::Clay)?;
    draw_lines(&mut lines, &face.grid, &camera);
    let mut after = artist.draw(&grid, &camera.orbit(f64::to_radians(YAW), 0.0), Lighting::Lit)?;
    for landmark in face.landmarks.iter().flatten() {
        if let Some(pixel) = camera.orbit(f64::to_radians(YAW), 0.0).project(in_face_axes(landmark)) {
            dot(&mut after, pixel, 1.5, LANDMARK);
        }
    }
    let words = format!(
        "{}x{} grid, {} points on the face",
        face.grid.raster.columns,
        face.grid.raster.rows,
        face.grid.valid()
    );
    let cells = [
        (&before, target.scan.name.as_str()),
        (&lines, words.as_str()),
        (&after, "the grid's own colours and landmarks"),
    ];
    Ok(contact_sheet(&cells, 3))
}

/// An average face as clay, from the front and the side.
pub fn average_picture(
    gpu: &Gpu,
    grid: &FaceGrid,
    landmarks: &[Option<Point3<f64>>],
) -> Result<RgbaImage, PipelineError> {
    let (mesh, _) = grid.mesh(|p| *p);
    let (centre, radius) = mesh.bounding_ball();
    let mut artist = Artist { gpu, renderer: Renderer::new(gpu, SIDE, SIDE, Smoothing::Samples4)? };
    let straight = Photographer::camera(centre, radius, &Rotation3::identity(), [SIDE, SIDE]);
    let mut front = artist.draw(&mesh, &straight, Lighting::Clay)?;
    let side = artist.draw(&mesh, &straight.orbit(f64::to_radians(YAW + 15.0), 0.0), Lighting::Clay)?;
    for landmark in landmarks.iter().flatten() {
        if let Some(pixel) = straight.project(*landmark) {
            dot(&mut front, pixel, 1.5, LANDMARK);
        }
    }
    Ok(contact_sheet(&[(&front, "average face, consensus landmarks"), (&side, "from the subject's left")], 2))
}

fn draw_lines(picture: &mut RgbaImage, grid: &FaceGrid, camera: &ViewCamera) {
    let columns = grid.raster.columns;
    for &[a, b, c, d] in &grid.cells {
        let on = |i: usize| ((i / columns).is_multiple_of(LINES), (i % columns).is_multiple_of(LINES));
        let edges = [(a, b, on(a).0), (d, c, on(d).0), (a, d, on(a).1), (b, c, on(b).1)];
        for (from, to, _) in edges.into_iter().filter(|(_, _, wanted)| *wanted) {
            let ends = grid.points[from].zip(grid.points[to]);
            if let Some((from, to)) = ends.and_then(|(a, b)| camera.project(a).zip(camera.project(b))) {
                line(picture, from, to, 0.7, GRID);
            }
        }
    }
}
