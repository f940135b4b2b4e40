//! Cutting the painted eye out of the skin around it.

use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point2, Point3};

use super::{
    edit::EditMesh,
    outline::{Outline, smooth_curve},
    regions::EyeLandmarks,
};

/// Length of edges at the rim, eye widths, and how fast it may grow away from it.
const EDGE: f64 = 0.075;
const EDGE_GROWTH: f64 = 0.9;
/// How far around the rim the mesh is refined, eye widths.
const AROUND: f64 = 0.35;
/// The cut runs this far outside the network's rim, eye widths: the network sees where white ends, not where skin does.
const DILATION: f64 = 0.02;
/// Surface farther behind the corners than this is the inside of the head, eye widths.
const BEHIND: f64 = 0.6;
/// Lids nearer to each other than this are shut, eye widths.
const SHUT: f64 = 0.10;
/// What lies this far behind the lids is no lash, eye widths.
const DEEP: f64 = 0.03;
/// Points of a rim that lie so far behind its foremost ones have fallen into the socket, eye widths.
const FALLEN: f64 = 0.45;
/// A rim of fewer places is none.
const FEWEST_RIM: usize = 12;
/// Points of the smooth outline to each landmark.
const STEPS: usize = 8;

/// A cut-out eye.
#[derive(Debug, Clone)]
pub struct EyeHole {
    /// The rim in the plane of the face.
    pub outline: Outline,
    /// Corners in the axes of the face: towards the temple, towards the nose.
    pub corners: [Point3<f64>; 2],
    /// Places on the skin's side of the rim.
    pub rim: Vec<u32>,
    /// Vertices of what was cut out.
    pub painted: Vec<u32>,
    /// Vertices of what lies behind the skin around it.
    pub deep: Vec<u32>,
}

/// Why an eye could not be cut out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error, Serialize, Deserialize)]
pub enum EyeFault {
    /// Landmarks are missing.
    #[error("its landmarks were not found on the surface")]
    NoLandmarks,
    /// The lids touch.
    #[error("it is closed in the scan, and what lies behind its lids was not scanned")]
    Shut,
    /// The lids are modelled around an empty socket.
    #[error("its lids are modelled around a hollow: an eyeball is put there, but the lids stay open")]
    Hollow,
    /// The rim leaves the surface.
    #[error("the surface around it has holes")]
    OffSurface,
}

/// Cuts one eye out of `edit`, a mesh in the face's axes; `landmarks` are in the same. On a fault nothing is changed.
pub fn open(
    edit: &mut EditMesh,
    landmarks: &[Option<Point3<f64>>],
    eye: &EyeLandmarks,
) -> Result<EyeHole, EyeFault> {
    let at = |i: usize| landmarks[i].ok_or(EyeFault::NoLandmarks);
    let (outer, inner) = (at(eye.outer)?, at(eye.inner)?);
    let width = (outer.xy() - inner.xy()).norm();
    let rim = |list: &[usize; 7]| -> Vec<Point2<f64>> {
        let between = list.iter().filter_map(|&i| landmarks[i].map(|p| p.xy()));
        std::iter::once(outer.xy()).chain(between).chain([inner.xy()]).collect()
    };
    let (upper, lower) = (rim(&eye.upper), rim(&eye.lower));
    if upper.len() < 6 || lower.len() < 6 || width < 1e-6 {
        return Err(EyeFault::NoLandmarks);
    }
    let pairs = eye.upper.iter().zip(&eye.lower);
    let gaps: Vec<f64> =
        pairs.filter_map(|(&u, &l)| Some((landmarks[u]?.xy() - landmarks[l]?.xy()).norm())).collect();
    if gaps.iter().sum::<f64>() / (gaps.len().max(1) as f64) < SHUT * width {
        return Err(EyeFault::Shut);
    }
    if hollow_front(landmarks, eye, width).is_some() {
        return Err(EyeFault::Hollow);
    }
    let outline = dilated(&upper, &lower, width);
    let (low, high) = outline.bounds();
    let mut depths: Vec<f64> =
        eye.upper.iter().chain(&eye.lower).filter_map(|&i| Some(landmarks[i]?.z)).collect();
    depths.sort_by(f64::total_cmp);
    let front = depths[depths.len() / 2];
    let (nearest, foremost) = (front - BEHIND * width, front + width);
    let margin = AROUND * width;
    let mut patch = edit.patch(
        &Point3::new(low.x - margin, low.y - margin, nearest),
        &Point3::new(high.x + margin, high.y + margin, foremost),
    );
    let copy = edit.clone();
    let fine = EDGE * width;
    edit.refine(&mut patch, |p| {
        let away = outline.inside(&p.xy()).abs();
        if away > margin || !(nearest..foremost).contains(&p.z) {
            return f64::INFINITY;
        }
        fine + EDGE_GROWTH * (away - fine).max(0.0)
    });
    let on = edit.embed(&mut patch, |p| outline.inside(&p.xy()), |p| p.z > nearest && p.z < foremost);
    let strays = strays(edit, &patch, &outline);
    let is_inside = |triangle: u32| {
        if strays.contains(&triangle) {
            return false;
        }
        let corners = edit.corners(triangle);
        let free: Vec<f64> =
            corners.iter().filter(|c| !on.contains(c)).map(|&c| outline.inside(&edit.at(c).xy())).collect();
        let middle = corners.iter().map(|&c| edit.at(c).coords).sum::<nalgebra::Vector3<f64>>() / 3.0;
        let by_corners = if free.is_empty() {
            outline.inside(&middle.xy().into()) > 0.0
        } else {
            free.iter().all(|level| *level > 0.0)
        };
        by_corners && middle.z > nearest
    };
    let (cut_out, around): (Vec<u32>, Vec<u32>) = patch.iter().copied().partition(|&t| is_inside(t));
    let of = |edit: &EditMesh, list: &[u32]| -> BTreeSet<u32> {
        list.iter().flat_map(|&t| edit.corners(t)).collect()
    };
    let shared: BTreeSet<u32> = of(edit, &cut_out).intersection(&of(edit, &around)).copied().collect();
    if cut_out.is_empty() || shared.len() < FEWEST_RIM {
        *edit = copy;
        return Err(EyeFault::OffSurface);
    }
    edit.detach(&cut_out, &shared);
    let painted: BTreeSet<u32> = cut_out.iter().flat_map(|&t| edit.mesh().triangles[t as usize]).collect();
    let (rim, deep) = behind_skin(edit, &patch, &shared, &painted, front - DEEP * width);
    if rim.len() < FEWEST_RIM {
        *edit = copy;
        return Err(EyeFault::OffSurface);
    }
    Ok(EyeHole { outline, corners: [outer, inner], rim, painted: painted.into_iter().collect(), deep })
}

/// The depth of the lids' edges where the network's points fall past them into an empty socket; `None` on a whole face.
pub fn hollow_front(landmarks: &[Option<Point3<f64>>], eye: &EyeLandmarks, width: f64) -> Option<f64> {
    let rim = eye.upper.iter().chain(&eye.lower).chain([&eye.outer, &eye.inner]);
    let mut depths: Vec<f64> = rim.filter_map(|&i| Some(landmarks[i]?.z)).collect();
    depths.sort_by(f64::total_cmp);
    let front = *depths.get(depths.len() * 4 / 5)?;
    let fallen = depths.iter().filter(|z| **z < front - FALLEN * width).count();
    (fallen * 4 > depths.len()).then_some(front)
}

/// Of the places around the cut those of the skin, and the vertices of what lies behind it: a socket that was modelled, an
/// eyeball larger than the opening. `depth` is the z behind which a piece is no lash.
fn behind_skin(
    edit: &EditMesh,
    patch: &[u32],
    shared: &BTreeSet<u32>,
    painted: &BTreeSet<u32>,
    depth: f64,
) -> (Vec<u32>, Vec<u32>) {
    let component = edit.components();
    let of = |place: u32| component[place as usize];
    let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
    for &place in shared {
        *counts.entry(of(place)).or_default() += 1;
    }
    let skin = counts.iter().max_by_key(|(_, count)| **count).map(|(name, _)| *name);
    let rim = shared.iter().copied().filter(|&place| Some(of(place)) == skin).collect();
    let mut pieces: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for vertex in patch.iter().flat_map(|&t| edit.mesh().triangles[t as usize]) {
        if Some(of(vertex)) != skin && !painted.contains(&vertex) {
            pieces.entry(of(vertex)).or_default().insert(vertex);
        }
    }
    let mean = |piece: &BTreeSet<u32>| piece.iter().map(|&v| edit.at(v).z).sum::<f64>() / piece.len() as f64;
    (rim, pieces.into_values().filter(|piece| mean(piece) < depth).flatten().collect())
}

/// Lashes and the like: pieces of their own that reach across the rim. They are not cut.
fn strays(edit: &EditMesh, patch: &[u32], outline: &Outline) -> BTreeSet<u32> {
    let component = edit.components();
    let mut pieces: BTreeMap<u32, (Vec<u32>, bool)> = BTreeMap::new();
    for &triangle in patch {
        let corners = edit.corners(triangle);
        let within = corners.iter().all(|&c| outline.inside(&edit.at(c).xy()) > 0.0);
        let piece = pieces.entry(component[corners[0] as usize]).or_insert((Vec::new(), true));
        piece.0.push(triangle);
        piece.1 &= within;
    }
    let skin = pieces.values().map(|piece| piece.0.len()).max().unwrap_or(0);
    pieces.into_values().filter(|(piece, within)| piece.len() < skin && !within).flat_map(|p| p.0).collect()
}

/// The smooth rim through both lids, moved outwards, but not at the corners.
fn dilated(upper: &[Point2<f64>], lower: &[Point2<f64>], width: f64) -> Outline {
    let mut curve = smooth_curve(upper, STEPS);
    let below = smooth_curve(lower, STEPS);
    curve.extend(below[1..below.len() - 1].iter().rev());
    let middle =
        Point2::from(curve.iter().map(|p| p.coords).sum::<nalgebra::Vector2<f64>>() / curve.len() as f64);
    let (outer, inner) = (upper[0], upper[upper.len() - 1]);
    let axis = (inner - outer) / (inner - outer).norm_squared();
    let count = curve.len();
    let moved = (0..count)
        .map(|i| {
            let (p, before, after) = (curve[i], curve[(i + count - 1) % count], curve[(i + 1) % count]);
            let along = after - before;
            let normal = nalgebra::Vector2::new(along.y, -along.x).try_normalize(1e-12).unwrap_or_default();
            let normal = if normal.dot(&(p - middle)) < 0.0 { -normal } else { normal };
            let t = (p - outer).dot(&axis).clamp(0.0, 1.0);
            p + normal * (DILATION * width * (4.0 * t * (1.0 - t)).min(1.0))
        })
        .collect();
    Outline::new(moved)
}
