//! Several muscles on one piece of skin.
//!
//! 000 §7.2 asks for combinations "with an additional technique, like Bui's approach, where the muscle contractions were
//! combined by simulating their parallelism": two muscles that pull the skin the same way do not pull it twice as far.
//! Here the skin goes to the nearest place at which every muscle has its own way: with displacements aᵢ = mᵢuᵢ, the sum
//! r = Σ λᵢuᵢ of least λ ≥ 0 with Σⱼ max(0, uᵢ·uⱼ) λⱼ ≥ mᵢ. Pulls in one direction give the strongest, pulls at right
//! angles and against each other add up, and everything between is between, without a step.

use nalgebra::Vector3;

/// Sweeps of the projected Gauss–Seidel iteration; the systems are small and diagonally strong.
const SWEEPS: usize = 24;

/// How displacements of one point by several actions become one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Merge {
    /// As muscles in parallel.
    #[default]
    Parallel,
    /// Added up, as blend shapes are.
    Sum,
}

/// So many actions can move one point at once.
pub const MOST_PULLS: usize = 40;

/// One displacement of several, by ascending action; of more than [`MOST_PULLS`] the first.
pub fn merge(how: Merge, pulls: &[Vector3<f64>]) -> Vector3<f64> {
    if how == Merge::Sum || pulls.len() < 2 {
        return pulls.iter().sum();
    }
    let count = pulls.len().min(MOST_PULLS);
    let (mut lengths, mut units) = ([0.0; MOST_PULLS], [Vector3::zeros(); MOST_PULLS]);
    for (i, pull) in pulls[..count].iter().enumerate() {
        lengths[i] = pull.norm();
        units[i] = pull / lengths[i].max(f64::MIN_POSITIVE);
    }
    let mut tension = lengths;
    for _ in 0..SWEEPS {
        for i in 0..count {
            let others: f64 =
                (0..count).filter(|&j| j != i).map(|j| units[i].dot(&units[j]).max(0.0) * tension[j]).sum();
            tension[i] = (lengths[i] - others).max(0.0);
        }
    }
    units[..count].iter().zip(&tension).map(|(unit, tension)| unit * *tension).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn close(a: Vector3<f64>, b: Vector3<f64>) -> bool {
        (a - b).norm() < 1e-6
    }

    #[test]
    fn along_one_line_the_strongest_counts_and_across_they_add() {
        let (x, y) = (Vector3::x(), Vector3::y());
        assert!(close(merge(Merge::Parallel, &[x * 3.0, x * 2.0]), x * 3.0));
        assert!(close(merge(Merge::Parallel, &[x * 2.0, x * 2.0, x * 2.0]), x * 2.0));
        assert!(close(merge(Merge::Parallel, &[x * 3.0, y * 2.0]), x * 3.0 + y * 2.0));
        assert!(close(merge(Merge::Parallel, &[x * 3.0, x * -2.0]), x));
        assert!(close(merge(Merge::Sum, &[x * 3.0, x * 2.0]), x * 5.0));
        assert!(close(merge(Merge::Parallel, &[y * 4.0]), y * 4.0));
        assert!(close(merge(Merge::Parallel, &[]), Vector3::zeros()));
        assert!(close(merge(Merge::Parallel, &[y, Vector3::zeros()]), y));
    }

    #[test]
    fn each_of_two_muscles_at_an_acute_angle_has_its_way() {
        let a = Vector3::new(2.0, 0.0, 0.0);
        let b = Vector3::new(1.0, 1.0, 0.0) * 1.2;
        let r = merge(Merge::Parallel, &[a, b]);
        assert!(r.dot(&a.normalize()) > a.norm() - 1e-6 && r.dot(&b.normalize()) > b.norm() - 1e-6);
        assert!(r.norm() < (a + b).norm());
    }

    proptest! {
        #[test]
        fn never_farther_than_the_sum_of_lengths_and_never_a_step(
            raw in prop::collection::vec(prop::array::uniform3(-5.0..5.0_f64), 1..6),
            nudge in prop::array::uniform3(-1e-4..1e-4_f64),
        ) {
            let pulls: Vec<_> = raw.iter().map(|v| Vector3::from(*v)).collect();
            let r = merge(Merge::Parallel, &pulls);
            let total: f64 = pulls.iter().map(Vector3::norm).sum();
            prop_assert!(r.norm() <= total + 1e-9);
            let mut moved = pulls.clone();
            moved[0] += Vector3::from(nudge);
            if pulls[0].norm() > 0.1 {
                prop_assert!((merge(Merge::Parallel, &moved) - r).norm() < 0.1);
            }
        }
    }
}
