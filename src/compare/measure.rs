//! Distances between a predicted face and the true one, and what they come to.

use nalgebra::Point3;

use super::{CompareError, FacePart, REACH, face_parts};
use crate::scan::{Scan, Surface};

/// True motion below which a share of it would only weigh rounding, RMS millimetres.
const STILL: f64 = 0.01;

/// What a distance is taken to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DistanceKind {
    /// The truth's vertex of the same number.
    Vertex,
    /// The nearest point of the truth's surface.
    Surface,
}

impl DistanceKind {
    /// `vertex` or `surface`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Vertex => "vertex",
            Self::Surface => "surface",
        }
    }
}

/// What the first row holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Whole {
    /// The vertices that belong to some part of the face.
    Face,
    /// Every vertex.
    Mesh,
}

/// What the errors of some vertices come to; lengths in millimetres, every vertex counts alike.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// `whole`, a part's name, or `elsewhere`.
    pub name: &'static str,
    /// How many there are; at least one.
    pub vertices: usize,
    /// Mean error.
    pub mean: f64,
    /// Root mean square error.
    pub rms: f64,
    /// The error that 95 % of the vertices stay within, interpolated.
    pub p95: f64,
    /// Largest error.
    pub max: f64,
    /// Root mean square of the true motion.
    pub motion_rms: f64,
}

impl Row {
    /// RMS error over RMS true motion: 0 is perfect, 1 no better than the neutral. `None` where nothing should
    /// move, which is below 0.01 mm.
    pub fn share(&self) -> Option<f64> {
        (self.motion_rms >= STILL).then(|| self.rms / self.motion_rms)
    }

    fn of(name: &'static str, errors: &[f64], motions: &[f64], chosen: &[usize]) -> Option<Self> {
        if chosen.is_empty() {
            return None;
        }
        let mut sorted: Vec<f64> = chosen.iter().map(|&v| errors[v]).collect();
        sorted.sort_by(f64::total_cmp);
        let count = sorted.len() as f64;
        let rms = |squares: f64| (squares / count).sqrt();
        Some(Self {
            name,
            vertices: sorted.len(),
            mean: sorted.iter().sum::<f64>() / count,
            rms: rms(sorted.iter().map(|e| e * e).sum()),
            p95: quantile(&sorted, 0.95),
            max: sorted[sorted.len() - 1],
            motion_rms: rms(chosen.iter().map(|&v| motions[v] * motions[v]).sum()),
        })
    }
}

/// A quantile of sorted values, which are at least one, interpolated between neighbours.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let (below, t) = (place.floor() as usize, place.fract());
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (sorted[above] - sorted[below]) * t
}

/// A predicted face measured against the true one.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// What the distances are taken to.
    pub kind: DistanceKind,
    /// V distances of the prediction from the truth, millimetres.
    pub errors: Vec<f64>,
    /// V distances of the neutral from the truth, taken alike, millimetres.
    pub motions: Vec<f64>,
    /// V: whether a vertex counts in the first row.
    pub counted: Vec<bool>,
    /// `whole` first, then the parts that have vertices, `elsewhere` last where every vertex counts.
    pub rows: Vec<Row>,
}

impl Comparison {
    /// Measures `predicted` against `truth`; both and `neutral` in one frame, millimetres.
    ///
    /// The prediction must have the neutral's triangles. Where the truth has them too, vertices are compared by their
    /// number; otherwise by their distance to the truth's surface. Without a single landmark there are no parts, and
    /// every vertex counts.
    pub fn of(
        neutral: &Scan,
        predicted: &Scan,
        truth: &Scan,
        landmarks: &[Option<Point3<f64>>],
        whole: Whole,
    ) -> Result<Self, CompareError> {
        let (wanted, found) = (neutral.mesh.positions.len(), predicted.mesh.positions.len());
        let (predicted_name, neutral_name) = (called(predicted), called(neutral));
        if found != wanted {
            return Err(CompareError::OtherVertices {
                predicted: predicted_name,
                neutral: neutral_name,
                found,
                wanted,
            });
        }
        if predicted.mesh.triangles != neutral.mesh.triangles {
            return Err(CompareError::OtherTriangles { predicted: predicted_name, neutral: neutral_name });
        }
        let shared = truth.mesh.positions.len() == wanted && truth.mesh.triangles == neutral.mesh.triangles;
        let (kind, errors, motions) = if shared {
            let apart = |scan: &Scan| {
                scan.mesh.positions.iter().zip(&truth.mesh.positions).map(|(p, q)| (p - q).norm()).collect()
            };
            (DistanceKind::Vertex, apart(predicted), apart(neutral))
        } else {
            let surface = Surface::new(&truth.mesh)
                .map_err(|source| CompareError::Truth { truth: called(truth), source })?;
            (DistanceKind::Surface, to_surface(predicted, &surface)?, to_surface(neutral, &surface)?)
        };

        let parts = face_parts(&neutral.mesh.positions, landmarks);
        let known = landmarks.iter().any(Option::is_some);
        let everything = whole == Whole::Mesh || !known;
        let counted: Vec<bool> = parts.iter().map(|part| everything || part.is_some()).collect();
        let chosen = |keep: &dyn Fn(usize) -> bool| (0..wanted).filter(|&v| keep(v)).collect::<Vec<_>>();
        let row = |name, keep: &dyn Fn(usize) -> bool| Row::of(name, &errors, &motions, &chosen(keep));
        let first = row("whole", &|v| counted[v])
            .ok_or(CompareError::NoFace { neutral: neutral_name, reach: REACH })?;
        let mut rows = vec![first];
        rows.extend(FacePart::ALL.iter().filter_map(|&part| row(part.name(), &|v| parts[v] == Some(part))));
        if everything && known {
            rows.extend(row("elsewhere", &|v| parts[v].is_none()));
        }
        Ok(Self { kind, errors, motions, counted, rows })
    }

    /// The first row.
    pub fn whole(&self) -> &Row {
        &self.rows[0]
    }
}

/// For each vertex its distance from a surface.
fn to_surface(scan: &Scan, surface: &Surface) -> Result<Vec<f64>, CompareError> {
    let distance = |(vertex, p): (usize, &Point3<f64>)| {
        let nearest = surface.nearest(*p);
        let unreachable = || CompareError::OutOfReach { file: called(scan), vertex };
        nearest.map(|found| (found.position - p).norm()).ok_or_else(unreachable)
    };
    scan.mesh.positions.iter().enumerate().map(distance).collect()
}

fn called(scan: &Scan) -> String {
    scan.path.as_ref().map_or_else(|| scan.name.clone(), |path| path.display().to_string())
}
