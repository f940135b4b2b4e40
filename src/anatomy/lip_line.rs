//! The line between the lips: the network's inner-lip landmarks, refined to the crease of the surface and the dark line
//! of the texture.

use nalgebra::{Point2, Point3, Vector2};

use super::regions::{INNER_CORNERS, LOWER_INNER, OUTER_CORNERS, UPPER_INNER};

/// Columns in which the line is looked for.
const COLUMNS: usize = 96;
/// Rows looked at in each column.
const ROWS: usize = 41;
/// How far the line may lie from the landmarks, mouth widths.
const REACH: f64 = 0.05;
/// The cut ends this share of the way from the inner corners to the outer ones.
const BEYOND: f64 = 0.25;
/// Two heights that make a crease lie this far above and below, mouth widths.
const CREASE_ARM: f64 = 0.025;
/// The price of lying away from the landmarks, at the end of the reach.
const STRAY: f64 = 0.5;
/// The price of a step of one row between neighbouring columns.
const STEP: f64 = 0.02;
/// What a crease of slope 1 on both sides is worth, in relative luma.
const CREASE: f64 = 0.35;
/// A line that is not cheaper than its surroundings by this much says nothing: then the landmarks stay as they are.
const CONTRAST: f64 = 0.05;

/// A curve over the mouth, in the face's axes.
#[derive(Debug, Clone)]
pub struct LipLine {
    origin: Point2<f64>,
    along: Vector2<f64>,
    /// Heights above `origin` across `along`, evenly from the first column to the last.
    heights: Vec<f64>,
    /// Along-coordinates of first and last column, millimetres.
    pub ends: [f64; 2],
    /// Along-coordinates of the inner corners.
    pub corners: [f64; 2],
    /// How far the texture and the crease have moved the line at most, millimetres.
    pub moved: f64,
}

impl LipLine {
    /// `landmarks` are the scan's, in the face's axes; `mouth` is its width in millimetres. `luma` gives the texture's
    /// brightness and `depth` the surface's z at a place in the plane of the face, each where there is one.
    pub fn find(
        landmarks: &[Option<Point3<f64>>],
        mouth: f64,
        luma: Option<&dyn Fn(f64, f64) -> f64>,
        depth: &dyn Fn(f64, f64) -> Option<f64>,
    ) -> Option<Self> {
        let at = |i: usize| landmarks[i].map(|p| p.xy());
        let [right, left] = [at(INNER_CORNERS[0])?, at(INNER_CORNERS[1])?];
        let beyond = |inner: Point2<f64>, outer: usize| {
            at(outer).map_or(inner, |outer| inner + (outer - inner) * BEYOND)
        };
        let mut middle = vec![beyond(right, OUTER_CORNERS[0]), right];
        let pairs = UPPER_INNER.iter().zip(&LOWER_INNER);
        middle.extend(pairs.filter_map(|(&u, &l)| Some(nalgebra::center(&at(u)?, &at(l)?))));
        middle.extend([left, beyond(left, OUTER_CORNERS[1])]);
        if middle.len() < 8 {
            return None;
        }
        let origin = nalgebra::center(&right, &left);
        let along = (left - right).try_normalize(1e-9)?;
        let across = Vector2::new(-along.y, along.x);
        let mut knots: Vec<(f64, f64)> =
            middle.iter().map(|p| ((p - origin).dot(&along), (p - origin).dot(&across))).collect();
        knots.sort_by(|a, b| a.0.total_cmp(&b.0));
        let ends = [knots[0].0, knots[knots.len() - 1].0];
        if ends[1] - ends[0] < 0.3 * mouth {
            return None;
        }
        let mut line = Self {
            origin,
            along,
            heights: (0..COLUMNS).map(|i| interpolate(&knots, column(ends, i))).collect(),
            ends,
            corners: [(right - origin).dot(&along), (left - origin).dot(&along)],
            moved: 0.0,
        };
        line.refine(mouth, luma, depth);
        Some(line)
    }

    /// The same line, ending at other along-coordinates: both its ends and its inner corners.
    pub fn shortened(&mut self, ends: [f64; 2]) {
        let places: Vec<f64> = (0..COLUMNS).map(|i| self.height(column(ends, i))).collect();
        self.heights = places;
        self.ends = ends;
        self.corners = [self.corners[0].max(ends[0]), self.corners[1].min(ends[1])];
    }

    /// Along-coordinate of a place, millimetres from the middle between the inner corners, to the subject's left.
    pub fn along(&self, point: &Point3<f64>) -> f64 {
        (point.xy() - self.origin).dot(&self.along)
    }

    /// How far a place lies above the line, millimetres.
    pub fn above(&self, point: &Point3<f64>) -> f64 {
        let across = Vector2::new(-self.along.y, self.along.x);
        (point.xy() - self.origin).dot(&across) - self.height(self.along(point))
    }

    /// The place on the line at an along-coordinate, in the plane of the face.
    pub fn place(&self, along: f64) -> Point2<f64> {
        self.origin + self.along * along + Vector2::new(-self.along.y, self.along.x) * self.height(along)
    }

    /// Upwards across the line, a unit vector in the plane of the face.
    pub fn up(&self) -> Vector2<f64> {
        Vector2::new(-self.along.y, self.along.x)
    }

    fn height(&self, along: f64) -> f64 {
        let place = (along - self.ends[0]) / (self.ends[1] - self.ends[0]) * (COLUMNS - 1) as f64;
        let place = place.clamp(0.0, (COLUMNS - 1) as f64);
        let left = (place.floor() as usize).min(COLUMNS - 2);
        let t = place - left as f64;
        self.heights[left] * (1.0 - t) + self.heights[left + 1] * t
    }

    /// Moves the line to where it is darkest and deepest, by the cheapest way through all columns.
    fn refine(
        &mut self,
        mouth: f64,
        luma: Option<&dyn Fn(f64, f64) -> f64>,
        depth: &dyn Fn(f64, f64) -> Option<f64>,
    ) {
        let shift = |row: usize| (row as f64 / (ROWS - 1) as f64 * 2.0 - 1.0) * REACH * mouth;
        let arm = CREASE_ARM * mouth;
        let up = self.up();
        let mut brightness = vec![[0.0; ROWS]; COLUMNS];
        let mut crease = vec![[0.0; ROWS]; COLUMNS];
        for i in 0..COLUMNS {
            let middle = self.place(column(self.ends, i));
            for row in 0..ROWS {
                let p = middle + up * shift(row);
                let z = |offset: f64| depth(p.x + up.x * offset, p.y + up.y * offset);
                if let (Some(above), Some(here), Some(below)) = (z(arm), z(0.0), z(-arm)) {
                    crease[i][row] = ((above + below - 2.0 * here) / (2.0 * arm)).clamp(-2.0, 2.0);
                }
                brightness[i][row] = luma.map_or(0.0, |luma| luma(p.x, p.y));
            }
        }
        let mut all: Vec<f64> = brightness.iter().flatten().copied().collect();
        all.sort_by(f64::total_cmp);
        let usual = all[all.len() / 2].max(1e-3);
        let cost = |i: usize, row: usize| brightness[i][row] / usual - CREASE * crease[i][row];
        let price = |i: usize, row: usize| cost(i, row) + STRAY * (shift(row) / (REACH * mouth)).powi(2);
        let path = cheapest_rows(price);
        let on_path: f64 =
            path.iter().enumerate().map(|(i, &row)| cost(i, row)).sum::<f64>() / COLUMNS as f64;
        let mut costs: Vec<f64> =
            (0..COLUMNS).flat_map(|i| (0..ROWS).map(move |row| (i, row))).map(|(i, r)| cost(i, r)).collect();
        costs.sort_by(f64::total_cmp);
        if costs[costs.len() / 2] - on_path < CONTRAST {
            return;
        }
        let offsets: Vec<f64> = path.into_iter().map(shift).collect();
        for i in 0..COLUMNS {
            // A mean over seven columns; the ends are repeated.
            let window = (0..7).map(|k| offsets[(i + k).saturating_sub(3).min(COLUMNS - 1)]);
            let offset = window.sum::<f64>() / 7.0;
            self.heights[i] += offset;
            self.moved = self.moved.max(offset.abs());
        }
    }
}

/// The along-coordinate of a column.
fn column(ends: [f64; 2], i: usize) -> f64 {
    ends[0] + (ends[1] - ends[0]) * i as f64 / (COLUMNS - 1) as f64
}

/// The row of each column on the cheapest way from the first to the last.
fn cheapest_rows(price: impl Fn(usize, usize) -> f64) -> Vec<usize> {
    let mut total: Vec<f64> = (0..ROWS).map(|row| price(0, row)).collect();
    let mut from = vec![[0_usize; ROWS]; COLUMNS];
    for (i, from) in from.iter_mut().enumerate().skip(1) {
        let next = (0..ROWS)
            .map(|row| {
                let step = |before: usize| total[before] + STEP * (before as f64 - row as f64).powi(2);
                let best = (0..ROWS).min_by(|&a, &b| step(a).total_cmp(&step(b))).unwrap_or(row);
                from[row] = best;
                step(best) + price(i, row)
            })
            .collect();
        total = next;
    }
    let mut row = (0..ROWS).min_by(|&a, &b| total[a].total_cmp(&total[b])).unwrap_or(ROWS / 2);
    let mut rows = vec![row; COLUMNS];
    for i in (1..COLUMNS).rev() {
        row = from[i][row];
        rows[i - 1] = row;
    }
    rows
}

/// Linear between knots that ascend, constant beyond.
fn interpolate(knots: &[(f64, f64)], x: f64) -> f64 {
    let right = knots.partition_point(|knot| knot.0 < x).clamp(1, knots.len() - 1);
    let ((x0, y0), (x1, y1)) = (knots[right - 1], knots[right]);
    let t = if x1 > x0 { ((x - x0) / (x1 - x0)).clamp(0.0, 1.0) } else { 0.0 };
    y0 + (y1 - y0) * t
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracking::LANDMARK_COUNT;

    /// A straight mouth 50 mm wide.
    fn mouth() -> Vec<Option<Point3<f64>>> {
        let mut landmarks = vec![None; LANDMARK_COUNT];
        for (i, x) in [(61, -25.0), (78, -22.0), (308, 22.0), (291, 25.0)] {
            landmarks[i] = Some(Point3::new(x, -70.0, 10.0));
        }
        for (k, (&u, &l)) in UPPER_INNER.iter().zip(&LOWER_INNER).enumerate() {
            let x = -18.0 + 4.5 * k as f64;
            landmarks[u] = Some(Point3::new(x, -69.5, 10.0));
            landmarks[l] = Some(Point3::new(x, -70.5, 10.0));
        }
        landmarks
    }

    #[test]
    fn without_anything_to_see_it_is_the_landmarks() {
        let line = LipLine::find(&mouth(), 50.0, None, &|_, _| Some(0.0)).unwrap();
        assert!(line.moved.abs() < 1e-12);
        assert!((line.ends[0] + 22.75).abs() < 1e-9 && (line.corners[1] - 22.0).abs() < 1e-9);
        assert!((line.above(&Point3::new(3.0, -69.0, 0.0)) - 1.0).abs() < 1e-9);
        assert!((line.place(3.0) - Point2::new(3.0, -70.0)).norm() < 1e-9);
    }

    #[test]
    fn it_goes_to_the_dark_line_and_to_the_crease() {
        let dark = |_: f64, y: f64| if (y + 71.0).abs() < 0.4 { 0.2 } else { 0.6 };
        let line = LipLine::find(&mouth(), 50.0, Some(&dark), &|_, _| Some(0.0)).unwrap();
        assert!((line.place(0.0).y + 71.0).abs() < 0.4, "{}", line.place(0.0));
        let valley = |_: f64, y: f64| Some(1.5 * (y + 69.2).abs());
        let line = LipLine::find(&mouth(), 50.0, None, &valley).unwrap();
        assert!((line.place(0.0).y + 69.2).abs() < 0.4, "{}", line.place(0.0));
    }

    #[test]
    fn too_few_landmarks_give_no_line() {
        let mut landmarks = mouth();
        landmarks[308] = None;
        assert!(LipLine::find(&landmarks, 50.0, None, &|_, _| None).is_none());
    }
}
