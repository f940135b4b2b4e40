//! Whether an opened scan is still the scan: nothing lost, torn, turned over or moved but what was meant to be.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Vector3};
use understudy::{
    anatomy::{Anatomy, PartKind},
    scan::Mesh,
};

use super::{
    opened::Opened,
    topology::{Edge, area, barycentric, boundary, edges, euler, irregular, loops, pieces, welded},
};

/// Rounding, millimetres.
const ROUNDING: f64 = 1e-6;

/// What a scan was opened into, by what its triangles say.
#[derive(Debug)]
pub struct Findings {
    /// Edges of the lips' rims, both together.
    pub lip_edges: usize,
    /// For each eye that was cut out, the edges around it.
    pub eye_rings: Vec<usize>,
    /// Vertices of the eyes that were cut out, for each.
    pub cut_out: Vec<BTreeSet<u32>>,
    /// Edges of the skin that belong to one triangle alone, less the scan's own.
    pub new_boundary: usize,
}

/// Checks everything that holds for any scan. The scan's triangles share their vertices.
#[track_caller]
pub fn check(opened: &Opened) -> Findings {
    let (scan, anatomy) = (&opened.scan, &opened.anatomy);
    anatomy.mesh.validate().unwrap();
    parts_divide_the_mesh(anatomy);
    let skin = skin(anatomy);
    let cut_out = cut_out(&scan.triangles, &skin.triangles);
    the_scan_comes_first(opened, &cut_out);
    no_edge_is_torn(scan, &skin);
    nothing_turns_over(opened, &skin, &cut_out);
    for part in &anatomy.parts[1..] {
        the_part_is_a_disc(anatomy, part.kind);
    }
    borders(opened, &skin, &cut_out)
}

fn parts_divide_the_mesh(anatomy: &Anatomy) {
    assert_eq!(anatomy.parts[0].kind, PartKind::Skin);
    let (mut vertex, mut triangle) = (0, 0);
    for part in &anatomy.parts {
        assert_eq!((part.vertices.start, part.triangles.start), (vertex, triangle), "{part:?}");
        assert!(!part.vertices.is_empty() && !part.triangles.is_empty(), "{part:?}");
        (vertex, triangle) = (part.vertices.end, part.triangles.end);
        let own = anatomy.mesh.triangles[part.triangles.clone()].iter().flatten();
        assert!(own.into_iter().all(|v| part.vertices.contains(&(*v as usize))), "{part:?}");
    }
    assert_eq!((vertex, triangle), (anatomy.mesh.positions.len(), anatomy.mesh.triangles.len()));
    assert_eq!(anatomy.lower_side.len(), anatomy.skin_vertices());
    assert!(anatomy.lower_side.iter().all(|side| (0.0..=1.0).contains(side)));
}

fn skin(anatomy: &Anatomy) -> Mesh {
    let part = &anatomy.parts[0];
    anatomy.mesh.stretch(&part.vertices, &part.triangles)
}

/// The vertices of what was cut off each piece of the scan; the largest remnant of a piece is the skin.
fn cut_out(before: &[[u32; 3]], after: &[[u32; 3]]) -> Vec<BTreeSet<u32>> {
    let (own, _) = pieces(before);
    let (now, count) = pieces(after);
    let mut sizes = vec![0; count];
    for piece in &now {
        sizes[*piece] += 1;
    }
    let mut remnants: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    // A triangle that was split keeps its number for one of its pieces.
    for (own, now) in own.iter().zip(&now) {
        remnants.entry(*own).or_default().insert(*now);
    }
    let skins: BTreeSet<usize> =
        remnants.values().map(|pieces| *pieces.iter().max_by_key(|piece| sizes[**piece]).unwrap()).collect();
    let of = |piece: usize| {
        let own = after.iter().zip(&now).filter(|(_, number)| **number == piece);
        own.flat_map(|(triangle, _)| *triangle).collect()
    };
    (0..count).filter(|piece| !skins.contains(piece)).map(of).collect()
}

/// The scan's own vertices, in order and to the bit, but those of cut-out eyes, which go straight back.
fn the_scan_comes_first(opened: &Opened, cut_out: &[BTreeSet<u32>]) {
    let (scan, anatomy) = (&opened.scan, &opened.anatomy);
    assert_eq!(anatomy.scan_vertices, scan.positions.len());
    let own = scan.positions.iter().zip(&anatomy.mesh.positions);
    for (vertex, (before, after)) in (0_u32..).zip(own) {
        if cut_out.iter().any(|vertices| vertices.contains(&vertex)) {
            let frame = anatomy.frame.unwrap();
            let moved = frame.enter(after) - frame.enter(before);
            assert!(moved.xy().norm() < ROUNDING && moved.z < ROUNDING, "vertex {vertex} goes by {moved:?}");
        } else {
            assert_eq!(before.coords.map(f64::to_bits), after.coords.map(f64::to_bits), "vertex {vertex}");
        }
    }
}

fn no_edge_is_torn(scan: &Mesh, skin: &Mesh) {
    let length = |mesh: &Mesh, list: &[Edge]| -> f64 {
        let one = |&(a, b): &Edge| (mesh.positions[a as usize] - mesh.positions[b as usize]).norm();
        list.iter().map(one).sum()
    };
    let (before, after) = (irregular(&scan.triangles), irregular(&skin.triangles));
    if before.is_empty() {
        assert!(after.is_empty(), "{} edges of more than two triangles", after.len());
    }
    assert!(length(skin, &after) <= length(scan, &before) + ROUNDING);
}

/// Every triangle lies in the plane of one of the scan's and faces the same way, all of them cover the scan once, and
/// their texture coordinates, colours and materials are those of the place. A cut-out eye has gone straight back: it
/// covers as much as is missing, seen from the front.
fn nothing_turns_over(opened: &Opened, skin: &Mesh, cut_out: &[BTreeSet<u32>]) {
    let scan = &opened.scan;
    let out = opened.anatomy.frame.map_or_else(Vector3::zeros, |frame| frame.leave_vector(&Vector3::z()));
    let mut missing: Vec<_> = (0..scan.triangles.len()).map(|t| area(scan, t)).collect();
    let mut behind = 0.0;
    for (number, corners) in skin.triangles.iter().enumerate() {
        let own = area(skin, number);
        if cut_out.iter().any(|vertices| vertices.contains(&corners[0])) {
            behind += own.dot(&out);
            if number < scan.triangles.len() {
                the_look_is_the_places(opened, number, skin, number, &out);
            }
            continue;
        }
        let parent = parent(opened, skin, number);
        missing[parent] -= own;
        let Some(normal) = area(scan, parent).try_normalize(1e-9) else { continue };
        let along = own.dot(&normal);
        let aslant = (own - normal * along).norm();
        assert!(along > -1e-7 && aslant < 1e-7 + 1e-5 * along, "triangle {number}: {along}, {aslant} mm²");
        the_look_is_the_places(opened, parent, skin, number, &normal);
    }
    for (triangle, missing) in missing.iter().enumerate() {
        let excess = -missing.dot(&area(scan, triangle).try_normalize(1e-9).unwrap_or_default());
        assert!(excess < 1e-5, "{excess} mm² too much of triangle {triangle}");
    }
    let seen = missing.iter().map(|area| area.dot(&out)).sum::<f64>();
    assert!((seen - behind).abs() < 1e-4, "{seen} mm² are missing, {behind} mm² were cut out");
    if cut_out.is_empty() {
        let lost = missing.iter().map(Vector3::norm).sum::<f64>();
        assert!(lost < 1e-4, "{lost} mm² are missing");
    }
}

/// The triangle of the scan that one of the opened skin is part of.
fn parent(opened: &Opened, skin: &Mesh, number: usize) -> usize {
    if number < opened.scan.triangles.len() {
        return number;
    }
    let places = skin.triangles[number].map(|v| skin.positions[v as usize].coords);
    let middle = Point3::from((places[0] + places[1] + places[2]) / 3.0);
    let found = opened.surface.nearest(middle).unwrap();
    let away = (found.position - middle).norm();
    assert!(away < ROUNDING, "triangle {number} lies {away} mm off the scan");
    found.triangle as usize
}

/// Compares a triangle with the place of the scan from where it was moved along `back`, if it was.
fn the_look_is_the_places(opened: &Opened, parent: usize, skin: &Mesh, number: usize, back: &Vector3<f64>) {
    let scan = &opened.scan;
    let (whole, own) = (area(scan, parent).dot(back), area(skin, number).dot(back));
    let material = skin.triangle_materials.get(number).map(|&m| &skin.materials[m as usize]);
    // The scan's own cavity is painted anew. Slivers say nothing.
    if material.is_some_and(|material| material.name == "mouth") || whole < 1e-3 || own < 1e-4 {
        return;
    }
    let scans = scan.triangle_materials.get(parent).map(|&m| &scan.materials[m as usize]);
    if let (Some(material), Some(scans)) = (material, scans.or(scan.materials.first())) {
        assert_eq!(material, scans, "triangle {number}");
    }
    for k in 0..3 {
        let vertex = skin.triangles[number][k] as usize;
        let weights = barycentric(scan, parent, &skin.positions[vertex], back);
        if let (Some(uvs), Some(parents)) = (skin.uv_triangles.get(number), scan.uv_triangles.get(parent)) {
            let corners = parents.map(|uv| scan.uvs[uv as usize]);
            agrees(skin.uvs[uvs[k] as usize], corners, weights, number);
        }
        if !scan.colours.is_empty() {
            let corners = scan.triangles[parent].map(|v| scan.colours[v as usize]);
            agrees(skin.colours[vertex], corners, weights, number);
        }
    }
}

fn agrees<const N: usize>(found: [f32; N], corners: [[f32; N]; 3], weights: [f64; 3], number: usize) {
    for axis in 0..N {
        let wanted: f64 = (0..3).map(|k| f64::from(corners[k][axis]) * weights[k]).sum();
        let off = (f64::from(found[axis]) - wanted).abs();
        assert!(off < 2e-5, "triangle {number}: {found:?} where {wanted} is wanted");
    }
}

/// Cavity, teeth, tongue and eyes: one sheet, without holes or handles, all of it facing one way. A cavity that hangs
/// from shut lips is shut as well.
fn the_part_is_a_disc(anatomy: &Anatomy, kind: PartKind) {
    let part = anatomy.parts.iter().find(|part| part.kind == kind).unwrap();
    let mesh = anatomy.mesh.stretch(&part.vertices, &part.triangles);
    let triangles = welded(&mesh.positions, &mesh.triangles, 1e-5);
    assert!(irregular(&triangles).is_empty(), "{kind:?}: {:?}", irregular(&triangles));
    let border = boundary(&triangles);
    let is_shut = kind == PartKind::Cavity && anatomy.mouth.as_ref().is_some_and(|mouth| mouth.is_cut);
    let wanted = if is_shut { (1, 2, 0) } else { (1, 1, 1) };
    assert_eq!((pieces(&triangles).1, euler(&triangles), loops(&border).len()), wanted, "{kind:?}");
}

/// What has become of the skin's borders: the scan's own, the lips' rims, the rims around the eyes and of the eyes, and
/// nothing else.
fn borders(opened: &Opened, skin: &Mesh, cut_out: &[BTreeSet<u32>]) -> Findings {
    let scan = &opened.scan;
    let scans: Vec<[Point3<f64>; 2]> =
        boundary(&scan.triangles).iter().map(|&(a, b)| [a, b].map(|v| scan.positions[v as usize])).collect();
    let is_scans = |&(a, b): &Edge| {
        let ends = [a, b].map(|v| skin.positions[v as usize]);
        scans.iter().any(|[p, q]| ends.iter().all(|end| distance(end, p, q) < ROUNDING))
    };
    let after = boundary(&skin.triangles);
    let mut fresh: BTreeSet<Edge> = after.iter().filter(|edge| !is_scans(edge)).copied().collect();
    let new_boundary = fresh.len();
    let mut lip_edges = 0;
    if let Some(mouth) = opened.anatomy.mouth.as_ref().filter(|mouth| mouth.is_cut) {
        for pair in mouth.rims.iter().flat_map(|rim| rim.windows(2)) {
            let edge = (pair[0].min(pair[1]), pair[0].max(pair[1]));
            assert!(fresh.remove(&edge), "{edge:?} of the lips' rims is no border");
            lip_edges += 1;
        }
    }
    let out = opened.anatomy.frame.map_or_else(Vector3::z, |frame| frame.leave_vector(&Vector3::z()));
    // One of the two may have gone back.
    let near =
        |a: u32, b: u32| (skin.positions[a as usize] - skin.positions[b as usize]).cross(&out).norm() < 1e-4;
    let meet = |&(a, b): &Edge, &(p, q): &Edge| near(a, p) && near(b, q) || near(a, q) && near(b, p);
    let mut eye_rings = Vec::new();
    for vertices in cut_out {
        let (own, around): (BTreeSet<Edge>, BTreeSet<Edge>) =
            fresh.iter().partition(|(a, b)| vertices.contains(a) && vertices.contains(b));
        eye_rings.push(own.len());
        fresh = around.into_iter().filter(|edge| !own.iter().any(|other| meet(edge, other))).collect();
    }
    assert!(fresh.is_empty(), "{} borders where nothing was cut: {fresh:?}", fresh.len());
    assert_eq!(edges(&skin.triangles).is_empty(), scan.triangles.is_empty());
    Findings { lip_edges, eye_rings, cut_out: cut_out.to_vec(), new_boundary }
}

/// From a point to the stretch between two others.
pub fn distance(point: &Point3<f64>, a: &Point3<f64>, b: &Point3<f64>) -> f64 {
    let along = b - a;
    let t = ((point - a).dot(&along) / along.norm_squared().max(1e-30)).clamp(0.0, 1.0);
    (point - (a + along * t)).norm()
}
