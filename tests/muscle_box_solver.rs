//! The bounded solver against clarabel's interior point, and against the conditions that a solution meets.

#![allow(
    clippy::unwrap_used,
    clippy::float_cmp,
    reason = "helpers of tests fail as tests do; bounds are met exactly"
)]

use clarabel::{
    algebra::CscMatrix,
    solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus},
};
use nalgebra::{DMatrix, DVector};
use understudy::muscle::BoxSolver;

/// Numbers that look random and are the same everywhere: a 64-bit mixing of a counter, in -1..1.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Normal equations of a random problem whose columns nearly depend on each other by `closeness`.
fn problem(numbers: &mut Numbers, unknowns: usize, closeness: f64) -> (DMatrix<f64>, DVector<f64>) {
    let rows = unknowns * 2 + 3;
    let mut a = DMatrix::from_fn(rows, unknowns, |_, _| numbers.next());
    for j in 1..unknowns {
        let before = a.column(j - 1).into_owned();
        let own = a.column(j) * (1.0 - closeness) + before * closeness;
        a.set_column(j, &own);
    }
    let truth = DVector::from_fn(unknowns, |_, _| 1.2 * numbers.next() + 0.3);
    let b = &a * truth + DVector::from_fn(rows, |_, _| 0.3 * numbers.next());
    (a.tr_mul(&a), a.tr_mul(&b))
}

fn objective(q: &DMatrix<f64>, c: &DVector<f64>, x: &DVector<f64>) -> f64 {
    0.5 * (x.transpose() * q * x)[(0, 0)] - c.dot(x)
}

fn interior_point(q: &DMatrix<f64>, c: &DVector<f64>, exaggerate: bool) -> Option<DVector<f64>> {
    let n = c.len();
    let (mut rows, mut columns, mut values) = (Vec::new(), Vec::new(), Vec::new());
    for (i, j) in (0..n).flat_map(|j| (0..=j).map(move |i| (i, j))) {
        rows.push(i);
        columns.push(j);
        values.push(q[(i, j)]);
    }
    let upper_triangle = CscMatrix::new_from_triplets(n, n, rows, columns, values);
    // −x ≤ 0, and x ≤ 1 unless exaggeration is allowed.
    let bounds = if exaggerate { n } else { 2 * n };
    let (mut rows, mut columns, mut values) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..bounds {
        rows.push(i);
        columns.push(i % n);
        values.push(if i < n { -1.0 } else { 1.0 });
    }
    let a = CscMatrix::new_from_triplets(bounds, n, rows, columns, values);
    let b: Vec<f64> = (0..bounds).map(|i| if i < n { 0.0 } else { 1.0 }).collect();
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: 1e-11,
        tol_gap_rel: 1e-11,
        tol_feas: 1e-11,
        ..DefaultSettings::default()
    };
    let linear: Vec<f64> = c.iter().map(|c| -c).collect();
    let mut solver =
        DefaultSolver::new(&upper_triangle, &linear, &a, &b, &[NonnegativeConeT(bounds)], settings).unwrap();
    solver.solve();
    // Now and then it makes no progress before it is there.
    let solved = solver.solution.status == SolverStatus::Solved;
    solved.then(|| DVector::from_vec(solver.solution.x.clone()))
}

/// What holds of a solution and of nothing else: in bounds, no pull inwards at a bound, none at all between.
fn assert_optimal(q: &DMatrix<f64>, c: &DVector<f64>, x: &DVector<f64>, upper: f64) {
    let gradient = q * x - c;
    for i in 0..x.len() {
        let scale = c[i].abs() + q.column(i).amax() * (1.0 + x.amax()) + 1e-9;
        let pull = gradient[i] / scale;
        assert!((0.0..=upper).contains(&x[i]), "{}", x[i]);
        if x[i] > 0.0 && x[i] < upper {
            assert!(pull.abs() < 1e-7, "between its bounds, {pull}");
        } else if x[i] == 0.0 {
            assert!(pull > -1e-7, "at the lower bound, {pull}");
        } else {
            assert!(pull < 1e-7, "at the upper bound, {pull}");
        }
    }
}

#[test]
fn thousands_of_random_problems_agree_with_an_interior_point_solver() {
    let mut numbers = Numbers(7);
    let (mut farthest, mut compared) = (0.0_f64, 0);
    for round in 0..3000 {
        let unknowns = 1 + round % 20;
        let closeness = [0.0, 0.5, 0.9, 0.99][round % 4];
        let exaggerate = round % 3 == 0;
        let (q, c) = problem(&mut numbers, unknowns, closeness);
        let mut solver = BoxSolver::contractions(unknowns, exaggerate);
        let own = solver.solve(&q, &c).unwrap().clone();
        assert_optimal(&q, &c, &own, if exaggerate { f64::INFINITY } else { 1.0 });
        let Some(theirs) = interior_point(&q, &c, exaggerate) else { continue };
        compared += 1;
        let worse = objective(&q, &c, &own) - objective(&q, &c, &theirs);
        assert!(worse < 1e-8 * (1.0 + objective(&q, &c, &theirs).abs()), "round {round}: {worse}");
        // Where columns nearly depend on each other, many answers are as good to twelve digits.
        if closeness < 0.6 {
            farthest = farthest.max((own - theirs).amax());
        }
    }
    assert!(farthest < 1e-4 && compared > 2900, "{farthest}, {compared}");
}

#[test]
fn ill_conditioned_problems_of_full_size_meet_the_conditions() {
    let mut numbers = Numbers(11);
    for round in 0..300 {
        let closeness = 1.0 - 10.0_f64.powi(-(1 + round % 5));
        let (q, c) = problem(&mut numbers, 52, closeness);
        let mut solver = BoxSolver::contractions(52, round % 2 == 0);
        let x = solver.solve(&q, &c).unwrap().clone();
        assert_optimal(&q, &c, &x, if round % 2 == 0 { f64::INFINITY } else { 1.0 });
    }
}

#[test]
fn where_the_last_solution_stood_does_not_matter() {
    let mut numbers = Numbers(3);
    let mut warm = BoxSolver::contractions(16, false);
    for _ in 0..500 {
        let (q, c) = problem(&mut numbers, 16, 0.5);
        let cold = BoxSolver::contractions(16, false).solve(&q, &c).unwrap().clone();
        let own = warm.solve(&q, &c).unwrap();
        assert!((own - cold).amax() < 1e-9);
    }
}

#[test]
fn unknowns_without_bounds_and_with_one_value_are_solved_with_the_others() {
    let mut numbers = Numbers(5);
    let (q, c) = problem(&mut numbers, 8, 0.3);
    let mut free = BoxSolver::new(vec![f64::NEG_INFINITY; 8], vec![f64::INFINITY; 8]);
    let x = free.solve(&q, &c).unwrap();
    assert!((&q * x - &c).amax() < 1e-9);
    let mut lower = vec![f64::NEG_INFINITY; 8];
    let mut upper = vec![f64::INFINITY; 8];
    (lower[2], upper[2]) = (0.25, 0.25);
    let mut pinned = BoxSolver::new(lower, upper);
    let x = pinned.solve(&q, &c).unwrap();
    let gradient = &q * x - &c;
    assert!(x[2] == 0.25 && gradient.iter().enumerate().all(|(i, g)| i == 2 || g.abs() < 1e-9));
}

#[test]
fn what_is_not_positive_definite_or_not_a_number_has_no_solution() {
    let mut solver = BoxSolver::contractions(2, false);
    let wanting = DVector::from_vec(vec![1.0, 1.0]);
    assert!(solver.solve(&DMatrix::from_diagonal_element(2, 2, -1.0), &wanting).is_none());
    let mut solver = BoxSolver::contractions(2, false);
    assert!(solver.solve(&DMatrix::from_diagonal_element(2, 2, f64::NAN), &wanting).is_none());
}
