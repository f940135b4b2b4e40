//! Splines against VTK, SciPy and Kornia: `reference/spline_reference.py` says how the numbers were made.

#![allow(clippy::unwrap_used, reason = "a reference file that does not parse must fail the test")]

use nalgebra::{Point, SVector};
use serde_json::Value;
use understudy::spline::{Kernel, Options, Regularisation, Spline};

/// Largest difference allowed, in the unit of the case: millimetres in 3D, a square of side 2 in 2D.
///
/// VTK and SciPy solve the same equations in f64; what is left is rounding. Kornia adds 1e-8 inside the logarithm, so
/// its U is off by up to 5e-9, which the weights of this case make 1e-7.
fn tolerance(oracle: &str) -> f64 {
    if oracle == "kornia" { 1e-6 } else { 1e-9 }
}

fn rows<const D: usize>(value: &Value) -> Vec<SVector<f64, D>> {
    let rows = value.as_array().unwrap();
    rows.iter().map(|row| SVector::from_fn(|axis, _| row[axis].as_f64().unwrap())).collect()
}

fn points<const D: usize>(value: &Value) -> Vec<Point<f64, D>> {
    rows(value).into_iter().map(Point::from).collect()
}

fn largest_difference<const D: usize>(case: &Value, kernel: Kernel) -> f64 {
    let options = Options {
        regularisation: Regularisation::Absolute(case["lambda"].as_f64().unwrap()),
        ..Options::default()
    };
    let spline =
        Spline::<D>::fit(kernel, &points(&case["centres"]), &rows(&case["values"]), options).unwrap();
    let expected = rows::<D>(&case["expected"]);
    let queries = points(&case["queries"]);
    assert_eq!(queries.len(), expected.len());
    queries.iter().zip(expected).map(|(q, e)| (spline.evaluate(q) - e).amax()).fold(0.0, f64::max)
}

#[test]
fn splines_match_the_oracles() {
    let file: Value = serde_json::from_str(include_str!("reference/spline_reference.json")).unwrap();
    let cases = file["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 15);
    for case in cases {
        let kernel = match case["kernel"].as_str().unwrap() {
            "Linear" => Kernel::Linear,
            "ThinPlate" => Kernel::ThinPlate,
            "Cubic" => Kernel::Cubic,
            "Hardy" => Kernel::Hardy,
            "Gaussian" => Kernel::Gaussian,
            other => panic!("unknown kernel {other}"),
        };
        let difference = match case["dimension"].as_u64().unwrap() {
            2 => largest_difference::<2>(case, kernel),
            3 => largest_difference::<3>(case, kernel),
            other => panic!("unknown dimension {other}"),
        };
        let (oracle, lambda) = (case["oracle"].as_str().unwrap(), &case["lambda"]);
        println!("{oracle} {kernel} {}D lambda {lambda}: {difference:.1e}", case["dimension"]);
        assert!(difference <= tolerance(oracle), "{oracle} {kernel} lambda {lambda}: {difference:e}");
    }
}
