//! A scan that has been opened is still the scan: cut where it had to be cut, and nothing else.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{collections::BTreeMap, sync::LazyLock};

use common::{
    james,
    opened::Opened,
    sound::{Findings, check},
};
use nalgebra::{Point3, Rotation3, Vector3};
use understudy::{pipeline::read_canonical_face, scan::Mesh, tracking::LANDMARK_COUNT};

const NAMES: [&str; 7] = ["face", "mouth", "upper teeth", "lower teeth", "tongue", "right eye", "left eye"];

static JAMES: LazyLock<Opened> = LazyLock::new(|| Opened::load(&james()));

/// Lips and both eyes were opened, and the borders are those of the cuts.
#[track_caller]
fn is_wholly_open(opened: &Opened) -> Findings {
    let findings = check(opened);
    assert!(opened.anatomy.omissions.is_empty(), "{:?}", opened.anatomy.omissions);
    let mouth = opened.anatomy.mouth.as_ref().unwrap();
    assert!(mouth.is_cut && mouth.rims[0].len() == mouth.rims[1].len());
    assert_eq!(findings.lip_edges, 2 * (mouth.rims[0].len() - 1));
    assert_eq!(findings.eye_rings.len(), 2);
    assert_eq!(findings.new_boundary, findings.lip_edges + 2 * findings.eye_rings.iter().sum::<usize>());
    findings
}

fn kinds(opened: &Opened) -> Vec<&'static str> {
    opened.anatomy.parts.iter().map(|part| part.kind.name()).collect()
}

#[test]
fn a_textured_scan_stays_whole() {
    let findings = is_wholly_open(&JAMES);
    assert!(findings.lip_edges > 60 && findings.eye_rings.iter().all(|edges| *edges > 60), "{findings:?}");
    assert_eq!(kinds(&JAMES), NAMES);
}

/// Its mouth is open already, with a cavity behind it: nothing has to be cut there.
#[test]
fn a_scan_with_coloured_vertices_and_a_mouth_of_its_own_stays_whole() {
    let opened = Opened::load(&common::asset("template_ply"));
    let findings = check(&opened);
    assert!(opened.anatomy.omissions.is_empty(), "{:?}", opened.anatomy.omissions);
    assert_eq!((findings.lip_edges, findings.eye_rings.len()), (0, 2));
    assert_eq!(findings.new_boundary, 2 * findings.eye_rings.iter().sum::<usize>());
    assert_eq!(kinds(&opened), NAMES);
}

#[test]
fn a_scan_without_colours_stays_whole() {
    let scan = Mesh {
        positions: JAMES.scan.positions.clone(),
        triangles: JAMES.scan.triangles.clone(),
        ..Mesh::default()
    };
    is_wholly_open(&Opened::new(scan, JAMES.landmarks.clone()));
}

/// Leaning, turned and elsewhere: the face's own axes are what counts.
#[test]
fn a_scan_that_does_not_face_the_front_stays_whole() {
    let turn = Rotation3::from_euler_angles(0.5, -0.8, 0.3);
    let place = |p: &Point3<f64>| turn * p + Vector3::new(300.0, -1200.0, 40.0);
    let mut scan = JAMES.scan.clone();
    scan.positions = scan.positions.iter().map(place).collect();
    let landmarks = JAMES.landmarks.iter().map(|p| p.as_ref().map(place)).collect();
    is_wholly_open(&Opened::new(scan, landmarks));
}

/// Four triangles for each of a scan's.
fn halved(scan: &Mesh) -> Mesh {
    let mut dense = Mesh {
        triangles: Vec::new(),
        uv_triangles: Vec::new(),
        triangle_materials: Vec::new(),
        ..scan.clone()
    };
    let (mut vertices, mut uvs) = (BTreeMap::new(), BTreeMap::new());
    for (corners, uv_corners) in scan.triangles.iter().zip(&scan.uv_triangles) {
        let sides = [(0, 1), (1, 2), (2, 0)];
        let middles = sides.map(|(i, j): (usize, usize)| {
            let (a, b) = (corners[i].min(corners[j]), corners[i].max(corners[j]));
            *vertices.entry((a, b)).or_insert_with(|| {
                let [p, q] = [a, b].map(|v| dense.positions[v as usize]);
                dense.positions.push(nalgebra::center(&p, &q));
                dense.positions.len() as u32 - 1
            })
        });
        let uv_middles = sides.map(|(i, j): (usize, usize)| {
            let (a, b) = (uv_corners[i].min(uv_corners[j]), uv_corners[i].max(uv_corners[j]));
            *uvs.entry((a, b)).or_insert_with(|| {
                let [p, q] = [a, b].map(|uv| dense.uvs[uv as usize]);
                dense.uvs.push([f32::midpoint(p[0], q[0]), f32::midpoint(p[1], q[1])]);
                dense.uvs.len() as u32 - 1
            })
        });
        let quarters =
            |[a, b, c]: [u32; 3], [m, n, o]: [u32; 3]| [[a, m, o], [m, b, n], [o, n, c], [m, n, o]];
        dense.triangles.extend(quarters(*corners, middles));
        dense.uv_triangles.extend(quarters(*uv_corners, uv_middles));
    }
    dense
}

#[test]
fn a_dense_scan_stays_whole() {
    is_wholly_open(&Opened::new(halved(&JAMES.scan), JAMES.landmarks.clone()));
}

/// 468 vertices and 898 triangles: the average face, whose vertices are its landmarks.
#[test]
fn a_scan_of_few_triangles_stays_whole() {
    let file = common::asset("canonical_face");
    let positions = read_canonical_face(&file).unwrap();
    let json: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    let triangles: Vec<[u32; 3]> = serde_json::from_value(json["triangles"].clone()).unwrap();
    let mut landmarks: Vec<_> = positions.iter().copied().map(Some).collect();
    landmarks.resize(LANDMARK_COUNT, None);
    let opened = Opened::new(Mesh { positions, triangles, ..Mesh::default() }, landmarks);
    is_wholly_open(&opened);
}

/// A file that splits the surface into single triangles, as an STL does, is opened as one that does not.
#[test]
fn a_scan_whose_triangles_share_no_vertex_is_opened_alike() {
    // Numbered by first appearance, so that ties between places fall alike.
    let scan = &JAMES.scan;
    let mut number = BTreeMap::new();
    let mut positions = Vec::new();
    let triangles: Vec<[u32; 3]> = scan
        .triangles
        .iter()
        .map(|corners| {
            corners.map(|v| {
                *number.entry(v).or_insert_with(|| {
                    positions.push(scan.positions[v as usize]);
                    positions.len() as u32 - 1
                })
            })
        })
        .collect();
    let exploded: Vec<_> = triangles.iter().flatten().map(|&v| positions[v as usize]).collect();
    let alone = (0..exploded.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let shared = Opened::new(Mesh { positions, triangles, ..Mesh::default() }, JAMES.landmarks.clone());
    let split = Mesh { positions: exploded, triangles: alone, ..Mesh::default() };
    let split = Opened::new(split, JAMES.landmarks.clone());
    is_wholly_open(&shared);
    split.anatomy.mesh.validate().unwrap();
    assert_eq!(kinds(&shared), kinds(&split));
    let corners = |opened: &Opened| -> Vec<[Point3<f64>; 3]> {
        let mesh = &opened.anatomy.mesh;
        mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize])).collect()
    };
    let (one, other) = (corners(&shared), corners(&split));
    assert_eq!(one.len(), other.len());
    for (number, (p, q)) in one.iter().zip(&other).enumerate() {
        assert!(p.iter().zip(q).all(|(p, q)| (p - q).norm() < 1e-9), "triangle {number}: {p:?} and {q:?}");
    }
}

/// Numbers in −1..=1, the same in every run.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next())
    }
}

/// Rough surfaces, and landmarks that lie anywhere near where they should: what is cut is cut cleanly all the same.
#[test]
fn no_noise_tears_a_scan() {
    for seed in 0..24_u64 {
        let mut noise = Noise(seed);
        let (astray, rough) = (0.25 * (seed + 1) as f64, 0.05 * (seed % 8) as f64);
        let mut scan = JAMES.scan.clone();
        for position in &mut scan.positions {
            *position += noise.vector() * rough;
        }
        let landmarks = JAMES.landmarks.iter().map(|p| p.map(|p| p + noise.vector() * astray)).collect();
        let opened = Opened::new(scan, landmarks);
        println!("{astray} mm astray, {rough:.2} mm rough: {:?}", opened.anatomy.omissions);
        check(&opened);
    }
}
