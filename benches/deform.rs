//! The surface warp and action units: `cargo bench --bench deform`. One thread.
//!
//! James is the demonstration's scan, opened; the finer one is its mesh with every triangle cut into four, as scanned.

#![allow(clippy::unwrap_used, reason = "a benchmark without its assets has nothing to measure")]

#[path = "../examples/shared/stand.rs"]
mod stand;

use std::{collections::BTreeMap, sync::LazyLock};

use divan::{Bencher, bench, black_box};
use nalgebra::{Point3, Vector3, center};
use stand::Stand;
use understudy::{
    actions::{ActionLibrary, ActionWeights, Merge},
    anatomy::Anatomy,
    deform::{Handle, Stiffness, SurfaceWarp},
    rig::{ActionRig, ActionSolver, Method, SourceFace, TargetFace, WarpKind, facing},
    scan::{Mesh, Surface},
    tracking::SKIN_LANDMARK_COUNT,
};

/// Handles of the warps that are built.
const HANDLES: usize = 600;
/// Per squared millimetre, as `rig::spread` has it on a face of ordinary size.
const STIFFNESS: Stiffness = Stiffness { tension: 0.004 };
const WARPS: [&str; 2] = ["surface", "spline"];
const SIX: [&str; 6] = ["1=0.5", "4L=0.4", "6=0.7", "12=0.8", "17=0.3", "26=0.6"];

/// A scan whose landmarks are known.
struct Face {
    anatomy: Anatomy,
    scan: Mesh,
    surface: Surface,
    landmarks: Vec<Option<Point3<f64>>>,
}

static JAMES: LazyLock<Face> = LazyLock::new(|| {
    let target = Stand::new(None).unwrap().target;
    Face {
        anatomy: target.anatomy.clone(),
        scan: target.mesh().clone(),
        surface: target.surface.clone(),
        landmarks: target.landmarks.clone(),
    }
});

static FINER: LazyLock<Face> = LazyLock::new(|| {
    let scan = finer(&JAMES.scan);
    let surface = Surface::new(&scan).unwrap();
    let anatomy = Anatomy::prepare(&scan, &surface, &JAMES.landmarks, None);
    Face { anatomy, scan, surface, landmarks: JAMES.landmarks.clone() }
});

/// Every triangle cut into four.
fn finer(mesh: &Mesh) -> Mesh {
    let mut positions = mesh.positions.clone();
    let mut middles: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    let mut triangles = Vec::new();
    for &[a, b, c] in &mesh.triangles {
        let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[from, to]| {
            *middles.entry([from.min(to), from.max(to)]).or_insert_with(|| {
                positions.push(center(&positions[from as usize], &positions[to as usize]));
                positions.len() as u32 - 1
            })
        });
        triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    Mesh { positions, triangles, ..Mesh::default() }
}

fn face(name: &str) -> &'static Face {
    if name == "james" { &JAMES } else { &FINER }
}

fn rig(face: &Face, warp: &str) -> ActionRig {
    let library = ActionLibrary::built_in();
    let target = TargetFace::new(face.landmarks.clone(), facing(&library.face, &face.landmarks)).unwrap();
    let warp = if warp == "surface" { WarpKind::Surface } else { WarpKind::Spline };
    let method = Method { warp, ..Method::default() };
    ActionRig::new(library, &target, &face.anatomy, &face.surface, method, Merge::Parallel).unwrap()
}

fn weights() -> ActionWeights {
    let mut weights = ActionWeights::default();
    for text in SIX {
        weights.set_text(text).unwrap();
    }
    weights
}

fn main() {
    // Cargo's test of benchmarks runs each once and wants no report.
    if !std::env::args().any(|argument| argument == "--test" || argument == "--list") {
        for name in ["james", "finer"] {
            let face = face(name);
            let rig = rig(face, "surface");
            println!(
                "{name}: {} vertices, {} of them soft, {} controls, {} columns",
                face.scan.positions.len(),
                rig.puppet().warp().vertices(),
                rig.controls().rest.len(),
                rig.puppet().warp().controls(),
            );
        }
    }
    divan::main();
}

/// The warp's equations alone, all vertices and 600 columns.
#[bench(args = ["james", "finer"], sample_count = 5, sample_size = 1)]
fn surface_warp_new(bencher: Bencher<'_, '_>, name: &str) {
    let scan = &face(name).scan;
    let step = scan.positions.len() / HANDLES;
    let handles: Vec<Handle> = (0..HANDLES).map(|k| Handle::at((k * step) as u32, k)).collect();
    let still = vec![false; scan.positions.len()];
    bencher.bench_local(|| {
        SurfaceWarp::new(black_box(&scan.positions), &scan.triangles, &handles, HANDLES, &still, STIFFNESS)
    });
}

/// The whole rig.
#[bench(args = [("james", "surface"), ("james", "spline"), ("finer", "surface"), ("finer", "spline")], sample_count = 3, sample_size = 1)]
fn action_rig_new(bencher: Bencher<'_, '_>, (name, warp): (&str, &str)) {
    let face = face(name);
    bencher.bench_local(|| rig(black_box(face), warp));
}

#[bench(args = [("james", "surface"), ("james", "spline"), ("finer", "surface"), ("finer", "spline")], sample_count = 200, sample_size = 1)]
fn action_rig_pose(bencher: Bencher<'_, '_>, (name, warp): (&str, &str)) {
    let (rig, weights) = (rig(face(name), warp), weights());
    let mut frame = rig.new_frame();
    bencher.bench_local(|| rig.pose(black_box(&weights), &mut frame).unwrap());
}

/// What of it is not the product with the matrix.
#[bench(args = WARPS, sample_count = 200, sample_size = 1)]
fn action_rig_pose_controls(bencher: Bencher<'_, '_>, warp: &str) {
    let (rig, weights) = (rig(&JAMES, warp), weights());
    let mut frame = rig.new_frame();
    let eyes = rig.eyes(&weights);
    bencher.bench_local(|| rig.pose_controls(black_box(&weights), &eyes, &mut frame));
}

/// The library's own face with six actions on, from nothing.
#[bench(sample_count = 200, sample_size = 1)]
fn action_solver_solve(bencher: Bencher<'_, '_>) {
    let library = ActionLibrary::built_in();
    let solver = ActionSolver::new(library, &SourceFace::library(library)).unwrap();
    let mut vectors = vec![Vector3::zeros(); SKIN_LANDMARK_COUNT];
    for (key, magnitude) in weights().iter() {
        for moved in &library.get(key).unwrap().vectors {
            if let Some(vector) = vectors.get_mut(moved.handle) {
                *vector += moved.vector * magnitude;
            }
        }
    }
    let count = solver.keys().count();
    bencher.bench_local(|| {
        let mut magnitudes = vec![0.0; count];
        solver.solve(black_box(&vectors), &mut magnitudes);
        magnitudes
    });
}
