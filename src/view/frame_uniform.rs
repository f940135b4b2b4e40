//! What the programs know of a whole picture.

use bytemuck::{Pod, Zeroable};
use nalgebra::{Matrix3, Matrix4};

use super::ViewCamera;
use super::look::{Lighting, Look};
use super::model::{CLAY, Model};

/// Matrices, lights and background.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(super) struct FrameUniform {
    clip_from_model: [[f32; 4]; 4],
    view_from_model: [[f32; 4]; 4],
    normal_from_model: [[f32; 4]; 4],
    eye: [f32; 4],
    lights: [f32; 4],
    background_top: [f32; 4],
    background_bottom: [f32; 4],
    clay: [f32; 4],
    specular: f32,
    facing: f32,
    height: f32,
    padding: f32,
}

impl FrameUniform {
    /// For a picture of so many pixels' height.
    pub(super) fn new(
        model: &Model,
        world_from_model: &Matrix4<f64>,
        camera: &ViewCamera,
        look: Look,
        height: u32,
    ) -> Self {
        let view_from_model = camera.view_from_world() * world_from_model;
        let linear: Matrix3<f64> = view_from_model.fixed_view::<3, 3>(0, 0).into();
        // The cofactors turn normals as the inverse transpose does, but exist for every matrix. A mirror turns
        // them inside out; their sign puts that right.
        let facing = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
        let [x, y, z] = [linear.column(0), linear.column(1), linear.column(2)];
        let cofactors = Matrix3::from_columns(&[y.cross(&z), z.cross(&x), x.cross(&y)]) * facing;
        // Nothing in a bare shape holds baked light: it needs the key light that clay gets.
        let bare = look.lighting == Lighting::Lit && !model.coloured;
        let (lights, specular) = if bare { look.lit_by(Lighting::Clay) } else { look }.lights();
        let [background_top, background_bottom] = look.background_colours();
        let clay = [CLAY[0], CLAY[1], CLAY[2], f32::from(u8::from(look.lighting == Lighting::Clay))];
        Self {
            clip_from_model: (camera.clip_from_view() * view_from_model).cast::<f32>().into(),
            view_from_model: view_from_model.cast::<f32>().into(),
            normal_from_model: cofactors.to_homogeneous().cast::<f32>().into(),
            eye: camera.eye_in_view().cast::<f32>().into(),
            lights,
            background_top,
            background_bottom,
            clay,
            specular,
            facing: facing as f32,
            height: height as f32,
            padding: 0.0,
        }
    }
}
