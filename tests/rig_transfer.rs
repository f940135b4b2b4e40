//! Transfer and warp against what must come out of them: a target that is the performer's own face, turned and scaled,
//! must move as the performer does, turned and scaled.

#![allow(clippy::panic, clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use nalgebra::{Point3, Rotation3, Vector3};
use understudy::{
    anatomy::Anatomy,
    assets::Assets,
    head::{Camera, HeadPose, true_turn},
    lift::{Displacements, Expression, Performer, frontal_pose},
    pipeline::read_canonical_face,
    rig::{Driver, Method, Rig, TargetFace},
    scan::{Mesh, Surface},
    tracking::{LANDMARK_COUNT, LandmarkState, Landmarks, index},
    wire::HeadMeter,
};

const SCALE: f64 = 1.3;

struct Pair {
    performer: Performer,
    target: TargetFace,
    mesh: Mesh,
    surface: Surface,
    /// From the performer's scan frame to the target's.
    turn: Rotation3<f64>,
}

/// The canonical face before a camera, and the same face 1.3 times as large, scanned with the chin up.
fn pair() -> Pair {
    let file = Assets::locate().unwrap().verified("canonical_face").unwrap();
    let average = read_canonical_face(&file).unwrap();
    let json: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    let triangles: Vec<[u32; 3]> = serde_json::from_value(json["triangles"].clone()).unwrap();

    let camera = Camera::with_field_of_view(640, 480, 60.0).unwrap();
    let rest = frontal_pose();
    let mut points: Vec<Vector3<f64>> = average
        .iter()
        .map(|p| {
            let placed = rest.to_camera(p);
            let pixel = camera.project(&placed);
            Vector3::new(
                pixel.x,
                pixel.y,
                (placed.z - rest.translation.z) * camera.focal / rest.translation.z,
            )
        })
        .collect();
    points.resize(LANDMARK_COUNT, points[index::RIGHT_EYE_INNER]);
    let landmarks =
        Landmarks { points, states: vec![LandmarkState::Observed; LANDMARK_COUNT], presence: 1.0 };
    let performer = Performer::from_average_face(camera, &average, &[&landmarks]).unwrap();

    let chin_up = Rotation3::from_axis_angle(&Vector3::x_axis(), -0.3);
    let turn = chin_up * performer.rest().rotation.inverse() * rest.rotation;
    let positions: Vec<Point3<f64>> = average.iter().map(|p| chin_up * p * SCALE).collect();
    let mut target_landmarks: Vec<_> = positions.iter().copied().map(Some).collect();
    target_landmarks.resize(LANDMARK_COUNT, None);
    let target = TargetFace::new(target_landmarks, chin_up.inverse()).unwrap();
    let mesh = Mesh { positions, triangles, ..Mesh::default() };
    let surface = Surface::new(&mesh).unwrap();
    Pair { performer, target, mesh, surface, turn }
}

fn rig(pair: &Pair, rule: Method) -> Rig {
    Rig::new(&pair.performer, &pair.target, &Anatomy::as_scanned(&pair.mesh), &pair.surface, rule).unwrap()
}

/// The controls of a scan that was not opened which landmarks drive, and where each goes; the others are control points.
fn by_landmark<'a>(
    rig: &'a Rig,
    controls: &'a [[f32; 3]],
) -> impl Iterator<Item = (usize, Vector3<f64>)> + 'a {
    rig.controls().drivers.iter().zip(controls).filter_map(|(driver, moved)| match driver {
        Driver::Landmark(landmark) => Some((*landmark, Vector3::from(moved.map(f64::from)))),
        Driver::Point(_) => None,
        other => panic!("{other:?} drives a scan that is one skin"),
    })
}

/// The lower face drops and the brows rise, smoothly over the face.
fn expression(performer: &Performer) -> Expression {
    let mut displacements = Displacements::neutral();
    for (vector, point) in displacements.vectors.iter_mut().zip(performer.neutral()) {
        let lower = 1.0 / (1.0 + ((point.y + 20.0) / 8.0).exp());
        let upper = 1.0 / (1.0 + ((45.0 - point.y) / 6.0).exp());
        *vector = Vector3::new(0.0, -20.0 * lower + 6.0 * upper, -4.0 * lower);
    }
    Expression { displacements, ..Expression::neutral(*performer.rest()) }
}

#[test]
fn the_neutral_is_the_scan_itself() {
    let pair = pair();
    for rule in [Method::default(), Method::THESIS] {
        let rig = rig(&pair, rule);
        let mut frame = rig.new_frame();
        let neutral = Expression::neutral(*pair.performer.rest());
        rig.pose(&neutral, &mut frame).unwrap();
        assert_eq!(frame.positions, rig.rest());
        assert!(frame.head.rotation.angle() < 1e-9 && frame.head.translation.vector.norm() < 1e-6);
    }
}

#[test]
fn the_spline_rule_turns_and_scales_motions_with_the_face() {
    let pair = pair();
    let rig = rig(&pair, Method::default());
    let expression = expression(&pair.performer);
    let mut frame = rig.new_frame();
    rig.pose_controls(&expression, &mut frame);
    for (landmark, found) in by_landmark(&rig, &frame.controls) {
        let wanted = pair.turn * expression.displacements.vectors[landmark] * SCALE;
        assert!((found - wanted).norm() < 0.02 * wanted.norm() + 0.01, "{landmark}: {found} for {wanted}");
    }
}

#[test]
fn vertices_follow_their_controls() {
    let pair = pair();
    let rig = rig(&pair, Method::default());
    let expression = expression(&pair.performer);
    let mut frame = rig.new_frame();
    rig.pose(&expression, &mut frame).unwrap();
    let (mut error, mut motion) = (0.0, 0.0);
    for (landmark, control) in by_landmark(&rig, &frame.controls) {
        // In this mesh a landmark is the vertex of the same index.
        let moved = Vector3::from(frame.positions[landmark]) - Vector3::from(rig.rest()[landmark]);
        error += (moved.cast() - control).norm_squared();
        motion += control.norm_squared();
    }
    assert!((error / motion).sqrt() < 0.01, "{}", (error / motion).sqrt());
}

#[test]
fn the_thesis_scales_the_lower_face_by_the_mouth_and_copies_the_upper() {
    let pair = pair();
    let rig = rig(&pair, Method::THESIS);
    let expression = expression(&pair.performer);
    let mut frame = rig.new_frame();
    rig.pose_controls(&expression, &mut frame);
    let nose = pair.performer.neutral()[index::NOSE_TIP].y;
    for (landmark, found) in by_landmark(&rig, &frame.controls) {
        let ratio = if pair.performer.neutral()[landmark].y < nose { SCALE } else { 1.0 };
        let wanted = expression.displacements.vectors[landmark].norm() * ratio;
        let found = found.norm();
        assert!((found - wanted).abs() < 0.01 * wanted + 0.01, "{landmark}: {found} for {wanted}");
    }
}

#[test]
fn the_head_turns_with_the_performers_in_the_targets_own_frame() {
    let pair = pair();
    let rig = rig(&pair, Method::default());
    let rest = *pair.performer.rest();
    // The performer turns to the subject's left, about the upright axis of the picture.
    let angle = 0.4;
    let turned =
        HeadPose { rotation: Rotation3::from_axis_angle(&Vector3::y_axis(), -angle) * rest.rotation, ..rest };
    let motion = rig.head_motion(&turned);
    let shown = true_turn(&Rotation3::new(Vector3::y() * angle)).angle();
    assert!((motion.rotation.angle() - shown).abs() < 1e-9);
    let axis = motion.rotation.axis().unwrap();
    let upright = pair.target.level.inverse() * Vector3::y();
    assert!((axis.dot(&upright) - 1.0).abs() < 1e-6, "{axis:?} should be {upright}");
}

#[test]
fn over_the_wire_the_head_moves_the_same() {
    let pair = pair();
    let rig = rig(&pair, Method::default());
    let rest = *pair.performer.rest();
    let turn = Rotation3::new(Vector3::new(0.2, -0.4, 0.15));
    let shift = Vector3::new(30.0, -12.0, 55.0);
    let moved = HeadPose { rotation: turn * rest.rotation, translation: rest.translation + shift, ..rest };
    let meter = HeadMeter::new(&pair.performer);
    for pose in [rest, moved] {
        let (sent, shown) = (rig.head_motion(&pose), meter.measure(&pose).on(&pair.target));
        let nose = pair.target.landmarks[index::NOSE_TIP].unwrap();
        assert!((sent * nose - shown * nose).norm() < 1e-6, "{sent} {shown}");
        assert!(sent.rotation.angle_to(&shown.rotation) < 1e-9);
    }
    assert!(meter.measure(&rest).angles.iter().all(|angle| angle.abs() < 1e-12));
}

#[test]
fn a_landmark_that_was_not_found_is_carried_over_and_snapped() {
    let mut pair = pair();
    let lost = 425;
    let truth = pair.target.landmarks[lost].take().unwrap();
    let rig = rig(&pair, Method::default());
    let control = rig.controls().of_landmark(lost).unwrap();
    let place = rig.controls().rest[control];
    assert!((place - truth).norm() < 2.0, "{place} for {truth}");
    assert!((pair.surface.nearest(place).unwrap().position - place).norm() < 1e-6);
}

#[test]
fn a_target_without_eyes_is_refused() {
    let mut landmarks = pair().target.landmarks;
    landmarks[index::LEFT_EYE_OUTER] = None;
    let refused = TargetFace::new(landmarks, Rotation3::identity()).unwrap_err().to_string();
    assert!(refused.contains("--landmarks"), "{refused}");
}
