//! Draws shapes with known answers, and compares one small picture with a stored one.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

#[path = "common/ball.rs"]
mod ball_scene;

use std::path::PathBuf;

use ball_scene::{BLACK, RADIUS, ball, camera, checker, draw, outwards, positions, textured};
use image::Rgba;
use nalgebra::{Matrix4, Point3, Vector3};
use understudy::scan::{Material, Mesh, TextureFormat};
use understudy::view::{
    Background, Gpu, Lighting, Look, Model, Projection, Renderer, Smoothing, ViewCamera, ViewError,
};

fn close(found: Rgba<u8>, wanted: [u8; 3], tolerance: i32) -> bool {
    found.0.iter().zip(wanted).all(|(&a, b)| (i32::from(a) - i32::from(b)).abs() <= tolerance)
}

#[test]
fn unlit_texture_keeps_its_bytes_the_right_way_up() {
    let mesh = textured(ball(48, 96), TextureFormat::Png, checker());
    let camera = camera(300, 300);
    let look = Look::UNLIT;
    let picture = draw(&mesh, &camera, look, Smoothing::Off);
    let (mut seen, fields) = (0, [[200, 60, 40], [40, 80, 190]]);
    for column in 0..8_u32 {
        for row in 0..4_u32 {
            // The middle of a field of the texture, on the ball.
            let (u, v) = ((f64::from(column) + 0.5) / 8.0, (f64::from(row) + 0.5) / 4.0);
            let (polar, around) = (v * std::f64::consts::PI, u * std::f64::consts::TAU);
            let normal = Vector3::new(polar.sin() * around.sin(), polar.cos(), polar.sin() * around.cos());
            if normal.z > 0.3 {
                let pixel = camera.project(Point3::from(normal * RADIUS)).unwrap();
                let found = *picture.get_pixel(pixel.x as u32, pixel.y as u32);
                let wanted = fields[((column + row) % 2) as usize];
                assert!(close(found, wanted, 1), "{column} {row}: {found:?}, wanted {wanted:?}");
                seen += 1;
            }
        }
    }
    assert!(seen >= 8, "{seen}");
}

#[test]
fn colours_of_vertices_and_materials_show_unlit() {
    let mut mesh = ball(24, 48);
    mesh.colours = vec![[0.2, 0.6, 0.4]; mesh.positions.len()];
    let middle = |mesh: &Mesh| *draw(mesh, &camera(80, 80), Look::UNLIT, Smoothing::Off).get_pixel(40, 40);
    assert!(close(middle(&mesh), [51, 153, 102], 1), "{:?}", middle(&mesh));

    // A linear factor of 0.214 is 127.5 in sRGB.
    let material = Material { name: String::new(), base_colour: [0.214_04; 4], texture: None, gloss: 0.0 };
    let factor = Mesh { colours: Vec::new(), materials: vec![material], ..mesh };
    assert!(close(middle(&factor), [127, 127, 127], 1), "{:?}", middle(&factor));

    let none = Mesh { materials: Vec::new(), ..factor };
    let [r, g, b, _] = middle(&none).0;
    assert!(r > g && g > b && r - b < 30 && b > 140, "clay is a warm grey, not {r} {g} {b}");
}

#[test]
fn the_outline_is_where_geometry_says() {
    let mesh = ball(96, 192);
    let perspective = camera(400, 300);
    let height = 2.5 * RADIUS;
    let parallel = ViewCamera { projection: Projection::Orthographic { height }, ..perspective };
    let Projection::Perspective { vertical_fov } = perspective.projection else { unreachable!() };
    let seen_from = perspective.eye.z;
    let closed_form = [
        (
            perspective,
            RADIUS / (seen_from * seen_from - RADIUS * RADIUS).sqrt() / (vertical_fov / 2.0).tan() * 150.0,
        ),
        (parallel, 300.0 * RADIUS / height),
    ];
    for (camera, radius) in closed_form {
        let look = Look::default().before(BLACK).lit_by(Lighting::Unlit);
        let picture = draw(&mesh, &camera, look, Smoothing::Off);
        let area = picture.pixels().filter(|p| p[0] > 0).count() as f64;
        let found = (area / std::f64::consts::PI).sqrt();
        assert!((found - radius).abs() < 0.15, "radius {found}, wanted {radius}");
        let columns = (0..400).filter(|&x| picture.get_pixel(x, 150)[0] > 0).count() as f64;
        assert!((columns / 2.0 - radius).abs() <= 1.0);
    }
}

#[test]
fn a_drawn_point_lands_on_the_pixel_that_project_names() {
    let gpu = Gpu::headless().unwrap();
    let mesh = Mesh { positions: vec![Point3::origin(); 3], triangles: vec![[0, 1, 2]], ..Mesh::default() };
    let model = Model::upload(&gpu, &mesh).unwrap();
    let mut renderer = Renderer::new(&gpu, 320, 200, Smoothing::Off).unwrap();
    let framed = camera(320, 200).orbit(0.4, -0.2);
    let parallel = ViewCamera { projection: Projection::Orthographic { height: 150.0 }, ..framed };
    let mut out = Vec::new();
    for (camera, size) in [(framed, 1.6), (parallel, 1.6)] {
        for place in [[0.0, 0.0, 0.0], [33.0, -21.5, 40.0], [-50.2, 30.0, -25.0]] {
            let place = Vector3::from(place);
            let corners = [[0.0, 1.0], [-0.866, -0.5], [0.866, -0.5]].map(|[x, y]| {
                let (_, sight) = camera.ray(camera.project(Point3::from(place)).unwrap());
                let right = sight.cross(&camera.up).normalize();
                let corner = place + (right * x + right.cross(&sight) * y) * size;
                corner.cast::<f32>().into()
            });
            let look = Look::default().before(BLACK).lit_by(Lighting::Unlit);
            renderer
                .draw(&model, &corners, &[[0.0, 0.0, 1.0]; 3], &Matrix4::identity(), &camera, &look)
                .unwrap();
            renderer.read(&mut out).unwrap();
            let bright: Vec<[f64; 2]> = (0..320 * 200)
                .filter(|i| out[4 * i] > 0)
                .map(|i| [(i % 320) as f64 + 0.5, (i / 320) as f64 + 0.5])
                .collect();
            assert!(!bright.is_empty());
            let mean = |axis: usize| bright.iter().map(|p| p[axis]).sum::<f64>() / bright.len() as f64;
            let wanted = camera.project(Point3::from(place)).unwrap();
            assert!(
                (mean(0) - wanted.x).abs() < 0.7 && (mean(1) - wanted.y).abs() < 0.7,
                "{bright:?} {wanted}"
            );
        }
    }
}

#[test]
fn the_inside_is_seen_and_lies_in_shadow() {
    let whole = ball(32, 64);
    let front: Vec<[u32; 3]> = whole
        .triangles
        .iter()
        .copied()
        .filter(|t| t.iter().all(|&v| whole.positions[v as usize].z > -1e-9))
        .collect();
    let shell = Mesh { triangles: front, uv_triangles: Vec::new(), ..whole };
    let look = Look::default().before(BLACK).lit_by(Lighting::Clay);
    let outside = camera(120, 120);
    let inside = outside.orbit(std::f64::consts::PI, 0.0);
    let [outside, inside] =
        [outside, inside].map(|c| draw(&shell, &c, look, Smoothing::Off).get_pixel(60, 60)[0]);
    assert!(inside > 30 && i32::from(inside) < i32::from(outside) - 40, "outside {outside}, inside {inside}");
}

#[test]
fn a_mirrored_model_still_shows_its_outside() {
    let gpu = Gpu::headless().unwrap();
    let mesh = ball(32, 64);
    let model = Model::upload(&gpu, &mesh).unwrap();
    let mut renderer = Renderer::new(&gpu, 100, 100, Smoothing::Off).unwrap();
    let (positions, normals) = (positions(&mesh), outwards(&mesh));
    let mut shot = |matrix: Matrix4<f64>| {
        let mut out = Vec::new();
        renderer.draw(&model, &positions, &normals, &matrix, &camera(100, 100), &Look::default()).unwrap();
        renderer.read(&mut out).unwrap();
        out
    };
    let mirror = Matrix4::new_nonuniform_scaling(&Vector3::new(-1.0, 1.0, 1.0));
    let (plain, mirrored) = (shot(Matrix4::identity()), shot(mirror));
    let differing = plain.iter().zip(&mirrored).filter(|(a, b)| a.abs_diff(**b) > 3).count();
    assert!(differing < plain.len() / 200, "{differing} of {}", plain.len());
}

#[test]
fn light_comes_from_the_upper_left() {
    let picture = draw(&ball(48, 96), &camera(200, 200), Look::default(), Smoothing::Samples4);
    let at = |x, y| i32::from(picture.get_pixel(x, y)[1]);
    assert!(at(60, 60) > at(140, 60) + 8, "{} {}", at(60, 60), at(140, 60));
    assert!(at(60, 60) > at(60, 140) + 8);
    assert!(at(140, 140) > 60, "nothing is black");
}

#[test]
fn a_transparent_background_has_no_alpha() {
    let look = Look::default().before(Background::Transparent).lit_by(Lighting::Unlit);
    for smoothing in [Smoothing::Off, Smoothing::Edges, Smoothing::Samples4] {
        let picture = draw(&ball(48, 96), &camera(160, 160), look, smoothing);
        assert_eq!(picture.get_pixel(1, 1).0, [0; 4]);
        assert_eq!(picture.get_pixel(80, 80)[3], 255);
        let clay = picture.get_pixel(80, 80).0;
        let between: Vec<_> = picture.pixels().filter(|p| p[3] > 30 && p[3] < 225).collect();
        assert_eq!(between.is_empty(), smoothing == Smoothing::Off);
        // Straight alpha: a half-covered pixel has the whole colour.
        assert!(
            between
                .iter()
                .all(|p| close(**p, [clay[0], clay[1], clay[2]], 255) && p[0].abs_diff(clay[0]) < 5)
        );
    }
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let mesh = textured(ball(48, 96), TextureFormat::Png, checker());
    for smoothing in [Smoothing::Off, Smoothing::Edges, Smoothing::Samples4] {
        let shot = || draw(&mesh, &camera(333, 222).orbit(0.3, 0.1), Look::default(), smoothing);
        assert!(shot() == shot(), "{smoothing:?}");
    }
}

#[test]
fn two_pictures_may_be_on_their_way() {
    let gpu = Gpu::headless().unwrap();
    let mesh = ball(16, 32);
    let model = Model::upload(&gpu, &mesh).unwrap();
    let mut renderer = Renderer::new(&gpu, 64, 64, Smoothing::Off).unwrap();
    let (positions, normals) = (positions(&mesh), outwards(&mesh));
    let mut out = Vec::new();
    assert!(matches!(renderer.fetch(&mut out), Err(ViewError::Turn { .. })));
    for red in [10, 20] {
        let look = Look::default().before(Background::Solid([red, 0, 0]));
        renderer.draw(&model, &positions, &normals, &Matrix4::identity(), &camera(64, 64), &look).unwrap();
        renderer.submit().unwrap();
    }
    assert!(matches!(renderer.submit(), Err(ViewError::Turn { .. })));
    for red in [10, 20] {
        renderer.fetch(&mut out).unwrap();
        assert_eq!((out.len(), out[0]), (64 * 64 * 4, red));
    }
}

#[test]
fn useless_input_is_named() {
    let gpu = Gpu::headless().unwrap();
    let upload = |mesh: &Mesh| Model::upload(&gpu, mesh).unwrap_err().to_string();
    for format in [TextureFormat::Png, TextureFormat::Jpeg] {
        let message = upload(&textured(ball(4, 8), format, b"not a picture".to_vec()));
        assert!(message.contains("skin.png") && message.contains("export it again"), "{message}");
    }
    let mut truncated = checker();
    truncated.truncate(truncated.len() / 2);
    assert!(upload(&textured(ball(4, 8), TextureFormat::Png, truncated)).contains("skin.png"));
    // A PNG header that claims 20,000 x 20,000 pixels.
    let mut huge = checker();
    huge[16..24].copy_from_slice(&[0, 0, 0x4e, 0x20, 0, 0, 0x4e, 0x20]);
    let header = crc32(&huge[12..29]);
    huge[29..33].copy_from_slice(&header.to_be_bytes());
    let message = upload(&textured(ball(4, 8), TextureFormat::Png, huge));
    assert!(message.contains("20000") && message.contains("16384"), "{message}");

    let mesh = ball(4, 8);
    let model = Model::upload(&gpu, &mesh).unwrap();
    let mut renderer = Renderer::new(&gpu, 64, 64, Smoothing::Off).unwrap();
    let few = [[0.0; 3]; 2];
    let (all, identity) = (positions(&mesh), Matrix4::identity());
    let mut draw = |p: &[[f32; 3]], n: &[[f32; 3]], c: &ViewCamera| {
        renderer.draw(&model, p, n, &identity, c, &Look::default()).unwrap_err().to_string()
    };
    assert!(draw(&few, &all, &camera(64, 64)).contains("2 positions"));
    assert!(draw(&all, &few, &camera(64, 64)).contains("2 normals"));
    assert!(draw(&all, &all, &camera(64, 48)).contains("64 x 64"));
    assert!(Renderer::new(&gpu, 0, 64, Smoothing::Off).is_err());
    assert!(Renderer::new(&gpu, 1 << 20, 64, Smoothing::Off).is_err());
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 })
    })
}

/// The stored picture was drawn with lavapipe 22.3; another driver may round differently but not look different.
/// `UPDATE_SNAPSHOTS=1 cargo test --release --test view_render` stores it anew.
#[test]
fn the_house_look_stays() {
    let mesh = textured(ball(48, 96), TextureFormat::Png, checker());
    let camera = camera(240, 180).orbit(0.4, 0.25);
    let picture = draw(&mesh, &camera, Look::default(), Smoothing::Samples4);
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/snapshots/view_ball.png");
    if std::env::var_os("UPDATE_SNAPSHOTS").is_some() {
        understudy::view::save_png(&path, &picture).unwrap();
    }
    let stored = image::open(&path).expect("UPDATE_SNAPSHOTS=1 stores the picture").into_rgba8();
    assert_eq!(stored.dimensions(), picture.dimensions());
    let differences: Vec<u8> =
        stored.as_raw().iter().zip(picture.as_raw()).map(|(a, b)| a.abs_diff(*b)).collect();
    let mean = differences.iter().map(|&d| f64::from(d)).sum::<f64>() / differences.len() as f64;
    let far = differences.iter().filter(|&&d| d > 12).count() as f64 / differences.len() as f64;
    assert!(mean < 1.0 && far < 0.01, "mean difference {mean:.2} levels, {:.2} % above 12", 100.0 * far);
}
