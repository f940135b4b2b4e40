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
    /// 3n × 12: B, the millimetres that the jaw's bend makes.
    bending: DMatrix<f64>,
    /// m × m and m × 12: DᵀD and DᵀB, of all markers and of those that a frame shows.
    whole: (DMatrix<f64>, DMatrix<f64>),
    shown: (DMatrix<f64>, DMatrix<f64>),
    ridge: f64,
    solver: BoxSolver,
    missing: Vec<usize>,
    /// 3n: d̂, 0 where it is missing; then what the solution leaves.
    left: DVector<f64>,
    /// m: Dᵀd̂, and the same less the jaw's bend.
    pulls: DVector<f64>,
    right: DVector<f64>,
    /// By how much a jaw's contraction changes that is solved with the bend of another, for each unit of that.
    slope: f64,
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
        let mut bending = DMatrix::zeros(rows, 12);
        for (k, marker) in markers.iter().enumerate() {
            bending.fixed_view_mut::<3, 12>(3 * k, 0).copy_from(&basis.bending(*marker));
        }
        let mut gram = columns.tr_mul(&columns);
        let ridge = (RIDGE * gram.trace() / muscles.len().max(1) as f64).max(f64::MIN_POSITIVE);
        for k in 0..muscles.len() {
            gram[(k, k)] += ridge;
        }
        let whole = (gram, columns.tr_mul(&bending));
        Self {
            jaw: basis.jaw().and_then(|jaw| muscles.iter().position(|muscle| *muscle == jaw)),
            shown: whole.clone(),
            whole,
            solver: BoxSolver::contractions(muscles.len(), exaggerate),
            missing: Vec::with_capacity(markers.len()),
            left: DVector::zeros(rows),
            pulls: DVector::zeros(muscles.len()),
            right: DVector::zeros(muscles.len()),
            slope: 0.0,
            muscles,
            markers,
            columns,
            bending,
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
            self.left.fixed_rows_mut::<3>(3 * k).copy_from(&seen.unwrap_or_default());
        }
        if self.missing.len() < self.markers.len() && !self.muscles.is_empty() {
            self.show();
            self.pulls.gemv_tr(1.0, &self.columns, &self.left, 0.0);
            self.settle(basis);
            for (k, muscle) in self.muscles.iter().enumerate() {
                contractions[*muscle] = self.solver.solution()[k];
            }
        }
        self.fit(basis)
    }

    /// Solves with the jaw's bend of a contraction until it is the solution's own: by the secant of how far the two are apart.
    fn settle(&mut self, basis: &MarkerBasis) {
        let mut bent = self.jaw.map(|jaw| self.solver.solution()[jaw]);
        let mut before: Option<(f64, f64)> = None;
        for _ in 0..MOST_BENDS {
            let (gram, bends) = if self.missing.is_empty() { &self.whole } else { &self.shown };
            self.right.copy_from(&self.pulls);
            if let Some(bent) = bent.filter(|bent| *bent != 0.0) {
                self.right.gemv(-1.0, bends, &basis.bend(bent), 1.0);
            }
            if self.solver.solve(gram, &self.right).is_none() {
                break;
            }
            let (Some(at), Some(jaw)) = (bent, self.jaw) else { break };
            let apart = self.solver.solution()[jaw] - at;
            if apart.abs() <= SETTLED {
                break;
            }
            if let Some((last_at, last_apart)) = before
                && (at - last_at).abs() > SETTLED
            {
                // A bound met on the way makes a kink; beyond these slopes it is no guide.
                self.slope = (1.0 + (apart - last_apart) / (at - last_at)).clamp(-0.5, 0.5);
            }
            before = Some((at, apart));
            bent = Some((at + apart / (1.0 - self.slope)).max(0.0));
        }
    }

    /// The Gram matrices of the markers that are seen: less the rows of the few that are not, or those of the few that are.
    fn show(&mut self) {
        if self.missing.is_empty() {
            return;
        }
        if 2 * self.missing.len() <= self.markers.len() {
            self.shown.0.copy_from(&self.whole.0);
            self.shown.1.copy_from(&self.whole.1);
            for k in 0..self.missing.len() {
                self.add(self.missing[k], -1.0);
            }
        } else {
            self.shown.0.fill(0.0);
            self.shown.0.fill_diagonal(self.ridge);
            self.shown.1.fill(0.0);
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
        let (gram, bends) = &mut self.shown;
        for row in 3 * marker..3 * marker + 3 {
            let own = self.columns.row(row);
            for (by, mut to) in own.iter().zip(gram.column_iter_mut()) {
                to.iter_mut().zip(own.iter()).for_each(|(to, own)| *to += sign * by * own);
            }
            for (by, mut to) in self.bending.row(row).iter().zip(bends.column_iter_mut()) {
                to.iter_mut().zip(own.iter()).for_each(|(to, own)| *to += sign * by * own);
            }
        }
    }

    /// What the solution leaves.
    fn fit(&mut self, basis: &MarkerBasis) -> PartFit {
        if let Some(jaw) = self.jaw {
            self.left.gemv(-1.0, &self.bending, &basis.bend(self.solver.solution()[jaw]), 1.0);
        }
        self.left.gemv(-1.0, &self.columns, self.solver.solution(), 1.0);
        let mut fit = PartFit { seen: self.markers.len() - self.missing.len(), ..PartFit::default() };
        let mut missing = self.missing.iter().peekable();
        for k in 0..self.markers.len() {
            if missing.next_if(|gone| **gone == k).is_none() {
                let squared = self.left.fixed_rows::<3>(3 * k).norm_squared();
                fit.squared += squared;
                fit.error += squared.sqrt();
            }
        }
        fit.error /= fit.seen.max(1) as f64;
        fit
    }
}
