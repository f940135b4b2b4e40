//! Fitting, building and applying a warp, on one thread: `cargo bench --bench spline`.

use divan::{Bencher, black_box};
use nalgebra::{Point3, Vector3};
use understudy::spline::{Factored, Kernel, Options, Spline, Warp};

const KERNELS: [Kernel; 4] = [Kernel::Linear, Kernel::ThinPlate, Kernel::Cubic, Kernel::Hardy];

/// Vertices and controls: a scan with the thesis's controls, and a lighter mesh with a denser rig.
const SIZES: [(usize, usize); 2] = [(35_000, 110), (6_393, 500)];

fn main() {
    divan::main();
}

/// `n` points on the front half of a face-sized ellipsoid, in millimetres, spread by the golden angle.
fn face(n: usize) -> Vec<Point3<f64>> {
    let point = |i: usize| {
        let depth = (i as f64 + 0.5) / n as f64;
        let (ring, turn) = ((1.0 - depth * depth).sqrt(), i as f64 * 2.399_963_229_728_653);
        Point3::new(75.0 * ring * turn.cos(), 110.0 * ring * turn.sin() + 40.0, 60.0 * depth)
    };
    (0..n).map(point).collect()
}

fn motion(n: usize) -> Vec<Vector3<f64>> {
    (0..n).map(|i| Vector3::new((i as f64).sin(), (2.0 * i as f64).cos(), 0.5)).collect()
}

#[divan::bench(args = [110, 500], consts = [0, 1, 2, 3], sample_count = 20)]
fn fit<const KERNEL: usize>(bencher: Bencher, controls: usize) {
    let (centres, values) = (face(controls), motion(controls));
    bencher.bench_local(|| Spline::fit(KERNELS[KERNEL], black_box(&centres), &values, Options::default()));
}

#[divan::bench(args = [110, 500], sample_count = 50)]
fn solve_again(bencher: Bencher, controls: usize) {
    let factored = Factored::new(Kernel::Linear, &face(controls), Options::default());
    let values = motion(controls);
    bencher.bench_local(|| factored.as_ref().map(|f| f.solve(black_box(&values))));
}

#[divan::bench(args = SIZES, consts = [0, 1], sample_count = 5)]
fn warp_build<const KERNEL: usize>(bencher: Bencher, (vertices, controls): (usize, usize)) {
    let (controls, points) = (face(controls), face(vertices));
    bencher
        .bench_local(|| Warp::new(KERNELS[KERNEL], black_box(&controls), &[], &points, Options::default()));
}

#[divan::bench(args = SIZES, sample_count = 400)]
fn warp_apply(bencher: Bencher, (vertices, controls): (usize, usize)) {
    let share = |j: usize, v: usize| ((j * 37 + v * 101) % 1013) as f32 / 1013.0;
    let warp = Warp::from_columns(vertices, controls, |j, column| {
        column.iter_mut().enumerate().for_each(|(v, entry)| *entry = share(j, v));
    });
    let q: Vec<[f32; 3]> = (0..controls).map(|j| [j as f32 * 0.1, 1.0, -0.5]).collect();
    let mut out = vec![[0.0_f32; 3]; vertices];
    bencher.bench_local(|| warp.as_ref().map(|w| w.apply(black_box(&q), black_box(&mut out))));
}
