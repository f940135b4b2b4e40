//! The orthonormal wavelet decomposition of an appearance sample (002 §V.ii, eq. 6–8; Mallat's pyramid on Haar's basis).

/// Samples of a template along each side (002 §V.ii: "each 16×16 template").
pub const SIDE: usize = 16;
/// Samples of a template, and its coefficients.
pub const COUNT: usize = SIDE * SIDE;
/// Scales of the pyramid: the mean, then four scales of details, coarse to fine.
pub const SCALES: usize = 5;

/// A square of samples row by row, or its coefficients: the mean first, the finest details in the last quadrants.
pub type Grid = [f32; COUNT];

/// Which scale a coefficient belongs to: 0 the mean, 1 the coarsest details, 4 the finest.
pub fn scale_of(coefficient: usize) -> usize {
    let reach = (coefficient % SIDE).max(coefficient / SIDE);
    (usize::BITS - reach.leading_zeros()) as usize
}

/// Samples to coefficients, in place: the sum of squares stays.
pub fn decompose(grid: &mut Grid) {
    let mut side = SIDE;
    while side > 1 {
        for row in 0..side {
            split(grid, row * SIDE, 1, side);
        }
        for column in 0..side {
            split(grid, column, SIDE, side);
        }
        side /= 2;
    }
}

/// Coefficients to samples, in place.
pub fn recompose(grid: &mut Grid) {
    let mut side = 2;
    while side <= SIDE {
        for column in 0..side {
            join(grid, column, SIDE, side);
        }
        for row in 0..side {
            join(grid, row * SIDE, 1, side);
        }
        side *= 2;
    }
}

/// Sums of neighbours to the first half of a line, their differences to the second.
fn split(grid: &mut Grid, start: usize, stride: usize, length: usize) {
    let mut line = [0.0; SIDE];
    for pair in 0..length / 2 {
        let (a, b) = (grid[start + 2 * pair * stride], grid[start + (2 * pair + 1) * stride]);
        line[pair] = (a + b) * std::f32::consts::FRAC_1_SQRT_2;
        line[pair + length / 2] = (a - b) * std::f32::consts::FRAC_1_SQRT_2;
    }
    for (at, &value) in line[..length].iter().enumerate() {
        grid[start + at * stride] = value;
    }
}

fn join(grid: &mut Grid, start: usize, stride: usize, length: usize) {
    let mut line = [0.0; SIDE];
    for pair in 0..length / 2 {
        let (sum, difference) = (grid[start + pair * stride], grid[start + (pair + length / 2) * stride]);
        line[2 * pair] = (sum + difference) * std::f32::consts::FRAC_1_SQRT_2;
        line[2 * pair + 1] = (sum - difference) * std::f32::consts::FRAC_1_SQRT_2;
    }
    for (at, &value) in line[..length].iter().enumerate() {
        grid[start + at * stride] = value;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn decomposed(value: impl Fn(usize, usize) -> f32) -> Grid {
        let mut grid = std::array::from_fn(|at| value(at % SIDE, at / SIDE));
        decompose(&mut grid);
        grid
    }

    #[test]
    fn a_constant_is_its_mean_alone() {
        let grid = decomposed(|_, _| 0.75);
        assert!((grid[0] - 0.75 * 16.0).abs() < 1e-5);
        assert!(grid[1..].iter().all(|value| value.abs() < 1e-6));
    }

    #[test]
    fn a_step_in_the_middle_is_one_coarse_coefficient() {
        let across = decomposed(|x, _| if x < 8 { 1.0 } else { -1.0 });
        assert!((across[1] - 16.0).abs() < 1e-5);
        assert!(across.iter().enumerate().all(|(at, value)| at == 1 || value.abs() < 1e-5));
        let down = decomposed(|_, y| if y < 8 { 1.0 } else { -1.0 });
        assert!((down[SIDE] - 16.0).abs() < 1e-5);
    }

    #[test]
    fn stripes_one_sample_wide_are_finest_details_alone() {
        let grid = decomposed(|x, _| if x % 2 == 0 { 1.0 } else { -1.0 });
        let fine: f32 = (0..COUNT).filter(|&at| scale_of(at) == 4).map(|at| grid[at] * grid[at]).sum();
        assert!((fine - 256.0).abs() < 1e-3);
    }

    #[test]
    fn scales_hold_1_3_12_48_and_192_coefficients() {
        let mut counts = [0; SCALES];
        for at in 0..COUNT {
            counts[scale_of(at)] += 1;
        }
        assert_eq!(counts, [1, 3, 12, 48, 192]);
    }

    #[test]
    fn pywavelets_finds_the_same_coefficients() {
        let text = include_str!("../../tests/reference/haar_reference.json");
        let reference: std::collections::BTreeMap<String, Vec<f32>> = serde_json::from_str(text).unwrap();
        let mut grid: Grid = reference["samples"].clone().try_into().unwrap();
        decompose(&mut grid);
        for (own, theirs) in grid.iter().zip(&reference["coefficients"]) {
            assert!((own - theirs).abs() < 2e-5, "{own} {theirs}");
        }
    }

    proptest! {
        #[test]
        fn energy_stays_and_samples_come_back(values in prop::collection::vec(-1.0..1.0_f32, COUNT)) {
            let samples: Grid = values.try_into().unwrap();
            let mut grid = samples;
            decompose(&mut grid);
            let energy = |grid: &Grid| grid.iter().map(|value| value * value).sum::<f32>();
            prop_assert!((energy(&grid) - energy(&samples)).abs() < 1e-3);
            recompose(&mut grid);
            for (a, b) in grid.iter().zip(&samples) {
                prop_assert!((a - b).abs() < 1e-5);
            }
        }
    }
}
