//! Fitting against closed forms and finite differences, and every way it can refuse.

use approx::assert_relative_eq;
use nalgebra::{
    DMatrix, Matrix2, Matrix3, Point, Point2, Point3, Rotation3, SMatrix, SVector, Vector2, Vector3,
};
use understudy::spline::{
    Factored, Flatness, Input, Kernel, Options, Polynomial, Regularisation, Spline, SplineError,
};

const ALL: [Kernel; 5] = [Kernel::Linear, Kernel::ThinPlate, Kernel::Cubic, Kernel::Hardy, Kernel::Gaussian];

/// n points scattered evenly over a face-sized box in millimetres, off the origin: the R3 sequence.
fn scattered(n: usize) -> Vec<Point3<f64>> {
    let step = [0.819_172_513_396_164_5, 0.671_043_606_703_789_3, 0.549_700_477_901_970_3];
    let at = |i: usize, axis: usize| (i as f64 * step[axis]).fract();
    (1..=n).map(|i| Point3::new(150.0 * at(i, 0), 200.0 * at(i, 1) + 90.0, 80.0 * at(i, 2) - 400.0)).collect()
}

/// A smooth motion of a few millimetres.
fn smile(points: &[Point3<f64>]) -> Vec<Vector3<f64>> {
    let motion = |p: &Point3<f64>| {
        Vector3::new(
            5.0 * (p.x / 40.0).sin(),
            4.0 * (p.y / 50.0 + p.z / 30.0).cos(),
            (p.x * p.y / 4000.0).sin(),
        )
    };
    points.iter().map(motion).collect()
}

fn regularised(regularisation: Regularisation) -> Options {
    Options { regularisation, ..Options::default() }
}

fn residual<const D: usize>(
    spline: &Spline<D>,
    centres: &[Point<f64, D>],
    values: &[SVector<f64, D>],
) -> f64 {
    centres.iter().zip(values).map(|(p, v)| (spline.evaluate(p) - v).norm_squared()).sum::<f64>().sqrt()
}

#[test]
fn affine_maps_come_out_exactly() {
    let m = Matrix3::new(1.1, 0.2, -0.1, 0.05, 0.9, 0.3, -0.2, 0.1, 1.3);
    let t = Vector3::new(3.0, -7.0, 11.0);
    let centres = scattered(40);
    let values: Vec<_> = centres.iter().map(|p| m * p.coords + t).collect();
    for kernel in ALL {
        // An affine map does not bend, so regularisation leaves it alone.
        for regularisation in [Regularisation::None, Regularisation::UnitBox(10.0)] {
            let spline = Spline::fit(kernel, &centres, &values, regularised(regularisation)).unwrap();
            for x in scattered(60).iter().map(|p| p + Vector3::new(31.0, -17.0, 5.0)) {
                assert_relative_eq!(spline.evaluate(&x), m * x.coords + t, epsilon = 1e-8);
                assert_relative_eq!(spline.jacobian(&x), m, epsilon = 1e-9);
            }
            assert!(spline.bending_energy().abs() < 1e-6, "{kernel}: {}", spline.bending_energy());
        }
    }
}

#[test]
fn values_are_met_to_a_billionth_of_the_box() {
    let centres = scattered(200);
    let values: Vec<_> = centres.iter().zip(smile(&centres)).map(|(p, d)| p.coords + d).collect();
    for kernel in ALL {
        let spline = Spline::fit(kernel, &centres, &values, Options::default()).unwrap();
        for (p, v) in centres.iter().zip(&values) {
            assert!((spline.evaluate(p) - v).norm() < 1e-9 * 200.0, "{kernel}");
        }
    }
}

#[test]
fn jacobians_match_finite_differences() {
    fn check<const D: usize>(spline: &Spline<D>, x: &Point<f64, D>) {
        let h = 1e-4;
        let mut numeric = SMatrix::<f64, D, D>::zeros();
        for axis in 0..D {
            let step = SVector::<f64, D>::from_fn(|row, _| if row == axis { h } else { 0.0 });
            let slope = (spline.evaluate(&(x + step)) - spline.evaluate(&(x - step))) / (2.0 * h);
            numeric.set_column(axis, &slope);
        }
        assert_relative_eq!(spline.jacobian(x), numeric, epsilon = 1e-7);
    }
    let centres = scattered(30);
    let flat: Vec<Point2<f64>> = centres.iter().map(nalgebra::Point3::xy).collect();
    let values = smile(&centres);
    let flat_values: Vec<Vector2<f64>> = values.iter().map(nalgebra::Vector3::xy).collect();
    for kernel in ALL {
        let spatial = Spline::fit(kernel, &centres, &values, Options::default()).unwrap();
        let planar = Spline::fit(kernel, &flat, &flat_values, Options::default()).unwrap();
        for x in &scattered(50)[30..] {
            check(&spatial, x);
            check(&planar, &x.xy());
        }
    }
}

/// The square of 000 fig. 4-4 (Bookstein's own example): four corners lifted by turns are w·(+1, −1, −1, +1).
/// The affine part vanishes by symmetry, and w·(U(0) − 2U(1) + U(√2)) = 1 at a corner.
#[test]
fn the_saddle_on_a_square_has_its_closed_form() {
    let corners =
        [Point2::new(0.0, 0.0), Point2::new(1.0, 0.0), Point2::new(0.0, 1.0), Point2::new(1.0, 1.0)];
    let values = [1.0, -1.0, -1.0, 1.0].map(|lift| Vector2::new(lift, 0.0));
    for kernel in ALL {
        // Every corner's nearest neighbour is one side away, so Hardy's s is 1.
        let u = |r_squared: f64| kernel.value(r_squared, 1.0);
        let w = 1.0 / (u(0.0) - 2.0 * u(1.0) + u(2.0));
        let x = Point2::new(0.3, 0.15);
        let closed =
            w * corners.iter().zip(&values).map(|(p, v)| v.x * u((x - p).norm_squared())).sum::<f64>();
        let spline = Spline::fit(kernel, &corners, &values, Options::default()).unwrap();
        assert_relative_eq!(spline.evaluate(&x).x, closed, epsilon = 1e-12);
        // Antisymmetric about the middle lines: nothing moves on them.
        assert!(spline.evaluate(&Point2::new(0.5, 0.8)).norm() < 1e-12);
    }
}

/// Two centres, a constant and U = r: the spline runs straight from one value to the other and is level beyond.
#[test]
fn two_centres_with_a_constant_give_a_ramp() {
    let centres = [Point3::new(-2.0, 1.0, 0.0), Point3::new(4.0, 1.0, 0.0)];
    let values = [Vector3::new(1.0, 0.0, 0.0), Vector3::new(3.0, 0.0, 6.0)];
    let options = Options { polynomial: Polynomial::Constant, ..Options::default() };
    let spline = Spline::fit(Kernel::Linear, &centres, &values, options).unwrap();
    for (t, x) in [(0.0, -2.0), (0.25, -0.5), (1.0, 4.0), (1.0, 50.0), (0.0, -9.0)] {
        let expected = values[0] + (values[1] - values[0]) * t;
        assert_relative_eq!(spline.evaluate(&Point3::new(x, 1.0, 0.0)), expected, epsilon = 1e-12);
    }
}

/// 002 eq. 4 as printed: c = H⁻¹x without polynomial, solved by hand for two points.
#[test]
fn hardy_without_polynomial_is_fidaleos_equation_four() {
    let centres = [Point3::new(0.0, 0.0, 0.0), Point3::new(0.0, 5.0, 0.0)];
    let values = [Vector3::new(1.0, 2.0, 0.0), Vector3::new(-1.0, 2.0, 4.0)];
    let options = Options { polynomial: Polynomial::None, ..Options::default() };
    let spline = Spline::fit(Kernel::Hardy, &centres, &values, options).unwrap();
    let (near, far) = (5.0, 50.0_f64.sqrt());
    let det = near * near - far * far;
    let c = [(values[0] * near - values[1] * far) / det, (values[1] * near - values[0] * far) / det];
    let x = Point3::new(3.0, 1.0, -2.0);
    let h = |i: usize| ((x - centres[i]).norm_squared() + 25.0_f64).sqrt();
    assert_relative_eq!(spline.evaluate(&x), c[0] * h(0) + c[1] * h(1), epsilon = 1e-12);
}

/// The conversion of λ, against the system of 000 eq. 4.13 written out in millimetres.
#[test]
fn absolute_lambda_is_the_one_in_the_original_unit() {
    let centres = scattered(25);
    let values = smile(&centres);
    let n = centres.len();
    for (kernel, lambda) in [
        (Kernel::Linear, 20.0),
        (Kernel::ThinPlate, 0.4 * 90.0 * 90.0),
        (Kernel::Cubic, 1e6),
        (Kernel::Hardy, 20.0),
    ] {
        let nearest = |j: usize| {
            let others = centres.iter().enumerate().filter(|(i, _)| *i != j);
            others.map(|(_, p)| (p - centres[j]).norm_squared()).fold(f64::INFINITY, f64::min)
        };
        let u = |x: &Point3<f64>, j: usize| kernel.value((x - centres[j]).norm_squared(), nearest(j));
        let mut l = DMatrix::zeros(n + 4, n + 4);
        for i in 0..n {
            for j in 0..n {
                l[(i, j)] = u(&centres[i], j);
            }
            l[(i, i)] += kernel.definiteness() * lambda;
            for (k, term) in [1.0, centres[i].x, centres[i].y, centres[i].z].into_iter().enumerate() {
                l[(i, n + k)] = term;
                l[(n + k, i)] = term;
            }
        }
        let y = DMatrix::from_fn(n + 4, 3, |i, axis| values.get(i).map_or(0.0, |v| v[axis]));
        let c = l.lu().solve(&y).unwrap();
        let spline =
            Spline::fit(kernel, &centres, &values, regularised(Regularisation::Absolute(lambda))).unwrap();
        for x in &scattered(40)[25..] {
            let mut direct = c.row(n) + c.row(n + 1) * x.x + c.row(n + 2) * x.y + c.row(n + 3) * x.z;
            for j in 0..n {
                direct += c.row(j) * u(x, j);
            }
            assert_relative_eq!(
                spline.evaluate(x),
                Vector3::new(direct[0], direct[1], direct[2]),
                epsilon = 1e-7
            );
        }
    }
}

#[test]
fn more_regularisation_misses_more_and_bends_less() {
    let centres = scattered(60);
    let values = smile(&centres);
    for kernel in ALL {
        let (mut last_residual, mut last_bending) = (-1.0, f64::INFINITY);
        for exponent in -8..=4 {
            let lambda = Regularisation::UnitBox(10.0_f64.powi(exponent));
            let spline = Spline::fit(kernel, &centres, &values, regularised(lambda)).unwrap();
            let (residual, bending) = (residual(&spline, &centres, &values), spline.bending_energy());
            assert!(
                residual > last_residual,
                "{kernel} 1e{exponent}: residual {residual} <= {last_residual}"
            );
            assert!(bending < last_bending, "{kernel} 1e{exponent}: bending {bending} >= {last_bending}");
            assert!(bending > 0.0, "{kernel} 1e{exponent}");
            (last_residual, last_bending) = (residual, bending);
        }
    }
}

#[test]
fn unit_box_lambda_does_not_know_the_unit_nor_the_place() {
    let centres = scattered(40);
    let values = smile(&centres);
    let turn = Rotation3::from_euler_angles(0.0, 0.0, std::f64::consts::FRAC_PI_2);
    let metres = |p: &Point3<f64>| turn * p / 1000.0 + Vector3::new(1.0, -2.0, 0.5);
    let moved: Vec<_> = centres.iter().map(metres).collect();
    for kernel in ALL {
        let options = regularised(Regularisation::UnitBox(0.03));
        let here = Spline::fit(kernel, &centres, &values, options).unwrap();
        let there = Spline::fit(kernel, &moved, &values, options).unwrap();
        for x in &scattered(60)[40..] {
            assert_relative_eq!(here.evaluate(x), there.evaluate(&metres(x)), epsilon = 1e-9);
        }
    }
}

#[test]
fn zero_values_give_exactly_zero() {
    let centres = scattered(30);
    for kernel in ALL {
        let spline = Spline::fit(kernel, &centres, &[Vector3::zeros(); 30], Options::default()).unwrap();
        assert!(scattered(50).iter().all(|x| spline.evaluate(x) == Vector3::zeros()), "{kernel}");
    }
}

#[test]
fn a_factored_system_answers_as_a_single_fit_does() {
    let centres = scattered(30);
    let values = smile(&centres);
    let factored = Factored::new(Kernel::ThinPlate, &centres, Options::default()).unwrap();
    let single = Spline::fit(Kernel::ThinPlate, &centres, &values, Options::default()).unwrap();
    let x = Point3::new(70.0, 150.0, -370.0);
    factored.solve(&vec![Vector3::x(); 30]).unwrap();
    assert_eq!(factored.solve(&values).unwrap().evaluate(&x), single.evaluate(&x));
}

#[test]
fn coplanar_centres_are_named_and_can_be_fitted_in_their_plane() {
    let turn = Rotation3::from_euler_angles(0.4, -0.7, 0.2);
    let flat: Vec<Point3<f64>> = scattered(20).iter().map(|p| turn * Point3::new(p.x, p.y, 12.0)).collect();
    let m = Matrix2::new(0.2, 0.1, -0.3, 0.1);
    let values: Vec<_> = scattered(20).iter().map(|p| (m * p.xy().coords).push(0.5)).collect();
    let found = Spline::fit(Kernel::Linear, &flat, &values, Options::default()).unwrap_err();
    assert!(matches!(found, SplineError::Flat { found: 20, shape: Flatness::Plane, .. }), "{found}");
    for kernel in ALL {
        let options = Options { polynomial: Polynomial::InSpan, ..Options::default() };
        let spline = Spline::fit(kernel, &flat, &values, options).unwrap();
        // Still exact for a motion that is affine in the plane, and level across it.
        let x = turn * Point3::new(20.0, 130.0, 12.0);
        let expected = (m * Vector2::new(20.0, 130.0)).push(0.5);
        assert_relative_eq!(spline.evaluate(&x), expected, epsilon = 1e-8);
        assert_relative_eq!(spline.evaluate(&(x + turn * Vector3::z() * 9.0)), expected, epsilon = 1e-8);
    }
    let line: Vec<_> = (0..6).map(|i| Point3::new(f64::from(i), 2.0 * f64::from(i), 0.0)).collect();
    let found = Factored::new(Kernel::Linear, &line, Options::default()).unwrap_err();
    assert!(matches!(found, SplineError::Flat { shape: Flatness::Line, .. }), "{found}");
}

#[test]
fn refusals_say_what_was_found() {
    let good = scattered(6);
    let fit = |centres: &[Point3<f64>], options| Factored::new(Kernel::Linear, centres, options).map(|_| ());

    let found = fit(&good[..3], Options::default());
    let polynomial = Polynomial::Affine;
    assert_eq!(found, Err(SplineError::TooFewCentres { polynomial, wanted: 4, found: 3 }));

    let mut holed = good.clone();
    holed[4].y = f64::NAN;
    assert_eq!(
        fit(&holed, Options::default()),
        Err(SplineError::NotFinite { input: Input::Centre, index: 4 })
    );

    let mut doubled = good.clone();
    doubled[5] = doubled[2];
    let found = fit(&doubled, Options::default());
    assert_eq!(found, Err(SplineError::Coincident { first: 2, second: 5, distance: 0.0 }));
    assert_eq!(fit(&doubled, regularised(Regularisation::UnitBox(0.01))), Ok(()));

    let found = fit(&good, regularised(Regularisation::Absolute(-2.0)));
    assert_eq!(found, Err(SplineError::Regularisation { lambda: -2.0 }));

    let options = Options { polynomial: Polynomial::Constant, ..Options::default() };
    let found = Factored::new(Kernel::Cubic, &good, options).unwrap_err();
    assert!(matches!(found, SplineError::PolynomialTooLow { kernel: Kernel::Cubic, .. }));

    for stiffness in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = Options { stiffness, ..Options::default() };
        let found = Factored::new(Kernel::Gaussian, &good, options).unwrap_err();
        assert!(matches!(found, SplineError::Stiffness { .. }), "{found}");
    }

    let spread = [Point3::new(-1e200, 0.0, 0.0), Point3::new(1e200, 1.0, 0.0), good[0], good[1]];
    assert!(matches!(fit(&spread, Options::default()), Err(SplineError::Extent { .. })));

    let factored = Factored::new(Kernel::Linear, &good, Options::default()).unwrap();
    let found = factored.solve(&[Vector3::zeros(); 5]).unwrap_err();
    assert_eq!(found, SplineError::Count { input: Input::Value, wanted: 6, found: 5 });
    let mut values = [Vector3::zeros(); 6];
    values[3].z = f64::INFINITY;
    let found = factored.solve(&values).unwrap_err();
    assert_eq!(found, SplineError::NotFinite { input: Input::Value, index: 3 });
    assert!(found.to_string().contains("value 3"));
}

#[test]
fn no_centres_at_all_is_a_refusal() {
    for polynomial in [Polynomial::Affine, Polynomial::InSpan, Polynomial::Constant, Polynomial::None] {
        for kernel in ALL {
            let options = Options { polynomial, ..Options::default() };
            assert!(Factored::<3>::new(kernel, &[], options).is_err(), "{kernel} {polynomial}");
        }
    }
}
