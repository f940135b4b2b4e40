//! How far a head has turned, given how far the network's landmarks say it has.
//!
//! The landmarks slide over a face that turns: on renderings of scans at known angles the pose that explains them best
//! has too little pitch and too much yaw. The pose itself is left as it is, since it is what the landmarks agree with
//! and what they are lifted by; only where the head's own turn is wanted is it corrected.

use nalgebra::{Rotation3, Vector3};

/// True over found, for turns about the picture's horizontal axis (pitch), its vertical (yaw) and its depth (roll).
///
/// Found on five scans (james, the average face of menpo3d, LeePerrySmith, humface, MeshMonk's DemoFace): pitch 1.10 to
/// 1.35, yaw 0.90 to 0.97, roll 1.00.
const GAINS: Vector3<f64> = Vector3::new(1.15, 0.95, 1.0);

/// The turn that shows as `found`; both in axes parallel to the picture's, from a head that faces the camera.
pub fn true_turn(found: &Rotation3<f64>) -> Rotation3<f64> {
    Rotation3::new(found.scaled_axis().component_mul(&GAINS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_turn_stays_none_and_each_axis_has_its_gain() {
        assert!(true_turn(&Rotation3::identity()).scaled_axis().norm() < 1e-12);
        for axis in 0..3 {
            let mut turn = Vector3::zeros();
            turn[axis] = 0.2;
            let wanted = turn * GAINS[axis];
            assert!((true_turn(&Rotation3::new(turn)).scaled_axis() - wanted).norm() < 1e-12);
        }
    }
}
