//! One picture at 1280 × 720, drawn and read back: heads of 12,000 and 50,000 triangles with a 2048-pixel texture, and a
//! real scan with and without living skin.

#![allow(clippy::expect_used, reason = "a benchmark that cannot draw has nothing to measure")]

#[path = "../examples/shared/wrinkles.rs"]
mod wrinkles;

use std::io::Cursor;
use std::sync::Arc;

use divan::{Bencher, bench, black_box};
use image::{ImageFormat, Rgba, RgbaImage};
use nalgebra::{Matrix4, Point3, Rotation3, Vector3};
use understudy::appearance::{AppearanceStates, Region};
use understudy::assets::Assets;
use understudy::pipeline::{
    HeadMode, LivingSkin, Networks, SharedFace, SkinRelief, Stage, Target, TargetOptions,
};
use understudy::rig::AvatarFrame;
use understudy::scan::{Material, Mesh, Texture, TextureFormat};
use understudy::tracking::TrackerOptions;
use understudy::view::{Gpu, Lighting, Look, Model, Renderer, SkinMode, Smoothing, ViewCamera};

fn main() {
    match Gpu::headless() {
        Ok(gpu) => println!("drawn by {}", gpu.adapter_name()),
        Err(error) => println!("{error}"),
    }
    divan::main();
}

const TRIANGLES: [u32; 2] = [12_000, 50_000];

#[bench(args = TRIANGLES)]
fn unsmoothed(bencher: Bencher<'_, '_>, triangles: u32) {
    picture(bencher, triangles, Smoothing::Off, Lighting::Lit);
}

#[bench(args = TRIANGLES)]
fn edges(bencher: Bencher<'_, '_>, triangles: u32) {
    picture(bencher, triangles, Smoothing::Edges, Lighting::Lit);
}

#[bench(args = TRIANGLES)]
fn edges_clay(bencher: Bencher<'_, '_>, triangles: u32) {
    picture(bencher, triangles, Smoothing::Edges, Lighting::Clay);
}

#[bench(args = TRIANGLES)]
fn samples4(bencher: Bencher<'_, '_>, triangles: u32) {
    picture(bencher, triangles, Smoothing::Samples4, Lighting::Lit);
}

/// Skin of the scan that the demo animates: none, there but neutral, wrinkled and the same in every picture, or another in
/// every picture.
#[bench(args = ["none", "neutral", "still", "moving"])]
fn living_skin(bencher: Bencher<'_, '_>, skin: &str) {
    let assets = Assets::locate().expect("a place of the assets");
    for companion in ["james_mtl", "james_jpg"] {
        assets.verified(companion).expect("the set-up's scan");
    }
    let path = |name: &str| assets.verified(name).expect("an asset of the set-up");
    let gpu = Gpu::headless().expect("an adapter");
    let mut networks = Networks::load(&assets, TrackerOptions::default()).expect("the networks");
    let options = TargetOptions::default();
    let mut target =
        Target::load(&path("james_obj"), &options, &gpu, &mut networks.tracker).expect("a target");
    target.prepare(&gpu).expect("an avatar");
    let face = SharedFace::read(&path("canonical_face")).expect("the canonical face");
    let volumes = wrinkles::volumes(face.frame());
    let relief = SkinRelief::default();
    let living =
        LivingSkin::new(&gpu, &target, &face, &volumes, &relief, SkinMode::Ratio, 1.2).expect("a skin");
    let (level, look) = (Rotation3::identity(), Look::default());
    let stage = Stage::new(&gpu, &target, &level, [1280, 720], look, HeadMode::Still, Smoothing::Edges);
    let mut stage = stage.expect("a stage").wearing((skin != "none").then_some(living));
    let frame = AvatarFrame::at_rest(&target.anatomy.mesh);
    let mut turn = 0_u8;
    bencher.bench_local(|| {
        turn = (turn + 1) % 10;
        let state = match skin {
            "moving" => f32::from(turn + 1) / 10.0,
            "still" => 1.0,
            _ => 0.0,
        };
        let mut states = AppearanceStates::default();
        for region in Region::ALL {
            states.set(region, Some(state));
        }
        stage.show(&states);
        black_box(stage.picture(&frame).expect("a picture").width());
    });
}

fn picture(bencher: Bencher<'_, '_>, triangles: u32, smoothing: Smoothing, lighting: Lighting) {
    let mesh = head(triangles);
    let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.cast::<f32>().into()).collect();
    let normals: Vec<[f32; 3]> =
        mesh.positions.iter().map(|p| p.coords.normalize().cast::<f32>().into()).collect();
    let gpu = Gpu::headless().expect("an adapter");
    let model = Model::upload(&gpu, &mesh).expect("a model");
    let mut renderer = Renderer::new(&gpu, 1280, 720, smoothing).expect("a renderer");
    let camera = ViewCamera::frame_bounds(Point3::origin(), 120.0, [1280, 720]).orbit(0.3, 0.1);
    let look = Look::default().lit_by(lighting);
    let mut out = Vec::new();
    bencher.bench_local(|| {
        renderer
            .draw(&model, &positions, &normals, &Matrix4::identity(), &camera, &look)
            .and_then(|()| renderer.read(&mut out))
            .expect("a picture");
        black_box(out.len())
    });
}

/// An egg as high as a head, with a fine texture, about the given number of triangles.
fn head(triangles: u32) -> Mesh {
    let rings = f64::from(triangles / 4).sqrt() as u32;
    let segments = 2 * rings;
    let mut mesh = Mesh::default();
    for i in 0..=rings {
        for j in 0..=segments {
            let (u, v) = (f64::from(j) / f64::from(segments), f64::from(i) / f64::from(rings));
            let (polar, around) = (v * std::f64::consts::PI, u * std::f64::consts::TAU);
            let [x, y, z] = [polar.sin() * around.sin(), polar.cos(), polar.sin() * around.cos()];
            mesh.positions.push(Point3::from(Vector3::new(75.0 * x, 115.0 * y, 95.0 * z)));
            mesh.uvs.push([u as f32, 1.0 - v as f32]);
        }
    }
    for i in 0..rings {
        for j in 0..segments {
            let (a, b) = (i * (segments + 1) + j, (i + 1) * (segments + 1) + j);
            mesh.triangles.extend([[a, b, a + 1], [a + 1, b, b + 1]]);
        }
    }
    mesh.uv_triangles.clone_from(&mesh.triangles);
    let image = RgbaImage::from_fn(2048, 2048, |x, y| {
        // About the contrast of skin.
        let fine = ((x * 7 + y * 13) ^ (x * y / 64)) % 16;
        Rgba([180 + fine as u8, 130 + fine as u8, 110 + fine as u8, 255])
    });
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png).expect("an encoded texture");
    let texture =
        Texture { name: "skin.png".to_owned(), format: TextureFormat::Png, bytes: bytes.into_inner() };
    let material = Material {
        name: "skin".to_owned(),
        base_colour: [1.0; 4],
        texture: Some(Arc::new(texture)),
        gloss: 0.0,
    };
    Mesh { materials: vec![material], ..mesh }
}
