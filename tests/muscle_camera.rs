//! Head pose and contractions from one camera's landmarks, where both are known.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use nalgebra::{Point3, Rotation3, Vector2, Vector3};
use understudy::{
    actions::ActionLibrary,
    head::{Camera, HeadPose, PoseSolver},
    lift::upright,
    muscle::{CameraFit, CameraSolver, FaceBasis, MuscleBasis},
    tracking::{SKIN_LANDMARK_COUNT, index, landmark_table},
};

const FOCAL: f64 = 700.0;

fn camera() -> Camera {
    Camera { focal: FOCAL, centre: Vector2::new(319.5, 239.5) }
}

fn solver(fit: CameraFit) -> CameraSolver {
    let basis = MuscleBasis::arkit().only(|element| !element.name.starts_with("eyeLook"));
    CameraSolver::new(camera(), FaceBasis::own(&basis).of_landmarks(), fit)
}

fn pose(yaw: f64, pitch: f64) -> HeadPose {
    HeadPose {
        rotation: upright().inverse() * Rotation3::from_euler_angles(pitch, yaw, 0.05),
        translation: Vector3::new(10.0, -5.0, 550.0),
        reprojection_error: 0.0,
    }
}

/// An expression in a pose, seen exactly, and where each landmark went.
fn seen(
    solver: &CameraSolver,
    pose: &HeadPose,
    acts: &[(&str, f64)],
) -> (Vec<Vector2<f64>>, Vec<f64>, Vec<Vector3<f64>>) {
    let basis = solver.basis();
    let mut contractions = vec![0.0; basis.count()];
    for (name, contraction) in acts {
        contractions[basis.muscles.iter().position(|m| m.name == *name).unwrap()] = *contraction;
    }
    let mut moved = Vec::new();
    basis.synthesize(&contractions, &mut moved);
    let pixels = (0..SKIN_LANDMARK_COUNT)
        .map(|i| camera().project(&pose.to_camera(&(basis.points[i] + moved[i]))))
        .collect();
    (pixels, contractions, moved)
}

/// The pose of the rigid points alone, from which the solver starts.
fn rigid(solver: &CameraSolver, pixels: &[Vector2<f64>]) -> HeadPose {
    let weights = landmark_table()[..SKIN_LANDMARK_COUNT].iter().map(|facts| facts.pose_weight).collect();
    PoseSolver::new(camera(), solver.basis().points.clone(), weights).solve(pixels, None).unwrap()
}

const ACTS: [&[(&str, f64)]; 4] = [
    &[("jawOpen", 0.8)],
    &[("mouthSmileLeft", 0.9), ("mouthSmileRight", 0.7), ("cheekSquintLeft", 0.4)],
    &[("browInnerUp", 0.8), ("browOuterUpLeft", 0.6), ("jawOpen", 0.3)],
    &[("browDownLeft", 0.9), ("noseSneerRight", 0.6), ("mouthPucker", 0.5)],
];

#[test]
fn what_is_seen_exactly_is_explained_exactly_when_nothing_pulls_to_rest() {
    let mut solver = solver(CameraFit { ridge: 1e-6, rounds: 40, ..CameraFit::default() });
    for (k, acts) in ACTS.iter().enumerate() {
        let truth = pose(0.15 * k as f64 - 0.2, 0.1);
        let (pixels, _, moved) = seen(&solver, &truth, acts);
        let mut contractions = vec![0.0; solver.basis().count()];
        let start = rigid(&solver, &pixels);
        let found = solver.solve(&pixels, &start, &mut contractions);
        let mut out = Vec::new();
        solver.basis().synthesize(&contractions, &mut out);
        let far = out.iter().zip(&moved).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(far < 0.3, "{acts:?}: {far} mm");
        // Rounds end when contractions change by less than 0.002.
        let turned = (found.rotation.matrix() - truth.rotation.matrix()).norm();
        assert!(turned < 2e-3 && found.reprojection_error < 0.2, "{turned} {}", found.reprojection_error);
    }
}

#[test]
fn expressions_turn_the_head_less_than_the_rigid_points_alone_say() {
    let mut solver = solver(CameraFit::default());
    let (mut alone, mut together, mut depth) = (0.0, 0.0, Vec::new());
    for acts in ACTS {
        let truth = pose(0.1, -0.05);
        let (pixels, _, moved) = seen(&solver, &truth, acts);
        let start = rigid(&solver, &pixels);
        let mut contractions = vec![0.0; solver.basis().count()];
        let found = solver.solve(&pixels, &start, &mut contractions);
        assert!(contractions.iter().all(|x| (0.0..=1.0).contains(x)));
        alone += start.rotation.angle_to(&truth.rotation).to_degrees();
        together += found.rotation.angle_to(&truth.rotation).to_degrees();
        let mut out = Vec::new();
        solver.basis().synthesize(&contractions, &mut out);
        depth.push((out[index::CHIN].z - moved[index::CHIN].z).abs());
    }
    assert!(together < 0.6 * alone, "{together} against {alone}");
    // One camera sees no depth: it follows from the muscles.
    assert!(depth.iter().all(|d| *d < 2.5), "{depth:?}");
}

#[test]
fn landmarks_that_are_missing_do_not_count() {
    let mut solver = solver(CameraFit::default());
    let truth = pose(0.0, 0.0);
    let (mut pixels, ..) = seen(&solver, &truth, ACTS[0]);
    for (i, pixel) in pixels.iter_mut().enumerate() {
        if solver.basis().points[i].x < -25.0 {
            *pixel = Vector2::repeat(f64::NAN);
        }
    }
    let mut contractions = vec![0.0; solver.basis().count()];
    let found = solver.solve(&pixels, &truth, &mut contractions);
    let jaw = solver.basis().muscles.iter().position(|m| m.name == "jawOpen").unwrap();
    assert!(contractions[jaw] > 0.5, "{}", contractions[jaw]);
    assert!(found.rotation.angle_to(&truth.rotation).to_degrees() < 1.5);
    let none = vec![Vector2::repeat(f64::NAN); SKIN_LANDMARK_COUNT];
    let held = contractions.clone();
    let still = solver.solve(&none, &truth, &mut contractions);
    assert_eq!((still.rotation, contractions), (truth.rotation, held));
}

#[test]
fn a_neutral_face_stays_neutral_however_it_turns() {
    let mut solver = solver(CameraFit::default());
    let points: Vec<Point3<f64>> = ActionLibrary::built_in().face[..SKIN_LANDMARK_COUNT].to_vec();
    for yaw in [-0.4, 0.0, 0.3] {
        let truth = pose(yaw, 0.1);
        let pixels: Vec<_> = points.iter().map(|p| camera().project(&truth.to_camera(p))).collect();
        let start = rigid(&solver, &pixels);
        let mut contractions = vec![0.0; solver.basis().count()];
        solver.solve(&pixels, &start, &mut contractions);
        assert!(contractions.iter().all(|x| *x < 1e-3), "{contractions:?}");
    }
}
