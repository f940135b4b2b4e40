//! Lids and eyeballs of opened scans: lids close without a gap, nothing comes through them, and eyes turn in place.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{collections::BTreeSet, sync::LazyLock};

use common::{
    asset, james,
    opened::{Opened, closing, looking, number, points},
    rays::{Seen, View, grid, inside, triangles_of},
    rims::Rims,
    sound::check,
    topology::{boundary, loops},
};
use nalgebra::{Point2, Point3, Vector3};
use understudy::{
    anatomy::{JawPose, PartKind, eye_landmarks},
    lift::{Eyes, Side},
    rig::{AvatarFrame, Puppet},
};

static JAMES: LazyLock<Scan> = LazyLock::new(|| Scan::new(Opened::load(&james())));
static TEMPLATE: LazyLock<Scan> = LazyLock::new(|| Scan::new(Opened::load(&asset("template_ply"))));

/// Millimetres between rays.
const STEP: f64 = 0.25;
/// This near to a rim a ray may pass on either side of it, millimetres.
const ON_RIM: f64 = 0.1;
/// Radius of an iris over its eyeball's.
const IRIS: f64 = 0.49;

struct Scan {
    opened: Opened,
    puppet: Puppet,
    /// Triangles of the eyes as they were scanned.
    painted: BTreeSet<u32>,
    /// Vertices around each eye, right and left.
    rims: [Vec<u32>; 2],
}

impl Scan {
    fn new(opened: Opened) -> Self {
        let findings = check(&opened);
        let painted =
            findings.cut_out.iter().flat_map(|eye| triangles_of(&opened.anatomy.mesh, eye)).collect();
        let skin = &opened.anatomy.mesh.triangles[opened.anatomy.parts[0].triangles.clone()];
        let borders = loops(&boundary(skin));
        let rims = Side::BOTH.map(|side| {
            let lids: BTreeSet<u32> =
                opened.anatomy.eye(side).unwrap().lids.vertices.iter().copied().collect();
            borders
                .iter()
                .max_by_key(|border| border.iter().filter(|v| lids.contains(v)).count())
                .unwrap()
                .clone()
        });
        let puppet = opened.puppet();
        Self { opened, puppet, painted, rims }
    }

    /// With closed mouth.
    fn posed(&self, eyes: &Eyes) -> AvatarFrame {
        let mut frame = self.puppet.new_frame();
        self.puppet.act(&JawPose::default(), eyes, &mut frame).unwrap();
        frame
    }

    /// The upper and the lower lid's rims from one corner to the other, upper first.
    fn lids(&self, side: Side, positions: &[Point3<f64>]) -> Rims {
        let (rim, face) = (&self.rims[number(side)], self.opened.anatomy.frame.unwrap());
        let rest: Vec<_> =
            rim.iter().map(|v| face.enter(&self.opened.anatomy.mesh.positions[*v as usize])).collect();
        let across = |a: &usize, b: &usize| rest[*a].x.total_cmp(&rest[*b].x);
        let first = (0..rim.len()).min_by(across).unwrap();
        let last = (0..rim.len()).max_by(across).unwrap();
        let walk = |step: usize| -> Vec<usize> {
            let mut way = vec![first];
            while way[way.len() - 1] != last {
                way.push((way[way.len() - 1] + step) % rim.len());
            }
            way
        };
        let (mut upper, mut lower) = (walk(1), walk(rim.len() - 1));
        let height = |way: &[usize]| way.iter().map(|i| rest[*i].y).sum::<f64>() / way.len() as f64;
        if height(&upper) < height(&lower) {
            std::mem::swap(&mut upper, &mut lower);
        }
        let placed = |way: Vec<usize>| way.into_iter().map(|i| positions[rim[i] as usize]).collect();
        let (up, along) = (self.opened.direction(0.0, 1.0, 0.0), self.opened.direction(1.0, 0.0, 0.0));
        Rims { upper: placed(upper), lower: placed(lower), up, along }
    }

    /// What the rays around an eye meet first, and how far inside the opening between the lids they are.
    fn seen(&self, side: Side, frame: &AvatarFrame) -> Vec<Met> {
        let (opened, seen) = (&self.opened, Seen::new(&self.opened, frame));
        let view = View::of(opened, opened.anatomy.eye(side).unwrap().centre, 0.0, 0.0);
        let rim = self.rims[number(side)].iter();
        let rim: Vec<_> = rim.map(|v| view.project(&seen.positions[*v as usize])).collect();
        let eye = eye_landmarks(side);
        let width = (opened.landmark(eye.outer) - opened.landmark(eye.inner)).norm();
        grid([0.75 * width, 0.6 * width], STEP)
            .filter_map(|place| {
                let (kind, triangle, _) = seen.from(&view, &place)?;
                let what = match kind {
                    PartKind::Eye(_) => What::Ball,
                    PartKind::Skin if self.painted.contains(&triangle) => What::Painted,
                    PartKind::Skin => What::Lid,
                    _ => What::Other,
                };
                Some(Met { place, what, inside: inside(&rim, &place) })
            })
            .collect()
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum What {
    Lid,
    Ball,
    /// The eye as it was scanned.
    Painted,
    Other,
}

#[derive(Debug)]
struct Met {
    place: Point2<f64>,
    what: What,
    /// Millimetres.
    inside: f64,
}

#[test]
fn shut_lids_leave_no_gap() {
    for scan in [&*JAMES, &*TEMPLATE] {
        let frame = scan.posed(&closing(1.0, 1.0));
        let positions = points(&frame.positions);
        for side in Side::BOTH {
            let widest = scan.lids(side, &positions).gaps().into_iter().fold(0.0, f64::max);
            let open = scan.seen(side, &frame).into_iter().filter(|met| met.what != What::Lid);
            let deepest = open.map(|met| met.inside).fold(0.0, f64::max);
            println!("{side:?}: rims {widest:.2} mm apart, an opening {:.2} mm wide", 2.0 * deepest);
            assert!(widest <= 0.4 && 2.0 * deepest <= 0.3, "{side:?}: {widest} and {deepest} mm");
        }
    }
}

#[test]
fn shut_lids_cover_the_iris() {
    for scan in [&*JAMES, &*TEMPLATE] {
        for gaze in [[0.0, 0.0], [0.4, 0.2], [-0.4, -0.2]] {
            let mut eyes = looking(gaze[0], gaze[1]);
            (eyes.right.closure, eyes.left.closure) = (1.0, 1.0);
            let frame = scan.posed(&eyes);
            for side in Side::BOTH {
                let eye = scan.opened.anatomy.eye(side).unwrap();
                let view = View::of(&scan.opened, eye.centre, 0.0, 0.0);
                let iris = view.project(&scan.opened.landmark(eye_landmarks(side).iris));
                let met = scan.seen(side, &frame);
                let on_iris = met.iter().filter(|m| (m.place - iris).norm() < IRIS * eye.radius);
                assert!(on_iris.clone().count() > 1000);
                let open: Vec<_> = on_iris.filter(|m| m.what != What::Lid).collect();
                assert!(open.is_empty(), "{side:?} looking {gaze:?}: {open:?}");
                assert!(met.iter().all(|m| m.what != What::Ball), "{side:?} looking {gaze:?}");
            }
        }
    }
}

#[test]
fn no_eyeball_comes_through_its_lids() {
    for (name, scan) in [("james", &*JAMES), ("template", &*TEMPLATE)] {
        for closure in [-0.35, 0.0, 0.1, 0.25, 0.4, 0.5, 0.6, 0.75, 0.9] {
            let frame = scan.posed(&closing(closure, closure));
            for side in Side::BOTH {
                let met = scan.seen(side, &frame);
                let outside = |what| met.iter().filter(move |m| m.what == what && m.inside < -ON_RIM);
                let through: Vec<_> = outside(What::Ball).collect();
                assert!(through.is_empty(), "{name} {side:?}, {closure} shut: {through:?}");
                // What was scanned of the eye lies behind the ball, but stays near the rim.
                let area = outside(What::Painted).count() as f64 * STEP * STEP;
                assert!(area < 1.0, "{name} {side:?}, {closure} shut: {area} mm² of the scanned eye");
            }
        }
    }
}

/// Wherever it looks, the opening shows as much of the ball as straight ahead.
#[test]
fn a_turned_eyeball_still_fills_its_opening() {
    for (name, scan) in [("james", &*JAMES), ("template", &*TEMPLATE)] {
        let area = |side, gaze: [f64; 2]| {
            let met = scan.seen(side, &scan.posed(&looking(gaze[0], gaze[1])));
            let through = met.iter().filter(|m| m.what == What::Ball && m.inside < -ON_RIM).count();
            assert_eq!(through, 0, "{name} {side:?}, looking {gaze:?}");
            met.iter().filter(|m| m.what == What::Ball).count() as f64
        };
        for side in Side::BOTH {
            let ahead = area(side, [0.0, 0.0]);
            for gaze in [[0.5, 0.0], [-0.5, 0.0], [0.0, 0.35], [0.0, -0.35], [0.4, 0.3]] {
                let share = area(side, gaze) / ahead;
                assert!(share > 0.95, "{name} {side:?}, looking {gaze:?}: {share} of the ball");
            }
        }
    }
}

/// The iris that is seen is the ball's, which turns, and not the scan's, which stays.
#[test]
fn most_of_an_open_iris_is_the_eyeballs() {
    for scan in [&*JAMES, &*TEMPLATE] {
        let frame = scan.posed(&Eyes::default());
        for side in Side::BOTH {
            let eye = scan.opened.anatomy.eye(side).unwrap();
            let view = View::of(&scan.opened, eye.centre, 0.0, 0.0);
            let iris = view.project(&scan.opened.landmark(eye_landmarks(side).iris));
            let met = scan.seen(side, &frame);
            let of = |what| {
                let on_iris = |m: &&Met| m.what == what && (m.place - iris).norm() < IRIS * eye.radius;
                met.iter().filter(on_iris).count() as f64
            };
            let share = of(What::Ball) / (of(What::Ball) + of(What::Painted));
            println!("{side:?}: {share:.2} of the iris");
            assert!(share > 0.55, "{side:?}: {share} of the iris");
        }
    }
}

/// Nothing at all moves but the winking eye's lids.
#[test]
fn a_wink_leaves_the_other_eye_as_it_was() {
    for scan in [&*JAMES, &*TEMPLATE] {
        for (side, eyes) in [(Side::Right, closing(1.0, 0.0)), (Side::Left, closing(0.0, 1.0))] {
            let frame = scan.posed(&eyes);
            let lids: BTreeSet<usize> =
                scan.opened.anatomy.eye(side).unwrap().lids.vertices.iter().map(|v| *v as usize).collect();
            let rest = scan.opened.anatomy.mesh.positions_f32();
            let mut moved = 0;
            for (vertex, (now, before)) in frame.positions.iter().zip(&rest).enumerate() {
                if lids.contains(&vertex) {
                    moved += usize::from(now.map(f32::to_bits) != before.map(f32::to_bits));
                } else {
                    assert_eq!(now.map(f32::to_bits), before.map(f32::to_bits), "{side:?}: vertex {vertex}");
                }
            }
            assert!(moved > 200, "{side:?}: {moved} vertices move");
        }
    }
}

/// Left is the subject's: a positive yaw takes the iris there.
#[test]
fn an_eye_turns_about_its_centre_to_where_it_looks() {
    for scan in [&*JAMES, &*TEMPLATE] {
        let rest = &scan.opened.anatomy.mesh.positions;
        for (yaw, pitch) in [(0.3, 0.0), (-0.3, 0.0), (0.0, 0.2), (0.0, -0.2), (0.4, 0.2)] {
            let eyes = looking(yaw, pitch);
            let frame = scan.posed(&eyes);
            let positions = points(&frame.positions);
            for side in Side::BOTH {
                let eye = scan.opened.anatomy.eye(side).unwrap();
                let bone = frame.bones.eyes[number(side)];
                // The puppet looks along the scan frame's z while nothing has turned it.
                let ahead = eye.centre + Vector3::z() * eye.radius;
                let wanted = eye.centre + eyes.of(side).direction() * eye.radius;
                assert!((bone * ahead - wanted).norm() < 1e-9, "{yaw} {pitch}: {}", bone * ahead - wanted);
                let part = scan.opened.part(PartKind::Eye(side)).unwrap();
                // The whole ball turns with it, the pole of its picture first.
                let pole = part.vertices.start;
                let aside = (positions[pole] - rest[pole]).x;
                let turned = (rest[pole] - eye.centre).z * yaw.sin();
                if pitch == 0.0 {
                    assert!(
                        (aside - turned).abs() < 0.12 * eye.radius * yaw.abs(),
                        "{yaw}: {aside} for {turned}"
                    );
                }
                for vertex in part.vertices.clone() {
                    assert!((positions[vertex] - bone * rest[vertex]).norm() < 1e-4);
                }
            }
        }
    }
}
