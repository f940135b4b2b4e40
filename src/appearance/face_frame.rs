//! The shared frame in which skins of different people lie on one another.
//!
//! It is the canonical face seen from the front, without perspective. Every pixel of it is anchored to a triangle of
//! landmarks (002 §V.i: ρ = a v₁ + b v₂ + c v₃), so that it can be found on any face that has the landmarks: in a picture,
//! on a performer's scan or on a target.

use nalgebra::{Point2, Point3, Scalar, Vector2, Vector3};

use crate::tracking::SKIN_LANDMARK_COUNT;

/// Pixels of the frame, across and down.
pub const FRAME_SIZE: [usize; 2] = [512, 576];
/// Pixels from cheek to cheek; every length in the documentation of the skin counts these.
pub const FACE_WIDTH: f64 = 448.0;

/// A place on the face: three landmarks and the weight of each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anchor {
    /// Landmarks.
    pub corners: [u16; 3],
    /// Shares that sum to 1.
    pub weights: [f32; 3],
}

impl Anchor {
    /// Where it is among landmarks in the plane, such as pixels.
    pub fn in_plane(&self, landmarks: &[Vector2<f64>]) -> Vector2<f64> {
        self.mean(|corner| landmarks[corner], Vector2::zeros())
    }

    /// Where it is among landmarks in space.
    pub fn in_space(&self, landmarks: &[Point3<f64>]) -> Point3<f64> {
        self.mean(|corner| landmarks[corner].coords, Vector3::zeros()).into()
    }

    fn mean<T>(&self, corner: impl Fn(usize) -> T, zero: T) -> T
    where
        T: Scalar + std::ops::Add<Output = T> + std::ops::Mul<f64, Output = T>,
    {
        let weighted = self.corners.iter().zip(self.weights);
        weighted.fold(zero, |sum, (&at, weight)| sum + corner(at as usize) * f64::from(weight))
    }
}

/// The frame: where each landmark lies in it, and what each of its pixels is anchored to.
#[derive(Debug, Clone)]
pub struct FaceFrame {
    points: Vec<Point2<f64>>,
    triangles: Vec<[u16; 3]>,
    anchors: Vec<Option<Anchor>>,
}

impl FaceFrame {
    /// `face` is the canonical face, 468 points in the scan frame, any unit; `triangles` are its skin. `None` if the face is
    /// no face: another number of points, a triangle beyond them, no width.
    pub fn new(face: &[Point3<f64>], triangles: &[[u32; 3]]) -> Option<Self> {
        if face.len() != SKIN_LANDMARK_COUNT || triangles.iter().flatten().any(|&c| c as usize >= face.len())
        {
            return None;
        }
        let (low, high) = face.iter().fold((face[0], face[0]), |(low, high), p| (low.inf(p), high.sup(p)));
        let (scale, middle) = (FACE_WIDTH / (high.x - low.x), nalgebra::center(&low, &high));
        if !scale.is_finite() {
            return None;
        }
        let centre = Point2::new(FRAME_SIZE[0] as f64, FRAME_SIZE[1] as f64) / 2.0;
        let points: Vec<Point2<f64>> =
            face.iter().map(|p| centre + Vector2::new(p.x - middle.x, middle.y - p.y) * scale).collect();
        let triangles: Vec<[u16; 3]> = triangles.iter().map(|t| t.map(|corner| corner as u16)).collect();
        let anchors = anchors(&points, face, &triangles);
        Some(Self { points, triangles, anchors })
    }

    /// 468 landmarks, pixels of the frame: x to the right in the picture, where the subject's left is, y down. Pixel centres
    /// are integers.
    pub fn points(&self) -> &[Point2<f64>] {
        &self.points
    }

    /// Landmarks in threes.
    pub fn triangles(&self) -> &[[u16; 3]] {
        &self.triangles
    }

    /// What every pixel is anchored to, row by row; none beside the face.
    pub fn anchors(&self) -> &[Option<Anchor>] {
        &self.anchors
    }

    /// What the pixel at a place is anchored to.
    pub fn anchor(&self, place: &Point2<f64>) -> Option<Anchor> {
        let [width, height] = FRAME_SIZE;
        let (x, y) = (place.x.round(), place.y.round());
        let inside = x >= 0.0 && y >= 0.0 && x < width as f64 && y < height as f64;
        inside.then(|| self.anchors[y as usize * width + x as usize]).flatten()
    }
}

/// Draws every triangle; where two lie before one another, the one nearer to the viewer is seen.
fn anchors(points: &[Point2<f64>], face: &[Point3<f64>], triangles: &[[u16; 3]]) -> Vec<Option<Anchor>> {
    let [width, height] = FRAME_SIZE;
    let mut anchors = vec![None; width * height];
    let mut nearest = vec![f64::NEG_INFINITY; width * height];
    for &corners in triangles {
        let [a, b, c] = corners.map(|corner| points[corner as usize]);
        let area = (b - a).perp(&(c - a));
        if area.abs() < 1e-9 {
            continue;
        }
        let bound = |low: f64, high: f64, size: usize| {
            (low.ceil().max(0.0) as usize)..((high.floor() + 1.0).clamp(0.0, size as f64) as usize)
        };
        let (left, right) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
        let (top, bottom) = (a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y));
        for y in bound(top, bottom, height) {
            for x in bound(left, right, width) {
                let place = Point2::new(x as f64, y as f64);
                let weights = [
                    (b - place).perp(&(c - place)),
                    (c - place).perp(&(a - place)),
                    (a - place).perp(&(b - place)),
                ]
                .map(|part| part / area);
                if weights.iter().any(|&weight| weight < -1e-9) {
                    continue;
                }
                let depth: f64 = corners.iter().zip(weights).map(|(&c, w)| face[c as usize].z * w).sum();
                let pixel = y * width + x;
                if depth > nearest[pixel] {
                    nearest[pixel] = depth;
                    anchors[pixel] = Some(Anchor { corners, weights: weights.map(|weight| weight as f32) });
                }
            }
        }
    }
    anchors
}

/// The frame of a sheet, for tests of what lies in a frame.
#[cfg(test)]
pub(super) fn sheet_frame() -> FaceFrame {
    let (face, triangles) = tests::sheet();
    FaceFrame::new(&face, &triangles).unwrap()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet of 468 points that bulges towards the viewer, in 26 columns and 18 rows.
    pub(super) fn sheet() -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let point = |i: usize| {
            let (x, y) = ((i % 26) as f64 - 12.5, (i / 26) as f64 - 8.5);
            Point3::new(x, y, -0.01 * x * x)
        };
        let cells = (0..17_u32).flat_map(|row| (0..25_u32).map(move |column| row * 26 + column));
        let triangles = cells.flat_map(|at| [[at, at + 1, at + 27], [at, at + 27, at + 26]]);
        ((0..468).map(point).collect(), triangles.collect())
    }

    #[test]
    fn a_pixel_is_where_its_anchor_says() {
        let (face, triangles) = sheet();
        let frame = FaceFrame::new(&face, &triangles).unwrap();
        let width = frame.points().iter().map(|p| p.x).fold(0.0, f64::max)
            - frame.points().iter().map(|p| p.x).fold(999.0, f64::min);
        assert!((width - FACE_WIDTH).abs() < 1e-9);
        let flat: Vec<Vector2<f64>> = frame.points().iter().map(|p| p.coords).collect();
        let mut seen = 0;
        for (pixel, anchor) in frame.anchors().iter().enumerate() {
            let Some(anchor) = anchor else { continue };
            let place = Vector2::new((pixel % FRAME_SIZE[0]) as f64, (pixel / FRAME_SIZE[0]) as f64);
            assert!((anchor.in_plane(&flat) - place).norm() < 1e-3);
            seen += 1;
        }
        // 448 across and 17/25 of it down.
        assert!((seen as f64 / (448.0 * 448.0 * 17.0 / 25.0) - 1.0).abs() < 0.02, "{seen}");
        assert!(frame.anchor(&Point2::new(-3.0, 5.0)).is_none());
        let middle = frame.anchor(&Point2::new(256.0, 288.0)).unwrap();
        assert!(middle.in_space(&face).coords.xy().norm() < 0.1);
    }

    #[test]
    fn what_is_no_face_gives_no_frame() {
        let (face, triangles) = sheet();
        assert!(FaceFrame::new(&face[..467], &triangles).is_none());
        assert!(FaceFrame::new(&face, &[[0, 1, 468]]).is_none());
        assert!(FaceFrame::new(&vec![Point3::origin(); 468], &triangles).is_none());
    }
}
