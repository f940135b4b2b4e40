//! A synthetic performer whose wrinkles are painted: learnt from one take, told in others, in known states and poses.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use std::{collections::BTreeMap, f64::consts::PI, sync::Arc};

use image::{Rgba, RgbaImage};
use nalgebra::{Matrix4, Point3, Rotation3, Vector3};
use understudy::{
    appearance::{AppearanceFrame, Area, FRAME_SIZE, FaceFrame, Region, Skin},
    assets::Assets,
    capture::{CaptureError, ClipInfo, Frame, FrameRate, FrameSource, Image, Timestamp},
    head::{Camera, HeadPose},
    lift::{Expression, FaceState, Performer, upright},
    muscle::MuscleBasis,
    pipeline::{
        Motion, MotionFrame, TakeLooks, classify_take, learn_skin, read_canonical_face, read_face_frame,
    },
    scan::{Material, Mesh, Texture, TextureFormat},
    tracking::{LANDMARK_COUNT, LandmarkState, Landmarks},
    view::{Background, Gpu, Lighting, Look, Model, Projection, Renderer, Smoothing, ViewCamera},
};

const SIZE: [u32; 2] = [480, 480];
const RATE: FrameRate = FrameRate { numerator: 25, denominator: 1 };
const LEVELS: usize = 8;
/// Half a metre away: 240 pixels from cheek to cheek.
const DEPTH: f64 = 270.0;

/// The painted performer in some state and pose: `state` in levels of `LEVELS`.
#[derive(Clone, Copy)]
struct Moment {
    state: usize,
    /// Pitch, yaw, roll, degrees.
    turn: [f64; 3],
    lighting: Lighting,
}

struct Painted {
    frame: FaceFrame,
    performer: Performer,
    face: Vec<Point3<f64>>,
    normals: Vec<[f32; 3]>,
    models: Vec<Model>,
    gpu: Gpu,
}

fn pose(turn: [f64; 3]) -> HeadPose {
    let [pitch, yaw, roll] = turn.map(f64::to_radians);
    HeadPose {
        rotation: upright() * Rotation3::from_euler_angles(pitch, yaw, roll),
        translation: Vector3::new(0.0, 0.0, DEPTH),
        reprojection_error: 0.0,
    }
}

/// Skin with pores; lines across the forehead and a fold beside the nose, as deep as the state.
fn skin(frame: &FaceFrame, state: f64) -> RgbaImage {
    let (forehead, fold) = (Area::of(Region::Forehead, frame), Area::of(Region::NasolabialLeft, frame));
    let [width, height] = FRAME_SIZE;
    RgbaImage::from_fn(width as u32, height as u32, |x, y| {
        let place = nalgebra::Point2::new(f64::from(x), f64::from(y));
        let pore = 0.03 * ((f64::from(x) * 0.9).sin() * (f64::from(y) * 1.1).cos());
        let shade = 0.10 * (f64::from(x) * 0.011).sin() + 0.06 * (f64::from(y) * 0.015).cos();
        let up = forehead.inside(&place);
        let lines = if up.x.abs() < 0.8 && (-0.8..0.2).contains(&up.y) {
            (0.5 + 0.5 * (up.y * 3.5 * PI).cos()).powi(3)
        } else {
            0.0
        };
        let beside = fold.inside(&place);
        let crease =
            (-((beside.x + 0.15 * beside.y) / 0.16).powi(2)).exp() * (1.0 - beside.y.powi(2)).max(0.0);
        let light = (0.62 + pore + shade) * (1.0 - state * (0.35 * lines + 0.4 * crease));
        let channel = |share: f64| (255.0 * light * share).clamp(0.0, 255.0) as u8;
        Rgba([channel(1.15), channel(0.95), channel(0.8), 255])
    })
}

impl Painted {
    fn new() -> Self {
        let canonical = Assets::locate().unwrap().verified("canonical_face").unwrap();
        let face = read_canonical_face(&canonical).unwrap();
        let frame = read_face_frame(&canonical).unwrap();
        let camera = Camera::with_field_of_view(SIZE[0] as i32, SIZE[1] as i32, 60.0).unwrap();
        let rest = pose([0.0; 3]);
        let seen = |at: usize| camera.project(&rest.to_camera(&face[at.min(face.len() - 1)]));
        let landmarks = Landmarks {
            points: (0..LANDMARK_COUNT).map(|at| seen(at).push(0.0)).collect(),
            states: vec![LandmarkState::Observed; LANDMARK_COUNT],
            presence: 1.0,
        };
        let performer = Performer::from_average_face(camera, &face, &[&landmarks]).unwrap();
        let triangles: Vec<[u32; 3]> = frame.triangles().iter().map(|t| t.map(u32::from)).collect();
        let mut normals = vec![Vector3::zeros(); face.len()];
        for triangle in &triangles {
            let [a, b, c] = triangle.map(|corner| face[corner as usize]);
            for corner in triangle {
                normals[*corner as usize] += (b - a).cross(&(c - a));
            }
        }
        let normals = normals.iter().map(|n| n.normalize().cast::<f32>().into()).collect();
        let uv = |p: &nalgebra::Point2<f64>| {
            [(p.x + 0.5) / FRAME_SIZE[0] as f64, 1.0 - (p.y + 0.5) / FRAME_SIZE[1] as f64].map(|v| v as f32)
        };
        let gpu = Gpu::headless().unwrap();
        let model = |level: usize| {
            let mut bytes = std::io::Cursor::new(Vec::new());
            let picture = skin(&frame, level as f64 / LEVELS as f64);
            picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
            let texture =
                Texture { name: "skin.png".into(), format: TextureFormat::Png, bytes: bytes.into_inner() };
            let material = Material {
                name: "skin".into(),
                base_colour: [1.0; 4],
                texture: Some(Arc::new(texture)),
                gloss: 0.0,
            };
            let mesh = Mesh {
                positions: face.clone(),
                triangles: triangles.clone(),
                uvs: frame.points().iter().map(uv).collect(),
                uv_triangles: triangles.clone(),
                materials: vec![material],
                ..Mesh::default()
            };
            Model::upload(&gpu, &mesh).unwrap()
        };
        let models = (0..=LEVELS).map(model).collect();
        Self { frame, performer, face, normals, models, gpu }
    }

    fn picture(&self, moment: Moment) -> Image {
        let [width, height] = SIZE;
        let camera = *self.performer.camera();
        let view = ViewCamera {
            eye: Point3::origin(),
            target: Point3::new(0.0, 0.0, -DEPTH),
            up: Vector3::y(),
            projection: Projection::Perspective {
                vertical_fov: 2.0 * (f64::from(height) / 2.0 / camera.focal).atan(),
            },
            near: 10.0,
            far: 1000.0,
            viewport: SIZE,
        };
        let pose = pose(moment.turn);
        let mut place = Matrix4::identity();
        place.fixed_view_mut::<3, 3>(0, 0).copy_from((upright() * pose.rotation).matrix());
        place.fixed_view_mut::<3, 1>(0, 3).copy_from(&(upright() * pose.translation));
        let mut renderer = Renderer::new(&self.gpu, width, height, Smoothing::Samples4).unwrap();
        let look = Look { background: Background::Solid([40, 60, 90]), lighting: moment.lighting };
        let positions: Vec<[f32; 3]> = self.face.iter().map(|p| p.cast::<f32>().into()).collect();
        renderer.draw(&self.models[moment.state], &positions, &self.normals, &place, &view, &look).unwrap();
        let mut out = Vec::new();
        renderer.read(&mut out).unwrap();
        Image::from_rgba(width as usize, height as usize, &out).unwrap()
    }

    /// What tracking would find, were it exact.
    fn motion(&self, moments: &[Moment]) -> Motion {
        let basis = MuscleBasis::arkit().clone();
        let contracted: Vec<usize> =
            ["browInnerUp", "mouthSmileLeft"].iter().map(|name| basis.index(name).unwrap()).collect();
        let frames = (0..).zip(moments).map(|(index, moment)| {
            let mut expression = Expression::neutral(pose(moment.turn));
            expression.contractions = vec![0.0; basis.elements.len()];
            for &muscle in &contracted {
                expression.contractions[muscle] = moment.state as f64 / LEVELS as f64;
            }
            MotionFrame {
                index,
                timestamp: RATE.tick(index),
                expression,
                state: FaceState::Tracking,
                confidence: 1.0,
                marker_error: None,
            }
        });
        Motion {
            info: info(moments.len()),
            performer: self.performer.clone(),
            basis: Some(basis.clone()),
            frames: frames.collect(),
            neutral: (Timestamp(0), RATE.tick(9)),
            objections: Vec::new(),
        }
    }

    fn film(&self, moments: &[Moment]) -> Vec<Image> {
        moments.iter().map(|&moment| self.picture(moment)).collect()
    }

    fn told(&self, skin: &Skin, moments: &[Moment]) -> Vec<AppearanceFrame> {
        let film = Film::of(self.film(moments));
        classify_take(Box::new(film), &self.motion(moments), skin, &self.frame, |_| {}).unwrap()
    }
}

fn info(frames: usize) -> ClipInfo {
    ClipInfo {
        name: "painted".into(),
        width: SIZE[0] as i32,
        height: SIZE[1] as i32,
        rate: RATE,
        announced_frames: Some(frames as u64),
    }
}

struct Film {
    info: ClipInfo,
    pictures: std::iter::Enumerate<std::vec::IntoIter<Image>>,
}

impl Film {
    fn of(pictures: Vec<Image>) -> Self {
        Self { info: info(pictures.len()), pictures: pictures.into_iter().enumerate() }
    }
}

impl FrameSource for Film {
    fn info(&self) -> &ClipInfo {
        &self.info
    }

    fn read(&mut self, frame: &mut Frame) -> Result<bool, CaptureError> {
        let Some((index, image)) = self.pictures.next() else { return Ok(false) };
        *frame = Frame { image, index: index as u64, timestamp: RATE.tick(index as u64) };
        Ok(true)
    }
}

/// Neutral, a slow rise and fall with a rest on top, a head that hardly moves.
fn lesson() -> Vec<Moment> {
    let rise = |at: usize| at.saturating_sub(12).min(84_usize.saturating_sub(at)) / 3;
    let moment = |at: usize| Moment {
        state: rise(at).min(LEVELS),
        turn: [2.0 * (at as f64 * 0.09).sin(), 4.0 * (at as f64 * 0.06).cos(), 0.0],
        lighting: Lighting::Lit,
    };
    (0..96).map(moment).collect()
}

#[test]
fn painted_wrinkles_are_learnt_and_told_in_other_poses() {
    let painted = Painted::new();
    let moments = lesson();
    let film = painted.film(&moments);
    let copy =
        |film: &[Image]| -> Vec<Image> { film.iter().map(|i| Image::from_bgr(i.mat().clone())).collect() };
    let source = Box::new(Film::of(copy(&film)));
    let take = TakeLooks::gather(0, source, painted.motion(&moments), &painted.frame, |_| {}).unwrap();
    let open = |_: usize| Ok(Box::new(Film::of(copy(&film))) as Box<dyn FrameSource>);
    let learnt =
        learn_skin("painted".into(), &[take], &painted.frame, &BTreeMap::new(), open, |_| {}).unwrap();
    let skin = Skin::from_bytes(&learnt.skin.to_bytes().unwrap()).unwrap();
    for region in [Region::Forehead, Region::NasolabialLeft] {
        let learnt = skin.region(region).unwrap();
        assert!(learnt.volume.layers().len() >= 3);
        // The painted lines are in the last layer of the volume.
        let darkest = (0..learnt.volume.patch().pixels())
            .map(|pixel| learnt.volume.layers().last().unwrap().log_ratio(pixel))
            .fold(0.0, f32::min);
        assert!(darkest < -0.05, "{} {darkest}", region.name());
    }
    // A blink was not performed, and no muscle of the glabella contracted.
    assert!(skin.region(Region::EyeLeft).is_none() && skin.region(Region::Glabella).is_none());
    let said: Vec<String> = learnt.missing.iter().map(ToString::to_string).collect();
    assert!(said.iter().any(|line| line.contains("frown")) && said.iter().any(|line| line.contains("close")));

    let turns = [[0.0, 0.0, 0.0], [0.0, -20.0, 0.0], [0.0, 20.0, 0.0], [-10.0, 0.0, 8.0], [12.0, 10.0, -8.0]];
    for turn in turns {
        for region in [Region::Forehead, Region::NasolabialLeft] {
            let mut states = Vec::new();
            for state in (0..=LEVELS).step_by(2) {
                // Three alike, so that the median has settled.
                let told = painted.told(&skin, &[Moment { state, turn, lighting: Lighting::Lit }; 3]);
                states.push(told[2].states.get(region).unwrap_or(-1.0));
            }
            println!("{} {turn:?}: {states:.2?}", region.name());
            for (at, state) in states.iter().enumerate() {
                let wanted = at as f32 / 4.0;
                assert!((state - wanted).abs() < 0.3, "{} {turn:?}: {states:?}", region.name());
            }
            assert!(states[0] < 0.1 && states[4] > 0.9, "{} {turn:?}: {states:?}", region.name());
        }
    }
}

#[test]
fn regions_that_cannot_be_seen_are_absent() {
    let painted = Painted::new();
    let moments = lesson();
    let take = || Box::new(Film::of(painted.film(&moments)));
    let looks = TakeLooks::gather(0, take(), painted.motion(&moments), &painted.frame, |_| {}).unwrap();
    let open = |_: usize| Ok(take() as Box<dyn FrameSource>);
    let skin =
        learn_skin("painted".into(), &[looks], &painted.frame, &BTreeMap::new(), open, |_| {}).unwrap().skin;
    let straight = Moment { state: 4, turn: [0.0; 3], lighting: Lighting::Lit };
    let away = painted.told(&skin, &[Moment { turn: [0.0, -75.0, 0.0], ..straight }]);
    let aside = painted.told(&skin, &[Moment { turn: [0.0, 75.0, 0.0], ..straight }]);
    // The left fold is hidden in one of the two.
    let seen = [&away[0], &aside[0]].map(|frame| frame.states.get(Region::NasolabialLeft).is_some());
    assert!(!(seen[0] && seen[1]), "{seen:?}");
    // A board before the face.
    let mut picture = painted.picture(straight).to_rgba().unwrap();
    for (at, pixel) in picture.chunks_exact_mut(4).enumerate() {
        let stripe = if (at % 480) / 20 % 2 == 0 { 220 } else { 20 };
        pixel.copy_from_slice(&[stripe, stripe, stripe, 255]);
    }
    let film = Film::of(vec![Image::from_rgba(480, 480, &picture).unwrap()]);
    let hidden =
        classify_take(Box::new(film), &painted.motion(&[straight]), &skin, &painted.frame, |_| {}).unwrap();
    assert!(hidden[0].states.iter().all(|(_, state)| state.is_none()), "{:?}", hidden[0].states);
    // A clip that is shorter the second time.
    let none = classify_take(
        Box::new(Film::of(Vec::new())),
        &painted.motion(&[straight]),
        &skin,
        &painted.frame,
        |_| {},
    );
    assert!(none.unwrap()[0].states.iter().all(|(_, state)| state.is_none()));
}
