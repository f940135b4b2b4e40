//! How strongly each action unit is on in a performer's face.
//!
//! The library's vectors are carried to the performer's neutral, and the magnitudes are those in 0..=1 by which they
//! explain the landmarks' displacements best: least squares over the landmarks, of which what is seen in the picture
//! counts in full and the inferred depth little, with a little ridge that keeps actions apart which look alike. The
//! problem is convex; coordinate descent on its normal equations finds its one solution. Lids are measured by themselves
//! (`lift::closure`), so AU 5 and 45 come from there.

use nalgebra::{DMatrix, DVector, Vector3};

use super::{RigError, SourceFace, TargetFace, Transfer, TransferRule};
use crate::{
    actions::{Action, ActionKey, ActionLibrary, ActionWeights},
    lift::{Expression, Eyes, Side},
    tracking::{Region, SKIN_LANDMARK_COUNT, landmark_table},
};

/// Actions that landmarks tell apart; the jaw is one variable, AU27, and shared out to AU26 afterwards.
const SEEN: [u8; 20] = [1, 2, 4, 6, 7, 9, 10, 12, 14, 15, 16, 17, 18, 20, 22, 23, 24, 25, 27, 28];
/// Actions that the lids tell of.
const FROM_LIDS: [u8; 2] = [5, 45];
/// How much of AU27's motion AU26 is at magnitude 1 (`catalogue.toml`).
const DROP: f64 = 0.45;
/// How far a fully raised lid opens the eye beyond the neutral, as a closure.
const WIDE: f64 = 0.35;
/// Weight of displacements along the line of sight.
const DEPTH: f64 = 0.15;
/// Ridge over the squared outer canthal distance: half a millimetre's worth at every landmark for a full magnitude.
const RIDGE: f64 = 2e-3;
/// Coordinate descent ends when no magnitude changes by more, or after so many sweeps.
const SETTLED: f64 = 1e-7;
const SWEEPS: usize = 400;

/// The normal equations of one performer and one library.
#[derive(Debug, Clone)]
pub struct ActionSolver {
    actions: Vec<Action>,
    to_performer: Transfer,
    /// Landmarks that count, with their weights' square roots along the level axes.
    members: Vec<(usize, Vector3<f64>)>,
    level: nalgebra::Rotation3<f64>,
    /// 3 · members × actions.
    matrix: DMatrix<f64>,
    gram: DMatrix<f64>,
}

impl ActionSolver {
    /// For a performer's neutral.
    pub fn new(library: &ActionLibrary, performer: &SourceFace) -> Result<Self, RigError> {
        let face = TargetFace::of_source(performer)?;
        let to_performer = Transfer::new(&SourceFace::library(library), &face, TransferRule::Spline)?;
        let actions: Vec<Action> =
            library.actions.iter().filter(|action| SEEN.contains(&action.key.au)).cloned().collect();
        let members: Vec<(usize, Vector3<f64>)> = (0..SKIN_LANDMARK_COUNT)
            .filter_map(|i| {
                let weight: f64 = match landmark_table()[i].region {
                    Region::Oval => return None,
                    Region::Lids => 0.3,
                    Region::Lips => 0.7,
                    _ => 1.0,
                };
                Some((i, Vector3::new(1.0, 1.0, DEPTH) * weight.sqrt()))
            })
            .collect();
        let mut matrix = DMatrix::zeros(3 * members.len(), actions.len());
        for (j, action) in actions.iter().enumerate() {
            for moved in &action.vectors {
                if let Ok(row) = members.binary_search_by_key(&moved.handle, |member| member.0) {
                    let vector = performer.level * to_performer.vector(moved.handle, &moved.vector);
                    let weighted = vector.component_mul(&members[row].1);
                    for axis in 0..3 {
                        matrix[(3 * row + axis, j)] = weighted[axis];
                    }
                }
            }
        }
        let mut gram = matrix.transpose() * &matrix;
        let scale = performer.outer_canthal_distance();
        for k in 0..actions.len() {
            gram[(k, k)] += RIDGE * scale * scale;
        }
        Ok(Self { actions, to_performer, members, level: performer.level, matrix, gram })
    }

    /// The actions that are solved for.
    pub fn keys(&self) -> impl Iterator<Item = ActionKey> + '_ {
        self.actions.iter().map(|action| action.key)
    }

    /// Numbers of all units that [`ActionSolver::weights`] tells of, ascending.
    pub fn units(&self) -> Vec<u8> {
        let mut units: Vec<u8> = self.keys().map(|key| key.au).chain(FROM_LIDS).collect();
        if units.contains(&27) {
            units.push(26);
        }
        units.sort_unstable();
        units.dedup();
        units
    }

    pub(super) fn actions(&self) -> &[Action] {
        &self.actions
    }

    /// A displacement of one of the library's handles, on the performer.
    pub(super) fn to_performer(&self, handle: usize, vector: &Vector3<f64>) -> Vector3<f64> {
        self.to_performer.vector(handle, vector)
    }

    /// Magnitudes in the order of [`ActionSolver::keys`], each 0..=1. `vectors` are the landmarks' displacements,
    /// performer's scan frame, millimetres; `magnitudes` is where to start from and what comes out.
    pub fn solve(&self, vectors: &[Vector3<f64>], magnitudes: &mut [f64]) {
        let mut seen = DVector::<f64>::zeros(self.matrix.nrows());
        for (row, (landmark, weights)) in self.members.iter().enumerate() {
            let weighted = (self.level * vectors[*landmark]).component_mul(weights);
            seen.fixed_rows_mut::<3>(3 * row).copy_from(&weighted);
        }
        // What each magnitude still pulls, kept up as they change: most are off and stay so.
        let mut pull = self.matrix.tr_mul(&seen);
        for (column, &magnitude) in self.gram.column_iter().zip(magnitudes.iter()) {
            pull.axpy(-magnitude, &column, 1.0);
        }
        for _ in 0..SWEEPS {
            let mut change = 0.0_f64;
            for (j, magnitude) in magnitudes.iter_mut().enumerate() {
                let next = (*magnitude + pull[j] / self.gram[(j, j)]).clamp(0.0, 1.0);
                let step = next - *magnitude;
                if step != 0.0 {
                    pull.axpy(-step, &self.gram.column(j), 1.0);
                    *magnitude = next;
                    change = change.max(step.abs());
                }
            }
            if change < SETTLED {
                break;
            }
        }
    }

    /// The action units of one expression, solved for from nothing.
    pub fn measure(&self, expression: &Expression) -> ActionWeights {
        let mut magnitudes = vec![0.0; self.actions.len()];
        self.solve(&expression.displacements.vectors, &mut magnitudes);
        self.weights(&magnitudes, &expression.eyes)
    }

    /// A solution as action units, the jaw shared out and the lids added.
    pub fn weights(&self, magnitudes: &[f64], eyes: &Eyes) -> ActionWeights {
        let mut weights = ActionWeights::default();
        let mut set = |au: u8, side: Option<Side>, value: f64| {
            // In range by construction, so there is no error to handle.
            let _ = weights.set(ActionKey { au, side }, value.clamp(0.0, 1.0));
        };
        for (key, &magnitude) in self.keys().zip(magnitudes) {
            if key.au == 27 {
                set(26, None, magnitude / DROP);
                set(27, None, magnitude - DROP);
            } else {
                set(key.au, key.side, magnitude);
            }
        }
        for side in Side::BOTH {
            let closure = eyes.of(side).closure;
            set(5, Some(side), -closure / WIDE);
            set(45, Some(side), closure);
        }
        weights
    }
}
