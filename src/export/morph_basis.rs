//! A facial animation in as few morph targets as keep it within a tolerance.
//!
//! The rig moves V vertices by B·q, where q holds C control displacements, C × 3, and all three axes share B, V × C.
//! The principal components of the vertices' motion are found without forming it, in the metric G = BᵀB/V: the mean
//! over vertices of |B·q|² is Σₐ qₐᵀ G qₐ over the three axes. No mean is subtracted, so that zero weights are exactly
//! the neutral face. The truncated basis is the best of its rank (Eckart–Young), so the number of targets is the
//! smallest possible for this error.

use nalgebra::{DMatrix, DVector, MatrixXx3, SymmetricEigen};

/// Why an animation could not be compressed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MorphBasisError {
    /// The arguments do not fit together.
    #[error("cannot find morph targets: {reason}. {remedy}")]
    Refused {
        /// What was found.
        reason: String,
        /// What the caller can do.
        remedy: &'static str,
    },
    /// The tolerance is below what 64-bit numbers resolve in this motion.
    #[error(
        "cannot find morph targets: the error stays at {reached:e}, above the tolerance {tolerance:e}. Choose a larger \
         tolerance"
    )]
    ToleranceTooFine {
        /// Smallest root-mean-square error reached.
        reached: f64,
        /// What was asked for.
        tolerance: f64,
    },
}

/// Morph targets in control space and how strongly each frame shows them.
#[derive(Debug, Clone, PartialEq)]
pub struct MorphBasis {
    /// K × (C × 3) control displacements at weight 1, most important first; B times each is a morph target.
    pub shapes: Vec<MatrixXx3<f64>>,
    /// T × K. In every column the largest size is 1 and the first weight of that size is positive.
    pub weights: DMatrix<f64>,
    /// Root mean square over frames and vertices of the vertex error's length, in the displacements' unit.
    pub rms: f64,
    /// The same over vertices in the worst frame.
    pub worst_frame_rms: f64,
}

/// Compresses T frames of control displacements.
///
/// `gram` is BᵀB/V, C × C; each frame is C × 3; `tolerance` bounds [`MorphBasis::rms`], in the frames' unit. Costs one
/// symmetric eigenproblem of size min(T, 3C). Frames that do not move give no shapes. Refuses sizes that do not match,
/// numbers that are not finite, an asymmetric Gram matrix, and a tolerance that is not positive.
pub fn compress(
    gram: &DMatrix<f64>,
    frames: &[MatrixXx3<f64>],
    tolerance: f64,
) -> Result<MorphBasis, MorphBasisError> {
    check(gram, frames, tolerance)?;
    if frames.is_empty() || gram.is_empty() {
        let weights = DMatrix::zeros(frames.len(), 0);
        return Ok(MorphBasis { shapes: Vec::new(), weights, rms: 0.0, worst_frame_rms: 0.0 });
    }
    let motion = Motion::new(gram, frames);
    let Spectrum { energy, vectors, spread } =
        if frames.len() <= 3 * gram.nrows() { motion.by_frames()? } else { motion.by_controls()? };
    // Eigenvalues say where to cut; what counts is the residual itself, measured after the cut.
    let allowed = tolerance * tolerance * frames.len() as f64;
    let mut tail = 0.0;
    let mut wanted = energy.len();
    while wanted > 0 && tail + energy[wanted - 1].max(0.0) <= allowed {
        tail += energy[wanted - 1].max(0.0);
        wanted -= 1;
    }
    let mut kept = Truncation::new(&motion);
    let mut directions = vectors.column_iter().map(|vector| match &spread {
        Some(spread) => spread * vector,
        None => vector.into_owned(),
    });
    for direction in directions.by_ref().take(wanted) {
        kept.extend(direction);
    }
    loop {
        let (rms, worst_frame_rms) = motion.errors(&kept.residual);
        if rms <= tolerance {
            return Ok(kept.scaled(rms, worst_frame_rms));
        }
        let Some(direction) = directions.next() else {
            return Err(MorphBasisError::ToleranceTooFine { reached: rms, tolerance });
        };
        kept.extend(direction);
    }
}

fn check(gram: &DMatrix<f64>, frames: &[MatrixXx3<f64>], tolerance: f64) -> Result<(), MorphBasisError> {
    let refuse = |reason: String, remedy| Err(MorphBasisError::Refused { reason, remedy });
    let controls = gram.nrows();
    if gram.ncols() != controls {
        return refuse(format!("the Gram matrix is {controls} × {}", gram.ncols()), "Give BᵀB/V");
    }
    if !gram.iter().all(|value| value.is_finite()) {
        return refuse("the Gram matrix is not finite".into(), "Check the warp basis");
    }
    let size = gram.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
    if (gram - gram.transpose()).iter().any(|gap| gap.abs() > 1e-9 * size) {
        return refuse("the Gram matrix is not symmetric".into(), "Give BᵀB/V");
    }
    if let Some(frame) = frames.iter().position(|frame| frame.nrows() != controls) {
        let rows = frames[frame].nrows();
        return refuse(
            format!("frame {frame} moves {rows} controls of {controls}"),
            "Give every frame all controls",
        );
    }
    if let Some(frame) = frames.iter().position(|frame| !frame.iter().all(|value| value.is_finite())) {
        return refuse(
            format!("frame {frame} is not finite"),
            "Leave out frames that could not be solved, or hold the last good one",
        );
    }
    if !(tolerance.is_finite() && tolerance > 0.0) {
        return refuse(format!("the tolerance is {tolerance}"), "Choose a positive length");
    }
    Ok(())
}

/// Energies, descending, and for each a column of `vectors` that, multiplied by `spread`, is its direction over the T
/// frames. Few are wanted of many: the product waits until then.
struct Spectrum {
    energy: Vec<f64>,
    vectors: DMatrix<f64>,
    spread: Option<DMatrix<f64>>,
}

struct Motion<'a> {
    gram: &'a DMatrix<f64>,
    /// T × C for x, y and z.
    axes: [DMatrix<f64>; 3],
}

impl<'a> Motion<'a> {
    fn new(gram: &'a DMatrix<f64>, frames: &[MatrixXx3<f64>]) -> Self {
        let axes = [0, 1, 2].map(|axis| {
            DMatrix::from_fn(frames.len(), gram.nrows(), |frame, control| frames[frame][(control, axis)])
        });
        Self { gram, axes }
    }

    /// From the T × T products of frames with each other.
    fn by_frames(&self) -> Result<Spectrum, MorphBasisError> {
        let frames = self.axes[0].nrows();
        let mut products = DMatrix::zeros(frames, frames);
        for axis in &self.axes {
            products += axis * (self.gram * axis.transpose());
        }
        descending(products)
    }

    /// From the 3C × 3C products of whitened controls with each other, for long clips.
    fn by_controls(&self) -> Result<Spectrum, MorphBasisError> {
        let controls = self.gram.nrows();
        let metric = SymmetricEigen::new(self.gram.clone());
        // gram = root · rootᵀ; rounding can leave a semidefinite matrix with eigenvalues a little below zero.
        let root = &metric.eigenvectors
            * DMatrix::from_diagonal(&metric.eigenvalues.map(|value| value.max(0.0).sqrt()));
        let mut whitened = DMatrix::zeros(self.axes[0].nrows(), 3 * controls);
        for (at, axis) in self.axes.iter().enumerate() {
            whitened.columns_mut(at * controls, controls).copy_from(&(axis * &root));
        }
        let spectrum = descending(whitened.transpose() * &whitened)?;
        Ok(Spectrum { spread: Some(whitened), ..spectrum })
    }

    /// Root mean square vertex error over all frames, and in the worst one, for residuals like `axes`.
    fn errors(&self, residual: &[DMatrix<f64>; 3]) -> (f64, f64) {
        let mut squares = DVector::zeros(residual[0].nrows());
        for axis in residual {
            let weighted = axis * self.gram;
            for (frame, square) in squares.iter_mut().enumerate() {
                *square += weighted.row(frame).dot(&axis.row(frame));
            }
        }
        let mean = squares.sum() / squares.len().max(1) as f64;
        let worst = squares.iter().fold(0.0, |worst: f64, square| worst.max(*square));
        (mean.max(0.0).sqrt(), worst.sqrt())
    }
}

fn descending(products: DMatrix<f64>) -> Result<Spectrum, MorphBasisError> {
    // The iteration below would not end on infinities.
    if !products.iter().all(|value| value.is_finite()) {
        return Err(MorphBasisError::Refused {
            reason: "the displacements are too large to be squared".into(),
            remedy: "Check the unit of the displacements",
        });
    }
    let eigen = SymmetricEigen::new(products);
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let energy = order.iter().map(|&at| eigen.eigenvalues[at]).collect();
    Ok(Spectrum { energy, vectors: eigen.eigenvectors.select_columns(&order), spread: None })
}

/// Orthonormal directions over the frames, and what of the motion they leave.
struct Truncation {
    directions: Vec<DVector<f64>>,
    shapes: Vec<MatrixXx3<f64>>,
    residual: [DMatrix<f64>; 3],
}

impl Truncation {
    fn new(motion: &Motion) -> Self {
        Self { directions: Vec::new(), shapes: Vec::new(), residual: motion.axes.clone() }
    }

    fn extend(&mut self, mut direction: DVector<f64>) {
        let size = direction.norm();
        // Twice: weak components of long clips come out of the eigenproblem only nearly orthogonal.
        for _ in 0..2 {
            for earlier in &self.directions {
                let share = earlier.dot(&direction);
                direction.axpy(-share, earlier, 1.0);
            }
        }
        let left = direction.norm();
        if left <= 1e-12 * size || left == 0.0 {
            return;
        }
        direction /= left;
        let mut shape = MatrixXx3::zeros(self.residual[0].ncols());
        for (axis, residual) in self.residual.iter_mut().enumerate() {
            let column = residual.tr_mul(&direction);
            residual.ger(-1.0, &direction, &column, 1.0);
            shape.set_column(axis, &column);
        }
        self.directions.push(direction);
        self.shapes.push(shape);
    }

    fn scaled(self, rms: f64, worst_frame_rms: f64) -> MorphBasis {
        let mut weights = DMatrix::zeros(self.residual[0].nrows(), self.directions.len());
        let mut shapes = self.shapes;
        for (at, direction) in self.directions.iter().enumerate() {
            let size = direction.amax();
            // Among equals the first one decides, whatever rounding says of them.
            let lead = direction.iter().find(|value| value.abs() >= size * (1.0 - 1e-9));
            let scale = lead.map_or(size, |lead| size.copysign(*lead));
            weights.set_column(at, &(direction / scale));
            shapes[at] *= scale;
        }
        MorphBasis { shapes, weights, rms, worst_frame_rms }
    }
}

#[cfg(test)]
#[path = "morph_basis_tests.rs"]
mod tests;
