//! The precomputed warp: neutral controls never move, so a frame is one product with a fixed matrix.

use nalgebra::{DMatrix, Point3};

use super::product::multiply;
use super::unit_box::require_finite;
use super::{Factored, Input, Kernel, Options, SplineError};

/// Vertices worked on at once while building: eight pairs of f64 are what the baseline's registers hold.
const TILE: usize = 16;

/// B, vertices × controls: vertex v moves by Σⱼ B\[v, j\]·qⱼ when control j moves by qⱼ.
///
/// Computed in f64 from a displacement spline (000 eq. 4.19 with V = displacements, so that none gives exactly none),
/// stored in f32 control by control (Bᵀ). The rounding to f32 costs under 1e-4 mm on a face in millimetres.
#[derive(Clone, Debug, PartialEq)]
pub struct Warp {
    vertices: usize,
    controls: usize,
    /// Bᵀ, row j holding every vertex's share in control j.
    shares: Vec<f32>,
}

impl Warp {
    /// Builds B for `points` from a spline on `controls` and `anchors`, all in one unit and frame.
    ///
    /// Anchors are held at zero: they take part in the fit but have no column (002's phantom points around the face).
    /// Time and memory go with points × controls.
    ///
    /// # Errors
    /// As [`Factored::new`], with centres counted through the controls and then the anchors; a point that is not
    /// finite; or one so far off that a share overflows f32, named by its entry as in [`Warp::from_columns`].
    pub fn new(
        kernel: Kernel,
        controls: &[Point3<f64>],
        anchors: &[Point3<f64>],
        points: &[Point3<f64>],
        options: Options,
    ) -> Result<Self, SplineError> {
        require_finite(points, Input::Point)?;
        let centres = [controls, anchors].concat();
        let factored = Factored::<3>::new(kernel, &centres, options)?;
        let coefficients = factored.cardinal(controls.len())?;
        let basis = factored.basis();

        let vertices = points.len();
        let mut shares = vec![0.0; vertices * controls.len()];
        let mut functions = vec![[0.0_f64; TILE]; basis.len()];
        for (tile, points) in points.chunks(TILE).enumerate() {
            for (lane, point) in points.iter().enumerate() {
                basis.at(&basis.unit_box().enter(point), |i, value| functions[i][lane] = value);
            }
            for (j, column) in coefficients.column_iter().enumerate() {
                let mut sums = [0.0_f64; TILE];
                for (values, coefficient) in functions.iter().zip(column.iter()) {
                    for (sum, value) in sums.iter_mut().zip(values) {
                        *sum += value * coefficient;
                    }
                }
                let start = j * vertices + tile * TILE;
                for (share, sum) in shares[start..start + points.len()].iter_mut().zip(sums) {
                    *share = sum as f32;
                }
            }
        }
        Self::checked(vertices, controls.len(), shares)
    }

    /// A warp built in another way: `fill(j, column)` writes control j's share for every vertex into `column`, which
    /// has one entry for each vertex and comes zeroed.
    ///
    /// # Errors
    /// An entry that is not finite; its index is j · vertices + v.
    ///
    /// Two warps blended vertex by vertex:
    /// ```
    /// use understudy::spline::{SplineError, Warp};
    ///
    /// fn blend(a: &Warp, b: &Warp, share_of_b: &[f32]) -> Result<Warp, SplineError> {
    ///     Warp::from_columns(a.vertices(), a.controls(), |j, column| {
    ///         let both = a.column(j).iter().zip(b.column(j));
    ///         for ((to, (a, b)), t) in column.iter_mut().zip(both).zip(share_of_b) {
    ///             *to = a * (1.0 - t) + b * t;
    ///         }
    ///     })
    /// }
    /// # let one = Warp::from_columns(2, 1, |_, c| c.fill(1.0))?;
    /// # let three = Warp::from_columns(2, 1, |_, c| c.fill(3.0))?;
    /// # assert_eq!(blend(&one, &three, &[0.0, 0.5])?.column(0), [1.0, 2.0]);
    /// # Ok::<(), SplineError>(())
    /// ```
    pub fn from_columns(
        vertices: usize,
        controls: usize,
        mut fill: impl FnMut(usize, &mut [f32]),
    ) -> Result<Self, SplineError> {
        let mut shares = vec![0.0; vertices * controls];
        if vertices > 0 {
            for (j, column) in shares.chunks_exact_mut(vertices).enumerate() {
                fill(j, column);
            }
        }
        Self::checked(vertices, controls, shares)
    }

    fn checked(vertices: usize, controls: usize, shares: Vec<f32>) -> Result<Self, SplineError> {
        match shares.iter().position(|share| !share.is_finite()) {
            Some(index) => Err(SplineError::NotFinite { input: Input::Entry, index }),
            None => Ok(Self { vertices, controls, shares }),
        }
    }

    /// Rows of B.
    pub fn vertices(&self) -> usize {
        self.vertices
    }

    /// Columns of B.
    pub fn controls(&self) -> usize {
        self.controls
    }

    /// Control j's share in every vertex, length [`Warp::vertices`]; empty if there is no such control.
    pub fn column(&self, j: usize) -> &[f32] {
        let start = j.saturating_mul(self.vertices);
        self.shares.get(start..start.saturating_add(self.vertices)).unwrap_or(&[])
    }

    /// Writes B·q into `out`: the displacement of every vertex, in the unit of `displacements`. What `out` held is
    /// overwritten.
    ///
    /// Allocates nothing; scratch is 12 kB of stack. Each sum runs over the controls in order, multiplying and then
    /// adding, never fused, so the bytes do not depend on how wide the machine's vectors are.
    ///
    /// # Errors
    /// `displacements` not one for each control, or `out` not one for each vertex; `out` is then untouched.
    pub fn apply(&self, displacements: &[[f32; 3]], out: &mut [[f32; 3]]) -> Result<(), SplineError> {
        let count = |input, wanted, found| SplineError::Count { input, wanted, found };
        if displacements.len() != self.controls {
            return Err(count(Input::Displacement, self.controls, displacements.len()));
        }
        if out.len() != self.vertices {
            return Err(count(Input::Output, self.vertices, out.len()));
        }
        multiply(&self.shares, displacements, out);
        Ok(())
    }

    /// BᵀB / V, controls × controls: how alike the controls' effects are, averaged over the vertices. In f64; zero
    /// for a warp without vertices.
    pub fn gram(&self) -> DMatrix<f64> {
        let mut gram = DMatrix::zeros(self.controls, self.controls);
        let vertices = self.vertices.max(1) as f64;
        for i in 0..self.controls {
            for j in 0..=i {
                let value = dot(self.column(i), self.column(j)) / vertices;
                gram[(i, j)] = value;
                gram[(j, i)] = value;
            }
        }
        gram
    }
}

/// The dot product in f64 over eight fixed lanes, so that its order is the same on every machine.
fn dot(a: &[f32], b: &[f32]) -> f64 {
    const LANES: usize = 8;
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    let mut sums = [0.0_f64; LANES];
    for (a, b) in a.iter().zip(b) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += f64::from(*a) * f64::from(*b);
        }
    }
    let rest = a_rest.iter().zip(b_rest).map(|(a, b)| f64::from(*a) * f64::from(*b));
    sums.iter().sum::<f64>() + rest.sum::<f64>()
}
