//! A regular grid over the plane of the face, and the first surface above each of its points.

use nalgebra::{Point2, Point3, Vector2};

use super::GridError;

/// Points a side, at most.
const MAX_SIDE: usize = 2_000;
/// A point this far outside a triangle, in parts of it, still lies on its edge.
const EDGE: f64 = 1e-9;

/// Columns × rows points, evenly spaced from the lower to the upper corner, corners included (the thesis's `linspace` and
/// `meshgrid`). Point (column, row) is number row · columns + column; row 0 lies lowest. Millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Raster {
    /// Points across, at least 2.
    pub columns: usize,
    /// Points down, at least 2.
    pub rows: usize,
    low: Point2<f64>,
    high: Point2<f64>,
}

/// Where the line of sight through a grid point first meets a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Which triangle.
    pub triangle: u32,
    /// Weights of its corners, together 1.
    pub barycentric: [f64; 3],
    /// z there, interpolated linearly, millimetres.
    pub depth: f64,
}

impl Raster {
    /// A grid over the rectangle from `low` to `high`.
    pub fn new(columns: usize, rows: usize, low: Point2<f64>, high: Point2<f64>) -> Result<Self, GridError> {
        let extent = high - low;
        let wrong = |remedy| GridError::Raster { columns, rows, width: extent.x, height: extent.y, remedy };
        if !(2..=MAX_SIDE).contains(&columns) || !(2..=MAX_SIDE).contains(&rows) {
            return Err(wrong("give 2 to 2000 points a side"));
        }
        let sound = |side: f64| side > 1e-6 && side < 1e7;
        if !sound(extent.x) || !sound(extent.y) {
            return Err(wrong("look at the landmarks, or give a positive margin"));
        }
        Ok(Self { columns, rows, low, high })
    }

    /// A grid over the bounding rectangle of `points` seen along z, with `margin` millimetres around it.
    pub fn around(
        points: impl IntoIterator<Item = Point3<f64>>,
        margin: f64,
        columns: usize,
        rows: usize,
    ) -> Result<Self, GridError> {
        let mut corners: Option<(Point2<f64>, Point2<f64>)> = None;
        for p in points.into_iter().map(|p| p.xy()) {
            corners = Some(corners.map_or((p, p), |(low, high)| (low.inf(&p), high.sup(&p))));
        }
        let (low, high) = corners.ok_or(GridError::NoAxes)?;
        let margin = Vector2::repeat(margin);
        Self::new(columns, rows, low - margin, high + margin)
    }

    /// How many points there are.
    pub fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// Never: a grid has at least four points.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The lower corner, millimetres.
    pub fn low(&self) -> Point2<f64> {
        self.low
    }

    /// The upper corner, millimetres.
    pub fn high(&self) -> Point2<f64> {
        self.high
    }

    /// Millimetres between neighbours, across and down.
    pub fn step(&self) -> Vector2<f64> {
        let extent = self.high - self.low;
        Vector2::new(extent.x / (self.columns - 1) as f64, extent.y / (self.rows - 1) as f64)
    }

    /// Where point `number` lies.
    pub fn at(&self, number: usize) -> Point2<f64> {
        let [u, v] = self.uv(number);
        let extent = self.high - self.low;
        self.low + Vector2::new(u * extent.x, v * extent.y)
    }

    /// The texture coordinates of point `number`: column / (columns − 1), row / (rows − 1).
    pub fn uv(&self, number: usize) -> [f64; 2] {
        let (column, row) = (number % self.columns, number / self.columns);
        [column as f64 / (self.columns - 1) as f64, row as f64 / (self.rows - 1) as f64]
    }

    /// The four corners of every cell, counter-clockwise from the lower left.
    pub fn cells(&self) -> impl Iterator<Item = [usize; 4]> + use<> {
        let (columns, rows) = (self.columns, self.rows);
        (0..rows - 1).flat_map(move |row| {
            (0..columns - 1).map(move |column| {
                let at = row * columns + column;
                [at, at + 1, at + columns + 1, at + columns]
            })
        })
    }

    /// Looks along −z at a surface: for each grid point the nearest triangle before it, interpolated linearly, or `None`
    /// where there is none. Nothing is extrapolated.
    ///
    /// `positions` is V × 3 in the grid's axes; `triangles` are numbers and corners of those that count. Of equally near
    /// ones the first counts, and triangles seen edge-on are seen by nobody.
    pub fn sample(
        &self,
        positions: &[Point3<f64>],
        triangles: impl IntoIterator<Item = (u32, [u32; 3])>,
    ) -> Vec<Option<Sample>> {
        let mut samples: Vec<Option<Sample>> = vec![None; self.len()];
        let step = self.step();
        for (triangle, corners) in triangles {
            let [a, b, c] = corners.map(|v| positions[v as usize]);
            let (ab, ac) = ((b - a).xy(), (c - a).xy());
            let doubled = ab.perp(&ac);
            if doubled == 0.0 || !doubled.is_finite() {
                continue;
            }
            let range = |low: f64, high: f64, from: f64, step: f64, count: usize| {
                let first = ((low - from) / step - EDGE).ceil().clamp(0.0, count as f64) as usize;
                let last = ((high - from) / step + EDGE).floor().clamp(-1.0, count as f64 - 1.0);
                first..(last + 1.0) as usize
            };
            let (low, high) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
            for row in range(low.y, high.y, self.low.y, step.y, self.rows) {
                for column in range(low.x, high.x, self.low.x, step.x, self.columns) {
                    let number = row * self.columns + column;
                    let to = self.at(number) - a.xy();
                    let (s, t) = (to.perp(&ac) / doubled, ab.perp(&to) / doubled);
                    let weights = [1.0 - s - t, s, t];
                    if weights.iter().any(|w| *w < -EDGE) {
                        continue;
                    }
                    let depth = weights[0] * a.z + s * b.z + t * c.z;
                    if samples[number].is_none_or(|found| depth > found.depth) {
                        samples[number] = Some(Sample { triangle, barycentric: weights, depth });
                    }
                }
            }
        }
        samples
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn raster(columns: usize, rows: usize) -> Raster {
        Raster::new(columns, rows, Point2::new(-1.0, -1.0), Point2::new(1.0, 1.0)).unwrap()
    }

    fn numbered(triangles: &[[u32; 3]]) -> impl Iterator<Item = (u32, [u32; 3])> + '_ {
        (0..).zip(triangles.iter().copied())
    }

    #[test]
    fn a_plane_is_met_exactly_and_only_where_it_is() {
        let z = |x: f64, y: f64| 3.0 + 2.0 * x - y;
        let positions: Vec<_> = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]
            .iter()
            .map(|&[x, y]| Point3::new(x, y, z(x, y)))
            .collect();
        let grid = raster(9, 9);
        let samples = grid.sample(&positions, numbered(&[[0, 1, 2], [0, 2, 3]]));
        for (number, sample) in samples.iter().enumerate() {
            let p = grid.at(number);
            let inside = p.x.abs() <= 0.5 && p.y.abs() <= 0.5;
            assert_eq!(sample.is_some(), inside, "{p}");
            if let Some(sample) = sample {
                assert!((sample.depth - z(p.x, p.y)).abs() < 1e-12);
            }
        }
        assert_eq!(grid.cells().count(), 64);
        assert!(grid.uv(80).iter().all(|side| (side - 1.0).abs() < 1e-12));
    }

    #[test]
    fn the_nearest_surface_counts_whichever_comes_first() {
        let sheet = |z: f64| [[-2.0, -2.0], [2.0, -2.0], [0.0, 3.0]].map(|[x, y]| Point3::new(x, y, z));
        let positions = [sheet(5.0), sheet(9.0), sheet(-1.0)].concat();
        let samples = raster(3, 3).sample(&positions, numbered(&[[0, 1, 2], [3, 4, 5], [6, 7, 8]]));
        assert_eq!(samples[4].unwrap().triangle, 1);
    }

    #[test]
    fn useless_grids_are_refused() {
        let (low, high) = (Point2::new(0.0, 0.0), Point2::new(1.0, 1.0));
        assert!(Raster::new(1, 5, low, high).is_err());
        assert!(Raster::new(5, 20_000, low, high).is_err());
        assert!(Raster::new(5, 5, high, low).is_err());
        assert!(Raster::new(5, 5, low, Point2::new(f64::NAN, 1.0)).is_err());
        assert!(Raster::around([], 1.0, 5, 5).is_err());
    }

    proptest! {
        #[test]
        fn samples_lie_on_their_triangle(
            coordinates in prop::collection::vec(-1.5..1.5_f64, 9),
            columns in 2..40_usize,
            rows in 2..40_usize,
        ) {
            let positions: Vec<_> = coordinates.chunks(3).map(|c| Point3::new(c[0], c[1], c[2])).collect();
            let grid = raster(columns, rows);
            for (number, sample) in grid.sample(&positions, numbered(&[[0, 1, 2]])).into_iter().enumerate() {
                if let Some(Sample { barycentric, depth, .. }) = sample {
                    let on = (0..3).map(|k| positions[k].coords * barycentric[k]).sum::<nalgebra::Vector3<f64>>();
                    let off = Vector2::new(on.x, on.y) - grid.at(number).coords;
                    prop_assert!(off.norm() < 1e-6 && (on.z - depth).abs() < 1e-6);
                }
            }
        }
    }
}
