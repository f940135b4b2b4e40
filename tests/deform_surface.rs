//! The surface warp against NumPy and SciPy (`reference/surface_reference.py` says how the numbers were made), and
//! against what must hold of any solution.

#![allow(clippy::unwrap_used, reason = "a reference file that does not parse must fail the test")]

use nalgebra::{Point3, Vector3};
use serde_json::Value;
use understudy::deform::{Handle, Stiffness, SurfaceWarp};

const N: u32 = 15;

/// A bumpy sheet of 15 × 15 vertices with a hole.
fn sheet() -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let place = |i: u32| {
        let (x, y) = (f64::from(i % N), f64::from(i / N));
        let height = 0.8 * (0.7 * x).sin() * (0.5 * y).cos();
        Point3::new(x + 0.2 * (1.3 * y).sin(), y + 0.2 * (0.9 * x).cos(), height)
    };
    let in_hole = |row: u32, column: u32| (5..8).contains(&row) && (6..10).contains(&column);
    let cells = (0..N - 1).flat_map(|row| (0..N - 1).map(move |column| (row, column)));
    let triangles = cells.filter(|&(row, column)| !in_hole(row, column)).flat_map(|(row, column)| {
        let a = row * N + column;
        [[a, a + 1, a + N + 1], [a, a + N + 1, a + N]]
    });
    ((0..N * N).map(place).collect(), triangles.collect())
}

/// How far each of the warp's vertices goes.
fn moved(warp: &SurfaceWarp, columns: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut moved = vec![Vector3::zeros(); warp.vertices.len()];
    for (j, column) in columns.iter().enumerate() {
        for (to, share) in moved.iter_mut().zip(warp.column(j)) {
            *to += column * f64::from(*share);
        }
    }
    moved
}

fn numbers<const K: usize>(value: &Value) -> [f64; K] {
    std::array::from_fn(|k| value[k].as_f64().unwrap())
}

/// The handles of the reference and where each goes.
fn handles(reference: &Value) -> (Vec<Handle>, Vec<Vector3<f64>>) {
    let list = reference["handles"].as_array().unwrap().iter().enumerate();
    list.map(|(column, entry)| {
        let vertices = numbers(&entry["vertices"]).map(|vertex: f64| vertex as u32);
        let handle = Handle { vertices, weights: numbers(&entry["weights"]), ..Handle::at(0, column) };
        (handle, Vector3::from(numbers(&entry["moved"])))
    })
    .unzip()
}

#[test]
fn the_surface_moves_as_numpy_and_scipy_say() {
    let reference: Value = serde_json::from_str(include_str!("reference/surface_reference.json")).unwrap();
    let (positions, triangles) = sheet();
    let (handles, columns) = handles(&reference);
    let still: Vec<bool> = (0..N * N).map(|v| v < N || v % N == N - 1).collect();
    let stiffness = Stiffness { tension: reference["tension"].as_f64().unwrap() };
    let build =
        || SurfaceWarp::new(&positions, &triangles, &handles, handles.len(), &still, stiffness).unwrap();
    let warp = build();
    assert_eq!(warp.vertices.len() as u64, reference["moving"].as_u64().unwrap());
    let moved = moved(&warp, &columns);
    let mut worst = 0.0_f64;
    for row in reference["expected"].as_array().unwrap() {
        let [vertex, x, y, z] = numbers(row);
        let at = warp.vertices.binary_search(&(vertex as u32)).unwrap();
        worst = worst.max((moved[at] - Vector3::new(x, y, z)).amax());
    }
    println!("at most {worst:.1e} off");
    assert!(worst < 1e-5, "{worst}");

    let again = build();
    for column in 0..handles.len() {
        let bits = |warp: &SurfaceWarp| warp.column(column).iter().map(|s| s.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&warp), bits(&again), "column {column}");
    }
}

/// Also where a handle follows two columns and where several lie in one triangle.
#[test]
fn handles_that_go_one_way_take_all_of_the_surface_along() {
    let (positions, triangles) = sheet();
    let shift = Vector3::new(1.5, -0.75, 2.0);
    let mut handles: Vec<Handle> =
        [0, 44, 93, 160, 224].into_iter().enumerate().map(|(column, v)| Handle::at(v, column)).collect();
    handles.push(Handle { vertices: [16, 17, 32], weights: [0.2, 0.3, 0.5], ..Handle::at(0, 5) });
    handles.push(Handle { vertices: [16, 17, 32], weights: [0.3, 0.3, 0.4], ..Handle::at(0, 6) });
    let mut between = Handle::at(120, 0);
    between.follows = [(1, 0.25), (2, 0.75)];
    handles.push(between);
    for tension in [0.0, 0.3, 5.0] {
        let stiffness = Stiffness { tension };
        let still = vec![false; positions.len()];
        let warp = SurfaceWarp::new(&positions, &triangles, &handles, 7, &still, stiffness).unwrap();
        // The vertices within the hole belong to no triangle.
        assert_eq!(warp.vertices.len(), positions.len() - 6);
        for (vertex, moved) in warp.vertices.iter().zip(moved(&warp, &[shift; 7])) {
            assert!((moved - shift).norm() < 1e-5, "tension {tension}, vertex {vertex}: {moved}");
        }
    }
}
