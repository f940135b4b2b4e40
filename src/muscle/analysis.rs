//! Contractions of a frame from its markers' displacements (001 §4.1.2): eq. 2 and 3, each part of the face by itself.

use nalgebra::{DMatrix, DVector, Vector3};

use super::{BoxSolver, MarkerBasis, Part};

/// Added to the diagonal, of its mean: too little to see, enough where missing markers leave two muscles alike.
const RIDGE: f64 = 1e-10;
/// Solutions for one frame while the jaw's arc settles, and the change of its contraction at which it has.
const MOST_BENDS: usize = 12;
const SETTLED: f64 = 1e-7;

/// How well contractions explain a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PartFit {
    /// Markers of the part that were seen. Where there are none, its contractions stay those of the frame before.
    pub seen: usize,
    /// Per-frame marker error of 001 fig. 5: the mean of |d̂ⱼ − dⱼ| over them, millimetres.
    pub error: f64,
    /// The sum of |d̂ⱼ − dⱼ|², mm².
    pub squared: f64,
}

/// Both parts of a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FrameFit {
    /// Forehead, brows and lids.
    pub upper: PartFit,
    /// All below.
    pub lower: PartFit,
}

/// Analyses frame after frame; the next starts from where the last one ended, and ends at the same place as from any other.
#[derive(Debug, Clone)]
pub struct Analyser {
    basis: MarkerBasis,
    halves: [Half; 2],
    contractions: Vec<f64>,
}

impl Analyser {
    /// For contractions from 0 to 1, or from 0 upwards if `exaggerate`.
    pub fn new(basis: MarkerBasis, exaggerate: bool) -> Self {
        let halves = [Part::Upper, Part::Lower].map(|part| Half::new(&basis, part, exaggerate));
        let contractions = vec![0.0; basis.muscles.len()];
        Self { basis, halves, contractions }
    }

    /// The shapes by which frames are analysed.
    pub fn basis(&self) -> &MarkerBasis {
        &self.basis
    }

    /// The last frame's contractions, one for each muscle.
    pub fn contractions(&self) -> &[f64] {
        &self.contractions
    }

    /// Solves one frame by its displacements d̂, one for each marker in the basis' frame, millimetres; `None` where a
    /// marker was not seen.
    pub fn solve(&mut self, displacements: &[Option<Vector3<f64>>]) -> FrameFit {
        let [upper, lower] = &mut self.halves;
        FrameFit {
            upper: upper.solve(&self.basis, displacements, &mut self.contractions),
            lower: lower.solve(&self.basis, displacements, &mut self.contractions),
        }
    }
}

/// Muscles and markers of one part.
#[derive(Debug, Clone)]
struct Half {
    muscles: Vec<usize>,
    markers: Vec<usize>,
    /// Which of `muscles` is the jaw.
    jaw: Option<usize>,
    /// 3n × m: D.
    columns: DMatrix<f64>,
    /// m × m: DᵀD, of all markers and of those that a frame shows.
    gram: DMatrix<f64>,
    shown: DMatrix<f64>,
    ridge: f64,
    solver: BoxSolver,
    missing: Vec<usize>,
    /// 3n: d̂, 0 where it is missing; the same less the jaw's bend; what is left.
    seen: DVector<f64>,
    straight: DVector<f64>,
    right: DVector<f64>,
}

impl Half {
    fn new(basis: &MarkerBasis, part: Part, exaggerate: bool) -> Self {
        let muscles: Vec<usize> =
            (0..basis.muscles.len()).filter(|&i| basis.muscles[i].part == part).collect();
        let markers: Vec<usize> = (0..basis.markers()).filter(|&j| basis.parts[j] == Some(part)).collect();
        let rows = 3 * markers.len();
        let columns = DMatrix::from_fn(rows, muscles.len(), |row, k| {
            basis.vectors[muscles[k]][markers[row / 3]][row % 3]
        });
        let mut gram = columns.tr_mul(&columns);
        let ridge = (RIDGE * gram.trace() / muscles.len().max(1) as f64).max(f64::MIN_POSITIVE);
        for k in 0..muscles.len() {
            gram[(k, k)] += ridge;
        }
        Self {
            jaw: basis.jaw().and_then(|jaw| muscles.iter().position(|muscle| *muscle == jaw)),
            shown: gram.clone(),
            solver: BoxSolver::contractions(muscles.len(), exaggerate),
            missing: Vec::with_capacity(markers.len()),
            seen: DVector::zeros(rows),
            straight: DVector::zeros(rows),
            right: DVector::zeros(muscles.len()),
            muscles,
            markers,
            columns,
            gram,
            ridge,
        }
    }

    fn solve(
        &mut self,
        basis: &MarkerBasis,
        displacements: &[Option<Vector3<f64>>],
        contractions: &mut [f64],
    ) -> PartFit {
        self.missing.clear();
        for (k, marker) in self.markers.iter().enumerate() {
            let seen = displacements.get(*marker).copied().flatten();
            if seen.is_none() {
                self.missing.push(k);
            }
            self.seen.fixed_rows_mut::<3>(3 * k).copy_from(&seen.unwrap_or_default());
        }
        let shown = self.markers.len() - self.missing.len();
        if shown == 0 || self.muscles.is_empty() {
            return self.fit(basis);
        }
        self.show();
        let mut bent = self.jaw.map(|jaw| self.solver.solution()[jaw]);
        for _ in 0..MOST_BENDS {
            self.straighten(basis, bent);
            self.right.gemv_tr(1.0, &self.columns, &self.straight, 0.0);
            let gram = if self.missing.is_empty() { &self.gram } else { &self.shown };
            if self.solver.solve(gram, &self.right).is_none() {
                break;
            }
            let now = self.jaw.map(|jaw| self.solver.solution()[jaw]);
            if now.zip(bent).is_none_or(|(now, bent)| (now - bent).abs() <= SETTLED) {
                break;
            }
            bent = now;
        }
        for (k, muscle) in self.muscles.iter().enumerate() {
            contractions[*muscle] = self.solver.solution()[k];
        }
        self.fit(basis)
    }

    /// The Gram matrix of the markers that are seen: less the rows of the few that are not, or those of the few that are.
    fn show(&mut self) {
        if self.missing.is_empty() {
            return;
        }
        if 2 * self.missing.len() <= self.markers.len() {
            self.shown.copy_from(&self.gram);
            for k in 0..self.missing.len() {
                self.add(self.missing[k], -1.0);
            }
        } else {
            self.shown.fill(0.0);
            self.shown.fill_diagonal(self.ridge);
            let mut next = 0;
            for marker in 0..self.markers.len() {
                if self.missing.get(next) == Some(&marker) {
                    next += 1;
                } else {
                    self.add(marker, 1.0);
                }
            }
        }
    }

    fn add(&mut self, marker: usize, sign: f64) {
        for row in 3 * marker..3 * marker + 3 {
            for b in 0..self.muscles.len() {
                let by = sign * self.columns[(row, b)];
                for a in 0..self.muscles.len() {
                    self.shown[(a, b)] += by * self.columns[(row, a)];
                }
            }
        }
    }

    /// d̂ less what the jaw's arc adds at a contraction.
    fn straighten(&mut self, basis: &MarkerBasis, jaw: Option<f64>) {
        self.straight.copy_from(&self.seen);
        let Some(jaw) = jaw.filter(|jaw| *jaw != 0.0) else { return };
        let bend = basis.bend(jaw);
        let mut missing = self.missing.iter().peekable();
        for (k, marker) in self.markers.iter().enumerate() {
            if missing.next_if(|gone| **gone == k).is_none() {
                let mut own = self.straight.fixed_rows_mut::<3>(3 * k);
                own -= basis.bend_at(&bend, *marker);
            }
        }
    }

    /// What the solution leaves.
    fn fit(&mut self, basis: &MarkerBasis) -> PartFit {
        self.straighten(basis, self.jaw.map(|jaw| self.solver.solution()[jaw]));
        self.straight.gemv(-1.0, &self.columns, self.solver.solution(), 1.0);
        let mut fit = PartFit { seen: self.markers.len() - self.missing.len(), ..PartFit::default() };
        let mut missing = self.missing.iter().peekable();
        for k in 0..self.markers.len() {
            if missing.next_if(|gone| **gone == k).is_none() {
                let squared = self.straight.fixed_rows::<3>(3 * k).norm_squared();
                fit.squared += squared;
                fit.error += squared.sqrt();
            }
        }
        fit.error /= fit.seen.max(1) as f64;
        fit
    }
}
