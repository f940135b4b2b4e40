//! A scan with its landmarks drawn on it, for a person to judge.

use image::RgbaImage;
use nalgebra::{Matrix4, Point3, Rotation3};

use super::{PipelineError, Target, photographer::Photographer};
use crate::{
    scan::NormalSolver,
    tracking::SKIN_LANDMARK_COUNT,
    view::{Gpu, Look, Renderer, Smoothing, ViewCamera, beside, dot},
};

/// Pixels.
const SIDE: u32 = 900;
/// Degrees; the second picture is from the subject's left.
const YAWS: [f64; 2] = [0.0, 35.0];
/// Radius of the framed ball over the outer canthal distance.
const FRAMING: f64 = 1.45;
const SKIN: [u8; 4] = [80, 230, 120, 255];
const IRIS: [u8; 4] = [90, 190, 255, 255];

/// Two pictures of the target side by side, every landmark a dot.
pub fn inspection_picture(gpu: &Gpu, target: &Target) -> Result<RgbaImage, PipelineError> {
    let (centre, eyes) = target.centre_and_eyes();
    let straight = Photographer::camera(centre, FRAMING * eyes, &Rotation3::identity(), [SIDE, SIDE]);
    let mesh = target.mesh();
    let positions = mesh.positions_f32();
    let normals = NormalSolver::once(&mesh.triangles, &positions);
    let mut renderer = Renderer::new(gpu, SIDE, SIDE, Smoothing::Samples4)?;
    let mut pictures = Vec::new();
    for yaw in YAWS {
        let camera = straight.orbit(f64::to_radians(yaw), 0.0);
        renderer.draw(
            target.model(),
            &positions,
            &normals,
            &Matrix4::identity(),
            &camera,
            &Look::default(),
        )?;
        let mut picture = renderer.read_picture()?;
        for (i, landmark) in target.landmarks.iter().enumerate() {
            if let Some(pixel) =
                landmark.filter(|p| is_seen(target, &camera, p)).and_then(|p| camera.project(p))
            {
                dot(&mut picture, pixel, 1.8, if i < SKIN_LANDMARK_COUNT { SKIN } else { IRIS });
            }
        }
        pictures.push(picture);
    }
    Ok(beside(&pictures[0], &pictures[1]))
}

/// Whether nothing stands between the camera and a point of the surface.
fn is_seen(target: &Target, camera: &ViewCamera, point: &Point3<f64>) -> bool {
    let hit = target.surface.cast(camera.eye, point - camera.eye);
    hit.is_some_and(|hit| (hit.position - point).norm() < 1.0)
}
