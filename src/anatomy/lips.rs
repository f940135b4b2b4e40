//! Opening the lips: refine, embed the lip line, find the way along it, cut.

use std::{collections::BTreeSet, ops::Range};

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use super::{
    distances::Distances,
    edit::{EditMesh, triangle_edges},
    lip_line::LipLine,
    regions::{INNER_CORNERS, LOWER_INNER, UPPER_INNER},
    slit::{Slit, SlitFault, cut},
};

/// Length of edges at the line, mouth widths, and how fast it may grow away from it.
const EDGE: f64 = 0.045;
const EDGE_GROWTH: f64 = 1.0;
/// How far around the line the mesh is refined, mouth widths.
const AROUND: f64 = 0.25;
/// Surface farther behind the lips than this is the back of the head or the throat, mouth widths.
const BEHIND: f64 = 0.5;
/// The way over the skin from lip to lip is longer than this, in straight distances, where a mouth is open already.
const DETOUR: f64 = 1.6;
/// Lips that share vertices do so this near to the line, mouth widths.
const TOUCHING: f64 = 0.08;
/// Over this distance a sheet of touching lips shows which lip it is, mouth widths.
const SHEET_REACH: f64 = 0.16;
/// Half of the distance over which the skin is looked at across the line of an open mouth, mouth widths, and how much
/// longer than straight its way is where the lips part.
const ACROSS: f64 = 0.08;
const NARROW_DETOUR: f64 = 2.2;
/// Of the cut's edges at least this share lies on the line.
const ON_LINE: f64 = 0.8;
/// Landmarks in the middle of the outer rims, upper and lower.
const LIP_MIDDLES: [usize; 2] = [0, 17];

/// What became of the lips.
#[derive(Debug, Clone)]
pub enum Lips {
    /// They were one skin, and are cut along this path.
    Cut(Slit),
    /// The scan has its own opening between them.
    Open,
}

/// Why the lips could not be opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error, Serialize, Deserialize)]
pub enum LipFault {
    /// The line leaves the surface.
    #[error("the lip line leaves the surface")]
    OffSurface,
    /// The line could not be followed over the surface.
    #[error("the surface between the lips has holes")]
    Broken,
    /// The surface could not be cut there.
    #[error(transparent)]
    Slit(#[from] SlitFault),
}

/// Opens the lips of `edit`, a mesh in the face's axes, along `line`. `landmarks` are in the same axes; `mouth` is the
/// mouth's width in millimetres. On a fault the mesh is as it was. Where an open mouth is narrower than its lips, the line
/// is shortened to it.
pub fn open(
    edit: &mut EditMesh,
    line: &mut LipLine,
    landmarks: &[Option<Point3<f64>>],
    mouth: f64,
) -> Result<Lips, LipFault> {
    let mut depths: Vec<f64> = UPPER_INNER
        .iter()
        .chain(&LOWER_INNER)
        .chain(&INNER_CORNERS)
        .filter_map(|&i| Some(landmarks[i]?.z))
        .collect();
    depths.sort_by(f64::total_cmp);
    let front = *depths.get(depths.len() / 2).ok_or(LipFault::OffSurface)?;
    let depths = front - BEHIND * mouth..front + mouth;
    let reach = AROUND * mouth;
    let ends = line.ends.map(|end| line.place(end));
    let low = Point3::new(ends[0].x - 2.0 * reach, ends[0].y.min(ends[1].y) - 2.0 * reach, depths.start);
    let high = Point3::new(ends[1].x + 2.0 * reach, ends[0].y.max(ends[1].y) + 2.0 * reach, depths.end);
    let mut patch = edit.patch(&low, &high);
    if patch.is_empty() {
        return Err(LipFault::OffSurface);
    }
    separate(edit, &patch, line, mouth);
    if is_open(edit, &patch, landmarks, depths.start)? {
        if let Some(ends) = opening(edit, &patch, line, front, mouth) {
            line.shortened(ends);
        }
        return Ok(Lips::Open);
    }

    let copy = edit.clone();
    let opened = open_fused(edit, &mut patch, line, mouth, &depths);
    if opened.is_err() {
        *edit = copy;
    }
    opened.map(Lips::Cut)
}

/// Lips that a modeller has closed may share the row of vertices in which they touch, where the surface then branches.
/// The lower one gets a row of its own.
fn separate(edit: &mut EditMesh, patch: &[u32], line: &LipLine, mouth: f64) {
    let on_line = |p: &Point3<f64>| {
        let along = line.along(p);
        (line.ends[0]..line.ends[1]).contains(&along) && line.above(p).abs() < TOUCHING * mouth
    };
    let edges = edit.edges(patch);
    let row: BTreeSet<u32> = edges
        .iter()
        .filter(|(_, triangles)| triangles.len() > 2)
        .flat_map(|(&(a, b), _)| [a, b])
        .filter(|&place| on_line(edit.at(place)))
        .collect();
    let neighbours = |edit: &EditMesh, triangle: u32| -> Vec<u32> {
        let around = triangle_edges(edit.corners(triangle));
        let pairs = around.iter().filter_map(|edge| edges.get(edge)).filter(|triangles| triangles.len() == 2);
        pairs.flatten().copied().filter(|&other| other != triangle).collect()
    };
    let mut below = Vec::new();
    for &place in &row {
        let mut fan: BTreeSet<u32> =
            patch.iter().copied().filter(|&t| edit.corners(t).contains(&place)).collect();
        let mut sheets = Vec::new();
        while let Some(start) = fan.pop_first() {
            let (mut sheet, mut next) = (vec![start], vec![start]);
            while let Some(triangle) = next.pop() {
                for other in neighbours(edit, triangle) {
                    if fan.remove(&other) {
                        sheet.push(other);
                        next.push(other);
                    }
                }
            }
            sheets.push(sheet);
        }
        // At the corners the lips are one sheet, and stay so.
        if sheets.len() > 1 {
            for sheet in sheets {
                if rise(edit, &sheet, place, mouth, &|t| neighbours(edit, t)) < 0.0 {
                    below.extend(sheet);
                }
            }
        }
    }
    edit.detach(&below, &row);
}

/// How far a sheet of surface rises, on average, as it leaves a place: an overhanging lip first leads downwards.
fn rise(edit: &EditMesh, sheet: &[u32], place: u32, mouth: f64, neighbours: &dyn Fn(u32) -> Vec<u32>) -> f64 {
    let start = *edit.at(place);
    let middle = |triangle: u32| {
        Point3::from(edit.corners(triangle).map(|c| edit.at(c).coords).iter().sum::<Vector3<f64>>() / 3.0)
    };
    let mut seen: BTreeSet<u32> = sheet.iter().copied().collect();
    let mut next = sheet.to_vec();
    while let Some(triangle) = next.pop() {
        for other in neighbours(triangle) {
            if (middle(other) - start).norm() < SHEET_REACH * mouth && seen.insert(other) {
                next.push(other);
            }
        }
    }
    seen.iter().map(|&t| middle(t).y - start.y).sum::<f64>() / seen.len().max(1) as f64
}

/// Whether the way over the skin from lip to lip leads around an opening.
fn is_open(
    edit: &EditMesh,
    patch: &[u32],
    landmarks: &[Option<Point3<f64>>],
    nearest: f64,
) -> Result<bool, LipFault> {
    let [upper, lower] = LIP_MIDDLES.map(|i| landmarks[i]);
    let (upper, lower) = upper.zip(lower).ok_or(LipFault::OffSurface)?;
    let places = || patch.iter().flat_map(|&t| edit.corners(t));
    let closest = |p: &Point3<f64>| {
        let far = |place: &u32| (edit.at(*place) - p).norm_squared();
        places().min_by(|a, b| far(a).total_cmp(&far(b)).then(a.cmp(b))).ok_or(LipFault::OffSurface)
    };
    let (from, to) = (closest(&upper)?, closest(&lower)?);
    let price = |a: u32, b: u32| {
        let (p, q) = (edit.at(a), edit.at(b));
        (p.z.min(q.z) > nearest).then(|| (p - q).norm())
    };
    let straight = (edit.at(from) - edit.at(to)).norm();
    let way = Distances::from(edit, patch, &[from], price).way_to(to);
    let detour = way.map_or(f64::INFINITY, |(_, length)| length / straight.max(1e-9));
    tracing::info!("from lip to lip the skin takes {detour:.2} times the straight way");
    Ok(detour > DETOUR)
}

/// Between which along-coordinates the lips really part: where the skin leads from one to the other only by a detour.
fn opening(edit: &EditMesh, patch: &[u32], line: &LipLine, front: f64, mouth: f64) -> Option<[f64; 2]> {
    const STEPS: usize = 24;
    let places: BTreeSet<u32> = patch.iter().flat_map(|&t| edit.corners(t)).collect();
    let closest = |target: Point3<f64>| {
        let far = |place: &u32| (edit.at(*place) - target).norm_squared();
        places.iter().copied().min_by(|a, b| far(a).total_cmp(&far(b)))
    };
    let step = (line.ends[1] - line.ends[0]) / STEPS as f64;
    let parts = |along: f64| {
        let (middle, up) = (line.place(along), line.up() * (ACROSS * mouth));
        // Of a lip's outside and its lining the outside lies in front.
        let at = |p: nalgebra::Point2<f64>| closest(Point3::new(p.x, p.y, front + ACROSS * mouth));
        let (Some(above), Some(below)) = (at(middle + up), at(middle - up)) else { return false };
        let price = |a: u32, b: u32| Some((edit.at(a) - edit.at(b)).norm());
        let way = Distances::from(edit, patch, &[above], price).way_to(below);
        let straight = (edit.at(above) - edit.at(below)).norm().max(ACROSS * mouth);
        way.is_none_or(|(_, length)| length > NARROW_DETOUR * straight)
    };
    let open: Vec<f64> =
        (0..=STEPS).map(|i| line.ends[0] + step * i as f64).filter(|&along| parts(along)).collect();
    let (first, last) = (*open.first()?, *open.last()?);
    (last - first > 0.3 * mouth).then(|| [(first - step).max(line.ends[0]), (last + step).min(line.ends[1])])
}

fn open_fused(
    edit: &mut EditMesh,
    patch: &mut Vec<u32>,
    line: &LipLine,
    mouth: f64,
    depths: &Range<f64>,
) -> Result<Slit, LipFault> {
    let fine = EDGE * mouth;
    let beyond = |p: &Point3<f64>| {
        let along = line.along(p);
        (line.ends[0] - along).max(along - line.ends[1])
    };
    edit.refine(patch, |p| {
        let away = line.above(p).abs().max(beyond(p));
        if away > AROUND * mouth || !depths.contains(&p.z) {
            return f64::INFINITY;
        }
        fine + EDGE_GROWTH * (away - fine).max(0.0)
    });
    let level = |p: &Point3<f64>| line.above(p);
    let on = edit.embed(patch, level, |p| beyond(p) <= 0.0 && depths.contains(&p.z));
    let end = |along: f64| {
        // Of the sheets of a folded lip the foremost one.
        let off = |place: &u32| {
            let p = edit.at(*place);
            (line.along(p) - along).abs() - 0.3 * p.z
        };
        on.iter()
            .filter(|place| (line.along(edit.at(**place)) - along).abs() < 2.0 * fine)
            .min_by(|a, b| off(a).total_cmp(&off(b)).then(a.cmp(b)))
            .copied()
            .ok_or(LipFault::OffSurface)
    };
    let (start, stop) = (end(line.ends[0])?, end(line.ends[1])?);
    let price = |a: u32, b: u32| {
        let (p, q) = (edit.at(a), edit.at(b));
        let length = (p - q).norm();
        if on.contains(&a) && on.contains(&b) {
            return Some(0.3 * length);
        }
        let off = line.above(p).abs().max(line.above(q).abs()) / fine;
        (p.z.min(q.z) > depths.start).then_some(length * (1.0 + 4.0 * off * off))
    };
    let (path, _) = Distances::from(edit, patch, &[start], price).way_to(stop).ok_or(LipFault::Broken)?;
    let followed = path.iter().filter(|place| on.contains(place)).count();
    if (followed as f64) < ON_LINE * path.len() as f64 {
        return Err(LipFault::Broken);
    }
    Ok(cut(edit, patch, &path, level)?)
}
