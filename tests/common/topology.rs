//! What a mesh is made of, whatever its shape: edges, pieces, and what a cut has done to them.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Vector3};
use understudy::scan::Mesh;

pub type Edge = (u32, u32);

/// The edges of some triangles: how often each is passed from its lower vertex to the higher, and back.
pub fn edges(triangles: &[[u32; 3]]) -> BTreeMap<Edge, [u32; 2]> {
    let mut edges: BTreeMap<Edge, [u32; 2]> = BTreeMap::new();
    for [a, b, c] in triangles {
        for (from, to) in [(*a, *b), (*b, *c), (*c, *a)] {
            edges.entry((from.min(to), from.max(to))).or_default()[usize::from(from > to)] += 1;
        }
    }
    edges
}

/// Edges of one triangle alone.
pub fn boundary(triangles: &[[u32; 3]]) -> BTreeSet<Edge> {
    edges(triangles).into_iter().filter(|(_, uses)| uses[0] + uses[1] == 1).map(|(edge, _)| edge).collect()
}

/// Edges that two triangles do not pass in opposite directions, nor one alone.
pub fn irregular(triangles: &[[u32; 3]]) -> Vec<Edge> {
    let regular = |uses: &[u32; 2]| matches!(uses, [1, 0 | 1] | [0, 1]);
    edges(triangles).into_iter().filter(|(_, uses)| !regular(uses)).map(|(edge, _)| edge).collect()
}

/// For each triangle the number of the piece that it hangs together with by shared vertices, and how many there are.
pub fn pieces(triangles: &[[u32; 3]]) -> (Vec<usize>, usize) {
    let vertices = triangles.iter().flatten().max().map_or(0, |most| *most as usize + 1);
    let mut parent: Vec<u32> = (0..vertices as u32).collect();
    let root = |parent: &mut Vec<u32>, mut v: u32| {
        while parent[v as usize] != v {
            parent[v as usize] = parent[parent[v as usize] as usize];
            v = parent[v as usize];
        }
        v
    };
    for [a, b, c] in triangles {
        for other in [b, c] {
            let (p, q) = (root(&mut parent, *a), root(&mut parent, *other));
            parent[p.max(q) as usize] = p.min(q);
        }
    }
    let mut numbers = BTreeMap::new();
    let of_triangle = triangles
        .iter()
        .map(|t| {
            let (root, next) = (root(&mut parent, t[0]), numbers.len());
            *numbers.entry(root).or_insert(next)
        })
        .collect();
    (of_triangle, numbers.len())
}

/// The triangles with vertices in one place made one, and without those that have no area left.
pub fn welded(positions: &[Point3<f64>], triangles: &[[u32; 3]], grid: f64) -> Vec<[u32; 3]> {
    let mut first: BTreeMap<[i64; 3], u32> = BTreeMap::new();
    let place: Vec<u32> = (0_u32..)
        .zip(positions)
        .map(|(v, p)| *first.entry([p.x, p.y, p.z].map(|c| (c / grid).round() as i64)).or_insert(v))
        .collect();
    let welded = triangles.iter().map(|t| t.map(|v| place[v as usize]));
    welded.filter(|[a, b, c]| a != b && b != c && c != a).collect()
}

/// Vertices less edges plus triangles: 1 for a disc, 2 for a ball.
pub fn euler(triangles: &[[u32; 3]]) -> i64 {
    let vertices: BTreeSet<u32> = triangles.iter().flatten().copied().collect();
    vertices.len() as i64 - edges(triangles).len() as i64 + triangles.len() as i64
}

/// The edges of a boundary as closed loops of vertices, each in the order in which its edges meet.
pub fn loops(boundary: &BTreeSet<Edge>) -> Vec<Vec<u32>> {
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &(a, b) in boundary {
        next.entry(a).or_default().push(b);
        next.entry(b).or_default().push(a);
    }
    let mut left = boundary.clone();
    let mut loops = Vec::new();
    while let Some((start, second)) = left.pop_first() {
        let mut found = vec![start, second];
        loop {
            let here = found[found.len() - 1];
            let onwards = next[&here].iter().find(|&&to| left.contains(&(here.min(to), here.max(to))));
            let Some(&to) = onwards else { break };
            left.remove(&(here.min(to), here.max(to)));
            if to == start {
                break;
            }
            found.push(to);
        }
        loops.push(found);
    }
    loops
}

/// The triangle's normal times its area.
pub fn area(mesh: &Mesh, triangle: usize) -> Vector3<f64> {
    let [a, b, c] = mesh.triangles[triangle].map(|v| mesh.positions[v as usize]);
    (b - a).cross(&(c - a)) / 2.0
}

/// The weights of a triangle's corners under which they give a place, seen along `sight`.
pub fn barycentric(mesh: &Mesh, triangle: usize, place: &Point3<f64>, sight: &Vector3<f64>) -> [f64; 3] {
    let [a, b, c] = mesh.triangles[triangle].map(|v| mesh.positions[v as usize]);
    let whole = (b - a).cross(&(c - a)).dot(sight);
    let v = (place - a).cross(&(c - a)).dot(sight) / whole;
    let w = (b - a).cross(&(place - a)).dot(sight) / whole;
    [1.0 - v - w, v, w]
}
