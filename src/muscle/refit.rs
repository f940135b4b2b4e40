//! New displacements of each marker from the contractions of all frames (001 §4.2).
//!
//! The paper solves Σᵢ xᵢ⁽ᵗ⁾ dᵢⱼ = d̂ⱼ⁽ᵗ⁾ by least squares. A muscle that the takes hardly use has next to no rows there, and
//! noise would be its shape: here each shape is drawn to the draft's by a weight that grows the less it was used, and one
//! that was not used at all keeps the draft's.

use nalgebra::{Cholesky, DMatrix, DVector, Vector3};

use super::{MarkerBasis, MuscleError, Part};

/// How firmly the draft holds: the weight, in frames of full contraction, of a muscle that was used very much.
const HOLD: f64 = 0.01;
/// Used for so many frames of full contraction, a muscle is held twice as firmly; for less, more so.
const LITTLE: f64 = 50.0;

/// Displacements of a frame, one for each marker, millimetres in the frame of the basis' face; `None` where not seen.
pub(super) type Frame = Vec<Option<Vector3<f64>>>;

/// The frames to learn from, with their contractions.
pub(super) struct Lesson<'a> {
    /// T frames.
    pub(super) frames: &'a [&'a Frame],
    /// T × M.
    pub(super) contractions: &'a [Vec<f64>],
}

/// The draft, each shape times its gauge, and which shapes may change.
pub(super) struct Hold<'a> {
    pub(super) draft: &'a MarkerBasis,
    /// M.
    pub(super) gauges: &'a [f64],
    /// M.
    pub(super) idle: &'a [bool],
}

impl Lesson<'_> {
    /// Fits what the muscles of `of` do to the markers of `at`, in `basis`, while all else stays. Where the two differ,
    /// what the markers' own muscles do is taken off first.
    pub(super) fn refit(
        &self,
        basis: &mut MarkerBasis,
        hold: &Hold,
        of: Part,
        at: Part,
    ) -> Result<(), MuscleError> {
        let count = basis.muscles.len();
        let learned: Vec<usize> =
            (0..count).filter(|&i| basis.muscles[i].part == of && !hold.idle[i]).collect();
        let fixed: Vec<usize> = (0..count)
            .filter(|i| {
                !learned.contains(i) && (basis.muscles[*i].part == at || basis.muscles[*i].part == of)
            })
            .collect();
        let markers: Vec<usize> = (0..basis.markers()).filter(|&j| basis.parts[j] == Some(at)).collect();
        if learned.is_empty() || markers.is_empty() {
            return Ok(());
        }
        let x = DMatrix::from_fn(self.frames.len(), learned.len(), |t, k| self.contractions[t][learned[k]]);
        let gram = x.tr_mul(&x);
        let anchors = DVector::from_fn(learned.len(), |k, _| HOLD * (1.0 + LITTLE / gram[(k, k)].max(1e-9)));
        let bends: Vec<_> = match basis.jaw() {
            Some(jaw) => self.contractions.iter().map(|x| basis.bend(x[jaw])).collect(),
            None => Vec::new(),
        };
        let mut whole = gram.clone();
        whole.set_diagonal(&(gram.diagonal() + &anchors));
        let whole = Cholesky::new(whole).ok_or_else(singular)?;
        let mut wanted = DMatrix::zeros(self.frames.len(), 3);
        for marker in markers {
            let mut own = None;
            for (t, frame) in self.frames.iter().enumerate() {
                let contractions = &self.contractions[t];
                let Some(mut left) = frame[marker] else {
                    wanted.row_mut(t).fill(0.0);
                    let own = own.get_or_insert_with(|| gram.clone());
                    let row = x.row(t).transpose();
                    own.ger(-1.0, &row, &row, 1.0);
                    continue;
                };
                for &i in &fixed {
                    left -= basis.vectors[i][marker] * contractions[i];
                }
                if let Some(bend) = bends.get(t) {
                    left -= basis.bend_at(bend, marker);
                }
                wanted.row_mut(t).copy_from(&left.transpose());
            }
            let mut right = x.tr_mul(&wanted);
            for (k, &i) in learned.iter().enumerate() {
                let draft = hold.draft.vectors[i][marker] * (hold.gauges[i] * anchors[k]);
                right.row_mut(k).zip_apply(&draft.transpose(), |a, b| *a += b);
            }
            let solved = match own {
                None => whole.solve(&right),
                Some(mut own) => {
                    own.set_diagonal(&(own.diagonal() + &anchors));
                    Cholesky::new(own).ok_or_else(singular)?.solve(&right)
                }
            };
            for (k, &i) in learned.iter().enumerate() {
                basis.vectors[i][marker] = Vector3::new(solved[(k, 0)], solved[(k, 1)], solved[(k, 2)]);
            }
        }
        Ok(())
    }
}

fn singular() -> MuscleError {
    MuscleError::Training {
        reason: "the contractions of the takes are not finite".to_owned(),
        remedy: "Leave out the take with damaged frames",
    }
}
