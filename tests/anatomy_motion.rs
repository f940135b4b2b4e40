//! Lips and jaw of opened scans in motion: they part where and as far as the performer's do, and nowhere else.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::sync::LazyLock;

use common::{
    acting::{Acting, CLIP, performing},
    asset, james,
    opened::{Opened, points},
    rims::{Rims, range},
};
use nalgebra::{Point3, Vector3, center};
use understudy::{
    anatomy::{
        BETWEEN_JAW_AND_SKULL, CHIN, FaceFrame, INNER_CORNERS, Jaw, JawPose, LOWER_INNER, LOWER_LIP, Mouth,
        ON_JAW, UPPER_INNER, lid_shares,
    },
    lift::{Expression, Eyes, Side},
    rig::{AvatarFrame, SourceFace, Transfer, TransferRule},
    tracking::index,
};

static JAMES: LazyLock<Acting> = LazyLock::new(|| Acting::new(&james()));
static TEMPLATE: LazyLock<Acting> = LazyLock::new(|| Acting::new(&asset("template_ply")));

/// Every so manieth frame of the clip is looked at.
const STEP: usize = 5;
/// Lips that touch may be so far apart, and so far into each other, millimetres.
const TOUCHING: f64 = 0.3;
const CROSSING: f64 = 0.05;

fn mouth(acting: &Acting) -> &Mouth {
    acting.opened.anatomy.mouth.as_ref().unwrap()
}

fn rims(acting: &Acting, frame: &AvatarFrame) -> Rims {
    Rims::of_mouth(
        mouth(acting),
        acting.lips().up(),
        &points(&frame.positions),
        &acting.opened.anatomy.mesh.positions,
    )
}

#[track_caller]
fn touch(acting: &Acting, frame: &AvatarFrame, what: &str) {
    let rims = rims(acting, frame);
    let pairs = rims.pairs();
    // Where the mouth was open the rims are known at the network's stations alone.
    let across = if mouth(acting).is_cut { rims.across() } else { pairs.clone() };
    for (kind, gaps) in [("pairs", pairs), ("across", across)] {
        let (least, most) = range(&gaps);
        assert!(most <= TOUCHING && least >= -CROSSING, "{what}: {kind} from {least} to {most} mm");
    }
}

#[test]
fn a_performer_who_does_nothing_moves_no_vertex() {
    let nothing = performing(|_, _| Vector3::zeros());
    assert_eq!(JAMES.posed(&nothing).positions, JAMES.rig.rest());
    // Lips that were scanned a little apart are brought together.
    let frame = TEMPLATE.posed(&nothing);
    touch(&TEMPLATE, &frame, "template");
    let moved: Vec<f32> = frame
        .positions
        .iter()
        .zip(TEMPLATE.rig.rest())
        .map(|(p, q)| (0..3).map(|k| (p[k] - q[k]).abs()).fold(0.0, f32::max))
        .collect();
    let rims = mouth(&TEMPLATE).rims.iter().flatten();
    assert!(rims.map(|&rim| moved[rim as usize]).all(|moved| moved < 0.6));
    // What hangs within the mouth, behind the rims, follows them with nothing to hold it.
    let farthest = moved.into_iter().fold(0.0, f32::max);
    assert!(farthest < 1.2, "{farthest} mm");
    for opened in [&JAMES.opened, &TEMPLATE.opened] {
        let puppet = opened.puppet();
        let mut frame = puppet.new_frame();
        puppet.act(&JawPose::default(), &Eyes::default(), &mut frame).unwrap();
        assert_eq!(frame.positions, puppet.rest());
    }
}

/// Expressions in which the lips touch: what a pair of inner lips does, it does together.
fn with_lips_together(moved: impl Fn(&Point3<f64>) -> Vector3<f64>) -> Expression {
    let neutral = CLIP.performer.neutral();
    performing(|i, place| {
        let pair = UPPER_INNER.iter().zip(&LOWER_INNER).find(|(u, l)| [**u, **l].contains(&i));
        moved(&pair.map_or(*place, |(&u, &l)| center(&neutral[u], &neutral[l])))
    })
}

/// How a place of the performer's face moves.
type Rule<'a> = &'a dyn Fn(&Point3<f64>) -> Vector3<f64>;

fn bump(place: &Point3<f64>, middle: &Point3<f64>, reach: f64) -> f64 {
    (-((place - middle).norm() / reach).powi(2)).exp()
}

#[test]
fn lips_that_touch_stay_together_whatever_the_face_does() {
    let neutral = CLIP.performer.neutral();
    let (right, left) = (neutral[index::MOUTH_RIGHT], neutral[index::MOUTH_LEFT]);
    let middle = center(&right, &left);
    let smile = |p: &Point3<f64>| {
        let pull = |corner, side| Vector3::new(8.0 * side, 5.0, -3.0) * bump(p, corner, 20.0);
        pull(&right, -1.0) + pull(&left, 1.0)
    };
    let pucker = |p: &Point3<f64>| Vector3::new(-0.4 * (p.x - middle.x), 0.0, 5.0) * bump(p, &middle, 30.0);
    let chew =
        |p: &Point3<f64>| Vector3::new(0.0, -12.0, -4.0) / (1.0 + ((p.y - middle.y + 25.0) / 5.0).exp());
    let aside = |p: &Point3<f64>| Vector3::new(9.0, 2.0, 0.0) * bump(p, &middle, 30.0);
    let sneer = |p: &Point3<f64>| Vector3::new(3.0, 6.0, 0.0) * bump(p, &right, 15.0);
    let down = |p: &Point3<f64>| Vector3::new(0.0, -8.0, -2.0) * bump(p, &middle, 30.0);
    let rules: [(&str, Rule); 6] = [
        ("smile", &smile),
        ("pucker", &pucker),
        ("chew", &chew),
        ("aside", &aside),
        ("sneer", &sneer),
        ("down", &down),
    ];
    for (name, rule) in rules {
        let expression = with_lips_together(rule);
        for acting in [&*JAMES, &*TEMPLATE] {
            assert_eq!(range(&acting.wanted_gaps(&expression.displacements)), (0.0, 0.0), "{name}");
            let frame = acting.posed(&expression);
            touch(acting, &frame, name);
            let rest = acting.rig.rest();
            let moved =
                frame.positions.iter().zip(rest).flat_map(|(p, q)| (0..3).map(move |k| (p[k] - q[k]).abs()));
            assert!(moved.fold(0.0, f32::max) > 3.0, "{name} moves nothing");
        }
    }
}

/// The gap of the rims at each of the network's pairs.
fn gaps(acting: &Acting, frame: &AvatarFrame) -> [f64; 9] {
    let (mouth, rest) = (mouth(acting), &acting.opened.anatomy.mesh.positions);
    let rims = rims(acting, frame);
    std::array::from_fn(|pair| {
        let node = mouth.nodes.iter().find(|node| node.station == pair + 1 && node.share == 0.0).unwrap();
        let at = |rim: &[u32], moved: &[Point3<f64>], place: &Point3<f64>| {
            // Where the node lies on its rim: on which edge, and how far along it.
            let along = |i: usize| {
                let [a, b] = [rim[i], rim[i + 1]].map(|v| rest[v as usize]);
                let t = ((place - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                ((place - (a + (b - a) * t)).norm(), i, t)
            };
            let (_, i, t) = (0..rim.len() - 1).map(along).min_by(|p, q| p.0.total_cmp(&q.0)).unwrap();
            moved[i] + (moved[i + 1] - moved[i]) * t
        };
        let upper = at(&mouth.rims[0], &rims.upper, &node.rest[0]);
        let lower = at(&mouth.rims[1], &rims.lower, &node.rest[1]);
        (upper - lower).dot(&acting.lips().up())
    })
}

#[test]
fn lips_part_as_far_as_the_performers_over_the_whole_clip() {
    for (name, acting) in [("james", &*JAMES), ("template", &*TEMPLATE)] {
        let (mut touching, mut widest, mut worst) = (0, 0.0_f64, 0.0_f64);
        for frame in CLIP.frames.iter().step_by(STEP) {
            let posed = acting.posed(&frame.expression);
            let wanted = acting.wanted_gaps(&frame.expression.displacements);
            for (pair, (found, wanted)) in gaps(acting, &posed).iter().zip(&wanted).enumerate() {
                let off = (found - wanted).abs();
                worst = worst.max(off);
                // A millimetre, or six parts in a hundred of a wide gap.
                assert!(
                    off < f64::max(1.0, 0.06 * wanted),
                    "{name}, pair {pair} of frame {}: {found} mm for {wanted}",
                    frame.index
                );
            }
            widest = widest.max(range(&wanted).1);
            if range(&wanted).1 <= 0.0 {
                touching += 1;
                touch(acting, &posed, &format!("{name}, frame {}", frame.index));
            }
        }
        println!("{name}: {touching} frames shut, gaps up to {widest:.1} mm, {worst:.2} mm off at most");
        assert!(touching > 30 && widest > 20.0, "the clip has {touching} shut frames and {widest} mm of gap");
    }
}

/// The corners belong to both rims; they go where the performer's inner corners go.
#[test]
fn the_corners_of_the_mouth_stay_shut() {
    for acting in [&*JAMES, &*TEMPLATE] {
        let rims = &mouth(acting).rims;
        assert_eq!([rims[0].first(), rims[0].last()], [rims[1].first(), rims[1].last()]);
    }
    let transfer =
        Transfer::new(&SourceFace::performer(&CLIP.performer), &JAMES.face, TransferRule::default()).unwrap();
    let (rim, rest) = (&mouth(&JAMES).rims[0], &JAMES.opened.anatomy.mesh.positions);
    for frame in CLIP.frames.iter().step_by(STEP) {
        let posed = points(&JAMES.posed(&frame.expression).positions);
        for (vertex, corner) in [rim[0], rim[rim.len() - 1]].into_iter().zip(INNER_CORNERS) {
            let found = posed[vertex as usize] - rest[vertex as usize];
            let wanted = transfer.vector(corner, &frame.expression.displacements.vectors[corner]);
            assert!((found - wanted).norm() < 0.01, "frame {}: {found} for {wanted}", frame.index);
        }
    }
}

/// Nearest vertices to some landmarks, and how far each has moved.
fn moved(
    opened: &Opened,
    landmarks: &[usize],
    positions: &[Point3<f64>],
) -> Vec<(Point3<f64>, Vector3<f64>)> {
    let vertex = |&i: &usize| opened.surface.nearest_vertex(opened.landmark(i)).unwrap().0 as usize;
    let rest = &opened.anatomy.mesh.positions;
    landmarks.iter().map(vertex).map(|v| (rest[v], positions[v] - rest[v])).collect()
}

#[test]
fn the_chin_turns_with_the_jaw_and_the_upper_face_stays() {
    for opened in [&JAMES.opened, &TEMPLATE.opened] {
        let (puppet, jaw, face) =
            (opened.puppet(), opened.anatomy.jaw.unwrap(), opened.anatomy.frame.unwrap());
        let rest = &opened.anatomy.mesh.positions[..opened.anatomy.skin_vertices()];
        let nose = face.enter(&opened.landmark(index::NOSE_TIP)).y;
        let mut frame = puppet.new_frame();
        for (opening, swing, protrusion) in [
            (0.1, 0.0, 0.0),
            (0.2, 0.0, 0.0),
            (0.35, 0.0, 0.0),
            (0.2, 0.1, 0.0),
            (0.2, -0.1, 0.0),
            (0.0, 0.0, 6.0),
        ] {
            let pose = JawPose { opening, swing, protrusion };
            puppet.act(&pose, &Eyes::default(), &mut frame).unwrap();
            let positions = points(&frame.positions);
            let bone = jaw.motion(&pose, 1.0);
            let mut farthest = 0.0_f64;
            for (place, found) in moved(opened, &CHIN, &positions) {
                let wanted = bone * place - place;
                farthest = farthest.max(wanted.norm());
                assert!((found - wanted).norm() < 0.05 * wanted.norm(), "{pose:?}: {found} for {wanted}");
            }
            let above = |height: f64| {
                let own = rest.iter().zip(&positions).filter(|(p, _)| face.enter(p).y > height);
                own.map(|(p, moved)| (moved - p).norm()).fold(0.0, f64::max)
            };
            let [over_nose, over_eyes] = [above(nose), above(0.0)];
            assert!(over_nose < 0.035 * farthest, "{pose:?}: {over_nose} mm above the nose of {farthest}");
            assert!(over_eyes < 0.01 * farthest, "{pose:?}: {over_eyes} mm above the eyes of {farthest}");
        }
    }
}

#[test]
fn the_jaw_turns_as_the_performers() {
    let neutral: Vec<_> = CLIP.performer.neutral().iter().copied().map(Some).collect();
    let bone = Jaw::of(&FaceFrame::of(&neutral).unwrap());
    for (opening, swing) in [(0.1, 0.0), (0.2, 0.0), (0.3, 0.0), (0.15, 0.06), (0.15, -0.06)] {
        let motion = bone.motion(&JawPose { opening, swing, protrusion: 0.0 }, 1.0);
        let expression = performing(|i, place| {
            let lower = [&ON_JAW[..], &LOWER_LIP, &LOWER_INNER].iter().any(|list| list.contains(&i));
            let share = if lower {
                1.0
            } else if BETWEEN_JAW_AND_SKULL.contains(&i) {
                0.5
            } else {
                0.0
            };
            (motion * place - place) * share
        });
        for acting in [&*JAMES, &*TEMPLATE] {
            let turn = acting.posed(&expression).bones.jaw.rotation.scaled_axis();
            let turn = acting.opened.anatomy.frame.unwrap().rotation() * turn;
            assert!((0.95..1.5).contains(&(turn.x / opening)), "opens by {} for {opening}", turn.x);
            assert!((turn.y - swing).abs() < 0.05, "swings by {} for {swing}", turn.y);
        }
    }
}

/// In the clip the jaw drops again and again; what the network guesses of its depth must not push it aside.
#[test]
fn a_dropping_jaw_does_not_swing() {
    let (mut widest, mut squares, mut products) = (0.0_f64, 0.0, 0.0);
    for frame in CLIP.frames.iter().step_by(STEP) {
        let turn = JAMES.posed(&frame.expression).bones.jaw.rotation.scaled_axis();
        let turn = JAMES.opened.anatomy.frame.unwrap().rotation() * turn;
        widest = widest.max(turn.x);
        squares += turn.x * turn.x;
        products += turn.x * turn.y;
    }
    let swing = products / squares;
    println!("opens by {widest:.3} rad, and swings by {swing:.3} of that");
    assert!(widest > 0.25 && swing.abs() < 0.06, "opens by {widest} rad, and swings by {swing} of that");
}

/// A blink moves the skin around the eyes too; the lids must not close by both.
#[test]
fn lids_go_where_their_own_shapes_take_them() {
    let rest = &JAMES.opened.anatomy.mesh.positions;
    let (mut worst, mut blinks) = (0.0_f64, 0);
    for frame in CLIP.frames.iter().step_by(2) {
        let posed = points(&JAMES.posed(&frame.expression).positions);
        for side in Side::BOTH {
            let lids = &JAMES.opened.anatomy.eye(side).unwrap().lids;
            let shut = lids.shapes.last().unwrap();
            let farthest =
                (0..shut.len()).max_by(|&a, &b| shut[a].norm().total_cmp(&shut[b].norm())).unwrap();
            let closure = frame.expression.eyes.of(side).closure;
            blinks += usize::from(closure > 0.8);
            let shares = lid_shares(closure);
            let wanted: Vector3<f64> =
                lids.shapes.iter().zip(shares).map(|(shape, share)| shape[farthest] * share).sum();
            let vertex = lids.vertices[farthest] as usize;
            worst = worst.max((posed[vertex] - rest[vertex] - wanted).norm() / shut[farthest].norm());
        }
    }
    println!("{blinks} shut eyes, a rim up to {worst:.2} of its way off");
    assert!(blinks > 5 && worst < 0.25, "{blinks} shut eyes, {worst:.2} off");
}
