//! The average of many scans (000 section 5.3): consensus landmarks, a morph of each scan to them, the mean of depths.

use std::path::PathBuf;

use nalgebra::{Point3, Vector3};

use super::{PipelineError, Target};
use crate::{
    anatomy::FaceFrame,
    grid::{AverageDepth, Consensus, DepthAverage, FaceGrid, GridError, Raster, morph},
    tracking::{LANDMARK_COUNT, SKIN_LANDMARK_COUNT, is_outline},
};

/// How faces are averaged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AverageOptions {
    /// Grid points across.
    pub columns: usize,
    /// Grid points down.
    pub rows: usize,
    /// Millimetres around the landmarks' bounding rectangle.
    pub margin: f64,
    /// The share of the scans, 0..=1, that must have a depth at a grid point.
    pub share: f64,
    /// The morph's λ, for landmarks in a box of side 1.
    pub smoothness: f64,
}

impl Default for AverageOptions {
    fn default() -> Self {
        Self { columns: 150, rows: 150, margin: 10.0, share: 0.5, smoothness: 1e-2 }
    }
}

/// A scan reduced to what is averaged: its face, cleaned, in the face's own axes, millimetres.
#[derive(Debug, Clone)]
pub struct FaceShape {
    /// The scan's name.
    pub name: String,
    positions: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    /// 478.
    landmarks: Vec<Option<Point3<f64>>>,
}

/// What scans have in common.
#[derive(Debug, Clone)]
pub struct AverageFace {
    /// The mean surface in its own axes (x to the subject's left, y up, z out of the face; the mean of the consensus
    /// landmarks is the origin), millimetres.
    pub grid: FaceGrid,
    /// Depths and their standard deviation.
    pub depth: AverageDepth,
    /// 478: where the scans' landmarks lie on average after the morph, in the same axes; those that too few scans have
    /// are absent.
    pub landmarks: Vec<Option<Point3<f64>>>,
    /// Numbers of the landmarks on which the consensus rests.
    pub common: Vec<usize>,
    /// For each scan that lacks some of the landmarks of others, its name and how many.
    pub missing: Vec<(String, usize)>,
    /// Names of the scans whose landmarks stand out, and by how many millimetres RMS they are off the consensus.
    pub outliers: Vec<(String, f64)>,
    /// The Procrustes analysis, its points in the axes of the first scan.
    pub consensus: Consensus,
}

impl FaceShape {
    /// A face that is clean already: positions, triangles and 478 landmarks in its own axes (x to the subject's left, y
    /// up, z out of the face), millimetres.
    pub fn new(
        name: impl Into<String>,
        positions: Vec<Point3<f64>>,
        triangles: Vec<[u32; 3]>,
        landmarks: Vec<Option<Point3<f64>>>,
    ) -> Self {
        Self { name: name.into(), positions, triangles, landmarks }
    }

    /// The face of a scan; `margin` millimetres around its landmarks are kept.
    pub fn of(target: &Target, margin: f64) -> Result<Self, PipelineError> {
        // Morphing may bring in what lies a little outside.
        let view = target.face_view(2.0 * margin + 10.0)?;
        let triangles = view.cleaned.triangles(&target.mesh().triangles).map(|(_, corners)| corners);
        let mut numbers = vec![None; view.cleaned.positions.len()];
        let mut positions = Vec::new();
        let triangles = triangles
            .map(|corners| {
                corners.map(|v| {
                    *numbers[v as usize].get_or_insert_with(|| {
                        positions.push(view.cleaned.positions[v as usize]);
                        positions.len() as u32 - 1
                    })
                })
            })
            .collect();
        Ok(Self { name: target.scan.name.clone(), positions, triangles, landmarks: view.landmarks })
    }
}

impl AverageFace {
    /// The average of `faces`; `step` is called after each of them.
    pub fn of(
        mut faces: Vec<FaceShape>,
        options: &AverageOptions,
        mut step: impl FnMut(),
    ) -> Result<Self, PipelineError> {
        let average = |source| PipelineError::Average { source };
        let (common, missing) = common_landmarks(&faces);
        let shapes: Vec<Vec<Point3<f64>>> =
            faces.iter().map(|face| chosen(&face.landmarks, &common)).collect();
        let consensus = Consensus::of(&shapes).map_err(average)?;
        let outliers = consensus.outliers().into_iter();
        let outliers = outliers.map(|i| (faces[i].name.clone(), consensus.residuals[i])).collect();
        let points = rectified(&common, &consensus.points).map_err(average)?;
        for face in &mut faces {
            let from = chosen(&face.landmarks, &common);
            let mut present: Vec<_> = face.landmarks.iter().flatten().copied().collect();
            let named = |source| PipelineError::Grid { scan: PathBuf::from(&face.name), source };
            morph(&mut face.positions, &from, &points, options.smoothness).map_err(named)?;
            morph(&mut present, &from, &points, options.smoothness).map_err(named)?;
            for (landmark, moved) in face.landmarks.iter_mut().flatten().zip(present) {
                *landmark = moved;
            }
        }
        let landmarks = mean_landmarks(&faces, options.share);
        let raster = Raster::around(
            landmarks.iter().flatten().copied(),
            options.margin,
            options.columns,
            options.rows,
        )
        .map_err(average)?;
        let mut sum = DepthAverage::new(raster);
        for face in &faces {
            let samples = raster.sample(&face.positions, (0..).zip(face.triangles.iter().copied()));
            sum.add(samples.iter().map(|sample| sample.map(|s| s.depth)));
            step();
        }
        let depth = sum.finish(options.share);
        let grid = FaceGrid::new(raster, &depth.depths)
            .map_err(|_| average(GridError::NothingCovered { share: 100.0 * options.share }))?;
        Ok(Self { grid, depth, landmarks, common, missing, outliers, consensus })
    }
}

/// The landmarks of the skin that every face has, and how many each face lacks of those that others have. The outline is
/// left out: each picture has its own silhouette.
fn common_landmarks(faces: &[FaceShape]) -> (Vec<usize>, Vec<(String, usize)>) {
    let has = |face: &FaceShape, landmark: usize| face.landmarks.get(landmark).is_some_and(Option::is_some);
    let some: Vec<usize> = (0..SKIN_LANDMARK_COUNT)
        .filter(|landmark| !is_outline(*landmark) && faces.iter().any(|face| has(face, *landmark)))
        .collect();
    let missing = faces
        .iter()
        .map(|face| (face.name.clone(), some.iter().filter(|landmark| !has(face, **landmark)).count()))
        .filter(|(_, count)| *count > 0)
        .collect();
    let common = some.into_iter().filter(|landmark| faces.iter().all(|face| has(face, *landmark))).collect();
    (common, missing)
}

fn chosen(landmarks: &[Option<Point3<f64>>], numbers: &[usize]) -> Vec<Point3<f64>> {
    numbers.iter().filter_map(|landmark| landmarks[*landmark]).collect()
}

/// The consensus turned to look along +z, upright, its mean at the origin.
fn rectified(common: &[usize], points: &[Point3<f64>]) -> Result<Vec<Point3<f64>>, GridError> {
    let mut landmarks = vec![None; LANDMARK_COUNT];
    for (landmark, point) in common.iter().zip(points) {
        landmarks[*landmark] = Some(*point);
    }
    let turn = FaceFrame::of(&landmarks).ok_or(GridError::NoAxes)?.rotation();
    let mean = points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len().max(1) as f64;
    Ok(points.iter().map(|p| turn * (p - mean)).collect())
}

/// The mean place of each landmark that at least `share` of the faces have.
fn mean_landmarks(faces: &[FaceShape], share: f64) -> Vec<Option<Point3<f64>>> {
    let mean = |landmark: usize| {
        let places: Vec<_> = faces.iter().filter_map(|face| face.landmarks.get(landmark).copied()?).collect();
        let enough = !places.is_empty() && places.len() as f64 >= share * faces.len() as f64 - 1e-9;
        let sum: Vector3<f64> = places.iter().map(|p| p.coords).sum();
        enough.then(|| Point3::from(sum / places.len() as f64))
    };
    (0..LANDMARK_COUNT).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, UnitQuaternion};

    use super::*;
    use crate::tracking::index;

    const SIDE: u32 = 61;

    /// A dome that is raised by `height` around the middle; landmarks of the skin lie on it along a spiral.
    fn dome(height: f64) -> FaceShape {
        let z = |x: f64, y: f64| {
            -(x * x + y * y) / 150.0 + height * (-((x - 10.0).powi(2) + y * y) / 800.0).exp()
        };
        let mut positions = Vec::new();
        let mut triangles = Vec::new();
        for row in 0..SIDE {
            for column in 0..SIDE {
                let (x, y) = (f64::from(column) * 3.0 - 90.0, f64::from(row) * 3.0 - 90.0);
                positions.push(Point3::new(x, y, z(x, y)));
                if row > 0 && column > 0 {
                    let at = row * SIDE + column;
                    triangles.extend([[at, at - 1, at - SIDE - 1], [at, at - SIDE - 1, at - SIDE]]);
                }
            }
        }
        let mut landmarks = vec![None; LANDMARK_COUNT];
        for (i, landmark) in landmarks.iter_mut().enumerate().take(SKIN_LANDMARK_COUNT).step_by(3) {
            let (radius, angle) = (3.0 * (i as f64).sqrt(), 2.4 * i as f64);
            let (x, y) = (radius * angle.cos(), radius * angle.sin());
            *landmark = Some(Point3::new(x, y, z(x, y)));
        }
        for (i, [x, y]) in [
            (index::RIGHT_EYE_OUTER, [-45.0, 30.0]),
            (index::LEFT_EYE_OUTER, [45.0, 30.0]),
            (index::MOUTH_RIGHT, [-25.0, -40.0]),
            (index::MOUTH_LEFT, [25.0, -40.0]),
        ] {
            landmarks[i] = Some(Point3::new(x, y, z(x, y)));
        }
        FaceShape::new("dome", positions, triangles, landmarks)
    }

    fn options() -> AverageOptions {
        AverageOptions { columns: 40, rows: 40, margin: 0.0, ..AverageOptions::default() }
    }

    #[test]
    fn opposite_perturbations_average_to_the_base() {
        let mut steps = 0;
        let base = AverageFace::of(vec![dome(0.0)], &options(), || steps += 1).unwrap();
        let both = AverageFace::of(vec![dome(4.0), dome(-4.0)], &options(), || steps += 1).unwrap();
        assert_eq!(steps, 3);
        assert_eq!(base.depth.spread(), (0.0, 0.0));
        let nearest = |p: &Point3<f64>| base.grid.nearest(p).unwrap().1;
        let step = base.grid.raster.step();
        // Grids lie a little differently; depth is compared where the points of both nearly coincide.
        let landmarks = both.landmarks.iter().zip(&base.landmarks);
        for (a, b) in landmarks.filter_map(|(a, b)| (*a).zip(*b)) {
            assert!((a - b).norm() < 0.2, "{a} {b}");
        }
        let near: Vec<_> = both.grid.points.iter().flatten().map(nearest).collect();
        assert!(near.iter().sum::<f64>() / (near.len() as f64) < 0.4 * step.norm());
        assert!(both.outliers.is_empty() && both.missing.is_empty());
    }

    #[test]
    fn turned_copies_average_to_one() {
        let turned = |k: f64| {
            let motion = Isometry3::from_parts(
                nalgebra::Translation3::new(10.0 * k, 0.0, 3.0),
                UnitQuaternion::from_euler_angles(0.05 * k, 0.03, -0.04 * k),
            );
            let mut face = dome(5.0);
            for p in face.positions.iter_mut().chain(face.landmarks.iter_mut().flatten()) {
                *p = motion * *p;
            }
            face
        };
        let faces = (0..4).map(|k| turned(f64::from(k))).collect();
        let average = AverageFace::of(faces, &options(), || {}).unwrap();
        let (mean, largest) = average.depth.spread();
        assert!(mean < 1e-6 && largest < 1e-6, "{mean} {largest}");
        let single = AverageFace::of(vec![turned(0.0)], &options(), || {}).unwrap();
        for (a, b) in average.grid.points.iter().zip(&single.grid.points) {
            assert!((a.unwrap() - b.unwrap()).norm() < 1e-6);
        }
    }

    #[test]
    fn what_some_lack_is_said_and_left_out() {
        let mut lacking = dome(0.0);
        lacking.name = "lacking".into();
        lacking.landmarks[index::NOSE_TIP] = None;
        lacking.landmarks[3] = None;
        let average = AverageFace::of(vec![dome(0.0), lacking, dome(0.0)], &options(), || {}).unwrap();
        assert_eq!(average.missing, [("lacking".to_owned(), 1)]);
        assert!(!average.common.contains(&3) && average.landmarks[3].is_some());
        let mut blind = dome(0.0);
        blind.landmarks[index::LEFT_EYE_OUTER] = None;
        let error = AverageFace::of(vec![dome(0.0), blind], &options(), || {}).unwrap_err().to_string();
        assert!(error.contains("no average") && error.contains("eye corners"), "{error}");
        assert!(AverageFace::of(Vec::new(), &options(), || {}).is_err());
    }
}
