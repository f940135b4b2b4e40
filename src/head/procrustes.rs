//! The rotation between two views of like points.

use nalgebra::{Matrix3, Rotation3, Vector3};

/// The rotation R that brings R·a closest to b, whatever their places and sizes (Kabsch); the identity where the points
/// do not tell.
pub fn rotation_between(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> Rotation3<f64> {
    let mean = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
    let (mean_a, mean_b) = (mean(a), mean(b));
    rotation_of(a.iter().zip(b).map(|(a, b)| (b - mean_b) * (a - mean_a).transpose()).sum())
}

/// The rotation R and shift t that bring R·a + t closest to b, each pair counting by its weight (of any sum but 0).
pub fn rigid_between(
    a: &[Vector3<f64>],
    b: &[Vector3<f64>],
    weights: &[f64],
) -> (Rotation3<f64>, Vector3<f64>) {
    let total = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let mean = |points: &[Vector3<f64>]| {
        points.iter().zip(weights).map(|(p, w)| p * *w).sum::<Vector3<f64>>() / total
    };
    let (mean_a, mean_b) = (mean(a), mean(b));
    let pairs = a.iter().zip(b).zip(weights);
    let turn = rotation_of(pairs.map(|((a, b), w)| (b - mean_b) * (a - mean_a).transpose() * *w).sum());
    (turn, mean_b - turn * mean_a)
}

fn rotation_of(covariance: Matrix3<f64>) -> Rotation3<f64> {
    let svd = covariance.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Rotation3::identity() };
    let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    Rotation3::from_matrix_unchecked(u * mirror * v_t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_rotation_comes_back_through_scale_and_shift() {
        let truth = Rotation3::from_euler_angles(0.3, -0.4, 0.1);
        let a: Vec<_> = (0..12)
            .map(|i| {
                let t = f64::from(i);
                Vector3::new(t.sin() * 30.0, (2.0 * t).cos() * 40.0, (3.0 * t).sin() * 10.0)
            })
            .collect();
        let b: Vec<_> = a.iter().map(|p| truth * p * 2.5 + Vector3::new(5.0, -7.0, 100.0)).collect();
        assert!((rotation_between(&a, &b).matrix() - truth.matrix()).norm() < 1e-9);
    }

    #[test]
    fn pairs_of_no_weight_do_not_count() {
        let truth = Rotation3::from_euler_angles(-0.2, 0.7, 0.5);
        let shift = Vector3::new(3.0, -4.0, 50.0);
        let a: Vec<_> =
            (0..9).map(|i| Vector3::new(f64::from(i).sin(), f64::from(i * i).cos(), f64::from(i))).collect();
        let mut b: Vec<_> = a.iter().map(|p| truth * p + shift).collect();
        b[4] += Vector3::new(9.0, 9.0, -9.0);
        let weights: Vec<f64> = (0..9).map(|i| if i == 4 { 0.0 } else { 0.5 + f64::from(i) }).collect();
        let (turn, moved) = rigid_between(&a, &b, &weights);
        assert!((turn.matrix() - truth.matrix()).norm() < 1e-9 && (moved - shift).norm() < 1e-9);
    }
}
