//! The moments of a take that differ most.

use super::MuscleCurves;
use crate::lift::FaceState;

/// Up to `count` frames, ascending, whose expressions differ most from the neutral and from each other: each is the
/// one farthest from those already chosen, of frames in which the face was seen, if there are any.
pub fn different_moments(curves: &MuscleCurves, count: usize) -> Vec<usize> {
    let frames = curves.frames();
    let seen: Vec<usize> = (0..frames.len()).filter(|&k| frames[k].state == FaceState::Tracking).collect();
    let candidates = if seen.is_empty() { (0..frames.len()).collect() } else { seen };
    // Squared distances to the nearest chosen expression; the neutral is the first.
    let mut far: Vec<f64> =
        candidates.iter().map(|&k| frames[k].contractions.iter().map(|x| x * x).sum()).collect();
    let mut chosen = Vec::new();
    while chosen.len() < count {
        // Of equal distances the earliest counts.
        let best = (0..far.len()).rev().max_by(|&a, &b| far[a].total_cmp(&far[b]));
        let Some(best) = best.filter(|&best| far[best] > 0.0) else { break };
        let expression = &frames[candidates[best]].contractions;
        for (distance, &k) in far.iter_mut().zip(&candidates) {
            let apart = frames[k].contractions.iter().zip(expression).map(|(a, b)| (a - b).powi(2)).sum();
            *distance = distance.min(apart);
        }
        chosen.push(candidates[best]);
    }
    if chosen.is_empty() {
        chosen.extend(candidates.first());
    }
    chosen.sort_unstable();
    chosen
}

#[cfg(test)]
mod tests {
    use super::super::curves::tests::curves;
    use super::*;

    #[test]
    fn each_expression_is_taken_once_where_it_is_strongest() {
        let made = curves(
            &["a", "b"],
            &[&[0.0, 0.0], &[0.5, 0.0], &[1.0, 0.0], &[0.9, 0.0], &[0.0, 0.0], &[0.0, 0.8], &[0.0, 0.4]],
        );
        assert_eq!(different_moments(&made, 2), [2, 5]);
        assert_eq!(different_moments(&made, 1), [2]);
        assert_eq!(different_moments(&made, 99).len(), 5);
    }

    #[test]
    fn a_face_at_rest_is_one_moment() {
        assert_eq!(different_moments(&curves(&["a"], &[&[0.0], &[0.0]]), 4), [0]);
    }
}
