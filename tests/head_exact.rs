//! Head pose from exact landmarks of a face that moves: what expressions leak into the head.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use nalgebra::{Point3, Rotation3, Vector3};
use understudy::{
    assets::Assets,
    head::{Camera, HeadPose, PoseSolver},
    lift::upright,
    pipeline::read_canonical_face,
    tracking::{Region, SKIN_LANDMARK_COUNT, index, landmark_table},
};

/// Poses with the weights of the table, degrees RMS.
const BOUND: f64 = 0.4;
const EXPRESSIONS: usize = 200;

/// Knuth's linear congruential generator: the same numbers everywhere.
struct Lcg(u64);

impl Lcg {
    /// 0 to 1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

fn canonical_face() -> Vec<Point3<f64>> {
    read_canonical_face(&Assets::locate().unwrap().verified("canonical_face").unwrap()).unwrap()
}

/// A jaw that drops, corners of the mouth that rise, brows that rise or frown, lids that close, all at once and each
/// side by itself: every landmark moves up to what the table says expressions move it. The nose stays: a nose that is
/// shifted as a whole is a turned head, whatever the weights.
fn expression(face: &[Point3<f64>], random: &mut Lcg) -> Vec<Vector3<f64>> {
    let mouth = nalgebra::center(&face[index::MOUTH_RIGHT], &face[index::MOUTH_LEFT]);
    let jaw = random.next();
    let [smile, brows, lids] = [(-0.4, 1.0), (-0.6, 1.0), (0.0, 1.0)].map(|(low, high): (f64, f64)| {
        let both = random.between(low, high);
        let uneven = random.between(-0.15, 0.15);
        [both - uneven, both + uneven]
    });
    face.iter()
        .zip(landmark_table())
        .map(|(point, facts)| {
            let side = point.x.signum();
            let of = |pair: [f64; 2]| pair[usize::from(side > 0.0)];
            let below = ((mouth.y - point.y) / 30.0).clamp(0.0, 1.0);
            let drop = Vector3::new(0.0, -1.0, -0.4) * jaw * below;
            let rise = Vector3::new(0.5 * side, 0.7, -0.3) * of(smile);
            let direction = match facts.region {
                Region::Jaw => drop,
                Region::Oval => drop + rise * 0.2 * below,
                Region::Lips | Region::Cheeks => drop + rise,
                Region::Brows | Region::Other => Vector3::new(0.1 * side, 1.0, -0.1) * of(brows),
                Region::Nose => Vector3::zeros(),
                Region::Lids | Region::Iris => Vector3::new(0.0, -1.0, 0.1) * of(lids),
            };
            direction.cap_magnitude(1.0) * facts.max_motion
        })
        .collect()
}

fn pose(random: &mut Lcg) -> HeadPose {
    let [pitch, yaw, roll] = [15.0, 30.0, 15.0].map(|most: f64| random.between(-most, most).to_radians());
    HeadPose {
        rotation: upright() * Rotation3::from_euler_angles(pitch, yaw, roll),
        translation: Vector3::new(
            random.between(-60.0, 60.0),
            random.between(-40.0, 40.0),
            random.between(400.0, 750.0),
        ),
        reprojection_error: 0.0,
    }
}

/// RMS of the angle between solved and true poses, degrees.
fn error(weights: &[f64]) -> f64 {
    let face = canonical_face();
    let camera = Camera::with_field_of_view(640, 480, 60.0).unwrap();
    let solver = PoseSolver::new(camera, face.clone(), weights.to_vec());
    let mut random = Lcg(20_261_122);
    let squares: f64 = (0..EXPRESSIONS)
        .map(|_| {
            let motion = expression(&face, &mut random);
            let truth = pose(&mut random);
            let pixels: Vec<_> = face
                .iter()
                .zip(&motion)
                .map(|(point, motion)| camera.project(&truth.to_camera(&(point + motion))))
                .collect();
            let found = solver.solve(&pixels, None).unwrap();
            found.rotation.angle_to(&truth.rotation).to_degrees().powi(2)
        })
        .sum();
    (squares / EXPRESSIONS as f64).sqrt()
}

#[test]
fn expressions_hardly_turn_the_head_when_points_weigh_what_the_table_says() {
    let table: Vec<f64> = landmark_table()[..SKIN_LANDMARK_COUNT].iter().map(|f| f.pose_weight).collect();
    let weighted = error(&table);
    let unweighted = error(&[1.0; SKIN_LANDMARK_COUNT]);
    println!("weighted {weighted:.3}°, unweighted {unweighted:.3}°");
    assert!(weighted <= BOUND, "{weighted}°");
    assert!(unweighted > 1.3 * weighted, "{unweighted}° without weights, {weighted}° with them");
}
