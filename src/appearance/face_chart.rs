//! Where the vertices of a target lie in the shared frame.

use std::ops::Range;

use nalgebra::{Point2, Point3, Vector3};

use super::{FACE_WIDTH, FaceFrame};
use crate::{
    anatomy::alike_pairs,
    scan::Mesh,
    spline::{Kernel, Options, Regularisation, Spline, SplineError},
    tracking::index,
};

/// λ over the squared outer canthal distance: a twentieth of what carries motion, because a fold that is painted beside
/// the fold of the shape is seen at once.
const LAMBDA: f64 = 0.05;
/// Pixels along which the chart fades towards the edge of the face.
const EDGE: f64 = 16.0;
/// Pixels before or behind the canonical face up to which a vertex is the face's for certain, and from which it is not:
/// ears, the neck, the back of the head lie there.
const DEPTH: Range<f64> = 50.0..80.0;
/// Share of a normal that points out of the face, below which a surface is not seen from the front, and above which it is.
const FACING: Range<f32> = 0.0..0.25;
/// Vertices farther from the landmarks than this share of their extent are not asked about.
const MARGIN: f64 = 0.25;

/// For each vertex of a target its place in the shared frame and how far it is of the face at all.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceChart {
    places: Vec<[f32; 2]>,
    covers: Vec<f32>,
}

impl FaceChart {
    /// Leads a target's landmarks (up to 478, scan frame) to those of the canonical face by a spline, and lays its vertices
    /// into the frame from the front. `canonical` is the face of which the frame was made; `skin` are the vertices that
    /// are skin, all others get no cover; `normals` are unit vectors for each vertex.
    pub fn new(
        frame: &FaceFrame,
        canonical: &[Point3<f64>],
        landmarks: &[Option<Point3<f64>>],
        mesh: &Mesh,
        normals: &[[f32; 3]],
        skin: &Range<usize>,
    ) -> Result<Self, SplineError> {
        let depths = Depths::of(frame, canonical);
        let lifted = |i: usize| Some(depths.lifted(&frame.points()[i], canonical.get(i)?));
        let pairs = alike_pairs(|i| *landmarks.get(i)?, lifted);
        let spline = spline(&pairs, landmarks)?;
        let near = Neighbourhood::of(pairs.iter().map(|(from, _)| from));
        let edges = rim(frame);

        let mut chart = Self::empty(mesh.positions.len());
        for vertex in skin.clone() {
            let point = &mesh.positions[vertex];
            if !near.holds(point) {
                continue;
            }
            let place = spline.evaluate(point);
            let flat = Point2::new(place[0], place[1]);
            chart.places[vertex] = [flat.x as f32, flat.y as f32];
            let Some(depth) = depths.at(frame, &flat) else { continue };
            let beyond = ((place[2] - depth).abs() - DEPTH.start) / (DEPTH.end - DEPTH.start);
            let inwards = edges.iter().map(|edge| distance(&flat, edge)).fold(f64::INFINITY, f64::min);
            let facing = (normals[vertex][2] - FACING.start) / (FACING.end - FACING.start);
            let cover = (1.0 - beyond).clamp(0.0, 1.0) * (inwards / EDGE).clamp(0.0, 1.0);
            chart.covers[vertex] = cover as f32 * facing.clamp(0.0, 1.0);
        }
        Ok(chart)
    }

    /// A chart without any face, of so many vertices.
    pub fn empty(vertices: usize) -> Self {
        Self { places: vec![[0.0; 2]; vertices], covers: vec![0.0; vertices] }
    }

    /// A chart whose vertices are known: pixels of the frame, and 0..=1 for each. `None` if there are not as many of one as
    /// of the other.
    pub fn of_places(places: Vec<[f32; 2]>, covers: Vec<f32>) -> Option<Self> {
        (places.len() == covers.len()).then_some(Self { places, covers })
    }

    /// Pixels of the frame, for each vertex; meaningless where the cover is 0.
    pub fn places(&self) -> &[[f32; 2]] {
        &self.places
    }

    /// 1 where a vertex is of the face, 0 where it is not, for each vertex.
    pub fn covers(&self) -> &[f32] {
        &self.covers
    }
}

/// From a target to the canonical face, in pixels with depth.
fn spline(
    pairs: &[(Point3<f64>, Point3<f64>)],
    landmarks: &[Option<Point3<f64>>],
) -> Result<Spline<3>, SplineError> {
    let corner = |i: usize| landmarks.get(i).copied().flatten().unwrap_or_else(Point3::origin);
    let eyes = (corner(index::RIGHT_EYE_OUTER) - corner(index::LEFT_EYE_OUTER)).norm();
    let (centres, values): (Vec<_>, Vec<_>) = pairs.iter().map(|(from, to)| (*from, to.coords)).unzip();
    let regularisation = Regularisation::Absolute(LAMBDA * eyes * eyes);
    Spline::fit(Kernel::ThinPlate, &centres, &values, Options { regularisation, ..Options::default() })
}

/// The canonical face's depth over the frame.
struct Depths {
    /// 468 values, pixels towards the viewer.
    of_landmarks: Vec<f64>,
    pixels_per_unit: f64,
}

impl Depths {
    fn of(frame: &FaceFrame, canonical: &[Point3<f64>]) -> Self {
        let (low, high) =
            canonical.iter().fold((f64::MAX, f64::MIN), |(low, high), p| (low.min(p.x), high.max(p.x)));
        let pixels_per_unit = FACE_WIDTH / (high - low).max(f64::MIN_POSITIVE);
        let known = canonical.iter().take(frame.points().len());
        Self { of_landmarks: known.map(|p| p.z * pixels_per_unit).collect(), pixels_per_unit }
    }

    fn lifted(&self, place: &Point2<f64>, point: &Point3<f64>) -> Point3<f64> {
        Point3::new(place.x, place.y, point.z * self.pixels_per_unit)
    }

    /// `None` beside the face.
    fn at(&self, frame: &FaceFrame, place: &Point2<f64>) -> Option<f64> {
        let anchor = frame.anchor(place)?;
        let shares = anchor.corners.iter().zip(anchor.weights);
        shares
            .map(|(&corner, weight)| Some(self.of_landmarks.get(usize::from(corner))? * f64::from(weight)))
            .sum()
    }
}

/// The box around the landmarks, and a little more.
struct Neighbourhood {
    low: Point3<f64>,
    high: Point3<f64>,
}

impl Neighbourhood {
    fn of<'a>(points: impl Iterator<Item = &'a Point3<f64>>) -> Self {
        let none = (Point3::from(Vector3::repeat(f64::MAX)), Point3::from(Vector3::repeat(f64::MIN)));
        let (low, high) = points.fold(none, |(low, high), p| (low.inf(p), high.sup(p)));
        let margin = (high - low) * MARGIN;
        Self { low: low - margin, high: high + margin }
    }

    fn holds(&self, point: &Point3<f64>) -> bool {
        (0..3).all(|axis| (self.low[axis]..=self.high[axis]).contains(&point[axis]))
    }
}

/// The edges of the face: those of one triangle only.
fn rim(frame: &FaceFrame) -> Vec<[Point2<f64>; 2]> {
    let sides = |t: &[u16; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    let mut edges: Vec<[u16; 2]> =
        frame.triangles().iter().flat_map(sides).map(|[a, b]| [a.min(b), a.max(b)]).collect();
    edges.sort_unstable();
    let single = edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 1);
    single.map(|edge| edge[0].map(|corner| frame.points()[usize::from(corner)])).collect()
}

/// From a place to a stretch of line, pixels.
fn distance(place: &Point2<f64>, [start, end]: &[Point2<f64>; 2]) -> f64 {
    let (along, away) = (end - start, place - start);
    let share = (away.dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (away - along * share).norm()
}
