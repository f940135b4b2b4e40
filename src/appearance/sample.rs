//! An appearance sample: the look of a region in one picture (002 §V.i), and its five offset versions.

use super::haar::{self, COUNT, Grid, SIDE};

/// Samples of the fine grid along each side: half a step of the 16×16 grid, and half a step around it.
pub const FINE_SIDE: usize = 2 * SIDE + 2;
/// Offset versions of a sample: its own place and half a step along both diagonals (002 fig. 6).
pub const OFFSETS: usize = 5;
/// Where each version starts in the fine grid, across and down.
const STARTS: [[usize; 2]; OFFSETS] = [[1, 1], [0, 0], [2, 0], [0, 2], [2, 2]];
/// Contrast below which a sample is not amplified any further, as a share of its mean: noise of a smooth skin.
const LEAST_CONTRAST: f32 = 0.02;

/// Luminance of a region on a fine grid, 0..=255, gamma-encoded as the picture is: a factor of light or of exposure is a
/// factor in it too, and noise is even.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sample {
    luma: Box<[u8]>,
}

impl Sample {
    /// Of 34×34 values, row by row.
    pub(super) fn new(luma: Box<[u8]>) -> Option<Self> {
        (luma.len() == FINE_SIDE * FINE_SIDE).then_some(Self { luma })
    }

    /// The five 16×16 versions; each value is the mean of four fine ones. Lighting is normalised: mean 0, and variance 1
    /// unless there is hardly any.
    pub fn versions(&self) -> [Grid; OFFSETS] {
        STARTS.map(|start| self.version(start))
    }

    /// The version in the sample's own place.
    pub fn own(&self) -> Grid {
        self.version(STARTS[0])
    }

    fn version(&self, [left, top]: [usize; 2]) -> Grid {
        let fine = |x: usize, y: usize| f32::from(self.luma[y * FINE_SIDE + x]);
        let mut grid: Grid = std::array::from_fn(|at| {
            let (x, y) = (left + 2 * (at % SIDE), top + 2 * (at / SIDE));
            (fine(x, y) + fine(x + 1, y) + fine(x, y + 1) + fine(x + 1, y + 1)) / 4.0
        });
        normalise(&mut grid);
        grid
    }

    /// Mean luminance, 0..=255.
    pub fn mean(&self) -> f32 {
        self.luma.iter().map(|&value| f32::from(value)).sum::<f32>() / self.luma.len() as f32
    }

    /// How much contrast the details have that are finer than a quarter of the region, over the mean luminance.
    pub fn relief(&self) -> f32 {
        let fine = |at: usize| f32::from(self.luma[at]);
        let mut grid: Grid = std::array::from_fn(|at| {
            let first = (1 + 2 * (at / SIDE)) * FINE_SIDE + 1 + 2 * (at % SIDE);
            (fine(first) + fine(first + 1) + fine(first + FINE_SIDE) + fine(first + FINE_SIDE + 1)) / 4.0
        });
        haar::decompose(&mut grid);
        let energy: f32 = (0..COUNT).filter(|&at| haar::scale_of(at) > 2).map(|at| grid[at] * grid[at]).sum();
        (energy / COUNT as f32).sqrt() / self.mean().max(1.0)
    }

    /// The picture of the sample, 34×34, row by row.
    pub fn luma(&self) -> &[u8] {
        &self.luma
    }
}

/// Mean 0 and variance 1, so that neither the colour of light nor exposure counts.
fn normalise(grid: &mut Grid) {
    let mean = grid.iter().sum::<f32>() / COUNT as f32;
    let variance = grid.iter().map(|value| (value - mean).powi(2)).sum::<f32>() / COUNT as f32;
    // A black sample has neither.
    let least = (LEAST_CONTRAST * mean).max(1e-3);
    let scale = 1.0 / (variance + least * least).sqrt();
    for value in grid {
        *value = (*value - mean) * scale;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(value: impl Fn(usize, usize) -> f32) -> Sample {
        let luma = (0..FINE_SIDE * FINE_SIDE).map(|at| value(at % FINE_SIDE, at / FINE_SIDE).round() as u8);
        Sample::new(luma.collect()).unwrap()
    }

    #[test]
    fn light_does_not_count() {
        let look = |x: usize, y: usize| ((x * 7 + y * 3) % 40) as f32;
        let (dark, bright) = (sample(|x, y| 60.0 + look(x, y)), sample(|x, y| 2.0 * (60.0 + look(x, y))));
        for (a, b) in dark.own().iter().zip(bright.own()) {
            assert!((a - b).abs() < 0.02, "{a} {b}");
        }
        let energy: f32 = dark.own().iter().map(|value| value * value).sum();
        assert!((energy / 256.0 - 1.0).abs() < 0.1);
    }

    #[test]
    fn smooth_and_black_samples_stay_smooth() {
        for level in [0.0, 120.0] {
            assert!(sample(|_, _| level).own().iter().all(|value| value.abs() < 1e-6));
        }
        let noise = sample(|x, y| 200.0 + ((x + y) % 2) as f32);
        assert!(noise.own().iter().all(|value| value.abs() < 0.2));
    }

    #[test]
    fn versions_lie_half_a_step_along_the_diagonals() {
        // A look that moves by one fine step is half a step of the sample.
        let look = |x: f32, y: f32| 120.0 + 60.0 * (x * 0.3).sin() + 40.0 * (y * 0.4).cos();
        let still = sample(|x, y| look(x as f32, y as f32));
        for (at, [dx, dy]) in
            [[0.0, 0.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]].into_iter().enumerate()
        {
            let moved = sample(|x, y| look(x as f32 + dx, y as f32 + dy));
            for (a, b) in still.versions()[at].iter().zip(moved.own()) {
                assert!((a - b).abs() < 0.05, "{at}: {a} {b}");
            }
        }
    }
}
