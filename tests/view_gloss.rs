//! Draws wet balls, whose reflections have a known place.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

#[path = "common/ball.rs"]
mod ball_scene;

use ball_scene::{BLACK, RADIUS, ball, camera, checker, draw, textured};
use image::RgbaImage;
use nalgebra::{Point2, Point3, Vector3};
use understudy::scan::{Material, Mesh, TextureFormat};
use understudy::view::{Lighting, Look, Smoothing, ViewCamera};

/// Millimetres.
const EYE: f64 = 12.0;
const IRIS: f64 = 11.7;
const HEAD: f64 = 130.0;

/// As in `shade.wgsl`: from the viewer's upper left, and from the right.
const KEY: [f64; 3] = [-0.55, 0.62, 0.72];
const FILL: [f64; 3] = [0.85, -0.10, 0.55];

/// A dark ball the size of an eye.
fn eye(gloss: f32) -> Mesh {
    let mut mesh = ball(48, 96);
    for position in &mut mesh.positions {
        *position *= EYE / RADIUS;
    }
    let base_colour = [0.02, 0.02, 0.02, 1.0];
    mesh.materials = vec![Material { name: "eye".into(), base_colour, texture: None, gloss }];
    mesh
}

fn before_a_head() -> ViewCamera {
    ViewCamera::frame_bounds(Point3::origin(), HEAD, [720, 720])
}

fn lit(gloss: f32) -> RgbaImage {
    draw(&eye(gloss), &before_a_head(), Look::default().before(BLACK), Smoothing::Off)
}

/// The pixel where the eye reflects a light that stands far away, fixed to the camera.
fn reflected(light: [f64; 3]) -> Point2<f64> {
    let (light, camera) = (Vector3::from(light).normalize(), before_a_head());
    let mut normal = Vector3::z();
    for _ in 0..20 {
        let to_eye = (camera.eye - Point3::from(normal * EYE)).normalize();
        normal = (light + to_eye).normalize();
    }
    camera.project(Point3::from(normal * EYE)).unwrap()
}

fn at(picture: &RgbaImage, place: Point2<f64>) -> u8 {
    picture.get_pixel(place.x as u32, place.y as u32)[1]
}

/// Centre and diameter, pixels, of what is brighter than `level`.
fn spot(picture: &RgbaImage, level: u8) -> (Point2<f64>, f64) {
    let bright: Vec<_> = picture.enumerate_pixels().filter(|(_, _, pixel)| pixel[1] > level).collect();
    let count = bright.len() as f64;
    let mean = |axis: &dyn Fn(u32, u32) -> u32| {
        bright.iter().map(|&(x, y, _)| f64::from(axis(x, y)) + 0.5).sum::<f64>() / count
    };
    (Point2::new(mean(&|x, _| x), mean(&|_, y| y)), 2.0 * (count / std::f64::consts::PI).sqrt())
}

fn brightest(picture: &RgbaImage) -> u8 {
    picture.pixels().map(|pixel| pixel[1]).max().unwrap()
}

#[test]
fn an_eye_has_a_small_white_glint_and_skin_has_none() {
    let wet = lit(1.0);
    let (place, wide) = spot(&wet, 150);
    let pixels_per_millimetre = {
        let camera = before_a_head();
        let [a, b] = [0.0, 1.0].map(|x| camera.project(Point3::new(x, 0.0, EYE)).unwrap().x);
        b - a
    };
    println!("{place} is {:.2} of an iris wide", wide / pixels_per_millimetre / IRIS);
    assert!((place - reflected(KEY)).norm() < 0.7, "{place}, wanted {}", reflected(KEY));
    assert!(at(&wet, place) >= 250);
    assert!((0.07..0.14).contains(&(wide / pixels_per_millimetre / IRIS)), "{wide} pixels");
    let dry = lit(0.0);
    assert!(brightest(&dry) < 90, "{}", brightest(&dry));
    // The glint is all that differs much.
    let differing = wet.pixels().zip(dry.pixels()).filter(|(a, b)| a[1].abs_diff(b[1]) > 60).count();
    assert!(differing < 60, "{differing}");
}

#[test]
fn a_less_wet_surface_shines_broadly_and_weakly() {
    let (eye, tongue) = (lit(1.0), lit(0.3));
    let half = |picture: &RgbaImage| spot(picture, brightest(picture) / 2 + 20);
    assert!((90..170).contains(&brightest(&tongue)), "{}", brightest(&tongue));
    assert!((half(&tongue).0 - reflected(KEY)).norm() < 4.0);
    assert!(half(&tongue).1 > 2.0 * half(&eye).1, "{:?} {:?}", half(&tongue), half(&eye));
}

#[test]
fn only_the_wettest_reflect_the_fill_light() {
    let beside = reflected(FILL) + nalgebra::Vector2::new(0.0, 9.0);
    let rise = |gloss| {
        let picture = lit(gloss);
        i32::from(at(&picture, reflected(FILL))) - i32::from(at(&picture, beside))
    };
    assert!((30..150).contains(&rise(1.0)), "{}", rise(1.0));
    assert!(rise(0.7) < 8, "{}", rise(0.7));
}

/// At two thirds of a pixel to the millimetre the glint is smaller than a pixel.
#[test]
fn a_small_glint_does_not_twinkle() {
    let peaks: Vec<u8> = (0..8)
        .map(|step| {
            let still = ViewCamera::frame_bounds(Point3::origin(), HEAD, [180, 180]);
            let way = Vector3::new(0.2, 0.1, 0.0) * f64::from(step);
            let moved = ViewCamera { eye: still.eye + way, target: still.target + way, ..still };
            brightest(&draw(&eye(1.0), &moved, Look::default().before(BLACK), Smoothing::Off))
        })
        .collect();
    let (dimmest, brightest) = (peaks.iter().min().unwrap(), peaks.iter().max().unwrap());
    assert!(*dimmest > 95 && brightest - dimmest < 50, "{peaks:?}");
}

#[test]
fn a_trace_of_gloss_is_hardly_seen() {
    // Vertex colours, so that wet or dry the ball gets the light of coloured scans.
    let ball = Mesh { colours: vec![[1.0; 3]; 97 * 193], ..ball(96, 192) };
    let painted =
        Material { name: String::new(), base_colour: [0.5, 0.2, 0.2, 1.0], texture: None, gloss: 0.0 };
    let painted = Mesh { materials: vec![painted], ..ball.clone() };
    for mut mesh in [textured(ball, TextureFormat::Png, checker()), painted] {
        let mut shot = |gloss| {
            mesh.materials[0].gloss = gloss;
            draw(&mesh, &camera(200, 200), Look::default().before(BLACK), Smoothing::Off)
        };
        let (dry, moist) = (shot(0.0), shot(0.001));
        let worst = dry
            .enumerate_pixels()
            .zip(moist.pixels())
            // Not at the outline: the rim light rises there within a triangle.
            .filter(|((x, y, _), _)| (f64::from(*x) - 99.5).hypot(f64::from(*y) - 99.5) < 80.0)
            .flat_map(|((_, _, dry), moist)| dry.0.into_iter().zip(moist.0))
            .map(|(a, b)| a.abs_diff(b))
            .max();
        assert!(worst <= Some(4), "{worst:?} levels apart");
    }
}

#[test]
fn without_light_and_in_clay_nothing_glints() {
    for lighting in [Lighting::Unlit, Lighting::Clay] {
        let shot = |gloss| {
            let mut mesh = textured(ball(24, 48), TextureFormat::Png, checker());
            mesh.materials[0].gloss = gloss;
            draw(&mesh, &camera(100, 100), Look::default().lit_by(lighting), Smoothing::Off)
        };
        assert!(shot(0.0) == shot(1.0), "{lighting:?}");
    }
}

/// A bare scan, of which a few triangles at the back have a texture.
#[test]
fn wet_parts_do_not_make_a_bare_scan_a_coloured_one() {
    let bare = ball(24, 48);
    let shot = |mesh: &Mesh| draw(mesh, &camera(100, 100), Look::default(), Smoothing::Off);
    let with = |gloss| {
        let mut mesh = textured(bare.clone(), TextureFormat::Png, checker());
        mesh.materials[0].gloss = gloss;
        mesh.materials.push(Material {
            name: "skin".into(),
            base_colour: [1.0; 4],
            texture: None,
            gloss: 0.0,
        });
        let behind = |triangle: &[u32; 3]| triangle.iter().all(|&v| mesh.positions[v as usize].z < -40.0);
        mesh.triangle_materials = mesh.triangles.iter().map(|t| u32::from(!behind(t))).collect();
        mesh
    };
    assert!(shot(&bare) == shot(&with(1.0)));
    assert!(shot(&bare) != shot(&with(0.0)));
    let coloured = |mesh: Mesh| Mesh { colours: vec![[1.0; 3]; bare.positions.len()], ..mesh };
    assert!(shot(&coloured(bare.clone())) == shot(&coloured(with(1.0))), "vertex colours count");
}
