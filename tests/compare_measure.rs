//! Comparisons of faces in closed form: errors that are known beforehand, and surfaces that are one surface.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use nalgebra::{Point3, Vector3};
use understudy::{
    compare::{CompareError, Comparison, DistanceKind, FacePart, REACH, Row, Whole, write_comparison},
    scan::{Mesh, Placement, Scan},
    tracking::{LANDMARK_COUNT, index},
};

type Shape = fn(f64, f64) -> f64;

/// A sheet of `side` × `side` squares of 4 mm, with a height for each place.
fn sheet(name: &str, side: u32, height: Shape) -> Scan {
    let mut mesh = Mesh::default();
    for i in 0..=side {
        for j in 0..=side {
            let [x, y] = [j, i].map(|k| 4.0 * (f64::from(k) - f64::from(side) / 2.0));
            mesh.positions.push(Point3::new(x, y, height(x, y)));
        }
    }
    for i in 0..side {
        for j in 0..side {
            let (a, b) = (i * (side + 1) + j, (i + 1) * (side + 1) + j);
            mesh.triangles.extend([[a, a + 1, b], [a + 1, b + 1, b]]);
        }
    }
    Scan::new(name, mesh, Placement::identity()).unwrap()
}

fn moved(scan: &Scan, by: impl Fn(usize, &Point3<f64>) -> Vector3<f64>) -> Scan {
    let mut scan = scan.clone();
    for (vertex, p) in scan.mesh.positions.iter_mut().enumerate() {
        *p += by(vertex, p);
    }
    scan
}

/// Every triangle cut into four at the middles of its edges.
fn subdivided(scan: &Scan) -> Scan {
    let mut mesh = Mesh { positions: scan.mesh.positions.clone(), ..Mesh::default() };
    for &[a, b, c] in &scan.mesh.triangles {
        let at = |v: u32| scan.mesh.positions[v as usize];
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([(a, b), (b, c), (c, a)].map(|(p, q)| nalgebra::center(&at(p), &at(q))));
        let [x, y, z] = [first, first + 1, first + 2];
        mesh.triangles.extend([[a, x, z], [x, b, y], [z, y, c], [x, y, z]]);
    }
    Scan::new("subdivided", mesh, Placement::identity()).unwrap()
}

fn flat() -> Scan {
    sheet("neutral", 20, |_, _| 0.0)
}

fn measured(neutral: &Scan, predicted: &Scan, truth: &Scan) -> Comparison {
    Comparison::of(neutral, predicted, truth, &[], Whole::Face).unwrap()
}

#[track_caller]
fn close(found: f64, wanted: f64) {
    assert!((found - wanted).abs() < 1e-9, "{found} instead of {wanted}");
}

#[test]
fn a_known_field_of_errors_gives_its_own_figures() {
    let neutral = flat();
    let count = neutral.mesh.positions.len();
    let truth = moved(&neutral, |_, _| Vector3::new(0.0, 3.0, 4.0));
    // Errors of 0, 0.01, 0.02 … mm in turning directions.
    let predicted = moved(&truth, |vertex, _| {
        let turn = vertex as f64;
        Vector3::new(turn.cos(), turn.sin(), 0.0) * (0.01 * vertex as f64)
    });
    let comparison = measured(&neutral, &predicted, &truth);
    assert_eq!(comparison.kind, DistanceKind::Vertex);
    assert_eq!(comparison.rows.len(), 1, "without landmarks there are no parts");
    let (row, n) = (comparison.whole(), count as f64);
    assert_eq!(row.vertices, count);
    close(row.mean, 0.01 * (n - 1.0) / 2.0);
    close(row.rms, 0.01 * ((n - 1.0) * (2.0 * n - 1.0) / 6.0).sqrt());
    close(row.p95, 0.01 * 0.95 * (n - 1.0));
    close(row.max, 0.01 * (n - 1.0));
    close(row.motion_rms, 5.0);
    close(row.share().unwrap(), row.rms / 5.0);
}

#[test]
fn the_truth_is_perfect_and_the_neutral_is_worth_one() {
    let neutral = flat();
    let truth = moved(&neutral, |_, p| Vector3::new(0.0, 0.1 * p.x, (0.05 * p.y).sin()));
    for truth in [truth.clone(), subdivided(&truth)] {
        let idle = measured(&neutral, &neutral, &truth);
        close(idle.whole().share().unwrap(), 1.0);
        let still = measured(&neutral, &neutral, &neutral);
        assert_eq!(still.whole().share(), None);
    }
    let perfect = measured(&neutral, &truth, &truth);
    let Row { mean, rms, p95, max, .. } = *perfect.whole();
    assert!([mean, rms, p95, max].iter().all(|error| error.abs() < f64::EPSILON));
}

#[test]
fn another_topology_is_measured_to_its_surface() {
    let neutral = flat();
    let truth = sheet("truth", 20, |x, y| 6.0 + (0.1 * x).sin() + 0.02 * y);
    let predicted = moved(&neutral, |vertex, _| Vector3::z() * truth.mesh.positions[vertex].z);
    let fine = subdivided(&truth);
    let comparison = measured(&neutral, &predicted, &fine);
    assert_eq!(comparison.kind, DistanceKind::Surface);
    assert!(comparison.whole().max < 1e-9, "{}", comparison.whole().max);
    // Off by 0.5 mm along the normal of a plane is 0.5 mm from it, wherever its vertices lie.
    let plane = subdivided(&moved(&neutral, |_, _| Vector3::z() * 2.0));
    let off = measured(&neutral, &moved(&neutral, |_, _| Vector3::z() * 2.5), &plane);
    close(off.whole().mean, 0.5);
    close(off.whole().motion_rms, 2.0);
}

#[test]
fn parts_are_told_apart_and_what_lies_beyond_the_landmarks_is_left_out() {
    let neutral = flat();
    let mut landmarks = vec![None; LANDMARK_COUNT];
    landmarks[index::RIGHT_EYE_OUTER] = Some(Point3::new(-20.0, 20.0, 0.0));
    landmarks[index::CHIN] = Some(Point3::new(0.0, -40.0, 0.0));
    let truth = moved(&neutral, |_, _| Vector3::z());
    // 2 mm about the eye, 0 elsewhere.
    let predicted = moved(&truth, |_, p| Vector3::z() * if p.y > -10.0 { 2.0 } else { 0.0 });
    let of = |whole| Comparison::of(&neutral, &predicted, &truth, &landmarks, whole).unwrap();
    let face = of(Whole::Face);
    let names: Vec<_> = face.rows.iter().map(|row| row.name).collect();
    assert_eq!(names, ["whole", FacePart::Lids.name(), FacePart::Jaw.name()]);
    close(face.rows[1].mean, 2.0);
    close(face.rows[2].max, 0.0);
    assert_eq!(face.rows[0].vertices, face.rows[1].vertices + face.rows[2].vertices);
    let within = |p: &Point3<f64>| landmarks.iter().flatten().any(|q| (p - q).norm() <= REACH);
    assert_eq!(face.rows[0].vertices, neutral.mesh.positions.iter().filter(|p| within(p)).count());

    let all = of(Whole::Mesh);
    let names: Vec<_> = all.rows.iter().map(|row| row.name).collect();
    assert_eq!(names, ["whole", "lids", "jaw", "elsewhere"]);
    assert_eq!(all.rows[0].vertices, neutral.mesh.positions.len());
    assert_eq!(all.rows[1..].iter().map(|row| row.vertices).sum::<usize>(), all.rows[0].vertices);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("errors.csv");
    write_comparison(&path, &all).unwrap();
    let text = std::fs::read_to_string(path).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 5);
    assert!(
        lines[2].starts_with("lids,vertex,")
            && lines[2].ends_with(",2.000000,2.000000,2.000000,2.000000,1.000000,2.000000")
    );
}

#[test]
fn meshes_that_do_not_fit_are_named() {
    let neutral = flat();
    let other = sheet("other", 19, |_, _| 0.0);
    let refused = |predicted: &Scan, truth: &Scan, landmarks: &[Option<Point3<f64>>]| {
        Comparison::of(&neutral, predicted, truth, landmarks, Whole::Face).unwrap_err()
    };
    let error = refused(&other, &neutral, &[]);
    assert!(matches!(error, CompareError::OtherVertices { found: 400, wanted: 441, .. }), "{error}");
    assert!(error.to_string().contains("other") && error.to_string().contains("neutral"));

    let mut turned = neutral.clone();
    turned.mesh.triangles.reverse();
    assert!(matches!(refused(&turned, &neutral, &[]), CompareError::OtherTriangles { .. }));

    let far = [Some(Point3::new(0.0, 0.0, 1000.0))];
    let error = refused(&neutral, &neutral, &far);
    assert!(matches!(error, CompareError::NoFace { .. }) && error.to_string().contains("--all"), "{error}");

    let lost = moved(&neutral, |vertex, _| Vector3::x() * if vertex == 7 { 1e12 } else { 0.0 });
    let error = refused(&lost, &other, &[]);
    assert!(matches!(error, CompareError::OutOfReach { vertex: 7, .. }), "{error}");
}
