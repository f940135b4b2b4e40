//! What must hold for any scattered centres.

use nalgebra::{Point2, Point3, Vector3};
use proptest::prelude::*;
use understudy::spline::{Kernel, Options, Regularisation, Spline, SplineError, Warp};

fn kernels() -> impl Strategy<Value = Kernel> {
    prop_oneof![
        Just(Kernel::Linear),
        Just(Kernel::ThinPlate),
        Just(Kernel::Cubic),
        Just(Kernel::Hardy),
        Just(Kernel::Gaussian)
    ]
}

fn vectors(limit: f64, count: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Vector3<f64>>> {
    let coordinate = -limit..limit;
    let vector =
        (coordinate.clone(), coordinate.clone(), coordinate).prop_map(|(x, y, z)| Vector3::new(x, y, z));
    proptest::collection::vec(vector, count)
}

/// Centres in a box of 200, no two closer than 0.5, and a value for each.
fn fits() -> impl Strategy<Value = (Vec<Point3<f64>>, Vec<Vector3<f64>>)> {
    vectors(100.0, 8..40).prop_flat_map(|mut centres| {
        let mut kept: Vec<Vector3<f64>> = Vec::new();
        for c in centres.drain(..) {
            if kept.iter().all(|k| (k - c).norm() > 0.5) {
                kept.push(c);
            }
        }
        let n = kept.len();
        let points: Vec<_> = kept.into_iter().map(Point3::from).collect();
        (Just(points), vectors(10.0, n..n + 1))
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn values_are_met((centres, values) in fits(), kernel in kernels()) {
        let spline = Spline::fit(kernel, &centres, &values, Options::default()).unwrap();
        for (p, v) in centres.iter().zip(&values) {
            prop_assert!((spline.evaluate(p) - v).norm() < 1e-9 * 200.0);
        }
    }

    #[test]
    fn bending_is_never_negative((centres, values) in fits(), kernel in kernels(), lambda in 0.0..1.0) {
        let options = Options { regularisation: Regularisation::UnitBox(lambda), ..Options::default() };
        let spline = Spline::fit(kernel, &centres, &values, options).unwrap();
        prop_assert!(spline.bending_energy() > -1e-9);
    }

    #[test]
    fn a_spline_is_linear_in_its_values((centres, values) in fits(), kernel in kernels(), k in -3.0..3.0) {
        let scaled: Vec<_> = values.iter().map(|v| v * k).collect();
        let one = Spline::fit(kernel, &centres, &values, Options::default()).unwrap();
        let many = Spline::fit(kernel, &centres, &scaled, Options::default()).unwrap();
        let x = Point3::new(12.0, -30.0, 7.0);
        let (one, many): (Vector3<f64>, Vector3<f64>) = (one.evaluate(&x) * k, many.evaluate(&x));
        prop_assert!((one - many).norm() < 1e-9 * (1.0 + one.norm()));
    }

    #[test]
    fn a_warp_is_its_spline((centres, values) in fits(), kernel in kernels(), held in 0_usize..4) {
        let (controls, anchors) = centres.split_at(centres.len() - held);
        let mut values = values;
        values[controls.len()..].fill(Vector3::zeros());
        let points = [Point3::new(12.0, -30.0, 7.0), Point3::new(-50.0, 8.0, 60.0), centres[0]];
        let warp = Warp::new(kernel, controls, anchors, &points, Options::default()).unwrap();
        let spline = Spline::fit(kernel, &centres, &values, Options::default()).unwrap();
        let q: Vec<_> = values[..controls.len()].iter().map(|v| v.cast::<f32>().into()).collect();
        let mut out = [[f32::NAN; 3]; 3];
        warp.apply(&q, &mut out).unwrap();
        for (v, (x, out)) in points.iter().zip(out).enumerate() {
            // f32 rounds each of the n products once or twice; what they sum to in size bounds the error.
            let size: f32 = (0..warp.controls()).map(|j| warp.column(j)[v].abs() * 20.0).sum();
            let allowed = f64::from(size * f32::EPSILON) * 8.0;
            prop_assert!((spline.evaluate(x) - Vector3::from(out).cast()).norm() <= allowed);
        }
    }

    #[test]
    fn anything_at_all_is_answered(
        numbers in proptest::collection::vec((any::<f64>(), any::<f64>()), 0..8),
        kernel in kernels(),
    ) {
        let centres: Vec<_> = numbers.iter().map(|(x, y)| Point2::new(*x, *y)).collect();
        let values = vec![nalgebra::Vector2::x(); centres.len()];
        let fitted: Result<Spline<2>, SplineError> = Spline::fit(kernel, &centres, &values, Options::default());
        if let Err(error) = fitted {
            prop_assert!(!error.to_string().is_empty());
        }
    }
}
