//! How the controls' displacements spread over skin and rims: through space, or over the surface.
//!
//! Through space a spline drags one lip along with the other, so either side of the lips has its own, without the other
//! lip's controls (000 §7.2 asks for finer regions; what they bring beyond this split was measured and is nothing). Over
//! the surface the cut itself keeps them apart.

use nalgebra::Point3;

use super::{
    Controls, RigError, TargetFace, VolumeMorph, WarpKind, controls::Driver, skin::HeldVertex, volume::reach,
};
use crate::{
    anatomy::{Anatomy, Lip, SidedSkin},
    deform::{DeformError, Handle, Stiffness, SurfaceWarp},
    spline::{Kernel, Options, Regularisation, Warp},
};

/// λ of the warp over the outer canthal distance: enough that two landmarks on one pixel do no harm, too little to
/// take more than a hundredth off a lip's gap.
const LAMBDA: f64 = 1e-4;
/// Tension of the surface times the squared outer canthal distance: 0.4 a squared centimetre on an average face.
const TENSION: f64 = 30.0;
/// Skin farther than this many outer canthal distances from every control does not move.
const REACH: f64 = 0.8;
/// A control farther than this many outer canthal distances from the skin does not hold it.
const OFF: f64 = 0.06;
/// With less of the skin within reach on the controls' pieces of the surface, the scan is too broken for this warp.
const WHOLE: f64 = 0.7;

/// What is moved: the skin's vertices, then the ring from which the cavity hangs.
pub(super) struct Points {
    pub(super) places: Vec<Point3<f64>>,
    /// 0 above the lips' line, 1 below it.
    pub(super) sides: Vec<f32>,
}

impl Points {
    pub(super) fn of(anatomy: &Anatomy) -> Self {
        let ring = anatomy.mouth.as_ref().map_or(&[][..], |mouth| &mouth.ring);
        let skin = &anatomy.mesh.positions[..anatomy.skin_vertices()];
        Self {
            places: skin.iter().copied().chain(ring.iter().map(|point| point.place)).collect(),
            sides: anatomy.lower_side.iter().copied().chain(ring.iter().map(|point| point.side)).collect(),
        }
    }
}

/// The points × controls matrix.
pub(super) fn spread(
    target: &TargetFace,
    controls: &Controls,
    anatomy: &Anatomy,
    points: &Points,
    held: &[HeldVertex],
    kind: WarpKind,
) -> Result<Warp, RigError> {
    let all = vec![true; points.places.len()];
    let through_space =
        |wanted: &[bool]| two_sided((Kernel::Linear, options(target)), controls, anatomy, points, wanted);
    match kind {
        WarpKind::Surface => (),
        WarpKind::Spline | WarpKind::Regions => return through_space(&all),
        WarpKind::Volume(morph) => return morphed(target, &morph, controls, anatomy, points),
    }
    match over_surface(target, controls, anatomy, held) {
        Ok(surface) => {
            let ring = ring_rims(anatomy, points);
            let mut trust = trusted(&surface, controls.rest.len());
            leave_lids(anatomy, &surface, &mut trust);
            let mut left = all;
            for (&vertex, trust) in surface.vertices.iter().zip(&trust) {
                left[vertex as usize] = *trust < 1.0;
            }
            for (at, rim) in ring.iter().enumerate() {
                left[anatomy.skin_vertices() + at] = rim.is_none();
            }
            let spline = through_space(&left)?;
            onto_surface(&spline, &surface, &trust, anatomy, &ring)
        }
        Err(fault) => {
            tracing::warn!("motion is spread through space and not over the surface: {fault}");
            through_space(&all)
        }
    }
}

/// Either side of the lips from all controls but the other lip's: a spline through both would tear neither apart. Points
/// that are not `wanted` are left at nothing.
fn two_sided(
    (kernel, options): (Kernel, Options),
    controls: &Controls,
    anatomy: &Anatomy,
    points: &Points,
    wanted: &[bool],
) -> Result<Warp, RigError> {
    let positions = &points.places;
    let fault = |source| RigError::Spline { what: "the target's control points", source };
    // One that is one skin has one side, with all controls.
    let others: &[Option<Lip>] =
        if anatomy.mouth.is_none() { &[None] } else { &[Some(Lip::Lower), Some(Lip::Upper)] };
    let mut halves = Vec::new();
    for &other in others {
        let members: Vec<usize> =
            (0..controls.rest.len()).filter(|&i| other != Some(controls.lips[i])).collect();
        let centres: Vec<_> = members.iter().map(|&i| controls.rest[i]).collect();
        let weight = |v: usize| match other {
            None => 1.0,
            Some(Lip::Upper) => points.sides[v],
            Some(_) => 1.0 - points.sides[v],
        };
        let vertices: Vec<usize> = (0..positions.len()).filter(|&v| wanted[v] && weight(v) > 0.0).collect();
        if vertices.is_empty() {
            continue;
        }
        let places: Vec<_> = vertices.iter().map(|&v| positions[v]).collect();
        let warp = Warp::new(kernel, &centres, &controls.anchors, &places, options).map_err(fault)?;
        let weights: Vec<f32> = vertices.iter().map(|&v| weight(v)).collect();
        halves.push((members, vertices, weights, warp));
    }
    Warp::from_columns(positions.len(), controls.rest.len(), |control, column| {
        for (members, vertices, weights, warp) in &halves {
            let Ok(own) = members.binary_search(&control) else { continue };
            for ((&vertex, weight), share) in vertices.iter().zip(weights).zip(warp.column(own)) {
                column[vertex] += share * weight;
            }
        }
    })
    .map_err(fault)
}

/// The morph of 002 §IV, either side of the lips by itself, which ends where the face does.
fn morphed(
    target: &TargetFace,
    morph: &VolumeMorph,
    controls: &Controls,
    anatomy: &Anatomy,
    points: &Points,
) -> Result<Warp, RigError> {
    let reach = reach(target, &points.places);
    let wanted: Vec<bool> = reach.iter().map(|share| *share > 0.0).collect();
    let whole = two_sided((morph.kernel, morph.options()), controls, anatomy, points, &wanted)?;
    Warp::from_columns(whole.vertices(), whole.controls(), |control, column| {
        for ((to, share), reach) in column.iter_mut().zip(whole.column(control)).zip(&reach) {
            *to = share * reach;
        }
    })
    .map_err(|source| RigError::Spline { what: "the target's volume", source })
}

pub(super) fn options(target: &TargetFace) -> Options {
    let lambda = LAMBDA * target.outer_canthal_distance();
    Options { regularisation: Regularisation::Absolute(lambda), ..Options::default() }
}

/// The surface warp of the skin, its columns the controls.
fn over_surface(
    target: &TargetFace,
    controls: &Controls,
    anatomy: &Anatomy,
    held: &[HeldVertex],
) -> Result<SurfaceWarp, DeformError> {
    let eyes = target.outer_canthal_distance();
    let skin = anatomy.skin_vertices();
    let positions = &anatomy.mesh.positions[..skin];
    let triangles = &anatomy.mesh.triangles[anatomy.parts[0].triangles.clone()];
    let mut handles = handles(controls, anatomy, triangles, OFF * eyes)?;
    for rim in held {
        let mut handle = Handle::at(rim.vertex as u32, 0);
        handle.follows = [0, 1].map(|end| (rim.controls[end], rim.shares[end]));
        handles.push(handle);
    }
    let still = beyond(positions, &controls.rest, REACH * eyes);
    let stiffness = Stiffness { tension: TENSION / (eyes * eyes).max(f64::MIN_POSITIVE) };
    let warp = SurfaceWarp::new(positions, triangles, &handles, controls.rest.len(), &still, stiffness)?;
    let within = still.iter().filter(|still| !**still).count();
    if (warp.vertices.len() as f64) < WHOLE * within as f64 {
        let reason = format!(
            "only {} of the face's {within} vertices hang together with its landmarks; weld the scan's vertices (in \
             Blender: Merge by Distance)",
            warp.vertices.len()
        );
        return Err(DeformError::Broken { reason });
    }
    Ok(warp)
}

/// The controls as places on the skin; those of a lip on their own side of the cut. Rims have vertices of their own
/// where the lips were cut.
fn handles(
    controls: &Controls,
    anatomy: &Anatomy,
    triangles: &[[u32; 3]],
    off: f64,
) -> Result<Vec<Handle>, DeformError> {
    let positions = &anatomy.mesh.positions[..anatomy.skin_vertices()];
    let skin = SidedSkin::new(positions, triangles, &anatomy.lower_side)
        .ok_or_else(|| DeformError::Broken { reason: "it has no triangles".to_owned() })?;
    let cut = anatomy.mouth.as_ref().is_some_and(|mouth| !mouth.held.is_empty());
    let mut handles = Vec::new();
    for (column, ((driver, rest), lip)) in
        controls.drivers.iter().zip(&controls.rest).zip(&controls.lips).enumerate()
    {
        if cut && matches!(driver, Driver::Rim { .. }) {
            continue;
        }
        let Some(place) = skin.nearest(*lip, *rest) else { continue };
        if (place.position - rest).norm() > off {
            continue;
        }
        handles.push(Handle {
            vertices: place.vertices,
            weights: place.weights,
            follows: [(column, 1.0), (column, 0.0)],
        });
    }
    Ok(handles)
}

/// Which positions lie farther than `reach` from all of `points`.
fn beyond(positions: &[Point3<f64>], points: &[Point3<f64>], reach: f64) -> Vec<bool> {
    let squared = reach * reach;
    positions.iter().map(|p| !points.iter().any(|q| (p - q).norm_squared() < squared)).collect()
}

/// The spline's matrix with the rows of everything that the surface reaches replaced, and with the cavity's ring on the
/// rims that it hangs from.
fn onto_surface(
    spline: &Warp,
    surface: &SurfaceWarp,
    trust: &[f32],
    anatomy: &Anatomy,
    ring: &[Option<usize>],
) -> Result<Warp, RigError> {
    let skin = anatomy.skin_vertices();
    Warp::from_columns(spline.vertices(), spline.controls(), |control, column| {
        column.copy_from_slice(spline.column(control));
        for ((&vertex, share), trust) in surface.vertices.iter().zip(surface.column(control)).zip(trust) {
            let through_space = &mut column[vertex as usize];
            *through_space += (share - *through_space) * trust;
        }
        for (at, rim) in ring.iter().enumerate() {
            if let Some(rim) = *rim {
                column[skin + at] = column[rim];
            }
        }
    })
    .map_err(|source| RigError::Spline { what: "the target's surface", source })
}

/// How far each of the surface's vertices is to be moved by it, 0..=1. Between handles shares add up to little more than 1;
/// far beyond the last ones, on the insides of mouths and sockets, they are differences of large numbers.
fn trusted(surface: &SurfaceWarp, controls: usize) -> Vec<f32> {
    const FULL: f32 = 3.0;
    const NONE: f32 = 6.0;
    let mut sums = vec![0.0_f32; surface.vertices.len()];
    for control in 0..controls {
        for (sum, share) in sums.iter_mut().zip(surface.column(control)) {
            *sum += share.abs();
        }
    }
    sums.iter().map(|sum| ((NONE - sum) / (NONE - FULL)).clamp(0.0, 1.0)).collect()
}

/// Prepared lids have shapes of their own and hang by their corners. Over the surface the skin around them, which a blink
/// moves too, would pull their free rims along and close them twice: they keep the spline, the more the farther they close.
fn leave_lids(anatomy: &Anatomy, surface: &SurfaceWarp, trust: &mut [f32]) {
    /// Of a lid's longest way the share from which on it is left alone.
    const LID: f64 = 0.25;
    for eye in anatomy.eyes.iter().flatten() {
        let Some(shut) = eye.lids.shapes.last() else { continue };
        let longest = shut.iter().map(nalgebra::Vector3::norm).fold(f64::MIN_POSITIVE, f64::max);
        for (vertex, way) in eye.lids.vertices.iter().zip(shut) {
            if let Ok(at) = surface.vertices.binary_search(vertex) {
                let own = (way.norm() / (LID * longest)).min(1.0) as f32;
                trust[at] = trust[at].min(1.0 - own);
            }
        }
    }
}

/// Of each point of the cavity's ring the rim's vertex from which it hangs.
fn ring_rims(anatomy: &Anatomy, points: &Points) -> Vec<Option<usize>> {
    let ring = anatomy.skin_vertices()..points.places.len();
    ring.map(|at| nearest_rim(anatomy, &points.places[at], points.sides[at])).collect()
}

fn nearest_rim(anatomy: &Anatomy, place: &Point3<f64>, side: f32) -> Option<usize> {
    let rim = &anatomy.mouth.as_ref()?.rims[usize::from(side >= 0.5)];
    let distance = |v: &u32| (anatomy.mesh.positions[*v as usize] - place).norm_squared();
    rim.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).map(|v| *v as usize)
}
