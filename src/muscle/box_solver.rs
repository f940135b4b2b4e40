//! Bounded least squares on normal equations: minimise ½ xᵀQx − cᵀx with l ≤ x ≤ u (001 eq. 3).
//!
//! The paper solves it with "the active set method" and "Lagrange method for the sub-problems". This is the primal active
//! set: a Cholesky solution over the unknowns that are free, a step towards it as far as the bounds allow, and one unknown
//! freed at a time once it is reached. The objective falls with every step, so that it ends at the one solution. Which
//! unknowns were free is kept from frame to frame, where little changes.

use nalgebra::{Cholesky, DMatrix, DVector};

/// A gradient at a bound that is smaller than this share of what makes it up pulls nothing.
const PULL: f64 = 1e-11;
/// An unknown this near to a bound, relative to 1 and the bound, is on it.
const NEAR: f64 = 1e-13;
/// Steps for each unknown after which rounding, and not the problem, keeps it going.
const PATIENCE: usize = 12;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    Free,
    Lower,
    Upper,
}

/// The unknowns' bounds, and where the last solution stood.
#[derive(Debug, Clone)]
pub struct BoxSolver {
    lower: Vec<f64>,
    upper: Vec<f64>,
    places: Vec<Place>,
    x: DVector<f64>,
    free: Vec<usize>,
    gradient: DVector<f64>,
}

impl BoxSolver {
    /// For unknowns between `lower` and `upper`, one each; infinite bounds are none.
    pub fn new(lower: Vec<f64>, upper: Vec<f64>) -> Self {
        let start = |(l, u): (&f64, &f64)| {
            if l.is_finite() {
                (Place::Lower, *l)
            } else if u.is_finite() {
                (Place::Upper, *u)
            } else {
                (Place::Free, 0.0)
            }
        };
        let (places, x): (Vec<_>, Vec<_>) = lower.iter().zip(&upper).map(start).unzip();
        let count = lower.len();
        Self {
            lower,
            upper,
            places,
            x: x.into(),
            free: Vec::with_capacity(count),
            gradient: DVector::zeros(count),
        }
    }

    /// `count` contractions: 0 to 1, or without an upper bound where exaggeration is allowed (001 §4.1.2).
    pub fn contractions(count: usize, exaggerate: bool) -> Self {
        Self::new(vec![0.0; count], vec![if exaggerate { f64::INFINITY } else { 1.0 }; count])
    }

    /// The last solution.
    pub fn solution(&self) -> &DVector<f64> {
        &self.x
    }

    /// Solves for symmetric positive definite `q`, n × n, and `c`, n, from the last solution on. `None` where `q` is not
    /// positive definite on the free unknowns or not finite; the last solution then stays.
    pub fn solve(&mut self, q: &DMatrix<f64>, c: &DVector<f64>) -> Option<&DVector<f64>> {
        let count = self.x.len();
        // Freeing all that pull at once is quick far from the solution; one at a time never goes round in circles.
        let mut many = 2;
        for _ in 0..PATIENCE * (count + 1) {
            let target = self.unbounded(q, c)?;
            if self.step_towards(&target) {
                continue;
            }
            self.gradient.copy_from(c);
            self.gradient.gemv(1.0, q, &self.x, -1.0);
            if !self.gradient.iter().all(|value| value.is_finite()) {
                return None;
            }
            let mut freed = false;
            let mut strongest: Option<(usize, f64)> = None;
            for i in 0..count {
                let inward = match self.places[i] {
                    Place::Lower => -self.gradient[i],
                    Place::Upper => self.gradient[i],
                    Place::Free => continue,
                };
                let pulls = inward > 0.0 && self.lower[i] < self.upper[i];
                let parts = || q.column(i).iter().zip(&self.x).map(|(q, x)| (q * x).abs()).sum::<f64>();
                if !pulls || inward <= PULL * (c[i].abs() + parts()) {
                    continue;
                }
                if many > 0 {
                    self.places[i] = Place::Free;
                    freed = true;
                } else {
                    let gain = inward * inward / q[(i, i)].max(f64::MIN_POSITIVE);
                    if strongest.is_none_or(|(_, best)| gain > best) {
                        strongest = Some((i, gain));
                    }
                }
            }
            many -= i32::from(many > 0);
            if let Some((i, _)) = strongest {
                self.places[i] = Place::Free;
            } else if !freed {
                break;
            }
        }
        Some(&self.x)
    }

    /// The minimum over the free unknowns with the others where they are.
    fn unbounded(&mut self, q: &DMatrix<f64>, c: &DVector<f64>) -> Option<DVector<f64>> {
        self.free.clear();
        self.free.extend((0..self.places.len()).filter(|&i| self.places[i] == Place::Free));
        let free = &self.free;
        let mut right = DVector::from_fn(free.len(), |k, _| c[free[k]]);
        for (j, place) in self.places.iter().enumerate() {
            if *place != Place::Free && self.x[j] != 0.0 {
                for (right, &i) in right.iter_mut().zip(free) {
                    *right -= q[(i, j)] * self.x[j];
                }
            }
        }
        let block = DMatrix::from_fn(free.len(), free.len(), |a, b| q[(free[a], free[b])]);
        Cholesky::new(block)?.solve_mut(&mut right);
        right.iter().all(|value| value.is_finite()).then_some(right)
    }

    /// Goes there as far as the bounds allow; whether one was met.
    fn step_towards(&mut self, target: &DVector<f64>) -> bool {
        let mut share = 1.0_f64;
        for (&i, &to) in self.free.iter().zip(target) {
            let from = self.x[i];
            let bound = if to < self.lower[i] {
                self.lower[i]
            } else if to > self.upper[i] {
                self.upper[i]
            } else {
                continue;
            };
            share = share.min(((bound - from) / (to - from)).clamp(0.0, 1.0));
        }
        if share >= 1.0 {
            for (&i, &to) in self.free.iter().zip(target) {
                self.x[i] = to;
            }
            return false;
        }
        for (&i, &to) in self.free.iter().zip(target) {
            let from = self.x[i];
            let now = from + (to - from) * share;
            let on = |bound: f64, outward: bool| {
                outward && bound.is_finite() && (now - bound).abs() <= NEAR * (1.0 + bound.abs())
            };
            if on(self.lower[i], to < from) {
                (self.x[i], self.places[i]) = (self.lower[i], Place::Lower);
            } else if on(self.upper[i], to > from) {
                (self.x[i], self.places[i]) = (self.upper[i], Place::Upper);
            } else {
                self.x[i] = now;
            }
        }
        true
    }
}
