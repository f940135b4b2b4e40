//! The moments of a take that differ most.

use super::MuscleCurves;
use crate::lift::FaceState;

/// Nanoseconds to both sides over which an expression is averaged, so that one that is held counts for more than a blink.
const HELD: i64 = 200_000_000;

/// Up to `count` frames, ascending, whose expressions differ most from the neutral and from each other: each is the
/// one farthest from those already chosen, of frames in which the face was seen, if there are any.
pub fn different_moments(curves: &MuscleCurves, count: usize) -> Vec<usize> {
    let frames = curves.frames();
    let seen: Vec<usize> = (0..frames.len()).filter(|&k| frames[k].state == FaceState::Tracking).collect();
    let candidates = if seen.is_empty() { (0..frames.len()).collect() } else { seen };
    let held: Vec<Vec<f64>> = candidates.iter().map(|&k| average(curves, k)).collect();
    // Squared distances to the nearest chosen expression; the neutral is the first.
    let mut far: Vec<f64> = held.iter().map(|values| values.iter().map(|x| x * x).sum()).collect();
    let mut chosen = Vec::new();
    while chosen.len() < count {
        // Of equal distances the earliest counts.
        let best = (0..far.len()).rev().max_by(|&a, &b| far[a].total_cmp(&far[b]));
        let Some(best) = best.filter(|&best| far[best] > 0.0) else { break };
        for (distance, values) in far.iter_mut().zip(&held) {
            let apart = values.iter().zip(&held[best]).map(|(a, b)| (a - b).powi(2)).sum();
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

/// The mean contractions around a frame.
fn average(curves: &MuscleCurves, frame: usize) -> Vec<f64> {
    let frames = curves.frames();
    let middle = frames[frame].time.0;
    let start = frames.partition_point(|other| other.time.0 < middle - HELD);
    let end = frames.partition_point(|other| other.time.0 <= middle.saturating_add(HELD));
    let mut mean = vec![0.0; curves.muscles().len()];
    for frame in &frames[start..end] {
        for (sum, value) in mean.iter_mut().zip(&frame.contractions) {
            *sum += value / (end - start) as f64;
        }
    }
    mean
}

#[cfg(test)]
mod tests {
    use super::super::curves::tests::curves;
    use super::*;

    #[test]
    fn each_expression_is_taken_once_and_a_blink_is_none() {
        // At 25 a second: a smile of a second, a blink of two frames, open jaws of a second.
        let mut rows = vec![[0.0; 3]; 100];
        rows[10..35].fill([1.0, 0.0, 0.0]);
        rows[45..47].fill([0.0, 1.0, 0.0]);
        rows[60..85].fill([0.0, 0.0, 0.8]);
        let rows: Vec<&[f64]> = rows.iter().map(<[f64; 3]>::as_slice).collect();
        let made = curves(&["smile", "blink", "jaw"], &rows);
        let chosen = different_moments(&made, 2);
        assert!((15..30).contains(&chosen[0]) && (65..80).contains(&chosen[1]), "{chosen:?}");
        assert_eq!(different_moments(&made, 1).len(), 1);
        let all = different_moments(&made, 999);
        assert!(all.len() <= 100 && all.is_sorted());
    }

    #[test]
    fn a_face_at_rest_is_one_moment() {
        assert_eq!(different_moments(&curves(&["a"], &[&[0.0], &[0.0]]), 4), [0]);
    }
}
