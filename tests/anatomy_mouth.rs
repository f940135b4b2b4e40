//! What was put behind the lips of a scan is seen between them, and nowhere else.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::sync::LazyLock;

use common::{
    acting::{Acting, CLIP},
    asset, james,
    opened::Opened,
    rays::{Seen, View, grid, inside},
};
use nalgebra::{Point3, center};
use understudy::{
    anatomy::{JawPose, OUTER_CORNERS, PartKind},
    lift::Eyes,
    rig::{AvatarFrame, Puppet},
};

static JAMES: LazyLock<Acting> = LazyLock::new(|| Acting::new(&james()));
static TEMPLATE: LazyLock<Opened> = LazyLock::new(|| Opened::load(&asset("template_ply")));

/// Degrees to the subject's left and up.
const VIEWS: [(f64, f64); 9] = [
    (0.0, 0.0),
    (35.0, 0.0),
    (-35.0, 0.0),
    (0.0, 20.0),
    (0.0, -20.0),
    (35.0, 20.0),
    (35.0, -20.0),
    (-35.0, 20.0),
    (-35.0, -20.0),
];
/// Millimetres between rays, and how far around the mouth they go: from the nose to below the chin, from cheek to cheek.
const STEP: f64 = 0.8;
const AROUND: [f64; 2] = [55.0, 60.0];
/// This near to the rims a ray may pass on either side of them, millimetres.
const ON_RIM: f64 = 0.3;

fn is_within(kind: PartKind) -> bool {
    matches!(kind, PartKind::Cavity | PartKind::UpperTeeth | PartKind::LowerTeeth | PartKind::Tongue)
}

/// Of the rays from all sides: how many meet the mouth's inside first, and those that do so beside the opening.
fn looked_into(opened: &Opened, frame: &AvatarFrame) -> (usize, Vec<String>) {
    let seen = Seen::new(opened, frame);
    let mouth = opened.anatomy.mouth.as_ref().unwrap();
    let middle = center(&opened.landmark(OUTER_CORNERS[0]), &opened.landmark(OUTER_CORNERS[1]));
    let (mut within, mut beside) = (0, Vec::new());
    for (yaw, pitch) in VIEWS {
        let view = View::of(opened, middle, f64::to_radians(yaw), f64::to_radians(pitch));
        let rim = mouth.rims[0].iter().chain(mouth.rims[1].iter().rev());
        let rim: Vec<_> = rim.map(|v| view.project(&seen.positions[*v as usize])).collect();
        for place in grid(AROUND, STEP) {
            let Some((kind, _, at)) = seen.from(&view, &place) else { continue };
            if is_within(kind) {
                within += 1;
                if inside(&rim, &place) < -ON_RIM {
                    beside.push(format!("{kind:?} at {at} from {yaw}°, {pitch}°"));
                }
            }
        }
    }
    (within, beside)
}

fn opened_by(puppet: &Puppet, opening: f64, swing: f64) -> AvatarFrame {
    let mut frame = puppet.new_frame();
    puppet.act(&JawPose { opening, swing, protrusion: 0.0 }, &Eyes::default(), &mut frame).unwrap();
    frame
}

#[test]
fn a_shut_mouth_shows_nothing_of_its_inside() {
    let (within, _) = looked_into(&JAMES.opened, &JAMES.rig.new_frame());
    assert_eq!(within, 0);
    // Its lips were scanned a hair's breadth apart.
    let (within, beside) = looked_into(&TEMPLATE, &opened_by(&TEMPLATE.puppet(), 0.0, 0.0));
    assert!(within < 10 && beside.is_empty(), "{within} rays, {beside:?}");
}

#[test]
fn an_open_mouth_shows_its_inside_between_the_lips_alone() {
    for (name, opened) in [("james", &JAMES.opened), ("template", &*TEMPLATE)] {
        let puppet = opened.puppet();
        for opening in [0.1, 0.2, 0.35] {
            for swing in [0.0, 0.1, -0.1] {
                let (within, beside) = looked_into(opened, &opened_by(&puppet, opening, swing));
                assert!(beside.is_empty(), "{name}, {opening} rad, {swing} aside: {beside:?}");
                assert!(
                    within > 500,
                    "{name}, {opening} rad, {swing} aside: {within} rays see into the mouth"
                );
            }
        }
    }
}

#[test]
fn a_jaw_that_swings_behind_shut_lips_stays_behind_them() {
    for opened in [&JAMES.opened, &*TEMPLATE] {
        let puppet = opened.puppet();
        for swing in [0.1, -0.1] {
            let (_, beside) = looked_into(opened, &opened_by(&puppet, 0.0, swing));
            assert!(beside.is_empty(), "{swing} aside: {beside:?}");
        }
    }
}

#[test]
fn nothing_comes_through_the_performing_face() {
    let mut most = 0;
    for frame in CLIP.frames.iter().step_by(25) {
        let (within, beside) = looked_into(&JAMES.opened, &JAMES.posed(&frame.expression));
        println!("frame {}: {within} rays, {} beside", frame.index, beside.len());
        if let Some(b) = beside.first() {
            println!("   {b}");
        }
        most = most.max(within);
    }
    assert!(most > 3000, "{most} rays at most see into the mouth");
}

/// The rays would see it if teeth stood out of the chin.
#[test]
fn what_comes_through_is_seen() {
    let opened = &JAMES.opened;
    let mut frame = opened_by(&opened.puppet(), 0.2, 0.0);
    let out = opened.direction(0.0, -5.0, 20.0).cast::<f32>();
    for vertex in opened.part(PartKind::LowerTeeth).unwrap().vertices.clone() {
        frame.positions[vertex] = (Point3::from(frame.positions[vertex]) + out).coords.into();
    }
    let (_, beside) = looked_into(opened, &frame);
    assert!(beside.len() > 100, "{}", beside.len());
}
