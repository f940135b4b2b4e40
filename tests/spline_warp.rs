//! The warp's matrix against the spline it stands for, at the sizes it is used at.

use nalgebra::{Point3, Vector3};
use understudy::spline::{Factored, Input, Kernel, Options, Polynomial, SplineError, Warp};

const ALL: [Kernel; 4] = [Kernel::Linear, Kernel::ThinPlate, Kernel::Cubic, Kernel::Hardy];

/// `n` points on the front half of a face-sized ellipsoid, in millimetres, spread by the golden angle.
fn face(n: usize) -> Vec<Point3<f64>> {
    let point = |i: usize| {
        let depth = (i as f64 + 0.5) / n as f64;
        let (ring, turn) = ((1.0 - depth * depth).sqrt(), i as f64 * 2.399_963_229_728_653);
        Point3::new(75.0 * ring * turn.cos(), 110.0 * ring * turn.sin() + 40.0, 60.0 * depth)
    };
    (0..n).map(point).collect()
}

fn smile(p: &Point3<f64>) -> Vector3<f64> {
    Vector3::new(
        5.0 * (p.x / 30.0).sin(),
        6.0 * (p.y / 40.0 + p.z / 30.0).cos(),
        3.0 * (p.x * p.y / 3000.0).sin(),
    )
}

#[test]
fn a_warp_agrees_with_its_spline_to_a_ten_thousandth_of_a_millimetre() {
    let (centres, points) = (face(110), face(5000));
    let (anchors, controls) = centres.split_at(20);
    let values: Vec<_> = controls.iter().map(smile).collect();
    let q: Vec<[f32; 3]> = values.iter().map(|v| v.cast::<f32>().into()).collect();
    for kernel in ALL {
        let warp = Warp::new(kernel, controls, anchors, &points, Options::default()).unwrap();
        assert_eq!((warp.vertices(), warp.controls()), (5000, 90));
        let order = [controls, anchors].concat();
        let held = values.iter().copied().chain(anchors.iter().map(|_| Vector3::zeros()));
        let factored = Factored::new(kernel, &order, Options::default()).unwrap();
        let spline = factored.solve(&held.collect::<Vec<_>>()).unwrap();
        let mut out = vec![[f32::NAN; 3]; points.len()];
        warp.apply(&q, &mut out).unwrap();
        let error = |(x, out): (&Point3<f64>, &[f32; 3])| {
            (spline.evaluate(x) - Vector3::from(*out).cast::<f64>()).norm()
        };
        let worst = points.iter().zip(&out).map(error).fold(0.0, f64::max);
        println!("{kernel}: {worst:.1e} mm");
        assert!(worst < 1e-4, "{kernel}: {worst:e} mm");
    }
}

#[test]
fn no_displacement_is_exactly_none_and_what_stood_there_is_overwritten() {
    let controls = face(40);
    let warp = Warp::new(Kernel::ThinPlate, &controls, &[], &face(1500), Options::default()).unwrap();
    let mut out = vec![[7.0; 3]; 1500];
    warp.apply(&[[0.0; 3]; 40], &mut out).unwrap();
    assert!(out.iter().flatten().all(|c| c.to_bits() == 0));
}

#[test]
fn controls_follow_their_displacement_and_anchors_stay() {
    let centres = face(60);
    let (anchors, controls) = centres.split_at(15);
    let warp = Warp::new(Kernel::Linear, controls, anchors, &centres, Options::default()).unwrap();
    let q: Vec<[f32; 3]> = controls.iter().map(|p| smile(p).cast::<f32>().into()).collect();
    let mut out = vec![[0.0; 3]; 60];
    warp.apply(&q, &mut out).unwrap();
    let wanted = anchors.iter().map(|_| [0.0; 3]).chain(q);
    for (found, wanted) in out.iter().zip(wanted) {
        assert!((Vector3::from(*found) - Vector3::from(wanted)).norm() < 1e-5);
    }
}

/// Shares of all centres sum to 1 (a common motion is affine), so without anchors everything moves together.
#[test]
fn a_common_motion_moves_everything_alike() {
    let warp = Warp::new(Kernel::Hardy, &face(50), &[], &face(700), Options::default()).unwrap();
    let mut out = vec![[0.0; 3]; 700];
    warp.apply(&[[1.0, -2.0, 3.0]; 50], &mut out).unwrap();
    for found in out {
        assert!((Vector3::from(found) - Vector3::new(1.0, -2.0, 3.0)).norm() < 1e-5);
    }
}

/// Every remainder of the block and of the unrolling, against the plain sum in the same order: equal to the bit.
#[test]
fn blocks_and_their_remainders_sum_in_order() {
    for vertices in [0, 1, 7, 1023, 1024, 1025, 2100] {
        for controls in [0, 1, 3, 4, 5, 9] {
            let share = |j: usize, v: usize| ((j * 37 + v * 101) % 1013) as f32 / 977.0 - 0.5;
            let warp = Warp::from_columns(vertices, controls, |j, column| {
                column.iter_mut().enumerate().for_each(|(v, entry)| *entry = share(j, v));
            })
            .unwrap();
            let q: Vec<[f32; 3]> =
                (0..controls).map(|j| [0.3, -0.7, 1.1].map(|k| k * (j as f32 + 0.1))).collect();
            let mut out = vec![[9.0; 3]; vertices];
            warp.apply(&q, &mut out).unwrap();
            for (v, found) in out.iter().enumerate() {
                for axis in 0..3 {
                    let wanted = (0..controls).fold(0.0_f32, |sum, j| sum + share(j, v) * q[j][axis]);
                    assert_eq!(
                        found[axis].to_bits(),
                        wanted.to_bits(),
                        "{vertices} x {controls}, vertex {v}"
                    );
                }
            }
        }
    }
}

#[test]
fn gram_is_the_mean_product_of_columns() {
    let warp = Warp::new(Kernel::Linear, &face(12), &[], &face(333), Options::default()).unwrap();
    let gram = warp.gram();
    assert_eq!(gram.shape(), (12, 12));
    for (i, j) in [(0, 0), (3, 8), (8, 3), (11, 11)] {
        let products = warp.column(i).iter().zip(warp.column(j)).map(|(a, b)| f64::from(*a) * f64::from(*b));
        assert!((gram[(i, j)] - products.sum::<f64>() / 333.0).abs() < 1e-12);
    }
    assert!(gram.symmetric_eigenvalues().iter().all(|e| *e > -1e-12));
}

#[test]
fn refusals_name_the_list() {
    let controls = face(10);
    let build = |controls: &[_], anchors: &[_], points: &[_]| {
        Warp::new(Kernel::Linear, controls, anchors, points, Options::default()).map(|_| ())
    };
    let hole = [controls[0], Point3::new(0.0, f64::NAN, 0.0)];
    let found = build(&controls, &[], &hole);
    assert_eq!(found, Err(SplineError::NotFinite { input: Input::Point, index: 1 }));
    // Counted through the controls and on into the anchors.
    let found = build(&controls, &[Point3::new(0.0, 0.0, -9.0), controls[3]], &controls);
    assert_eq!(found, Err(SplineError::Coincident { first: 3, second: 11, distance: 0.0 }));
    let polynomial = Polynomial::Affine;
    let found = build(&controls[..2], &controls[8..9], &controls);
    assert_eq!(found, Err(SplineError::TooFewCentres { polynomial, wanted: 4, found: 3 }));

    let warp = Warp::new(Kernel::Linear, &controls, &[], &face(5), Options::default()).unwrap();
    let mut out = [[4.0; 3]; 5];
    let found = warp.apply(&[[1.0; 3]; 9], &mut out);
    assert_eq!(found, Err(SplineError::Count { input: Input::Displacement, wanted: 10, found: 9 }));
    let found = warp.apply(&[[1.0; 3]; 10], &mut out[..4]);
    assert_eq!(found, Err(SplineError::Count { input: Input::Output, wanted: 5, found: 4 }));
    assert!(out.iter().flatten().all(|c| *c > 3.9));
    assert!(warp.column(10).is_empty());

    let far = build(&controls, &[], &[controls[0], Point3::new(0.0, 0.0, 1e200)]);
    assert_eq!(far, Err(SplineError::NotFinite { input: Input::Entry, index: 1 }));
    let found = Warp::from_columns(3, 2, |j, column| column[2] = if j == 1 { f32::NAN } else { 0.0 });
    assert_eq!(found, Err(SplineError::NotFinite { input: Input::Entry, index: 5 }));
}
