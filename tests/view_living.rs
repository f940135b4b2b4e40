//! Living skin as the device draws it, held against the same composed on the CPU, and against what it must not change.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests fail as tests do")]

#[path = "../examples/shared/stand.rs"]
mod stand;
#[path = "../examples/shared/wrinkles.rs"]
mod wrinkles;

use std::{io::Cursor, path::PathBuf, sync::Arc};

use image::{ImageFormat, Rgba, RgbaImage};
use nalgebra::{Matrix4, Point2, Point3, Rotation3, Vector3};
use stand::Stand;
use understudy::{
    appearance::{
        ALPHA_RAMP, AppearanceStates, Area, Composition, FRAME_SIZE, FaceChart, Layer, Patch, Region,
        TextureVolume,
    },
    assets::Assets,
    pipeline::{HeadMode, LivingSkin, SharedFace, SkinRelief, Stage, Target},
    rig::AvatarFrame,
    scan::{Material, Mesh, Texture, TextureFormat},
    view::{Gpu, LivingModel, Look, Model, Projection, Renderer, SkinMode, Smoothing, ViewCamera},
};

const GAIN: f32 = 1.2;
/// sRGB.
const GREY: u8 = 140;

fn face() -> SharedFace {
    let assets = Assets::locate().and_then(|assets| assets.verified("canonical_face"));
    SharedFace::read(&assets.unwrap_or_else(|error| panic!("{error}"))).unwrap()
}

/// The whole frame as a flat square, a millimetre a pixel; its upper left pixel's centre is the origin.
fn sheet(textured: bool) -> Mesh {
    let [width, height] = FRAME_SIZE.map(|side| side as f64);
    let corner = |x: f64, y: f64| Point3::new(x - 0.5, 0.5 - y, 0.0);
    let mut mesh = Mesh {
        positions: vec![corner(0.0, 0.0), corner(width, 0.0), corner(0.0, height), corner(width, height)],
        triangles: vec![[0, 2, 1], [1, 2, 3]],
        ..Mesh::default()
    };
    if textured {
        let picture = RgbaImage::from_pixel(4, 4, Rgba([GREY, GREY, GREY, 255]));
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, ImageFormat::Png).unwrap();
        let texture = Texture { name: "grey".into(), format: TextureFormat::Png, bytes: bytes.into_inner() };
        mesh.materials = vec![Material {
            name: "skin".into(),
            base_colour: [1.0; 4],
            texture: Some(Arc::new(texture)),
            gloss: 0.0,
        }];
        mesh.uvs = vec![[0.5; 2]];
        mesh.uv_triangles = vec![[0; 3]; 2];
    } else {
        mesh.colours = vec![[f32::from(GREY) / 255.0; 3]; 4];
    }
    mesh
}

/// Where the sheet's vertices lie in the frame, every one covered so far.
fn chart(mesh: &Mesh, cover: f32) -> FaceChart {
    let places = mesh.positions.iter().map(|p| [p.x as f32, -p.y as f32]).collect();
    FaceChart::of_places(places, vec![cover; 4]).unwrap()
}

/// The sheet drawn so that each pixel is one of the frame; `None` draws the model without any skin.
fn drawn(mesh: &Mesh, living: Option<(&[TextureVolume], SkinMode, f32, &AppearanceStates)>) -> RgbaImage {
    let gpu = Gpu::headless().unwrap();
    let viewport = FRAME_SIZE.map(|side| side as u32);
    let middle = nalgebra::center(&mesh.positions[0], &mesh.positions[3]);
    let camera = ViewCamera {
        eye: middle + Vector3::z() * 100.0,
        target: middle,
        up: Vector3::y(),
        projection: Projection::Orthographic { height: f64::from(viewport[1]) },
        near: 1.0,
        far: 200.0,
        viewport,
    };
    let [width, height] = viewport;
    let mut renderer = Renderer::new(&gpu, width, height, Smoothing::Off).unwrap();
    let model = Arc::new(Model::upload(&gpu, mesh).unwrap());
    let (positions, normals) = (mesh.positions_f32(), vec![[0.0, 0.0, 1.0]; 4]);
    let (world, look) = (Matrix4::identity(), Look::UNLIT);
    match living {
        None => renderer.draw(&model, &positions, &normals, &world, &camera, &look).unwrap(),
        Some((volumes, mode, cover, states)) => {
            let (face, chart) = (face(), chart(mesh, cover));
            let mut living =
                LivingModel::new(&gpu, model, face.frame(), &chart, volumes, mode, GAIN).unwrap();
            // What was shown before leaves nothing behind.
            living.show(&all(0.8));
            renderer.draw_living(&mut living, &positions, &normals, &world, &camera, &look).unwrap();
            living.show(states);
            renderer.draw_living(&mut living, &positions, &normals, &world, &camera, &look).unwrap();
        }
    }
    renderer.read_picture().unwrap()
}

fn all(state: f32) -> AppearanceStates {
    let mut states = AppearanceStates::default();
    for region in Region::ALL {
        states.set(region, Some(state));
    }
    states
}

fn mixed() -> AppearanceStates {
    let mut states = all(1.0);
    for (region, state) in Region::ALL.into_iter().zip([0.55, 0.9, 0.3, 1.0, 0.72, 0.14]) {
        states.set(region, Some(state));
    }
    states.set(Region::MouthCornerLeft, None);
    states
}

/// Largest and mean difference to what `wanted` says of each pixel, sRGB levels, and how many pixels are not grey.
fn differences(picture: &RgbaImage, wanted: impl Fn(&Point2<f64>) -> [f32; 3]) -> (f32, f32, usize) {
    let (mut largest, mut sum, mut changed) = (0.0_f32, 0.0, 0);
    for (x, y, pixel) in picture.enumerate_pixels() {
        let wanted = wanted(&Point2::new(f64::from(x), f64::from(y)));
        for (found, wanted) in pixel.0.iter().zip(wanted) {
            let difference = (f32::from(*found) - wanted.clamp(0.0, 255.0)).abs();
            largest = largest.max(difference);
            sum += difference / 3.0;
        }
        changed += usize::from(pixel[0].abs_diff(GREY) > 3);
    }
    (largest, sum / (picture.width() * picture.height()) as f32, changed)
}

#[test]
fn ratios_are_composed_as_on_the_cpu() {
    let face = face();
    let volumes = wrinkles::volumes(face.frame());
    let composed = Composition::new(face.frame(), &volumes);
    for (textured, cover) in [(true, 1.0), (false, 1.0), (true, 0.4)] {
        let picture = drawn(&sheet(textured), Some((&volumes, SkinMode::Ratio, cover, &mixed())));
        let wanted = |place: &Point2<f64>| {
            let factor = (GAIN * cover * composed.log_ratio(place, &mixed())).exp();
            if textured {
                [f32::from(GREY) * factor.powf(1.0 / 2.2); 3]
            } else {
                [encoded(decoded(GREY) * factor); 3]
            }
        };
        let (largest, mean, changed) = differences(&picture, wanted);
        println!(
            "textured {textured}: largest {largest:.2}, mean {mean:.3} levels, {changed} pixels changed"
        );
        assert!(largest < 1.0 && mean < 0.1, "largest {largest:.2}, mean {mean:.3}");
        assert!(changed > 5_000, "{changed}");
    }
}

#[test]
fn own_colours_are_composed_as_on_the_cpu() {
    let face = face();
    let volumes = wrinkles::volumes(face.frame());
    let composed = Composition::new(face.frame(), &volumes);
    let picture = drawn(&sheet(true), Some((&volumes, SkinMode::Own, 1.0, &mixed())));
    let (largest, mean, changed) = differences(&picture, |place| {
        let (own, share) = composed.own(place, &mixed());
        let grey = (f32::from(GREY) / 255.0).powi(2);
        std::array::from_fn(|k| 255.0 * (grey * (1.0 - share) + own[k].powf(2.0 / 2.2) * share).sqrt())
    });
    println!("largest {largest:.2}, mean {mean:.3} levels, {changed} pixels changed");
    assert!(largest < 1.0 && mean < 0.1, "largest {largest:.2}, mean {mean:.3}");
    assert!(changed > 60_000, "{changed}");
}

#[test]
fn a_neutral_skin_is_the_models_own_picture_byte_for_byte() {
    let face = face();
    let volumes = wrinkles::volumes(face.frame());
    for textured in [true, false] {
        let mesh = sheet(textured);
        let bare = drawn(&mesh, None);
        for (mode, states) in [
            (SkinMode::Ratio, AppearanceStates::default()),
            (SkinMode::Ratio, all(0.0)),
            (SkinMode::Own, AppearanceStates::default()),
            (SkinMode::Own, all(0.0)),
        ] {
            assert!(drawn(&mesh, Some((&volumes, mode, 1.0, &states))) == bare, "{mode:?}");
        }
        // What is beside the face has no skin, whatever is shown.
        assert!(drawn(&mesh, Some((&volumes, SkinMode::Ratio, 0.0, &all(1.0)))) == bare);
        assert!(drawn(&mesh, Some((&volumes, SkinMode::Ratio, 1.0, &all(1.0)))) != bare);
    }
}

#[test]
fn ten_pixels_lead_from_the_edge_of_a_region_to_its_whole() {
    let face = face();
    let (region, depth) = (Region::Forehead, -0.6_f32);
    let patch = Patch::of(region, face.frame());
    let flat = |ratio: f32| Layer::new(&vec![ratio; patch.pixels()], vec![[0; 3]; patch.pixels()]);
    let layers = vec![flat(0.0), flat(depth / 2.0), flat(depth)];
    let volumes = [TextureVolume::new(region, patch, layers).unwrap()];
    let picture = drawn(&sheet(true), Some((&volumes, SkinMode::Ratio, 1.0, &all(1.0))));
    let area = Area::of(region, face.frame());
    let edge = area.centre.y - area.down.norm();
    for step in -3..16 {
        let y = edge.ceil() + f64::from(step);
        let found = f32::from(picture.get_pixel(area.centre.x.round() as u32, y as u32)[0]);
        let alpha = ((y - edge) / ALPHA_RAMP).clamp(0.0, 1.0) as f32;
        let wanted = f32::from(GREY) * (GAIN * depth * alpha / 2.2).exp();
        assert!((found - wanted).abs() < 1.2, "{step} pixels inside: {found}, wanted {wanted}");
    }
}

#[test]
fn a_scan_frowns_as_it_did() {
    let (gpu, target, face) = james();
    let volumes = wrinkles::volumes(face.frame());
    let picture = worn(&gpu, &target, &face, &volumes, &all(1.0));
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/snapshots/view_wrinkles.png");
    if std::env::var_os("UPDATE_SNAPSHOTS").is_some() {
        picture.save(&path).unwrap();
    }
    let stored = image::open(&path).expect("UPDATE_SNAPSHOTS=1 stores the picture").into_rgba8();
    let mean = mean_difference(&stored, &picture);
    let without = mean_difference(&stored, &worn(&gpu, &target, &face, &volumes, &all(0.0)));
    println!("mean difference {mean:.3} levels, {without:.3} without wrinkles");
    assert!(mean < 0.15 && without > 0.4, "{mean:.3}, {without:.3} without wrinkles");
}

#[test]
fn a_scan_with_neutral_skin_is_the_scan() {
    let (gpu, target, face) = james();
    let volumes = wrinkles::volumes(face.frame());
    let bare = stage(&gpu, &target).picture(&AvatarFrame::at_rest(&target.anatomy.mesh)).unwrap();
    assert!(worn(&gpu, &target, &face, &volumes, &all(0.0)) == bare);
    assert!(worn(&gpu, &target, &face, &volumes, &AppearanceStates::default()) == bare);
}

#[test]
fn eyes_teeth_and_the_back_of_the_head_are_not_on_the_chart() {
    let (_, target, face) = james();
    let chart = face.chart(&target).unwrap();
    for part in &target.anatomy.parts[1..] {
        assert!(chart.covers()[part.vertices.clone()].iter().all(|cover| *cover == 0.0), "{:?}", part.kind);
    }
    // Where the landmarks are they lie where the frame has them, most of them within 6 mm of a face 150 mm wide.
    let skin = &target.anatomy.mesh.positions[..target.anatomy.scan_vertices];
    let mut errors: Vec<f64> = (0..468)
        .filter_map(|landmark| {
            let at = target.landmarks[landmark]?;
            let nearest = (0..skin.len())
                .min_by(|&a, &b| (skin[a] - at).norm_squared().total_cmp(&(skin[b] - at).norm_squared()))?;
            if chart.covers()[nearest] < 1.0 {
                return None;
            }
            let place = Point2::from(chart.places()[nearest].map(f64::from));
            Some((place - face.frame().points()[landmark]).norm())
        })
        .collect();
    errors.sort_unstable_by(f64::total_cmp);
    let [median, most] = [errors[errors.len() / 2], errors[errors.len() * 9 / 10]];
    println!("{} landmarks: median {median:.1} pixels, nine in ten within {most:.1}", errors.len());
    assert!(errors.len() > 250 && median < 8.0 && most < 18.0, "{median:.1}, {most:.1}");
    let behind = skin
        .iter()
        .zip(chart.covers())
        .filter(|(p, cover)| p.z < target.centre_and_eyes().0.z - 90.0 && **cover > 0.0);
    assert_eq!(behind.count(), 0);
}

fn james() -> (Gpu, Target, SharedFace) {
    let Stand { gpu, target, .. } = Stand::new(None).unwrap();
    (gpu, target, face())
}

fn stage(gpu: &Gpu, target: &Target) -> Stage {
    let (level, look) = (Rotation3::identity(), Look::default());
    let mut stage =
        Stage::new(gpu, target, &level, [256; 2], look, HeadMode::Still, Smoothing::Samples4).unwrap();
    let (centre, eyes) = target.centre_and_eyes();
    stage.look_at(centre, 1.15 * eyes, 0.0);
    stage
}

fn worn(
    gpu: &Gpu,
    target: &Target,
    face: &SharedFace,
    volumes: &[TextureVolume],
    states: &AppearanceStates,
) -> RgbaImage {
    let relief = SkinRelief::new(target, face, volumes, GAIN).unwrap();
    let skin = LivingSkin::new(gpu, target, face, volumes, &relief, SkinMode::Ratio, GAIN).unwrap();
    let mut stage = stage(gpu, target).wearing(Some(skin));
    stage.show(states);
    stage.picture(&AvatarFrame::at_rest(&target.anatomy.mesh)).unwrap()
}

fn mean_difference(one: &RgbaImage, other: &RgbaImage) -> f64 {
    assert_eq!(one.dimensions(), other.dimensions());
    let sum: f64 = one.iter().zip(other.iter()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
    sum / one.len() as f64
}

fn decoded(value: u8) -> f32 {
    ((f32::from(value) / 255.0 + 0.055) / 1.055).powf(2.4)
}

fn encoded(light: f32) -> f32 {
    255.0 * (1.055 * light.powf(1.0 / 2.4) - 0.055)
}
