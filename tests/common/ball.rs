//! A ball before a camera, which the tests of pictures draw.

#![allow(dead_code, reason = "each test uses its own part of this file")]
#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use std::sync::Arc;

use image::{Rgba, RgbaImage};
use nalgebra::{Matrix4, Point3, Vector3};
use understudy::scan::{Material, Mesh, Texture, TextureFormat};
use understudy::view::{Background, Gpu, Look, Model, Renderer, Smoothing, ViewCamera};

pub const RADIUS: f64 = 80.0;
pub const BLACK: Background = Background::Solid([0, 0, 0]);

/// A ball in rings from the north pole (+Y) to the south pole, with texture coordinates that wrap once around.
pub fn ball(rings: u32, segments: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..=rings {
        for j in 0..=segments {
            let (u, v) = (f64::from(j) / f64::from(segments), f64::from(i) / f64::from(rings));
            let (polar, around) = (v * std::f64::consts::PI, u * std::f64::consts::TAU);
            mesh.positions.push(Point3::from(
                Vector3::new(polar.sin() * around.sin(), polar.cos(), polar.sin() * around.cos()) * RADIUS,
            ));
            mesh.uvs.push([u as f32, 1.0 - v as f32]);
        }
    }
    for i in 0..rings {
        for j in 0..segments {
            let (a, b) = (i * (segments + 1) + j, (i + 1) * (segments + 1) + j);
            mesh.triangles.extend([[a, b, a + 1], [a + 1, b, b + 1]]);
        }
    }
    mesh.uv_triangles = mesh.triangles.clone();
    mesh
}

pub fn textured(mesh: Mesh, format: TextureFormat, bytes: Vec<u8>) -> Mesh {
    let texture = Arc::new(Texture { name: "skin.png".to_owned(), format, bytes });
    let material =
        Material { name: "skin".to_owned(), base_colour: [1.0; 4], texture: Some(texture), gloss: 0.0 };
    Mesh { materials: vec![material], ..mesh }
}

/// Eight by four fields, in turn 200, 60, 40 and 40, 80, 190.
pub fn checker() -> Vec<u8> {
    let image = RgbaImage::from_fn(256, 128, |x, y| {
        Rgba([[200, 60, 40, 255], [40, 80, 190, 255]][((x / 32 + y / 32) % 2) as usize])
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

pub fn positions(mesh: &Mesh) -> Vec<[f32; 3]> {
    mesh.positions.iter().map(|p| p.cast::<f32>().into()).collect()
}

pub fn outwards(mesh: &Mesh) -> Vec<[f32; 3]> {
    mesh.positions.iter().map(|p| p.coords.normalize().cast::<f32>().into()).collect()
}

pub fn camera(width: u32, height: u32) -> ViewCamera {
    ViewCamera::frame_bounds(Point3::origin(), RADIUS, [width, height])
}

/// Draws a mesh of which every normal points away from the origin.
pub fn draw(mesh: &Mesh, camera: &ViewCamera, look: Look, smoothing: Smoothing) -> RgbaImage {
    let gpu = Gpu::headless().unwrap();
    let model = Model::upload(&gpu, mesh).unwrap();
    let [width, height] = camera.viewport;
    let mut renderer = Renderer::new(&gpu, width, height, smoothing).unwrap();
    let mut out = Vec::new();
    let (positions, normals) = (positions(mesh), outwards(mesh));
    renderer.draw(&model, &positions, &normals, &Matrix4::identity(), camera, &look).unwrap();
    renderer.read(&mut out).unwrap();
    RgbaImage::from_raw(width, height, out).unwrap()
}
