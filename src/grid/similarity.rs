//! The similarity between two sets of like points.

use nalgebra::{Isometry3, Point3, Rotation3, Similarity3, Translation3, UnitQuaternion, Vector3};

use crate::head::rotation_between;

/// The turn, uniform scale and shift that bring `from` closest to `to` by least squares (Umeyama 1991), without mirroring;
/// `None` where either lies in one place, or numbers and lengths do not fit.
pub fn similarity_between(from: &[Point3<f64>], to: &[Point3<f64>]) -> Option<Similarity3<f64>> {
    if from.len() != to.len() {
        return None;
    }
    let (mean_from, size) = spread(from)?;
    let (mean_to, _) = spread(to)?;
    let vectors = |points: &[Point3<f64>]| points.iter().map(|p| p.coords).collect::<Vec<_>>();
    let turn: Rotation3<f64> = rotation_between(&vectors(from), &vectors(to));
    let along: f64 = from.iter().zip(to).map(|(a, b)| (turn * (a - mean_from)).dot(&(b - mean_to))).sum();
    let scale = along / (size * size);
    if !(scale.is_normal() && scale > 0.0) {
        return None;
    }
    let shift = mean_to.coords - turn * mean_from.coords * scale;
    let isometry =
        Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_rotation_matrix(&turn));
    Some(Similarity3::from_isometry(isometry, scale))
}

/// The centroid of points and their centroid size, √Σ|p − c|²; `None` where that is nothing or not finite.
pub(super) fn spread(points: &[Point3<f64>]) -> Option<(Point3<f64>, f64)> {
    let mean = points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len().max(1) as f64;
    let size = points.iter().map(|p| (p.coords - mean).norm_squared()).sum::<f64>().sqrt();
    (size.is_normal() && size > 1e-9).then_some((Point3::from(mean), size))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_similarity_comes_back() {
        let points: Vec<_> = (0..9)
            .map(|i| f64::from(i).sin())
            .map(|s| Point3::new(40.0 * s, 30.0 * (5.0 * s).cos(), 90.0 * s * s))
            .collect();
        let turn = UnitQuaternion::from_euler_angles(0.4, -1.2, 2.0);
        let truth = Similarity3::from_parts(Translation3::new(9.0, -800.0, 3.0), turn, 0.013);
        let moved: Vec<_> = points.iter().map(|p| truth * p).collect();
        let found = similarity_between(&points, &moved).unwrap();
        assert!((found.to_homogeneous() - truth.to_homogeneous()).norm() < 1e-9);
        assert!(similarity_between(&points, &moved[1..]).is_none());
        assert!(similarity_between(&[Point3::origin(); 4], &moved[..4]).is_none());
        assert!(similarity_between(&[], &[]).is_none());
    }
}
