//! Scans that lack what a face has are opened as far as they can be, say what was left out, and are never broken.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::sync::LazyLock;

use common::{james, opened::Opened, sound::check};
use nalgebra::Point3;
use understudy::{
    anatomy::{EyeFault, Omission, UPPER_INNER, eye_landmarks},
    lift::Side,
    scan::Mesh,
    tracking::{LANDMARK_COUNT, index, landmark_table},
};

static JAMES: LazyLock<Opened> = LazyLock::new(|| Opened::load(&james()));

/// James without the triangles within `reach` millimetres of some places, as the front sees them.
fn holed(places: &[Point3<f64>], reach: f64) -> Mesh {
    let mut mesh = JAMES.scan.clone();
    let keep: Vec<bool> = mesh
        .triangles
        .iter()
        .map(|corners| {
            let middle =
                corners.map(|v| mesh.positions[v as usize].coords).iter().sum::<nalgebra::Vector3<f64>>()
                    / 3.0;
            places.iter().all(|place| (middle - place.coords).norm() > reach)
        })
        .collect();
    let mut kept = keep.iter();
    mesh.triangles.retain(|_| *kept.next().unwrap());
    let mut kept = keep.iter();
    mesh.uv_triangles.retain(|_| *kept.next().unwrap());
    if !mesh.triangle_materials.is_empty() {
        let mut kept = keep.iter();
        mesh.triangle_materials.retain(|_| *kept.next().unwrap());
    }
    mesh
}

fn landmarks() -> Vec<Option<Point3<f64>>> {
    JAMES.landmarks.clone()
}

fn says(opened: &Opened, words: &str) -> bool {
    opened.anatomy.omissions.iter().any(|omission| omission.to_string().contains(words))
}

#[test]
fn without_colours_the_eyes_are_no_ones() {
    let mut bare = JAMES.scan.clone();
    (bare.materials, bare.triangle_materials, bare.colours) = Default::default();
    (bare.uvs, bare.uv_triangles) = Default::default();
    let opened = Opened::new(bare, landmarks());
    check(&opened);
    assert!(opened.anatomy.omissions.is_empty(), "{:?}", opened.anatomy.omissions);
    assert!(opened.anatomy.eyes.iter().all(Option::is_some) && opened.anatomy.mouth.is_some());
}

#[test]
fn holes_at_the_mouth_never_break_the_mesh() {
    let lip = |i: usize| JAMES.landmarks[i].unwrap();
    for places in [vec![lip(UPPER_INNER[1])], vec![lip(UPPER_INNER[4])], UPPER_INNER.map(lip).to_vec()] {
        for reach in [2.0, 5.0, 12.0] {
            let opened = Opened::new(holed(&places, reach), landmarks());
            check(&opened);
            assert!(opened.anatomy.mouth.is_some() || opened.omits_lips(), "{reach} mm: nothing is said");
            assert!(opened.anatomy.eyes.iter().all(Option::is_some));
        }
    }
}

#[test]
fn holes_instead_of_eyes_never_break_the_mesh() {
    let iris = |side| JAMES.landmarks[eye_landmarks(side).iris].unwrap();
    for reach in [4.0, 9.0, 16.0] {
        let opened = Opened::new(holed(&Side::BOTH.map(iris), reach), landmarks());
        check(&opened);
        for (side, eye) in Side::BOTH.into_iter().zip(&opened.anatomy.eyes) {
            let told =
                opened.anatomy.omissions.iter().any(|o| matches!(o, Omission::Eye(s, _) if *s == side));
            assert!(eye.is_some() || told, "{side:?} at {reach} mm: nothing is said");
        }
        assert!(opened.anatomy.mouth.is_some());
    }
}

#[test]
fn an_eye_without_landmarks_stays_and_is_named() {
    let mut points = landmarks();
    let eye = eye_landmarks(Side::Left);
    for i in eye.upper.iter().chain(&eye.lower) {
        points[*i] = None;
    }
    let opened = Opened::new(JAMES.scan.clone(), points);
    check(&opened);
    assert_eq!(opened.anatomy.omissions, [Omission::Eye(Side::Left, EyeFault::NoLandmarks)]);
    assert!(says(&opened, "the left eye stays as it was scanned"));
    assert!(opened.anatomy.eyes[0].is_some() && opened.anatomy.eyes[1].is_none());
}

#[test]
fn an_eye_that_was_scanned_shut_stays_shut() {
    let mut points = landmarks();
    let eye = eye_landmarks(Side::Right);
    for (u, l) in eye.upper.iter().zip(&eye.lower) {
        points[*u] = points[*l];
    }
    let opened = Opened::new(JAMES.scan.clone(), points);
    check(&opened);
    assert_eq!(opened.anatomy.omissions, [Omission::Eye(Side::Right, EyeFault::Shut)]);
}

#[test]
fn without_the_corners_of_eyes_or_mouth_nothing_is_opened() {
    for missing in [index::RIGHT_EYE_OUTER, index::LEFT_EYE_OUTER, index::MOUTH_RIGHT, index::MOUTH_LEFT] {
        let mut points = landmarks();
        points[missing] = None;
        let opened = Opened::new(JAMES.scan.clone(), points);
        assert_eq!(opened.anatomy.omissions, [Omission::NoFace]);
        assert_eq!(opened.anatomy.mesh, JAMES.scan);
    }
}

#[test]
fn a_lip_line_that_leaves_the_surface_leaves_the_lips() {
    let mut points = landmarks();
    for (i, facts) in landmark_table().iter().enumerate() {
        if facts.region == understudy::tracking::Region::Lips && !index_is_corner(i) {
            points[i] = points[i].map(|p| p + nalgebra::Vector3::new(0.0, 0.0, 400.0));
        }
    }
    let opened = Opened::new(JAMES.scan.clone(), points);
    check(&opened);
    assert!(opened.omits_lips(), "{:?}", opened.anatomy.omissions);
    assert!(says(&opened, "the lips stay closed"));
}

fn index_is_corner(landmark: usize) -> bool {
    landmark == index::MOUTH_RIGHT || landmark == index::MOUTH_LEFT
}

/// The two sides exchanged, the lips exchanged, all points in one, points far off: whatever comes of it, no mesh breaks.
#[test]
fn landmarks_on_the_wrong_side_never_break_the_mesh() {
    let own = landmarks();
    let mirrored: Vec<_> = (0..LANDMARK_COUNT).map(|i| own[landmark_table()[i].mirror]).collect();
    let mut exchanged = own.clone();
    for (u, l) in UPPER_INNER.iter().zip(&understudy::anatomy::LOWER_INNER) {
        exchanged.swap(*u, *l);
    }
    let upside_down: Vec<_> = own.iter().map(|p| p.map(|p| Point3::new(p.x, -p.y, p.z))).collect();
    let in_one = vec![own[index::NOSE_TIP]; LANDMARK_COUNT];
    let far_off: Vec<_> = own.iter().map(|p| p.map(|p| p * 1e6)).collect();
    check(&Opened::new(JAMES.scan.clone(), exchanged));
    // What is added to a face that is none has no shape to be judged; the mesh is sound all the same.
    for points in [mirrored, upside_down, in_one, far_off] {
        let opened = Opened::new(JAMES.scan.clone(), points);
        let mesh = &opened.anatomy.mesh;
        mesh.validate().unwrap();
        let last = opened.anatomy.parts.last().unwrap();
        assert_eq!((last.vertices.end, last.triangles.end), (mesh.positions.len(), mesh.triangles.len()));
        assert!(mesh.positions.len() >= JAMES.scan.positions.len());
    }
}
