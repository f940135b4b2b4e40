//! Action units measured: what was put into a face comes out again, and what comes out is the best there is.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use std::sync::LazyLock;

use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use understudy::{
    actions::{ActionKey, ActionLibrary, ActionWeights},
    lift::Eyes,
    rig::{ActionSolver, SourceFace, TargetFace, Transfer, TransferRule},
    tracking::{LANDMARK_COUNT, Region, SKIN_LANDMARK_COUNT, landmark_table},
};

/// The library's own face, seen as a performer's is or measured in space.
fn face(has_depth: bool) -> SourceFace {
    SourceFace { has_depth, ..SourceFace::library(ActionLibrary::built_in()) }
}

static SOLVER: LazyLock<ActionSolver> =
    LazyLock::new(|| ActionSolver::new(ActionLibrary::built_in(), &face(false)).unwrap());

/// What the landmarks do when these actions are on.
fn acted(weights: &ActionWeights) -> Vec<Vector3<f64>> {
    let mut vectors = vec![Vector3::zeros(); SKIN_LANDMARK_COUNT];
    for (key, magnitude) in weights.iter() {
        for moved in &ActionLibrary::built_in().get(key).unwrap().vectors {
            if let Some(vector) = vectors.get_mut(moved.handle) {
                *vector += moved.vector * magnitude;
            }
        }
    }
    vectors
}

fn solved(solver: &ActionSolver, vectors: &[Vector3<f64>]) -> Vec<(ActionKey, f64)> {
    let keys: Vec<ActionKey> = solver.keys().collect();
    let mut magnitudes = vec![0.0; keys.len()];
    solver.solve(vectors, &mut magnitudes);
    keys.into_iter().zip(magnitudes).collect()
}

/// What is put in, and how far off what comes out may be: pulled sideways, the corner of a mouth is drawn down as well.
const ACTED: [(&[&str], f64); 10] = [
    (&["12=0.8"], 0.12),
    (&["12L=0.7"], 0.12),
    (&["1=0.5", "2=0.5"], 0.12),
    (&["2R=0.9", "4L=0.6"], 0.12),
    (&["9=0.7", "27=0.5"], 0.12),
    (&["17=0.8", "4=0.5"], 0.12),
    (&["15L=0.8", "1=0.4"], 0.12),
    (&["18=0.6"], 0.12),
    (&["6=0.7", "12=0.9"], 0.12),
    (&["20R=0.6", "27=0.3", "2=0.3"], 0.15),
];

#[test]
fn actions_come_back_as_they_were_put_in() {
    let mut worst = (0.0, String::new());
    for has_depth in [false, true] {
        let solver = ActionSolver::new(ActionLibrary::built_in(), &face(has_depth)).unwrap();
        for (texts, allowed) in ACTED {
            let mut weights = ActionWeights::default();
            for text in texts {
                weights.set_text(text).unwrap();
            }
            for (key, found) in solved(&solver, &acted(&weights)) {
                let off = (found - weights.of(key)).abs();
                assert!(off < allowed, "{texts:?}: AU{key} is {found}");
                if off > worst.0 {
                    worst = (off, format!("{texts:?}: AU{key} is {found:.3}"));
                }
            }
        }
    }
    println!("at worst {:.3} off, {}", worst.0, worst.1);
}

/// A performer whose head is scanned askew shows the same actions.
#[test]
fn how_the_performer_was_scanned_does_not_matter() {
    let turn = Rotation3::from_euler_angles(0.2, -0.3, 0.1);
    let mut turned = face(false);
    for point in &mut turned.points {
        *point = turn * *point;
    }
    turned.level = turn.inverse();
    let solver = ActionSolver::new(ActionLibrary::built_in(), &turned).unwrap();
    let mut weights = ActionWeights::default();
    weights.set_text("12L=0.7").unwrap();
    weights.set_text("27=0.4").unwrap();
    let vectors = acted(&weights);
    let askew: Vec<_> = vectors.iter().map(|vector| turn * vector).collect();
    for ((key, a), (_, b)) in solved(&SOLVER, &vectors).into_iter().zip(solved(&solver, &askew)) {
        assert!((a - b).abs() < 1e-4, "AU{key} is {a} and {b}");
    }
}

#[test]
fn a_face_that_does_nothing_shows_no_action() {
    let keys: Vec<ActionKey> = SOLVER.keys().collect();
    // From wherever the last frame left it, and with a tracker's tremble.
    let tremble = |i: usize, k: usize| 0.05 * (12.9898 * i as f64 + 78.233 * k as f64).sin();
    let still = vec![Vector3::zeros(); SKIN_LANDMARK_COUNT];
    let trembling: Vec<_> =
        (0..SKIN_LANDMARK_COUNT).map(|i| Vector3::from_fn(|axis, _| tremble(i, axis))).collect();
    for vectors in [still, trembling] {
        let mut magnitudes = vec![0.5; keys.len()];
        SOLVER.solve(&vectors, &mut magnitudes);
        for (key, magnitude) in keys.iter().zip(&magnitudes) {
            assert!((0.0..0.02).contains(magnitude), "AU{key} is {magnitude}");
        }
        let weights = SOLVER.weights(&magnitudes, &Eyes::default());
        assert!(weights.iter().all(|(_, magnitude)| magnitude < 0.05));
    }
}

/// The problem as `rig::ActionSolver` documents it, written down once more.
struct Problem {
    /// For each action what a landmark's three weighted axes do.
    columns: Vec<Vec<f64>>,
    weights: Vec<(usize, Vector3<f64>)>,
    ridge: f64,
}

impl Problem {
    fn new(face: &SourceFace) -> Self {
        let library = ActionLibrary::built_in();
        let mut landmarks: Vec<_> = face.points[..SKIN_LANDMARK_COUNT].iter().copied().map(Some).collect();
        landmarks.resize(LANDMARK_COUNT, None);
        let target = TargetFace::new(landmarks, face.level).unwrap();
        let carry = Transfer::new(&SourceFace::library(library), &target, TransferRule::Spline).unwrap();
        let weights: Vec<(usize, Vector3<f64>)> = (0..SKIN_LANDMARK_COUNT)
            .filter(|&i| landmark_table()[i].region != Region::Oval)
            .map(|i| {
                let weight: f64 = match landmark_table()[i].region {
                    Region::Lids => 0.3,
                    Region::Lips => 0.7,
                    _ => 1.0,
                };
                (i, Vector3::new(1.0, 1.0, 0.15) * weight.sqrt())
            })
            .collect();
        let columns = SOLVER.keys().map(|key| {
            let action = library.get(key).unwrap();
            let row = |(landmark, weight): &(usize, Vector3<f64>)| {
                let moved = action.vectors.iter().find(|moved| moved.handle == *landmark);
                let vector = moved.map_or_else(Vector3::zeros, |moved| moved.vector);
                let seen = (face.level * carry.vector(*landmark, &vector)).component_mul(weight);
                [seen.x, seen.y, seen.z]
            };
            weights.iter().flat_map(row).collect()
        });
        let columns = columns.collect();
        Self { columns, weights, ridge: 2e-3 * face.outer_canthal_distance().powi(2) }
    }

    /// Derivatives of half the squared error, each over its own curvature.
    fn slopes(&self, vectors: &[Vector3<f64>], magnitudes: &[f64]) -> Vec<f64> {
        let mut left: Vec<f64> = self
            .weights
            .iter()
            .flat_map(|(landmark, weight)| {
                let seen = vectors[*landmark].component_mul(weight);
                [-seen.x, -seen.y, -seen.z]
            })
            .collect();
        for (column, magnitude) in self.columns.iter().zip(magnitudes) {
            for (left, value) in left.iter_mut().zip(column) {
                *left += value * magnitude;
            }
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let slope = |(column, magnitude): (&Vec<f64>, &f64)| {
            (dot(column, &left) + self.ridge * magnitude) / (dot(column, column) + self.ridge)
        };
        self.columns.iter().zip(magnitudes).map(slope).collect()
    }
}

static PROBLEM: LazyLock<Problem> = LazyLock::new(|| Problem::new(&face(false)));

/// What a magnitude inside its range could still gain is nothing, and at an end of it nothing inwards.
#[track_caller]
fn optimal(vectors: &[Vector3<f64>]) {
    let solution = solved(&SOLVER, vectors);
    let magnitudes: Vec<f64> = solution.iter().map(|entry| entry.1).collect();
    for ((key, magnitude), slope) in solution.into_iter().zip(PROBLEM.slopes(vectors, &magnitudes)) {
        assert!((0.0..=1.0).contains(&magnitude), "AU{key} is {magnitude}");
        let could_gain = (magnitude > 0.0 && slope > 1e-5) || (magnitude < 1.0 && slope < -1e-5);
        assert!(!could_gain, "AU{key} is {magnitude} with a slope of {slope}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn solutions_of_whatever_was_seen_are_the_best_within_bounds(
        raw in prop::collection::vec(prop::array::uniform3(-12.0..12.0_f64), SKIN_LANDMARK_COUNT),
        size in 0.0..1.0_f64,
    ) {
        let vectors: Vec<_> = raw.into_iter().map(|v| Vector3::from(v) * size).collect();
        optimal(&vectors);
    }

    #[test]
    fn solutions_of_faces_that_act_are_the_best_within_bounds(
        magnitudes in prop::collection::vec(0.0..1.6_f64, 60),
        noise in prop::collection::vec(prop::array::uniform3(-0.5..0.5_f64), SKIN_LANDMARK_COUNT),
    ) {
        let mut vectors: Vec<_> = noise.into_iter().map(Vector3::from).collect();
        for (key, magnitude) in SOLVER.keys().zip(magnitudes) {
            // Most actions are off, and some go farther than the library's.
            let magnitude = (2.0 * magnitude - 1.6).max(0.0);
            for moved in &ActionLibrary::built_in().get(key).unwrap().vectors {
                if let Some(vector) = vectors.get_mut(moved.handle) {
                    *vector += moved.vector * magnitude;
                }
            }
        }
        optimal(&vectors);
    }
}
