//! The three faces side by side, and the prediction once more in the colours of its errors.

use image::{RgbaImage, imageops};
use nalgebra::{Matrix4, Point3};

use super::{
    Comparison,
    colours::{UNCOUNTED, error_colour, key, round_length},
};
use crate::{
    scan::{Mesh, NormalSolver, Scan},
    view::{Gpu, Lighting, Look, Model, Renderer, Smoothing, ViewCamera, ViewError, contact_sheet},
};

/// Pixels of each picture.
const SIZE: [u32; 2] = [520, 620];
/// Degrees; the second row is seen from the subject's left.
const YAWS: [f64; 2] = [0.0, 32.0];

/// What the pictures show: a ball, scan frame, millimetres.
#[derive(Debug, Clone, Copy)]
pub struct Framing {
    /// Its middle.
    pub centre: Point3<f64>,
    /// Its radius.
    pub radius: f64,
}

/// Neutral, truth, prediction and errors, from the front and from the side, over the key to the colours.
///
/// The scans are in the scan frame; `comparison` is theirs. The colours reach up to the first round length that holds
/// 95 % of the errors that count.
pub fn comparison_sheet(
    gpu: &Gpu,
    neutral: &Scan,
    predicted: &Scan,
    truth: &Scan,
    comparison: &Comparison,
    framing: Framing,
) -> Result<RgbaImage, ViewError> {
    let top = round_length(comparison.whole().p95);
    let coloured = error_mesh(&predicted.mesh, comparison, top);
    let mut renderer = Renderer::new(gpu, SIZE[0], SIZE[1], Smoothing::Samples4)?;
    let straight = ViewCamera::frame_bounds(framing.centre, framing.radius, SIZE);
    let shown = [
        (&neutral.mesh, Lighting::Clay),
        (&truth.mesh, Lighting::Clay),
        (&predicted.mesh, Lighting::Clay),
        (&coloured, Lighting::Lit),
    ];
    let mut columns = Vec::new();
    for (mesh, lighting) in shown {
        columns.push(views(gpu, &mut renderer, mesh, lighting, &straight)?);
    }
    let whole = comparison.whole();
    let share = whole.share().map_or_else(String::new, |share| format!(", {share:.3} of motion"));
    let captions = [
        format!("neutral: {}", neutral.name),
        format!("truth: {}", truth.name),
        format!("predicted: {}", predicted.name),
        format!("error: RMS {:.3} mm{share}", whole.rms),
    ];
    let mut cells: Vec<(&RgbaImage, &str)> = Vec::new();
    for view in 0..YAWS.len() {
        for (pictures, caption) in columns.iter().zip(&captions) {
            cells.push((&pictures[view], if view == 0 { caption } else { "" }));
        }
    }
    let sheet = contact_sheet(&cells, shown.len() as u32);
    let paper = *sheet.get_pixel(0, 0);
    let key = key(sheet.width(), top, paper);
    let mut all = RgbaImage::from_pixel(sheet.width(), sheet.height() + key.height(), paper);
    imageops::overlay(&mut all, &sheet, 0, 0);
    imageops::overlay(&mut all, &key, 0, i64::from(sheet.height()));
    Ok(all)
}

/// The shape of the prediction with a colour for each vertex.
fn error_mesh(mesh: &Mesh, comparison: &Comparison, top: f64) -> Mesh {
    let errors = comparison.errors.iter().zip(&comparison.counted);
    Mesh {
        positions: mesh.positions.clone(),
        triangles: mesh.triangles.clone(),
        colours: errors
            .map(|(e, counted)| if *counted { error_colour(e / top) } else { UNCOUNTED })
            .collect(),
        ..Mesh::default()
    }
}

/// One mesh from every side.
fn views(
    gpu: &Gpu,
    renderer: &mut Renderer,
    mesh: &Mesh,
    lighting: Lighting,
    straight: &ViewCamera,
) -> Result<Vec<RgbaImage>, ViewError> {
    let model = Model::upload(gpu, mesh)?;
    let positions = mesh.positions_f32();
    let normals = NormalSolver::once(&mesh.triangles, &positions);
    let look = Look::default().lit_by(lighting);
    let world = Matrix4::identity();
    let mut pictures = Vec::new();
    for yaw in YAWS {
        let camera = straight.orbit(yaw.to_radians(), 0.0);
        renderer.draw(&model, &positions, &normals, &world, &camera, &look)?;
        pictures.push(renderer.read_picture()?);
    }
    Ok(pictures)
}
