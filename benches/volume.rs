//! Volume morphing on james: `cargo bench --bench volume`. One thread.
//!
//! A frame as the program does it, one product with the vertex × control matrix, and as 002 §IV does it: a substitution
//! into the factored system, then the sum over the centres at every vertex.

#![allow(clippy::unwrap_used, reason = "a benchmark without its assets has nothing to measure")]

#[path = "../examples/shared/stand.rs"]
mod stand;

use std::sync::LazyLock;

use divan::{Bencher, bench, black_box};
use nalgebra::{Point3, Rotation3, Vector3};
use stand::Stand;
use understudy::{
    anatomy::Anatomy,
    pipeline::Target,
    rig::{Puppet, TargetFace, VolumeMorph, VolumePoints, WarpKind},
    scan::Surface,
    spline::Factored,
};

const POINTS: [usize; 3] = [18, 68, 468];

struct James {
    anatomy: Anatomy,
    surface: Surface,
    face: TargetFace,
}

static JAMES: LazyLock<James> = LazyLock::new(|| {
    let Target { anatomy, surface, landmarks, .. } = Stand::new(None).unwrap().target;
    let face = TargetFace::new(landmarks, Rotation3::identity()).unwrap();
    James { anatomy, surface, face }
});

fn morph(points: usize) -> VolumeMorph {
    let points = match points {
        18 => VolumePoints::Tracked,
        68 => VolumePoints::Ibug,
        _ => VolumePoints::All,
    };
    VolumeMorph { points, ..VolumeMorph::default() }
}

fn puppet(points: usize) -> Puppet {
    let warp = WarpKind::Volume(morph(points));
    Puppet::new(&JAMES.face, &JAMES.anatomy, &JAMES.surface, &|_| None, &[], warp).unwrap()
}

fn centres(puppet: &Puppet) -> Vec<Point3<f64>> {
    [puppet.controls().rest.as_slice(), &puppet.controls().anchors].concat()
}

fn main() {
    // Cargo's test of benchmarks runs each once and wants no report.
    if !std::env::args().any(|argument| argument == "--test" || argument == "--list") {
        for points in POINTS {
            let puppet = puppet(points);
            let warp = puppet.warp();
            println!(
                "{points}: {} centres, {} vertices × {} columns with those of jaw and lids",
                centres(&puppet).len(),
                warp.vertices(),
                warp.controls()
            );
        }
    }
    divan::main();
}

#[bench(args = POINTS, sample_count = 5, sample_size = 1)]
fn build(bencher: Bencher<'_, '_>, points: usize) {
    LazyLock::force(&JAMES);
    bencher.bench_local(|| puppet(black_box(points)));
}

#[bench(args = POINTS, sample_count = 300)]
fn frame(bencher: Bencher<'_, '_>, points: usize) {
    let puppet = puppet(points);
    let mut frame = puppet.new_frame();
    for (j, control) in frame.controls.iter_mut().take(puppet.controls().rest.len()).enumerate() {
        *control = [(j as f32).sin(), 2.0, 0.5];
    }
    bencher.bench_local(|| puppet.place(black_box(&mut frame)).unwrap());
}

#[bench(args = POINTS, sample_count = 20)]
fn frame_as_published(bencher: Bencher<'_, '_>, points: usize) {
    let puppet = puppet(points);
    let centres = centres(&puppet);
    let morph = morph(points);
    let factored = Factored::new(morph.kernel, &centres, morph.options()).unwrap();
    let values: Vec<_> = (0..centres.len()).map(|j| Vector3::new((j as f64).sin(), 2.0, 0.5)).collect();
    let places: Vec<Point3<f64>> = puppet.rest().iter().map(|p| Point3::from(p.map(f64::from))).collect();
    let places = &places[..puppet.warp().vertices()];
    bencher.bench_local(|| {
        let spline = factored.solve(black_box(&values)).unwrap();
        places.iter().map(|place| spline.evaluate(place)).sum::<Vector3<f64>>()
    });
}
