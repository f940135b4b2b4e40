//! One template of a region, and how far a sample is from it (002 §V.ii, eq. 9).

use serde::{Deserialize, Serialize};

use super::haar::{self, COUNT, Grid, SCALES};

/// Coefficients that a template keeps: the largest (002 §V.ii).
pub const KEPT: usize = 50;
/// η_w of eq. 9 by scale: "from the high-scale top of the pyramid to the bottom, the weights are 2, 4, 2, 1, 0".
const WEIGHTS: [f32; SCALES] = [2.0, 4.0, 2.0, 1.0, 0.0];

/// The largest coefficients of one look of a region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Template {
    /// Which coefficients, ascending, and their values.
    kept: Vec<(u8, f32)>,
}

impl Template {
    /// Of the coefficients of a sample.
    pub fn new(coefficients: &Grid) -> Self {
        let mut order: Vec<u8> = (0..COUNT).map(|at| at as u8).collect();
        let size = |at: u8| coefficients[usize::from(at)].abs();
        order.sort_by(|&a, &b| size(b).total_cmp(&size(a)).then(a.cmp(&b)));
        order.truncate(KEPT);
        order.sort_unstable();
        Self { kept: order.into_iter().map(|at| (at, coefficients[usize::from(at)])).collect() }
    }

    /// Whether it could have been made by [`Template::new`].
    pub(super) fn is_sound(&self) -> bool {
        self.kept.len() == KEPT
            && self.kept.windows(2).all(|pair| pair[0].0 < pair[1].0)
            && self.kept.iter().all(|(_, value)| value.is_finite())
    }

    /// φ of eq. 9: the weighted sum of differences to a sample's coefficients; 0 for the template's own sample.
    pub fn score(&self, coefficients: &Grid) -> f32 {
        let difference = |&(at, value): &(u8, f32)| {
            WEIGHTS[haar::scale_of(usize::from(at))] * (value - coefficients[usize::from(at)]).abs()
        };
        self.kept.iter().map(difference).sum()
    }

    /// The template's own coefficients, 0 where it keeps none.
    pub fn coefficients(&self) -> Grid {
        let mut grid = [0.0; COUNT];
        for &(at, value) in &self.kept {
            grid[usize::from(at)] = value;
        }
        grid
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_score_is_the_weighted_sum_of_differences() {
        let grid: Grid = std::array::from_fn(|at| COUNT as f32 - at as f32);
        let template = Template::new(&grid);
        assert!(template.is_sound() && template.score(&grid).abs() < 1e-9);
        // The largest are the first three rows and two of the fourth.
        assert_eq!(template.kept.last().map(|(at, _)| *at), Some(49));
        for (at, weight) in
            [(0, 2.0), (1, 4.0), (17, 4.0), (2, 2.0), (35, 2.0), (7, 1.0), (8, 0.0), (50, 0.0)]
        {
            let mut other = grid;
            other[at] += 0.5;
            assert!((template.score(&other) - 0.5 * weight).abs() < 1e-4, "{at}");
        }
    }

    #[test]
    fn equal_coefficients_are_kept_in_order() {
        let template = Template::new(&[1.0; COUNT]);
        assert!(template.kept.iter().map(|(at, _)| usize::from(*at)).eq(0..KEPT));
        assert!(template.coefficients()[KEPT].abs() < 1e-9);
    }
}
