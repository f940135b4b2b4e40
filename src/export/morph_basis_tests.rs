//! The compression in control space against a singular value decomposition of the vertices themselves.

use super::*;
use proptest::prelude::*;

struct Case {
    basis: DMatrix<f64>,
    frames: Vec<MatrixXx3<f64>>,
}

impl Case {
    /// Motion whose components fall off by `decay`, from a fixed sequence of numbers begun at `seed`.
    fn new(vertices: usize, controls: usize, frames: usize, decay: f64, seed: u64) -> Self {
        let mut state = seed;
        let mut number = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let basis = DMatrix::from_fn(vertices, controls, |_, _| number());
        let shapes: Vec<_> =
            (0..8).map(|at| MatrixXx3::from_fn(controls, |_, _| number()) * decay.powi(at)).collect();
        let frames = (0..frames)
            .map(|_| shapes.iter().fold(MatrixXx3::zeros(controls), |sum, shape| sum + shape * number()))
            .collect();
        Self { basis, frames }
    }

    fn gram(&self) -> DMatrix<f64> {
        self.basis.transpose() * &self.basis / self.basis.nrows() as f64
    }

    /// T × 3V.
    fn vertices(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.frames.len(), 3 * self.basis.nrows(), |frame, column| {
            self.basis.row(column / 3).tr_dot(&self.frames[frame].column(column % 3))
        })
    }

    /// Errors of a compression measured on every vertex of every frame: overall and in the worst frame.
    fn errors(&self, found: &MorphBasis) -> (f64, f64) {
        let vertices = self.basis.nrows() as f64;
        let squares: Vec<f64> = self
            .frames
            .iter()
            .enumerate()
            .map(|(frame, wanted)| {
                let mut left = wanted.clone();
                for (at, shape) in found.shapes.iter().enumerate() {
                    left -= shape * found.weights[(frame, at)];
                }
                (&self.basis * left).norm_squared() / vertices
            })
            .collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        (mean.sqrt(), squares.iter().copied().fold(0.0, f64::max).sqrt())
    }

    /// Smallest root-mean-square error of every rank, by a full decomposition of the vertices' motion.
    fn best(&self) -> Vec<f64> {
        let values = self.vertices().singular_values();
        let count = (self.frames.len() * self.basis.nrows()) as f64;
        (0..=values.len()).map(|rank| (values.rows_range(rank..).norm_squared() / count).sqrt()).collect()
    }
}

#[test]
fn as_few_targets_as_the_decomposition_of_the_vertices() {
    // The second has more frames than 3 × controls and takes the other way.
    for (controls, frames) in [(7, 15), (4, 60)] {
        let case = Case::new(50, controls, frames, 0.4, 9);
        let best = case.best();
        for rank in 1..7 {
            let tolerance = best[rank] * 1.000_001;
            let found = compress(&case.gram(), &case.frames, tolerance).unwrap();
            assert_eq!(found.shapes.len(), rank);
            assert!((found.rms - best[rank]).abs() <= 1e-9 * best[0], "{} {}", found.rms, best[rank]);
            let (rms, worst) = case.errors(&found);
            assert!((rms - found.rms).abs() <= 1e-9 * best[0]);
            assert!((worst - found.worst_frame_rms).abs() <= 1e-9 * best[0]);
        }
    }
}

#[test]
fn a_single_shape_comes_back_as_it_is() {
    let case = Case::new(30, 5, 1, 1.0, 3);
    let shape = &case.frames[0];
    let frames: Vec<_> = [0.0, 0.5, -2.0, 1.0].iter().map(|scale| shape * *scale).collect();
    let found = compress(&case.gram(), &frames, 1e-9).unwrap();
    assert_eq!(found.shapes.len(), 1);
    let wanted = [0.0, -0.25, 1.0, -0.5];
    assert!(found.weights.iter().zip(wanted).all(|(got, wanted)| (got - wanted).abs() < 1e-12));
    assert!((&found.shapes[0] + shape * 2.0).amax() < 1e-12);
}

#[test]
fn no_motion_needs_no_targets_and_no_frames_are_no_error() {
    let gram = DMatrix::identity(3, 3);
    let still = vec![MatrixXx3::zeros(3); 20];
    let found = compress(&gram, &still, 0.1).unwrap();
    assert_eq!((found.shapes.len(), found.weights.shape(), found.rms), (0, (20, 0), 0.0));
    let none = compress(&gram, &[], 0.1).unwrap();
    assert_eq!((none.shapes.len(), none.weights.shape(), none.rms), (0, (0, 0), 0.0));
    let uncontrolled = compress(&DMatrix::zeros(0, 0), &[MatrixXx3::zeros(0)], 0.1).unwrap();
    assert_eq!((uncontrolled.shapes.len(), uncontrolled.weights.shape()), (0, (1, 0)));
    let unmoved = compress(&DMatrix::zeros(2, 2), &vec![MatrixXx3::repeat(2, 1.0); 20], 0.1).unwrap();
    assert_eq!((unmoved.shapes.len(), unmoved.rms), (0, 0.0));
}

#[test]
fn controls_that_move_nothing_are_allowed() {
    let mut case = Case::new(40, 5, 80, 0.3, 5);
    case.basis.column_mut(2).fill(0.0);
    let copy = case.basis.column(0).into_owned();
    case.basis.set_column(4, &copy);
    let found = compress(&case.gram(), &case.frames, 1e-4).unwrap();
    assert!(case.errors(&found).0 <= 1.000_001e-4);
}

#[test]
fn the_same_motion_gives_the_same_numbers() {
    let case = Case::new(50, 6, 40, 0.5, 2);
    let once = compress(&case.gram(), &case.frames, 0.01).unwrap();
    assert_eq!(once, compress(&case.gram(), &case.frames, 0.01).unwrap());
}

#[test]
fn what_does_not_fit_is_refused() {
    let gram = DMatrix::identity(3, 3);
    let frames = vec![MatrixXx3::repeat(3, 1.0); 2];
    let refused = |gram: &DMatrix<f64>, frames: &[MatrixXx3<f64>], tolerance, words: &str| {
        let error = compress(gram, frames, tolerance).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    refused(&DMatrix::zeros(3, 2), &frames, 0.1, "3 × 2");
    refused(&DMatrix::from_element(3, 3, f64::NAN), &frames, 0.1, "not finite");
    refused(&DMatrix::from_fn(3, 3, |row, _| row as f64), &frames, 0.1, "not symmetric");
    refused(&gram, &[MatrixXx3::zeros(4)], 0.1, "4 controls of 3");
    refused(&gram, &[MatrixXx3::repeat(3, f64::NAN)], 0.1, "frame 0 is not finite");
    refused(&gram, &[MatrixXx3::repeat(3, 1e200)], 0.1, "too large");
    refused(&gram, &frames, 0.0, "tolerance");
    refused(&gram, &frames, f64::NAN, "tolerance");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn the_bound_holds_on_the_vertices_and_one_target_fewer_would_break_it(
        controls in 1_usize..9,
        frames in 1_usize..40,
        decay in 0.2..1.0_f64,
        seed in any::<u64>(),
        strictness in 0.0..5.0_f64,
    ) {
        let case = Case::new(20, controls, frames, decay, seed);
        let best = case.best();
        let tolerance = best[0] * 10_f64.powf(-strictness) + 1e-12;
        let found = compress(&case.gram(), &case.frames, tolerance).unwrap();
        let (rms, worst) = case.errors(&found);
        prop_assert!(rms <= tolerance * (1.0 + 1e-9) && found.rms <= tolerance);
        prop_assert!((worst - found.worst_frame_rms).abs() <= 1e-9 * (1.0 + worst));
        let count = found.shapes.len();
        if count > 0 {
            prop_assert!(best[count - 1] > tolerance * (1.0 - 1e-6), "{} targets", count);
            for column in found.weights.column_iter() {
                prop_assert!((column.amax() - 1.0).abs() < 1e-12);
            }
        }
    }
}
