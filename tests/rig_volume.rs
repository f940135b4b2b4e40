//! Volume morphing (002 §IV) against its equations, written down once more, and against what a face must do.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::sync::LazyLock;

use common::opened::Opened;
use nalgebra::{DMatrix, Point3, Rotation3, Vector3};
use understudy::{
    anatomy::{Anatomy, PartKind},
    assets::Assets,
    lift::Eyes,
    pipeline::read_canonical_face,
    rig::{
        AvatarFrame, Driver, Puppet, RigError, TRACKED_18, TargetFace, VolumeMorph, VolumePoints, WarpKind,
    },
    scan::{Mesh, Surface},
    spline::Kernel,
    tracking::{LANDMARK_COUNT, index},
};

static JAMES: LazyLock<Opened> = LazyLock::new(|| Opened::load(&common::james()));

/// The canonical face as a scan: in this mesh a landmark is the vertex of the same index.
fn canonical() -> (Mesh, TargetFace) {
    let file = Assets::locate().unwrap().verified("canonical_face").unwrap();
    let positions = read_canonical_face(&file).unwrap();
    let json: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    let triangles: Vec<[u32; 3]> = serde_json::from_value(json["triangles"].clone()).unwrap();
    let face = face(&positions);
    (Mesh { positions, triangles, ..Mesh::default() }, face)
}

fn face(positions: &[Point3<f64>]) -> TargetFace {
    let mut landmarks: Vec<_> = positions.iter().copied().map(Some).collect();
    landmarks.resize(LANDMARK_COUNT, None);
    TargetFace::new(landmarks, Rotation3::identity()).unwrap()
}

fn puppet(mesh: &Mesh, face: &TargetFace, morph: VolumeMorph) -> Result<Puppet, RigError> {
    let (anatomy, surface) = (Anatomy::as_scanned(mesh), Surface::new(mesh).unwrap());
    Puppet::new(face, &anatomy, &surface, &|_| None, &[], WarpKind::Volume(morph))
}

fn morph(kernel: Kernel, lambda: f64) -> VolumeMorph {
    VolumeMorph { kernel, lambda, ..VolumeMorph::default() }
}

/// Some motion of the controls, millimetres.
fn motion(controls: usize) -> Vec<[f32; 3]> {
    (0..controls)
        .map(|j| [(j as f32).sin(), 3.0 * (2.0 * j as f32).cos(), 0.5 * (j as f32 + 1.0).sin()])
        .collect()
}

fn posed(puppet: &Puppet, controls: &[[f32; 3]]) -> AvatarFrame {
    let mut frame = puppet.new_frame();
    frame.controls[..controls.len()].copy_from_slice(controls);
    puppet.place(&mut frame).unwrap();
    frame
}

fn moved(puppet: &Puppet, frame: &AvatarFrame, vertex: usize) -> Vector3<f64> {
    Vector3::from_fn(|k, _| f64::from(frame.positions[vertex][k]) - f64::from(puppet.rest()[vertex][k]))
}

/// Equations 2 to 5, for displacements: H c = d with λ on the diagonal, by the sign of the kernel's definiteness; then the
/// sum at each place.
fn by_hand(
    centres: &[Point3<f64>],
    values: &[[f32; 3]],
    places: &[Point3<f64>],
    morph: &VolumeMorph,
) -> Vec<Vector3<f64>> {
    let axis = |k: usize| {
        let (low, high) = centres.iter().fold((f64::MAX, f64::MIN), |(a, b), p| (a.min(p[k]), b.max(p[k])));
        high - low
    };
    let side = axis(0).max(axis(1)).max(axis(2));
    let stiffness: Vec<f64> = (0..centres.len())
        .map(|i| {
            let others = (0..centres.len()).filter(|j| *j != i).map(|j| (centres[i] - centres[j]).norm());
            others.fold(f64::MAX, f64::min) / side * morph.stiffness
        })
        .collect();
    let h = |x: &Point3<f64>, i: usize| {
        let (r, s) = ((x - centres[i]).norm() / side, stiffness[i]);
        if morph.kernel == Kernel::Gaussian { (-(r / s).powi(2)).exp() } else { r.hypot(s) }
    };
    let sign = if morph.kernel == Kernel::Gaussian { 1.0 } else { -1.0 };
    let n = centres.len();
    let system =
        DMatrix::from_fn(n, n, |j, i| h(&centres[j], i) + if i == j { sign * morph.lambda } else { 0.0 });
    let right = DMatrix::from_fn(n, 3, |j, k| values.get(j).map_or(0.0, |value| f64::from(value[k])));
    let c = system.full_piv_lu().solve(&right).unwrap();
    let sum =
        |x: &Point3<f64>| (0..n).map(|i| c.row(i).transpose() * h(x, i)).sum::<nalgebra::DVector<f64>>();
    places.iter().map(|x| sum(x).fixed_rows::<3>(0).into()).collect()
}

#[test]
fn the_morph_is_that_of_the_equations() {
    let (mesh, face) = canonical();
    for (kernel, lambda, stiffness) in [
        (Kernel::Hardy, 0.01, 1.0),
        (Kernel::Hardy, 0.0, 0.5),
        (Kernel::Hardy, 0.1, 2.0),
        (Kernel::Gaussian, 0.01, 1.0),
        (Kernel::Gaussian, 0.1, 2.0),
    ] {
        let morph = VolumeMorph { stiffness, ..morph(kernel, lambda) };
        let puppet = puppet(&mesh, &face, morph).unwrap();
        let controls = puppet.controls();
        assert_eq!((controls.rest.len(), controls.anchors.len()), (18, 13));
        let values = motion(controls.rest.len());
        let frame = posed(&puppet, &values);
        let centres = [controls.rest.as_slice(), &controls.anchors].concat();
        let wanted = by_hand(&centres, &values, &mesh.positions, &morph);
        let off = (0..mesh.positions.len()).map(|v| (moved(&puppet, &frame, v) - wanted[v]).norm());
        let off = off.fold(0.0, f64::max);
        println!("{kernel} λ {lambda} stiffness × {stiffness}: {off:.1e} mm");
        assert!(off < 1e-4, "{kernel} λ {lambda}: {off} mm");
    }
}

#[test]
fn without_regularisation_every_tracked_point_is_met_and_every_phantom_stays() {
    let (mut mesh, face) = canonical();
    let draft = puppet(&mesh, &face, morph(Kernel::Hardy, 0.0)).unwrap();
    let anchors = draft.controls().anchors.clone();
    let first = mesh.positions.len();
    // Phantom points are no vertices; here they are made so. Beyond them stands a wall.
    mesh.positions.extend(&anchors);
    let far = [[0.0, 0.0, -250.0], [30.0, 0.0, -250.0], [0.0, 30.0, -250.0]].map(Point3::from);
    mesh.positions.extend(far);
    mesh.triangles.push([first as u32 + 13, first as u32 + 14, first as u32 + 15]);
    for kernel in [Kernel::Hardy, Kernel::Gaussian] {
        let puppet = puppet(&mesh, &face, morph(kernel, 0.0)).unwrap();
        let values = motion(18);
        let frame = posed(&puppet, &values);
        for (driver, value) in puppet.controls().drivers.iter().zip(&values) {
            let Driver::Landmark(landmark) = driver else { panic!("{driver:?}") };
            assert!(TRACKED_18.contains(landmark));
            let off = moved(&puppet, &frame, *landmark) - Vector3::from(value.map(f64::from));
            assert!(off.norm() < 1e-4, "{kernel} {landmark}: {off}");
        }
        for phantom in first..first + 13 {
            assert!(moved(&puppet, &frame, phantom).norm() < 1e-4, "{kernel}: a phantom point moves");
        }
        assert_eq!(frame.positions[first + 13..], puppet.rest()[first + 13..], "{kernel}: what is far moves");
    }
}

#[test]
fn no_motion_is_the_neutral_bit_for_bit() {
    let (mesh, face) = canonical();
    for points in [VolumePoints::Tracked, VolumePoints::Ibug, VolumePoints::All] {
        let puppet = puppet(&mesh, &face, VolumeMorph { points, ..VolumeMorph::default() }).unwrap();
        let still = vec![[0.0; 3]; puppet.controls().rest.len()];
        assert_eq!(posed(&puppet, &still).positions, puppet.rest(), "{points:?}");
    }
}

#[test]
fn phantom_points_stand_around_the_face() {
    let (mesh, face) = canonical();
    let puppet = puppet(&mesh, &face, VolumeMorph::default()).unwrap();
    let anchors = &puppet.controls().anchors;
    let middle = Point3::from(anchors.iter().map(|p| p.coords).sum::<Vector3<f64>>() / 13.0);
    let mut turns: Vec<f64> =
        anchors.iter().map(|p| (p.y - middle.y).atan2(p.x - middle.x).to_degrees()).collect();
    turns.sort_by(f64::total_cmp);
    let steps = turns.windows(2).map(|pair| pair[1] - pair[0]);
    assert!(steps.clone().all(|step| (12.0..45.0).contains(&step)), "{:?}", steps.collect::<Vec<_>>());
    // The face lies within the ring.
    let across = |p: &Point3<f64>| (p.x - middle.x).hypot(p.y - middle.y);
    let nearest = |turn: f64| {
        let off = |p: &&Point3<f64>| ((p.y - middle.y).atan2(p.x - middle.x).to_degrees() - turn).abs();
        anchors.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap()
    };
    for p in &mesh.positions {
        let turn = (p.y - middle.y).atan2(p.x - middle.x).to_degrees();
        assert!(across(p) < across(nearest(turn)), "{p} lies outside");
    }
}

#[test]
fn a_landmark_that_is_nowhere_is_left_out_and_a_flat_face_is_served() {
    let (mesh, mut face) = canonical();
    face.landmarks[index::CHIN] = None;
    assert_eq!(puppet(&mesh, &face, VolumeMorph::default()).unwrap().controls().rest.len(), 17);

    // Without an affine part centres in one plane do no harm.
    let (mut flat, _) = canonical();
    for position in &mut flat.positions {
        position.z = 0.0;
    }
    let face = self::face(&flat.positions);
    for kernel in [Kernel::Hardy, Kernel::Gaussian] {
        let puppet = puppet(&flat, &face, morph(kernel, 0.0)).unwrap();
        let values = motion(18);
        let frame = posed(&puppet, &values);
        assert!(frame.positions.iter().flatten().all(|value| value.is_finite()));
        let control = puppet.controls().of_landmark(index::CHIN).unwrap();
        let wanted = Vector3::from(values[control].map(f64::from));
        assert!((moved(&puppet, &frame, index::CHIN) - wanted).norm() < 1e-3, "{kernel}");
    }
}

#[test]
fn what_no_morph_can_be_made_of_is_refused() {
    let (mesh, face) = canonical();
    for lambda in [-0.01, f64::NAN, f64::INFINITY] {
        let refused = puppet(&mesh, &face, morph(Kernel::Hardy, lambda)).unwrap_err().to_string();
        assert!(refused.contains("regularisation"), "{refused}");
    }
    for stiffness in [0.0, -2.0, f64::NAN] {
        let morph = VolumeMorph { stiffness, ..VolumeMorph::default() };
        let refused = puppet(&mesh, &face, morph).unwrap_err().to_string();
        assert!(refused.contains("stiffness"), "{refused}");
    }
    // A kernel that wants an affine part does not get one.
    let refused = puppet(&mesh, &face, morph(Kernel::Cubic, 0.0)).unwrap_err().to_string();
    assert!(refused.contains("affine"), "{refused}");
}

#[test]
fn opened_lips_part_in_the_middle_and_stay_together_at_the_corners() {
    let opened = &*JAMES;
    let mouth = opened.anatomy.mouth.as_ref().unwrap();
    for kernel in [Kernel::Hardy, Kernel::Gaussian] {
        let puppet = opened.puppet_with(WarpKind::Volume(morph(kernel, 0.0)));
        let drivers = &puppet.controls().drivers;
        assert_eq!(drivers.len(), 18);
        let gaps = |upper: Vector3<f64>, lower: Vector3<f64>| -> Vec<f64> {
            let of = |driver: &Driver| match driver {
                Driver::Rim { lower: is_lower, .. } => {
                    (if *is_lower { lower } else { upper }).map(|v| v as f32).into()
                }
                _ => [0.0; 3],
            };
            let frame = posed(&puppet, &drivers.iter().map(of).collect::<Vec<_>>());
            let pairs = mouth.rims[0].iter().zip(&mouth.rims[1]);
            let at = |v: u32| Vector3::from(frame.positions[v as usize].map(f64::from));
            pairs.map(|(&u, &l)| (at(u) - at(l)).dot(&mouth.up)).collect()
        };
        let shift = Vector3::new(1.0, -4.0, 0.5);
        let together = gaps(shift, shift);
        let most = together.iter().fold(0.0_f64, |most, gap| most.max(gap.abs()));
        assert!(most < 0.02, "{kernel}: lips that go together part by {most} mm");
        let apart = gaps(mouth.up * 2.0, mouth.up * -8.0);
        let widest = apart.iter().copied().fold(0.0, f64::max);
        println!("{kernel}: {apart:.1?}");
        assert!((9.5..11.0).contains(&widest), "{kernel}: {widest} mm");
        assert!(apart.iter().all(|gap| *gap > -0.05), "{kernel}: lips go through each other");
        let [first, last] = [apart[0], apart[apart.len() - 1]];
        assert!(
            first < 0.35 * widest && last < 0.35 * widest,
            "{kernel}: {first} and {last} mm at the corners"
        );
    }
}

#[test]
fn teeth_follow_the_bone_and_the_skin_does_not() {
    let opened = &*JAMES;
    let puppet = opened.puppet_with(WarpKind::Volume(VolumeMorph::default()));
    let mut frame = puppet.new_frame();
    let jaw = understudy::anatomy::JawPose { opening: 0.2, ..Default::default() };
    puppet.act(&jaw, &Eyes::default(), &mut frame).unwrap();
    let farthest = |kind: PartKind| {
        let vertices = opened.part(kind).unwrap().vertices.clone();
        vertices.map(|v| moved(&puppet, &frame, v).norm()).fold(0.0, f64::max)
    };
    assert!(farthest(PartKind::LowerTeeth) > 10.0);
    assert!(farthest(PartKind::UpperTeeth) < 1e-6 && farthest(PartKind::Skin) < 1e-6);
}
