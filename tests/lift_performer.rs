//! Lifting against motions that are known: the canonical face, displaced, posed and projected by the test.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use nalgebra::{Point3, Rotation3, Vector3};
use understudy::{
    assets::Assets,
    head::{Camera, HeadPose},
    lift::{Performer, frontal_pose, upright},
    pipeline::read_canonical_face,
    tracking::{
        LANDMARK_COUNT, LandmarkState, Landmarks, Region, SKIN_LANDMARK_COUNT, index, landmark_table,
    },
};

fn camera() -> Camera {
    Camera::with_field_of_view(640, 480, 60.0).unwrap()
}

fn average_face() -> Vec<Point3<f64>> {
    read_canonical_face(&Assets::locate().unwrap().verified("canonical_face").unwrap()).unwrap()
}

/// What a network without fault would see of `points` at `pose`: pixels, and depth about the head's origin in pixels.
fn seen(points: &[Point3<f64>], pose: &HeadPose) -> Landmarks {
    let camera = camera();
    let mut seen: Vec<Vector3<f64>> = points
        .iter()
        .map(|p| {
            let placed = pose.to_camera(p);
            let pixel = camera.project(&placed);
            let depth = (placed.z - pose.translation.z) * camera.focal / pose.translation.z;
            Vector3::new(pixel.x, pixel.y, depth)
        })
        .collect();
    seen.resize(LANDMARK_COUNT, seen[index::RIGHT_EYE_INNER]);
    Landmarks { points: seen, states: vec![LandmarkState::Observed; LANDMARK_COUNT], presence: 1.0 }
}

fn turned(pitch: f64, yaw: f64) -> HeadPose {
    HeadPose {
        rotation: upright() * Rotation3::from_euler_angles(pitch, yaw, 0.0),
        translation: Vector3::new(15.0, -10.0, 520.0),
        ..frontal_pose()
    }
}

/// The jaw drops and comes forward a little; everything above the mouth keeps still.
fn jaw_drop(neutral: &[Point3<f64>]) -> Vec<Vector3<f64>> {
    neutral[..SKIN_LANDMARK_COUNT]
        .iter()
        .zip(landmark_table())
        .map(|(_, facts)| match facts.region {
            Region::Jaw => Vector3::new(0.0, -18.0, 3.0),
            _ => Vector3::zeros(),
        })
        .collect()
}

fn performer() -> Performer {
    let face = average_face();
    Performer::from_average_face(camera(), &face, &[&seen(&face, &frontal_pose())]).unwrap()
}

#[test]
fn the_neutral_scan_is_the_face_that_was_seen_and_lifts_to_nothing() {
    let (face, performer) = (average_face(), performer());
    for (found, truth) in performer.neutral().iter().zip(&face) {
        assert!((found - truth).norm() < 1e-3, "{found} for {truth}");
    }
    let landmarks = seen(&face, &turned(0.1, -0.3));
    let pose = performer.pose(&landmarks, None).unwrap();
    let lifted = performer.lift(&landmarks, &pose);
    assert!(lifted.vectors[..SKIN_LANDMARK_COUNT].iter().all(|v| v.norm() < 0.1));
}

#[test]
fn a_known_motion_comes_back_at_every_pose() {
    let (face, performer) = (average_face(), performer());
    let truth = jaw_drop(&face);
    let displaced: Vec<_> = face.iter().zip(&truth).map(|(p, d)| p + d).collect();
    for (pitch, yaw) in [(0.0, 0.0), (0.2, 0.0), (0.0, 0.35), (-0.15, -0.35)] {
        let pose = turned(pitch, yaw);
        let landmarks = seen(&displaced, &pose);
        let found = performer.pose(&landmarks, None).unwrap();
        let angle = (found.rotation.matrix() - pose.rotation.matrix()).norm() / 2_f64.sqrt();
        assert!(angle.to_degrees() < 0.5, "{:.2}° off at {pitch}, {yaw}", angle.to_degrees());
        let lifted = performer.lift(&landmarks, &found);
        let errors = lifted.vectors.iter().zip(&truth).map(|(v, t)| (v - t).norm_squared());
        let rms = (errors.sum::<f64>() / truth.len() as f64).sqrt();
        assert!(rms < 1.0, "{rms:.2} mm at {pitch}, {yaw}");
    }
}

#[test]
fn projecting_what_was_lifted_gives_the_landmarks_back() {
    let (face, performer) = (average_face(), performer());
    let displaced: Vec<_> = face.iter().zip(&jaw_drop(&face)).map(|(p, d)| p + d).collect();
    let landmarks = seen(&displaced, &turned(0.1, 0.2));
    let pose = performer.pose(&landmarks, None).unwrap();
    let projected = performer.project(&performer.lift(&landmarks, &pose), &pose);
    for (found, truth) in projected.iter().zip(&landmarks.points) {
        assert!((found.xy() - truth.xy()).norm() < 1e-6);
    }
}

#[test]
fn an_average_face_of_another_kind_is_refused() {
    let face = average_face();
    let landmarks = seen(&face, &frontal_pose());
    let refused = Performer::from_average_face(camera(), &face[..68], &[&landmarks]).unwrap_err();
    assert!(refused.to_string().contains("68 points, not 468"), "{refused}");
}
