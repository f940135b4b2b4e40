//! Sampling and classifying all regions of a frame: `cargo bench --bench appearance`. One thread.

#![allow(clippy::unwrap_used, reason = "a benchmark without its assets has nothing to measure")]

use divan::{Bencher, bench, black_box};
use nalgebra::{Rotation3, Vector3};
use understudy::{
    appearance::{
        Classifier, Exemplar, FaceFrame, Layer, Patch, Picture, Region, RegionSkin, Sampler, Samples, Skin,
        TextureVolume, haar,
    },
    assets::Assets,
    head::{Camera, HeadPose},
    lift::{Expression, Performer, upright},
    pipeline::{read_canonical_face, read_face_frame},
    tracking::{LANDMARK_COUNT, LandmarkState, Landmarks},
};

const SIZE: [usize; 2] = [640, 360];

fn main() {
    divan::main();
}

/// The average face before a camera, 200 pixels wide.
struct Scene {
    frame: FaceFrame,
    performer: Performer,
    shown: Expression,
    bytes: Vec<u8>,
}

impl Scene {
    fn new() -> Self {
        let canonical = Assets::locate().unwrap().verified("canonical_face").unwrap();
        let face = read_canonical_face(&canonical).unwrap();
        let camera = Camera::with_field_of_view(SIZE[0] as i32, SIZE[1] as i32, 60.0).unwrap();
        let pose = HeadPose {
            rotation: upright() * Rotation3::from_euler_angles(0.05, 0.1, 0.02),
            translation: Vector3::new(0.0, 0.0, 430.0),
            reprojection_error: 0.0,
        };
        let seen = |at: usize| camera.project(&pose.to_camera(&face[at.min(face.len() - 1)]));
        let landmarks = Landmarks {
            points: (0..LANDMARK_COUNT).map(|at| seen(at).push(0.0)).collect(),
            states: vec![LandmarkState::Observed; LANDMARK_COUNT],
            presence: 1.0,
        };
        let performer = Performer::from_average_face(camera, &face, &[&landmarks]).unwrap();
        let shown = Expression::neutral(*performer.rest());
        let pixel = |at: usize| (100.0 + 80.0 * (at as f64 * 0.013).sin()) as u8;
        let bytes = (0..SIZE[0] * SIZE[1] * 3).map(pixel).collect();
        Self { frame: read_face_frame(&canonical).unwrap(), performer, shown, bytes }
    }

    fn picture(&self) -> Picture<'_> {
        Picture::new(&self.bytes, SIZE[0], SIZE[1]).unwrap()
    }

    fn samples(&self, sampler: &Sampler) -> Samples {
        sampler.sample(self.picture(), &self.performer, &self.shown, false)
    }
}

/// All regions with five templates each.
fn skin() -> Skin {
    let region = |region: Region| {
        let look = |layer: usize| -> haar::Grid {
            std::array::from_fn(|at| ((at * (region.index() + 3)) as f32).sin() + layer as f32 * 0.1)
        };
        let patch = Patch { origin: [0, 0], size: [1, 1] };
        let layers = (0..5).map(|_| Layer::new(&[0.0], vec![[0; 3]])).collect();
        RegionSkin {
            classifier: Classifier::new(&[0, 1, 2, 3, 4].map(look), 1e6).unwrap(),
            volume: TextureVolume::new(region, patch, layers).unwrap(),
            exemplars: vec![Exemplar { take: 0, frames: Vec::new() }; 5],
        }
    };
    Skin::new("bench".into(), vec!["bench".into()], Region::ALL.map(region).to_vec()).unwrap()
}

#[bench(sample_count = 500, sample_size = 1)]
fn sample(bencher: Bencher<'_, '_>) {
    let scene = Scene::new();
    let sampler = Sampler::new(&scene.frame, &scene.performer).unwrap();
    bencher.bench_local(|| black_box(scene.samples(&sampler)));
}

#[bench(sample_count = 500, sample_size = 1)]
fn classify(bencher: Bencher<'_, '_>) {
    let scene = Scene::new();
    let samples = scene.samples(&Sampler::new(&scene.frame, &scene.performer).unwrap());
    let skin = skin();
    bencher.bench_local(|| black_box(skin.classify(black_box(&samples))));
}
