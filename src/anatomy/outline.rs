//! A closed curve in the plane of the face, and how far a place lies inside it.

use nalgebra::Point2;

/// A closed polygon, millimetres, in the axes of the face.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Corners in order; the last joins the first.
    pub corners: Vec<Point2<f64>>,
    low: Point2<f64>,
    high: Point2<f64>,
}

impl Outline {
    /// From its corners, at least three.
    pub fn new(corners: Vec<Point2<f64>>) -> Self {
        let infinity = f64::INFINITY;
        let start = (Point2::new(infinity, infinity), Point2::new(-infinity, -infinity));
        let (low, high) = corners.iter().fold(start, |(low, high), p| (low.inf(p), high.sup(p)));
        Self { corners, low, high }
    }

    /// Millimetres to the curve, positive inside.
    pub fn inside(&self, point: &Point2<f64>) -> f64 {
        let (mut nearest, mut is_inside) = (f64::INFINITY, false);
        for (i, a) in self.corners.iter().enumerate() {
            let b = &self.corners[(i + 1) % self.corners.len()];
            let edge = b - a;
            let t = ((point - a).dot(&edge) / edge.norm_squared().max(1e-12)).clamp(0.0, 1.0);
            nearest = nearest.min((point - (a + edge * t)).norm_squared());
            if (a.y > point.y) != (b.y > point.y) && point.x < a.x + (point.y - a.y) * edge.x / edge.y {
                is_inside = !is_inside;
            }
        }
        if is_inside { nearest.sqrt() } else { -nearest.sqrt() }
    }

    /// The lowest and the highest point of the curve at `x`; `None` beside it.
    pub fn span_at(&self, x: f64) -> Option<(f64, f64)> {
        let next = self.corners.iter().cycle().skip(1);
        let crossings = self.corners.iter().zip(next).filter(|(a, b)| (a.x > x) != (b.x > x));
        crossings.map(|(a, b)| a.y + (x - a.x) / (b.x - a.x) * (b.y - a.y)).fold(None, |span, y| {
            Some(span.map_or((y, y), |(low, high): (f64, f64)| (low.min(y), high.max(y))))
        })
    }

    /// The corners of the box around the curve.
    pub fn bounds(&self) -> (Point2<f64>, Point2<f64>) {
        (self.low, self.high)
    }
}

/// A smooth curve through points (Catmull–Rom), `steps` to each stretch, both ends included.
pub fn smooth_curve(points: &[Point2<f64>], steps: usize) -> Vec<Point2<f64>> {
    let Some((first, last)) = points.first().zip(points.last()) else { return Vec::new() };
    let at = |i: isize| -> Point2<f64> {
        let count = points.len() as isize;
        if i < 0 {
            first + (first - points[1.min(points.len() - 1)])
        } else if i >= count {
            last + (last - points[points.len().saturating_sub(2)])
        } else {
            points[i as usize]
        }
    };
    let mut curve = Vec::new();
    for i in 0..points.len() as isize - 1 {
        let [a, b, c, d] = [-1, 0, 1, 2].map(|k| at(i + k).coords);
        for step in 0..steps {
            let t = step as f64 / steps as f64;
            let p = b * 2.0
                + (c - a) * t
                + (a * 2.0 - b * 5.0 + c * 4.0 - d) * (t * t)
                + (b * 3.0 - a - c * 3.0 + d) * (t * t * t);
            curve.push(Point2::from(p * 0.5));
        }
    }
    curve.push(*last);
    curve
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_knows_inside_from_outside() {
        let square =
            Outline::new([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]].map(Point2::from).to_vec());
        assert!((square.inside(&Point2::new(1.0, 2.0)) - 1.0).abs() < 1e-12);
        assert!((square.inside(&Point2::new(-3.0, 2.0)) + 3.0).abs() < 1e-12);
        assert!((square.inside(&Point2::new(7.0, 8.0)) + 5.0).abs() < 1e-12);
        assert_eq!(square.span_at(1.0), Some((0.0, 4.0)));
        assert_eq!(square.span_at(5.0), None);
        assert_eq!(square.bounds().1, Point2::new(4.0, 4.0));
    }

    #[test]
    fn a_smooth_curve_passes_its_points() {
        let points = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, 1.0]].map(Point2::from);
        let curve = smooth_curve(&points, 5);
        assert_eq!(curve.len(), 16);
        for (i, p) in points.iter().enumerate() {
            assert!((curve[5 * i] - p).norm() < 1e-12);
        }
        assert!(smooth_curve(&[], 3).is_empty());
    }
}
