//! Transfer with handles at known vertices: what rule, warp and number of handles are worth by themselves.

use nalgebra::{Point3, Rotation3, Vector3};
use understudy::{
    actions::Catalogue,
    deform::{Handle, Stiffness, SurfaceWarp},
    rig::{SourceFace, TargetFace, Transfer, TransferRule},
    scan::Surface,
    spline::{Kernel, Options, Regularisation, Warp},
    tracking::{IBUG_68, LANDMARK_COUNT, SKIN_LANDMARK_COUNT, index},
};

use crate::protocol::{Case, Face, Outcome, Protocol, error};

/// Which vertices are handles.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Handles {
    Ibug68,
    Network468,
    /// And the catalogue's muscle control points.
    Muscles,
    /// And its wrinkle control points.
    Wrinkles,
    Full,
}

/// What spreads their motion.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Spread {
    Surface,
    Space(Kernel),
    /// Upper and lower face apart, below and above the tip of the nose.
    Regions(Kernel),
}

pub struct Row {
    pub handles: Handles,
    pub rule: TransferRule,
    pub spread: Spread,
}

/// Errors of every expression under A1 and A2, for each of the rows.
pub fn errors(protocol: &Protocol, case: &Case, mean: &Face, rows: &[Row]) -> Outcome<Vec<[Vec<f64>; 2]>> {
    let mut results = Vec::new();
    let mut warps: Vec<(Handles, Spread, Matrix)> = Vec::new();
    for row in rows {
        let handles = handles(protocol, case, row.handles)?;
        if !warps.iter().any(|(h, s, _)| *h == row.handles && *s == row.spread) {
            warps.push((row.handles, row.spread, Matrix::new(protocol, case, &handles, row.spread)?));
        }
        let Some((_, _, matrix)) = warps.iter().find(|(h, s, _)| *h == row.handles && *s == row.spread)
        else {
            continue;
        };
        let mut of_tasks = [Vec::new(), Vec::new()];
        for (task, source) in [&case.a1, mean].into_iter().enumerate() {
            let transfer = transfer(protocol, row, source, case, &handles)?;
            for (motion, truth) in source.motions.iter().zip(&case.target.motions) {
                let moved: Vec<[f32; 3]> = handles
                    .iter()
                    .enumerate()
                    .map(|(k, &v)| {
                        transfer.vector(SKIN_LANDMARK_COUNT + k, &motion[v]).map(|c| c as f32).into()
                    })
                    .collect();
                of_tasks[task].push(error(&matrix.apply(&moved), truth, &protocol.evaluation_mask));
            }
        }
        results.push(of_tasks);
    }
    Ok(results)
}

/// The landmarks, and the vertices nearest to the catalogue's control points on the target.
fn with_points(protocol: &Protocol, case: &Case, wrinkles: bool) -> Outcome<Vec<usize>> {
    let surface = Surface::new(&case.target.mesh)?;
    let landmarks: Vec<_> =
        protocol.landmarks_468.iter().map(|&v| Some(case.target.mesh.positions[v])).collect();
    let placed = Catalogue::get().place(&landmarks, &surface);
    let points = placed[SKIN_LANDMARK_COUNT..].iter().zip(&Catalogue::get().points);
    let chosen = points.filter(|(_, point)| wrinkles || point.is_muscle);
    let vertices = chosen.filter_map(|(place, _)| Some(surface.nearest_vertex((*place)?)?.0 as usize));
    Ok(protocol.landmarks_468.iter().copied().chain(vertices).collect())
}

fn handles(protocol: &Protocol, case: &Case, which: Handles) -> Outcome<Vec<usize>> {
    let mut vertices: Vec<usize> = match which {
        Handles::Ibug68 => protocol.landmarks_68.clone(),
        Handles::Network468 => protocol.landmarks_468.clone(),
        Handles::Muscles => with_points(protocol, case, false)?,
        Handles::Wrinkles => with_points(protocol, case, true)?,
        Handles::Full => protocol
            .landmarks_468
            .iter()
            .chain(&protocol.extras)
            .copied()
            .chain(protocol.rim_vertices())
            .collect(),
    };
    vertices.sort_unstable();
    vertices.dedup();
    Ok(vertices)
}

/// The product's own rule, with the handles behind the landmarks.
fn transfer(
    protocol: &Protocol,
    row: &Row,
    source: &Face,
    case: &Case,
    handles: &[usize],
) -> Outcome<Transfer> {
    let at = |face: &Face, vertices: &[usize]| -> Vec<Point3<f64>> {
        vertices.iter().map(|&v| face.mesh.positions[v]).collect()
    };
    let mut points = at(source, &protocol.landmarks_468);
    points.extend(at(source, handles));
    let mut landmarks: Vec<Option<Point3<f64>>> =
        at(&case.target, &protocol.landmarks_468).into_iter().map(Some).collect();
    landmarks.resize(LANDMARK_COUNT, None);
    if row.handles == Handles::Ibug68 {
        for (i, landmark) in landmarks.iter_mut().enumerate() {
            if !IBUG_68.contains(&i) {
                *landmark = None;
            }
        }
        // iBUG's own vertices, which are not quite the network's.
        for (k, &i) in IBUG_68.iter().enumerate() {
            landmarks[i] = Some(case.target.mesh.positions[protocol.landmarks_68[k]]);
            points[i] = source.mesh.positions[protocol.landmarks_68[k]];
        }
    }
    let source = SourceFace { points, level: Rotation3::identity(), closed_lips: [0.0; 9], has_depth: true };
    Ok(Transfer::new(&source, &TargetFace::new(landmarks, Rotation3::identity())?, row.rule)?)
}

/// Vertices × handles.
enum Matrix {
    Space(Warp),
    Surface(SurfaceWarp, usize),
}

impl Matrix {
    fn new(protocol: &Protocol, case: &Case, handles: &[usize], spread: Spread) -> Outcome<Self> {
        let mesh = &case.target.mesh;
        let at = |vertices: &[usize]| -> Vec<Point3<f64>> {
            vertices.iter().map(|&v| mesh.positions[v]).collect()
        };
        let (centres, anchors) = (at(handles), at(&protocol.zero_anchors));
        let options = Options { regularisation: Regularisation::UnitBox(1e-7), ..Options::default() };
        Ok(match spread {
            Spread::Space(kernel) => {
                Self::Space(Warp::new(kernel, &centres, &anchors, &mesh.positions, options)?)
            }
            Spread::Regions(kernel) => {
                let border = mesh.positions[protocol.landmarks_468[index::NOSE_TIP]].y;
                let mut columns = vec![vec![0.0_f32; mesh.positions.len()]; handles.len()];
                for lower in [false, true] {
                    let belongs = |p: &Point3<f64>| (p.y < border) == lower;
                    let own: Vec<usize> = (0..handles.len()).filter(|&k| belongs(&centres[k])).collect();
                    let places: Vec<usize> =
                        (0..mesh.positions.len()).filter(|&v| belongs(&mesh.positions[v])).collect();
                    let own_centres: Vec<_> = own.iter().map(|&k| centres[k]).collect();
                    let warp = Warp::new(kernel, &own_centres, &anchors, &at(&places), options)?;
                    for (column, &k) in own.iter().enumerate() {
                        for (&v, share) in places.iter().zip(warp.column(column)) {
                            columns[k][v] = *share;
                        }
                    }
                }
                let copy = |k: usize, to: &mut [f32]| to.copy_from_slice(&columns[k]);
                Self::Space(Warp::from_columns(mesh.positions.len(), handles.len(), copy)?)
            }
            Spread::Surface => {
                let mut still = vec![false; mesh.positions.len()];
                for &v in &protocol.zero_anchors {
                    still[v] = true;
                }
                let eyes = (mesh.positions[protocol.landmarks_468[33]]
                    - mesh.positions[protocol.landmarks_468[263]])
                    .norm();
                let own: Vec<Handle> =
                    handles.iter().enumerate().map(|(k, &v)| Handle::at(v as u32, k)).collect();
                let tension = if handles.len() > 150 { 30.0 } else { 80.0 } / (eyes * eyes);
                let warp = SurfaceWarp::new(
                    &mesh.positions,
                    &mesh.triangles,
                    &own,
                    own.len(),
                    &still,
                    Stiffness { tension },
                )?;
                Self::Surface(warp, mesh.positions.len())
            }
        })
    }

    fn apply(&self, moved: &[[f32; 3]]) -> Vec<Vector3<f64>> {
        match self {
            Self::Space(warp) => {
                let mut out = vec![[0.0_f32; 3]; warp.vertices()];
                // Sizes fit by construction.
                let _ = warp.apply(moved, &mut out);
                out.iter().map(|v| Vector3::from(v.map(f64::from))).collect()
            }
            Self::Surface(warp, vertices) => {
                let mut out = vec![Vector3::zeros(); *vertices];
                for (column, vector) in moved.iter().enumerate() {
                    let vector = Vector3::from(vector.map(f64::from));
                    for (&v, share) in warp.vertices.iter().zip(warp.column(column)) {
                        out[v as usize] += vector * f64::from(*share);
                    }
                }
                out
            }
        }
    }
}
