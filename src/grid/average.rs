//! Faces morphed to one shape, and the mean of their depths (000 section 5.3).

use nalgebra::{Point3, Vector3};

use super::{GridError, Raster};
use crate::spline::{Kernel, Options, Polynomial, Regularisation, Spline};

/// Moves `positions` by the thin-plate spline (r² ln r²) that carries the landmarks `from` to `to`, all in one unit.
///
/// `smoothness` is λ for landmarks in a box of side 1: how far the spline may miss its landmarks in favour of bending
/// less. 0 meets them exactly.
pub fn morph(
    positions: &mut [Point3<f64>],
    from: &[Point3<f64>],
    to: &[Point3<f64>],
    smoothness: f64,
) -> Result<(), GridError> {
    let options = Options {
        regularisation: Regularisation::UnitBox(smoothness),
        polynomial: Polynomial::Affine,
        ..Options::default()
    };
    let displacements: Vec<Vector3<f64>> = from.iter().zip(to).map(|(from, to)| to - from).collect();
    let spline = Spline::fit(Kernel::ThinPlate, from, &displacements, options)?;
    for p in positions {
        *p += spline.evaluate(p);
    }
    Ok(())
}

/// Mean and variance of depth at each point of a grid, face by face (Welford).
#[derive(Debug, Clone)]
pub struct DepthAverage {
    raster: Raster,
    faces: usize,
    counts: Vec<u32>,
    means: Vec<f64>,
    squares: Vec<f64>,
}

/// What many faces have in common.
#[derive(Debug, Clone, PartialEq)]
pub struct AverageDepth {
    /// Where the grid lies, millimetres.
    pub raster: Raster,
    /// Mean depth where enough faces have one, millimetres.
    pub depths: Vec<Option<f64>>,
    /// Standard deviation there (n − 1), millimetres; 0 for one face.
    pub deviations: Vec<Option<f64>>,
}

impl DepthAverage {
    /// Of no face yet.
    pub fn new(raster: Raster) -> Self {
        let none = vec![0.0; raster.len()];
        Self { raster, faces: 0, counts: vec![0; raster.len()], means: none.clone(), squares: none }
    }

    /// Adds a face: columns · rows depths in millimetres, `None` where it has none.
    pub fn add(&mut self, depths: impl IntoIterator<Item = Option<f64>>) {
        self.faces += 1;
        for (i, depth) in depths.into_iter().enumerate().take(self.counts.len()) {
            if let Some(depth) = depth {
                self.counts[i] += 1;
                let off = depth - self.means[i];
                self.means[i] += off / f64::from(self.counts[i]);
                self.squares[i] += off * (depth - self.means[i]);
            }
        }
    }

    /// The average where at least `share` (0..=1) of the faces have a depth, and at least one has.
    pub fn finish(self, share: f64) -> AverageDepth {
        let enough = |count: u32| count > 0 && f64::from(count) >= share * self.faces as f64 - 1e-9;
        let where_enough = |value: &dyn Fn(usize) -> f64| {
            (0..self.counts.len()).map(|i| enough(self.counts[i]).then(|| value(i))).collect()
        };
        let deviation = |i: usize| match self.counts[i] {
            0 | 1 => 0.0,
            count => (self.squares[i] / f64::from(count - 1)).max(0.0).sqrt(),
        };
        AverageDepth {
            raster: self.raster,
            depths: where_enough(&|i| self.means[i]),
            deviations: where_enough(&deviation),
        }
    }
}

impl AverageDepth {
    /// Mean and largest standard deviation over the grid, millimetres.
    pub fn spread(&self) -> (f64, f64) {
        let count = self.deviations.iter().flatten().count().max(1) as f64;
        let mean = self.deviations.iter().flatten().sum::<f64>() / count;
        (mean, self.deviations.iter().flatten().copied().fold(0.0, f64::max))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;

    #[test]
    fn mean_deviation_and_share() {
        let raster = Raster::new(2, 2, Point2::new(0.0, 0.0), Point2::new(1.0, 1.0)).unwrap();
        let mut average = DepthAverage::new(raster);
        average.add([Some(1.0), Some(2.0), None, None]);
        average.add([Some(3.0), None, Some(7.0), None]);
        average.add([Some(5.0), Some(4.0), None, None]);
        let half = average.clone().finish(0.5);
        assert_eq!(half.depths, [Some(3.0), Some(3.0), None, None]);
        assert!((half.deviations[0].unwrap() - 2.0).abs() < 1e-12);
        assert!((half.deviations[1].unwrap() - 2.0_f64.sqrt()).abs() < 1e-12);
        let (mean, largest) = half.spread();
        assert!((mean - 1.707).abs() < 1e-3 && (largest - 2.0).abs() < 1e-12);
        assert_eq!(average.clone().finish(0.0).depths, [Some(3.0), Some(3.0), Some(7.0), None]);
        assert_eq!(average.finish(1.0).depths, [Some(3.0), None, None, None]);
    }

    #[test]
    fn a_morph_meets_its_landmarks() {
        let from: Vec<_> = (0..12)
            .map(f64::from)
            .map(|t| Point3::new(50.0 * t.sin(), 50.0 * (1.7 * t).cos(), 20.0 * (3.0 * t).sin()))
            .collect();
        let to: Vec<_> =
            from.iter().map(|p| Point3::new(p.x * 1.1, p.y + 0.01 * p.x * p.x, p.z - 3.0)).collect();
        let mut moved = from.clone();
        morph(&mut moved, &from, &to, 0.0).unwrap();
        assert!(moved.iter().zip(&to).all(|(a, b)| (a - b).norm() < 1e-8));
        let mut smooth = from.clone();
        morph(&mut smooth, &from, &to, 0.1).unwrap();
        assert!(smooth.iter().zip(&to).any(|(a, b)| (a - b).norm() > 0.1));
        assert!(morph(&mut moved, &from[..3], &to[..3], 0.0).is_err());
    }
}
