//! A small mesh and its motion, which the tests of GLB files write.

#![allow(dead_code, reason = "each test uses its own part of this file")]
#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use std::sync::Arc;

use nalgebra::Point3;
use understudy::capture::Timestamp;
use understudy::export::{GlbPart, MorphTarget, NodeKey};
use understudy::scan::{Material, Mesh, Texture, TextureFormat};

pub fn picture(format: image::ImageFormat) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let pixels = image::RgbImage::from_fn(8, 4, |x, y| image::Rgb([x as u8 * 30, y as u8 * 60, 90]));
    pixels.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

pub fn textured(name: &str, format: TextureFormat) -> Material {
    let encoding = match format {
        TextureFormat::Png => image::ImageFormat::Png,
        TextureFormat::Jpeg => image::ImageFormat::Jpeg,
    };
    let texture = Texture { name: format!("{name}.img"), format, bytes: picture(encoding) };
    Material { name: name.into(), base_colour: [1.0; 4], texture: Some(Arc::new(texture)), gloss: 0.0 }
}

pub fn plain(name: &str, base_colour: [f32; 4]) -> Material {
    Material { name: name.into(), base_colour, texture: None, gloss: 0.0 }
}

/// A 4 × 4 grid of 18 triangles, 10 cm wide.
pub fn grid() -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..4_u32 {
        for column in 0..4_u32 {
            let (x, y) = (f64::from(column) / 30.0, f64::from(row) / 30.0);
            mesh.positions.push(Point3::new(x, y, 0.01 * (x * y * 300.0).sin()));
            mesh.uvs.push([column as f32 / 3.0, row as f32 / 3.0]);
            if row < 3 && column < 3 {
                let at = row * 4 + column;
                mesh.triangles.extend([[at, at + 1, at + 5], [at, at + 5, at + 4]]);
            }
        }
    }
    mesh.uv_triangles.clone_from(&mesh.triangles);
    mesh
}

/// The grid with a seam along its diagonal triangles, as an unwrapped scan has.
pub fn seamed() -> Mesh {
    let mut mesh = grid();
    let shifted: Vec<_> = mesh.uvs.iter().map(|[u, v]| [u * 0.5, v * 0.5]).collect();
    mesh.uvs.extend(shifted);
    for corners in mesh.uv_triangles.iter_mut().skip(9) {
        *corners = corners.map(|corner| corner + 16);
    }
    mesh.materials = vec![textured("skin", TextureFormat::Png)];
    mesh
}

pub fn normals(mesh: &Mesh) -> Vec<[f32; 3]> {
    vec![[0.0, 0.0, 3.0]; mesh.positions.len()]
}

pub fn morphs(mesh: &Mesh, count: usize) -> Vec<MorphTarget> {
    let delta = |morph: usize, vertex: usize| [0.001 * morph as f32, 0.0001 * vertex as f32, 0.002];
    let deltas = |morph| (0..mesh.positions.len()).map(|vertex| delta(morph, vertex)).collect();
    (0..count)
        .map(|morph| MorphTarget { name: format!("shape \"{morph}\""), deltas: deltas(morph) })
        .collect()
}

pub fn weights(frames: usize, morphs: usize) -> Vec<Vec<f32>> {
    let weight = |frame: usize, morph: usize| (frame as f32 * 0.1 + morph as f32).sin();
    (0..frames).map(|frame| (0..morphs).map(|morph| weight(frame, morph)).collect()).collect()
}

pub fn times(frames: usize) -> Vec<Timestamp> {
    (0..frames as i64).map(|frame| Timestamp(frame * 33_366_666)).collect()
}

pub fn head(frames: usize) -> Vec<NodeKey> {
    let key = |frame: usize| {
        let half = frame as f32 * 0.05;
        NodeKey {
            translation: [0.0, 0.01 * frame as f32, -0.5],
            rotation: [0.0, half.sin(), 0.0, half.cos()],
        }
    };
    (0..frames).map(key).collect()
}

/// The mesh alone, without normals or motion.
pub fn part<'a>(name: &'a str, mesh: &'a Mesh) -> GlbPart<'a> {
    GlbPart { name, mesh, normals: &[], morphs: &[], pivot: [0.0; 3], keys: None }
}
