//! The one matrix that moves skin and cavity: splines on both sides of the lips, the jaw, the lids.
//!
//! All of it is linear in what changes from frame to frame, so a frame stays one product (and an export's morph targets
//! come from the same columns). A rigid motion x → x + (R − I)(x − p) + t that a vertex follows by the weight w is the
//! sum of four columns w·(x − p) and w with the columns of R − I and t as their displacements; a lid's shape is three
//! columns, one an axis.

use nalgebra::{Isometry3, Point3, Vector3};

use super::{
    Controls, RigError, TargetFace, WarpKind,
    controls::Driver,
    spread::{Points, options, spread},
};
use crate::{
    anatomy::{Anatomy, BETWEEN_JAW_AND_SKULL, CLOSURES, CORNERS, Jaw, Lip, ON_JAW, lid_shares},
    lift::{Eyes, Side},
    spline::{Kernel, Spline, Warp},
};

/// Columns of a rigid motion.
const RIGID: usize = 4;
/// Columns of one eye's lids.
const LIDS: usize = 3 * CLOSURES.len();
/// In the middle of the lips, up to this share of half the mouth's width, the lower one goes with the jaw altogether.
const MIDDLE: f64 = 0.55;
/// Landmarks this far above the mouth lie on the skull, mouth widths.
const ABOVE: f64 = 0.12;

/// The matrix, and what its columns are.
#[derive(Debug, Clone)]
pub struct SkinWarp {
    /// Soft vertices × columns.
    pub warp: Warp,
    /// Columns of the controls.
    controls: usize,
    /// First column of the jaw.
    jaw: Option<usize>,
    /// First columns of the right and the left eye's lids.
    lids: [Option<usize>; 2],
    /// How much each control moves with the jaw.
    pub jaw_shares: Vec<f64>,
    pivot: Point3<f64>,
}

impl SkinWarp {
    /// For an opened target, or a scan as it is.
    pub fn new(
        target: &TargetFace,
        controls: &Controls,
        anatomy: &Anatomy,
        kind: WarpKind,
    ) -> Result<Self, RigError> {
        let points = Points::of(anatomy);
        let held = HeldVertex::all(anatomy, controls);
        let spline = spread(target, controls, anatomy, &points, &held, kind)?;
        let shares = |jaw| match kind {
            // There the morph alone moves the skin; the bone moves teeth, tongue and what of the cavity hangs on it.
            WarpKind::Volume(_) => Ok(JawShares::none(controls, &points, jaw)),
            _ => JawShares::new(target, controls, anatomy, &points, jaw),
        };
        let bone = anatomy.jaw.map(shares).transpose()?;
        let jaw = bone.is_some().then_some(controls.rest.len());
        let mut columns = controls.rest.len() + if jaw.is_some() { RIGID } else { 0 };
        let lids = [0, 1].map(|eye| {
            anatomy.eyes[eye].as_ref().filter(|eye| !eye.lids.vertices.is_empty())?;
            columns += LIDS;
            Some(columns - LIDS)
        });
        let skin = anatomy.skin_vertices();
        let mut moved = vec![0.0_f32; points.places.len()];
        let warp = Warp::from_columns(anatomy.soft_vertices(), columns, |j, column| {
            moved.fill(0.0);
            let rigid = jaw.filter(|&first| (first..first + RIGID).contains(&j)).map(|first| j - first);
            if j < spline.controls() {
                moved.copy_from_slice(spline.column(j));
            } else if let (Some(which), Some(bone)) = (rigid, &bone) {
                bone.fill(which, &points.places, &mut moved);
            } else {
                let eye = usize::from(lids[1].is_some_and(|first| j >= first));
                if let (Some(first), Some(eye)) = (lids[eye], &anatomy.eyes[eye]) {
                    let (shape, axis) = ((j - first) / 3, (j - first) % 3);
                    for (&vertex, displacement) in eye.lids.vertices.iter().zip(&eye.lids.shapes[shape]) {
                        moved[vertex as usize] = displacement[axis] as f32;
                    }
                }
            }
            for rim in &held {
                moved[rim.vertex] = rim.value(j, rigid, &controls.rest, bone.as_ref());
            }
            column[..skin].copy_from_slice(&moved[..skin]);
            hang(anatomy, rigid, &moved[skin..], &mut column[skin..]);
        })
        .map_err(|source| RigError::Spline { what: "the target's skin", source })?;
        Ok(Self {
            warp,
            controls: controls.rest.len(),
            jaw,
            lids,
            jaw_shares: bone
                .as_ref()
                .map_or_else(|| vec![0.0; controls.rest.len()], |b| b.at_controls.clone()),
            pivot: anatomy.jaw.map_or_else(Point3::origin, |jaw| jaw.pivot),
        })
    }

    /// A warp made in another way, which has only controls.
    pub fn plain(warp: Warp) -> Self {
        let controls = warp.controls();
        Self {
            warp,
            controls,
            jaw: None,
            lids: [None, None],
            jaw_shares: vec![0.0; controls],
            pivot: Point3::origin(),
        }
    }

    /// Whether a jaw moves it.
    pub fn has_jaw(&self) -> bool {
        self.jaw.is_some()
    }

    /// Writes what jaw and lids put into their columns.
    pub fn drive(&self, jaw: &Isometry3<f64>, eyes: &Eyes, out: &mut [[f32; 3]]) {
        debug_assert!(out.len() == self.warp.controls() && self.controls <= out.len());
        if let Some(first) = self.jaw {
            let turn = jaw.rotation.to_rotation_matrix().into_inner() - nalgebra::Matrix3::identity();
            let slide = jaw * self.pivot - self.pivot;
            for axis in 0..3 {
                out[first + axis] = turn.column(axis).map(|v| v as f32).into();
            }
            out[first + 3] = slide.map(|v| v as f32).into();
        }
        for (side, first) in Side::BOTH.into_iter().zip(self.lids) {
            let Some(first) = first else { continue };
            for (k, share) in lid_shares(eyes.of(side).closure).into_iter().enumerate() {
                for axis in 0..3 {
                    out[first + 3 * k + axis] = [0.0; 3];
                    out[first + 3 * k + axis][axis] = share as f32;
                }
            }
        }
    }
}

/// A vertex on a rim: it goes exactly where the controls on either side of it go.
pub(super) struct HeldVertex {
    pub(super) vertex: usize,
    pub(super) controls: [usize; 2],
    pub(super) shares: [f64; 2],
}

impl HeldVertex {
    fn all(anatomy: &Anatomy, controls: &Controls) -> Vec<Self> {
        let Some(mouth) = &anatomy.mouth else { return Vec::new() };
        let held = mouth.held.iter().filter_map(|rim| {
            let control = |node: usize| {
                let driver = Driver::Rim { node, lower: rim.lower };
                controls.drivers.iter().position(|d| *d == driver)
            };
            Some(Self {
                vertex: rim.vertex as usize,
                controls: [control(rim.nodes[0])?, control(rim.nodes[1])?],
                shares: [1.0 - rim.share, rim.share],
            })
        });
        held.collect()
    }

    /// Its entry in column `j`, which is the jaw's column `rigid` or a control's or a lid's.
    fn value(&self, j: usize, rigid: Option<usize>, rest: &[Point3<f64>], bone: Option<&JawShares>) -> f32 {
        let pairs = self.controls.iter().zip(self.shares);
        let sum: f64 = match (rigid, bone) {
            (Some(which), Some(bone)) => {
                let rigid = |c: usize| bone.at_controls[c] * rigid_column(which, &rest[c], &bone.pivot);
                pairs.map(|(&control, share)| share * rigid(control)).sum()
            }
            _ => pairs.filter(|(control, _)| **control == j).map(|(_, share)| share).sum(),
        };
        sum as f32
    }
}

/// How much everything moves with the jaw: all on chin and middle lower lip, not at all above the mouth, and between
/// them as a spline through both goes, on either side of the lips.
struct JawShares {
    at_points: Vec<f64>,
    at_controls: Vec<f64>,
    pivot: Point3<f64>,
}

impl JawShares {
    fn new(
        target: &TargetFace,
        controls: &Controls,
        anatomy: &Anatomy,
        points: &Points,
        jaw: Jaw,
    ) -> Result<Self, RigError> {
        let mut known = KnownShares::new(target, controls, anatomy);
        let splines = |known: &KnownShares| -> Result<_, RigError> {
            Ok((known.spline(target, Lip::Lower)?, known.spline(target, Lip::Upper)?))
        };
        let (upper, lower) = splines(&known)?;
        // At the corners the lips are one: there both sides go halfway between what each alone would.
        for (place, driver) in controls.rest.iter().zip(&controls.drivers) {
            if matches!(driver, Driver::Landmark(i) if CORNERS.contains(i)) {
                let share = f64::midpoint(upper.evaluate(place).x, lower.evaluate(place).x).clamp(0.0, 1.0);
                known.push(*place, share, Lip::Neither);
            }
        }
        let (upper, lower) = splines(&known)?;
        let share = |p: &Point3<f64>, side: f64| {
            let value = |spline: &Spline<3>| spline.evaluate(p).x;
            let mixed = if side <= 0.0 {
                value(&upper)
            } else if side >= 1.0 {
                value(&lower)
            } else {
                (1.0 - side) * value(&upper) + side * value(&lower)
            };
            mixed.clamp(0.0, 1.0)
        };
        let at_points =
            points.places.iter().zip(&points.sides).map(|(p, side)| share(p, f64::from(*side))).collect();
        let side = |lip: Lip| match lip {
            Lip::Upper => 0.0,
            Lip::Lower => 1.0,
            Lip::Neither => 0.5,
        };
        let at_controls =
            controls.rest.iter().zip(&controls.lips).map(|(p, lip)| share(p, side(*lip))).collect();
        Ok(Self { at_points, at_controls, pivot: jaw.pivot })
    }

    /// Of skin that does not go with it.
    fn none(controls: &Controls, points: &Points, jaw: Jaw) -> Self {
        Self {
            at_points: vec![0.0; points.places.len()],
            at_controls: vec![0.0; controls.rest.len()],
            pivot: jaw.pivot,
        }
    }

    /// One of the four columns at all points.
    fn fill(&self, which: usize, positions: &[Point3<f64>], column: &mut [f32]) {
        for ((to, p), share) in column.iter_mut().zip(positions).zip(&self.at_points) {
            *to = (share * rigid_column(which, p, &self.pivot)) as f32;
        }
    }
}

fn rigid_column(which: usize, point: &Point3<f64>, pivot: &Point3<f64>) -> f64 {
    if which < 3 { point[which] - pivot[which] } else { 1.0 }
}

/// Where the share is known beforehand.
struct KnownShares {
    places: Vec<Point3<f64>>,
    shares: Vec<f64>,
    lips: Vec<Lip>,
}

impl KnownShares {
    fn new(target: &TargetFace, controls: &Controls, anatomy: &Anatomy) -> Self {
        let corners = [61, 291].map(|i: usize| target.landmarks[i].unwrap_or_else(Point3::origin));
        let middle = nalgebra::center(&corners[0], &corners[1]);
        let width = (corners[1] - corners[0]).norm().max(f64::MIN_POSITIVE);
        let along = (corners[1] - corners[0]) / width;
        let up = anatomy.frame.map_or_else(Vector3::y, |frame| frame.leave_vector(&Vector3::y()));
        let mut known = Self { places: Vec::new(), shares: Vec::new(), lips: Vec::new() };
        for ((place, lip), driver) in controls.rest.iter().zip(&controls.lips).zip(&controls.drivers) {
            let (aside, above) = ((place - middle).dot(&along).abs(), (place - middle).dot(&up));
            let is_middle = aside < MIDDLE * width / 2.0;
            let share = match (driver, lip) {
                (_, Lip::Upper) => is_middle.then_some(0.0),
                (_, Lip::Lower) => is_middle.then_some(1.0),
                (Driver::Landmark(i), _) if ON_JAW.contains(i) => Some(1.0),
                (Driver::Landmark(i), _) if CORNERS.contains(i) || BETWEEN_JAW_AND_SKULL.contains(i) => None,
                _ => (above > ABOVE * width).then_some(0.0),
            };
            if let Some(share) = share {
                known.push(*place, share, *lip);
            }
        }
        for anchor in &controls.anchors {
            known.push(*anchor, 0.0, Lip::Neither);
        }
        known
    }

    fn push(&mut self, place: Point3<f64>, share: f64, lip: Lip) {
        self.places.push(place);
        self.shares.push(share);
        self.lips.push(lip);
    }

    /// Through all but one lip's.
    fn spline(&self, target: &TargetFace, without: Lip) -> Result<Spline<3>, RigError> {
        let members: Vec<usize> = (0..self.places.len()).filter(|&i| self.lips[i] != without).collect();
        let centres: Vec<_> = members.iter().map(|&i| self.places[i]).collect();
        let values: Vec<_> = members.iter().map(|&i| Vector3::new(self.shares[i], 0.0, 0.0)).collect();
        Spline::fit(Kernel::Linear, &centres, &values, options(target))
            .map_err(|source| RigError::Spline { what: "the jaw's influence", source })
    }
}

/// Hangs the cavity on its ring and on the jaw, in one column. `rigid` says which of the jaw's columns it is, if any.
fn hang(anatomy: &Anatomy, rigid: Option<usize>, ring: &[f32], column: &mut [f32]) {
    let Some((mouth, jaw)) = anatomy.mouth.as_ref().zip(anatomy.jaw) else { return };
    let places = &anatomy.mesh.positions[anatomy.skin_vertices()..];
    for ((to, hanging), place) in column.iter_mut().zip(&mouth.hanging).zip(places) {
        let bone = rigid.map_or(0.0, |which| rigid_column(which, place, &jaw.pivot));
        *to = (f64::from(ring[hanging.ring]) * hanging.with_ring + bone * hanging.with_jaw) as f32;
    }
}
