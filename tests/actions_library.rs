//! The built-in library of action units, and its control points on two scans.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::sync::LazyLock;

use common::{asset, james, opened::Opened};
use nalgebra::{Point3, Vector3};
use understudy::{
    actions::{Action, ActionKey, ActionLibrary, Catalogue},
    lift::Side,
    tracking::{SKIN_LANDMARK_COUNT, index, landmark_table},
};

static JAMES: LazyLock<Opened> = LazyLock::new(|| Opened::load(&james()));
static TEMPLATE: LazyLock<Opened> = LazyLock::new(|| Opened::load(&asset("template_ply")));

const RIGHT_BROW: [usize; 5] = [70, 63, 105, 66, 107];

/// The handle on the other side of the face.
fn mirror(handle: usize) -> usize {
    let Some(point) = handle.checked_sub(SKIN_LANDMARK_COUNT) else { return landmark_table()[handle].mirror };
    let points = &Catalogue::get().points;
    let is_partner =
        |k: &usize| points[*k].name == points[point].name && points[*k].side != points[point].side;
    (0..points.len()).find(is_partner).unwrap_or(point) + SKIN_LANDMARK_COUNT
}

fn action(au: u8, side: Option<Side>) -> &'static Action {
    ActionLibrary::built_in().get(ActionKey { au, side }).unwrap()
}

/// Where an action moves a handle; handles left out do not move.
fn vector(action: &Action, handle: usize) -> Vector3<f64> {
    action
        .vectors
        .iter()
        .find(|moved| moved.handle == handle)
        .map_or_else(Vector3::zeros, |moved| moved.vector)
}

fn sides(has_sides: bool) -> Vec<Option<Side>> {
    if has_sides { Side::BOTH.map(Some).to_vec() } else { vec![None] }
}

/// AU 43 and 45 close by the lids' shapes, which the eyes' closure drives, as the others do beside their vectors.
#[test]
fn every_action_of_the_catalogue_is_there_on_every_side() {
    let library = ActionLibrary::built_in();
    let mut wanted = 0;
    for facts in &Catalogue::get().actions {
        for side in sides(facts.sides) {
            let action = action(facts.au, side);
            wanted += 1;
            let name = action.key;
            assert!(action.pairs > 0 && !action.source.is_empty(), "AU{name} comes from nowhere");
            let farthest = action.vectors.iter().map(|moved| moved.vector.norm()).fold(0.0, f64::max);
            assert!((0.5..60.0).contains(&farthest), "AU{name} moves by {farthest} mm");
            for moved in &action.vectors {
                let spread = moved.spread;
                assert!(
                    moved.vector.iter().all(|c| c.is_finite()) && spread.is_finite() && spread >= 0.0,
                    "AU{name}"
                );
                // The pairs say the same rather than each something else.
                assert!(spread < 1.0 + 1.2 * farthest, "AU{name}: {spread} mm of spread");
            }
            assert!(action.closure.iter().all(|closure| (-0.5..=1.0).contains(closure)), "AU{name}");
        }
    }
    assert_eq!(library.actions.len(), wanted);
    assert_eq!(library.face.len(), Catalogue::get().handles());
}

#[test]
fn left_and_right_mirror_each_other() {
    let library = ActionLibrary::built_in();
    let flipped = |v: Vector3<f64>| Vector3::new(-v.x, v.y, v.z);
    for (handle, place) in library.face.iter().enumerate() {
        let off = (flipped(place.coords) - library.face[mirror(handle)].coords).norm();
        assert!(off < 0.01, "{} lies {off} mm off", Catalogue::get().handle_name(handle));
    }
    for facts in &Catalogue::get().actions {
        let ends = if facts.sides { [Some(Side::Right), Some(Side::Left)] } else { [None, None] };
        let [right, left] = ends.map(|side| action(facts.au, side));
        assert!(
            (right.closure[0] - left.closure[1]).abs() < 1e-9
                && (right.closure[1] - left.closure[0]).abs() < 1e-9
        );
        for handle in 0..library.face.len() {
            let off = (flipped(vector(right, handle)) - vector(left, mirror(handle))).norm();
            // Vectors of less than two hundredths of a millimetre are left out, perhaps of one side alone.
            assert!(off < 0.01, "AU{}, {}: {off} mm off", facts.au, Catalogue::get().handle_name(handle));
        }
    }
}

/// The table of ICT-FaceKit's vertices gives eight landmarks of either upper lip one vertex: the average face must not.
#[test]
fn no_two_landmarks_of_the_face_share_a_place() {
    let face = &ActionLibrary::built_in().face[..SKIN_LANDMARK_COUNT];
    let shares = |i: usize| (0..face.len()).any(|j| i != j && (face[i] - face[j]).norm() < 0.05);
    let shared: Vec<usize> = (0..face.len()).filter(|&i| shares(i)).collect();
    assert!(shared.is_empty(), "{shared:?}");
}

#[test]
fn actions_do_what_their_names_say() {
    for side in Side::BOTH {
        let own =
            |landmark: usize| if side == Side::Right { landmark } else { landmark_table()[landmark].mirror };
        let up = |au: u8, landmark: usize| vector(action(au, Some(side)), own(landmark)).y;
        let corner = if side == Side::Right { index::MOUTH_RIGHT } else { index::MOUTH_LEFT };
        assert!(vector(action(12, Some(side)), corner).y > 5.0);
        assert!(vector(action(15, Some(side)), corner).y < -2.0);
        assert!(up(1, RIGHT_BROW[4]) > 2.0 && up(2, RIGHT_BROW[1]) > 2.0);
        // The inner end by 1 and the outer by 2, not the other way round.
        assert!(up(1, RIGHT_BROW[4]) > up(1, RIGHT_BROW[0]) && up(2, RIGHT_BROW[0]) > up(2, RIGHT_BROW[4]));
        assert!(RIGHT_BROW.iter().all(|&landmark| up(4, landmark) < -0.5));
        let eye = usize::from(side == Side::Left);
        for au in [43, 45] {
            assert!(action(au, Some(side)).closure[eye] > 0.95, "AU{au} does not shut");
            assert!(action(au, Some(side)).closure[1 - eye].abs() < 0.05, "AU{au} shuts the other eye");
        }
        assert!(action(5, Some(side)).closure[eye] < -0.2);
    }
    let [dropped, stretched] = [26, 27].map(|au| vector(action(au, None), 152).y);
    assert!(dropped < -8.0 && stretched < 1.5 * dropped, "the chin goes by {dropped} and {stretched} mm");
    assert!(vector(action(17, None), 152).y > 1.0);
}

/// Points on a face: on its surface, on their side of it, apart, and each where its partner is on the other side.
fn well_placed(opened: &Opened, most_uneven: f64) {
    let catalogue = Catalogue::get();
    let places: Vec<Point3<f64>> =
        catalogue.place(&opened.landmarks, &opened.surface).into_iter().map(Option::unwrap).collect();
    let face = opened.anatomy.frame.unwrap();
    let within: Vec<Point3<f64>> = places.iter().map(|place| face.enter(place)).collect();
    let (mut worst, mut worst_name) = (0.0, String::new());
    for (k, point) in catalogue.points.iter().enumerate() {
        let handle = SKIN_LANDMARK_COUNT + k;
        let name = catalogue.handle_name(handle);
        let off = (opened.surface.nearest(places[handle]).unwrap().position - places[handle]).norm();
        assert!(off < 1e-6, "{name} lies {off} mm off the surface");
        let x = within[handle].x;
        match point.side {
            Some(Side::Right) => assert!(x < 0.0, "{name} lies on the left: {x}"),
            Some(Side::Left) => assert!(x > 0.0, "{name} lies on the right: {x}"),
            None => assert!(x.abs() < 4.0, "{name} lies {x} mm off the midline"),
        }
        for (other, place) in places.iter().enumerate().skip(handle + 1) {
            let apart = (place - places[handle]).norm();
            assert!(apart > 0.3, "{name} and {} lie {apart} mm apart", catalogue.handle_name(other));
        }
        let [own, partner] = [handle, mirror(handle)].map(|handle| within[handle]);
        let uneven = (Point3::new(-partner.x, partner.y, partner.z) - own).norm();
        if uneven > worst {
            (worst, worst_name) = (uneven, name);
        }
    }
    println!("least even: {worst_name}, {worst:.1} mm");
    assert!(worst < most_uneven, "{worst_name} lies {worst} mm from its partner's mirror image");
}

#[test]
fn control_points_lie_on_james_where_they_should() {
    well_placed(&JAMES, 8.0);
}

#[test]
fn control_points_lie_on_the_template_where_they_should() {
    well_placed(&TEMPLATE, 6.0);
}
