//! Pictures of a scan, for the networks that know faces from pictures.

use std::sync::Arc;

use nalgebra::{Matrix4, Point2, Point3, Rotation3, Vector3};

use super::PipelineError;
use crate::{
    anatomy::{FaceFrame, FrontView},
    capture::{CaptureError, Image},
    scan::{Mesh, NormalSolver, Surface, SurfacePoint},
    tracking::{Landmarks, Tracker},
    view::{Gpu, Lighting, Look, Model, Projection, Renderer, Smoothing, ViewCamera},
};

/// Width and height of the pictures; the landmark network looks at 256 × 256 of a face that fills about half of it.
pub(super) const SIZE: [u32; 2] = [640, 640];

/// Pixels of the frontal view's sides, and its height and middle in outer canthal distances: brows to chin.
const VIEW_SIDE: u32 = 1024;
const VIEW_HEIGHT: f64 = 2.0;
const VIEW_MIDDLE: f64 = -0.45;

/// Photographs one mesh.
pub struct Photographer {
    renderer: Renderer,
    model: Arc<Model>,
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    rgba: Vec<u8>,
}

/// A picture with the camera that took it and the face found on it.
pub struct Portrait {
    /// Where the camera stood, in the mesh's own frame and unit.
    pub camera: ViewCamera,
    /// The face, in pixels of the picture.
    pub landmarks: Landmarks,
}

impl Photographer {
    /// `model` is the uploaded mesh; `mesh` may be in whatever frame and unit.
    pub fn new(gpu: &Gpu, model: Arc<Model>, mesh: &Mesh) -> Result<Self, PipelineError> {
        let positions = mesh.positions_f32();
        let normals = NormalSolver::once(&mesh.triangles, &positions);
        Ok(Self {
            renderer: Renderer::new(gpu, SIZE[0], SIZE[1], Smoothing::Off)?,
            model,
            positions,
            normals,
            rgba: Vec::new(),
        })
    }

    /// A camera before `centre` that shows a ball of `radius`; `facing` turns the mesh's frame so that the face looks
    /// at the camera, upright.
    pub fn camera(centre: Point3<f64>, radius: f64, facing: &Rotation3<f64>, size: [u32; 2]) -> ViewCamera {
        let straight = ViewCamera::frame_bounds(Point3::origin(), radius, size);
        let turn = facing.inverse();
        ViewCamera {
            eye: centre + turn * straight.eye.coords,
            target: centre,
            up: turn * Vector3::y(),
            ..straight
        }
    }

    /// The scan's own colours seen straight from the front; the mesh must be in the scan frame.
    pub fn front_view(&self, gpu: &Gpu, frame: &FaceFrame) -> Result<FrontView, PipelineError> {
        let height = VIEW_HEIGHT * frame.eyes;
        let centre = Point2::new(0.0, VIEW_MIDDLE * frame.eyes);
        let distance = 3.0 * frame.eyes;
        let camera = ViewCamera {
            eye: frame.leave(&Point3::new(centre.x, centre.y, distance)),
            target: frame.leave(&Point3::new(centre.x, centre.y, 0.0)),
            up: frame.leave_vector(&Vector3::y()),
            projection: Projection::Orthographic { height },
            near: 0.01 * frame.eyes,
            far: 2.0 * distance,
            viewport: [VIEW_SIDE, VIEW_SIDE],
        };
        let mut renderer = Renderer::new(gpu, VIEW_SIDE, VIEW_SIDE, Smoothing::Off)?;
        let world = Matrix4::identity();
        renderer.draw(&self.model, &self.positions, &self.normals, &world, &camera, &Look::UNLIT)?;
        let picture = image::DynamicImage::from(renderer.read_picture()?).into_rgb8();
        Ok(FrontView { picture, centre, scale: height / f64::from(VIEW_SIDE) })
    }

    /// Takes the picture and looks for a face on it.
    pub fn portrait(
        &mut self,
        camera: ViewCamera,
        lighting: Lighting,
        tracker: &mut Tracker,
    ) -> Result<Option<Portrait>, PipelineError> {
        let look = Look::UNLIT.lit_by(lighting);
        let world = Matrix4::identity();
        self.renderer.draw(&self.model, &self.positions, &self.normals, &world, &camera, &look)?;
        self.renderer.read(&mut self.rgba)?;
        let [width, height] = SIZE.map(|side| side as usize);
        let image = Image::from_rgba(width, height, &self.rgba)
            .map_err(|source| CaptureError::Library { path: "a rendering of the scan".into(), source })?;
        tracker.reset();
        Ok(tracker.track(&image)?.map(|landmarks| Portrait { camera, landmarks }))
    }
}

impl Portrait {
    /// Where the ray of a picture's point first meets the surface.
    pub fn cast(&self, pixel: nalgebra::Vector2<f64>, surface: &Surface) -> Option<SurfacePoint> {
        // Landmarks count pixel centres as integers, the view's pixels start at corners.
        let (origin, direction) = self.camera.ray(Point2::new(pixel.x + 0.5, pixel.y + 0.5));
        surface.cast(origin, direction.into_inner())
    }

    /// The cosine between the surface and the line of sight: 1 faces the camera, 0 grazes.
    pub fn facing(&self, point: &SurfacePoint) -> f64 {
        (self.camera.eye - point.position).normalize().dot(&point.normal)
    }
}
