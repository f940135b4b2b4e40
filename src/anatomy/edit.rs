//! A mesh under the knife: refined, split along a line, cut open. Nothing that was there moves.
//!
//! Vertices keep their numbers, new ones follow. Vertices at one position share a *place*, so that a surface which its
//! file splits along texture seams holds together while it is worked on.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;

use super::disjoint::DisjointSets;
use crate::scan::Mesh;

/// An edge between two places, the lower first.
pub type Edge = (u32, u32);

/// The mesh and which of its vertices lie in one place.
#[derive(Debug, Clone)]
pub struct EditMesh {
    mesh: Mesh,
    /// V indices: the first vertex at the same position.
    place: Vec<u32>,
}

impl EditMesh {
    /// Takes a mesh that has been validated.
    pub fn new(mesh: Mesh) -> Self {
        let mut first = BTreeMap::new();
        let key = |p: &Point3<f64>| [p.x, p.y, p.z].map(|c| (c + 0.0).to_bits());
        let place = (0_u32..).zip(&mesh.positions).map(|(v, p)| *first.entry(key(p)).or_insert(v)).collect();
        Self { mesh, place }
    }

    /// The mesh as it now is.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The mesh, finished.
    pub fn into_mesh(self) -> Mesh {
        self.mesh
    }

    /// Where a vertex lies.
    pub fn place(&self, vertex: u32) -> u32 {
        self.place[vertex as usize]
    }

    /// The position of a place, or of a vertex.
    pub fn at(&self, place: u32) -> &Point3<f64> {
        &self.mesh.positions[place as usize]
    }

    /// The places of a triangle's corners.
    pub fn corners(&self, triangle: u32) -> [u32; 3] {
        self.mesh.triangles[triangle as usize].map(|v| self.place(v))
    }

    /// The triangles that touch a box.
    pub fn patch(&self, low: &Point3<f64>, high: &Point3<f64>) -> Vec<u32> {
        let touches = |corners: &[u32; 3]| {
            (0..3).all(|axis| {
                let values = corners.map(|v| self.mesh.positions[v as usize][axis]);
                let (least, most) = values
                    .iter()
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| (l.min(*v), m.max(*v)));
                least <= high[axis] && most >= low[axis]
            })
        };
        (0_u32..).zip(&self.mesh.triangles).filter(|(_, corners)| touches(corners)).map(|(t, _)| t).collect()
    }

    /// The edges of some triangles and which of these have them.
    pub fn edges(&self, patch: &[u32]) -> BTreeMap<Edge, Vec<u32>> {
        let mut edges: BTreeMap<Edge, Vec<u32>> = BTreeMap::new();
        for &triangle in patch {
            for edge in triangle_edges(self.corners(triangle)) {
                edges.entry(edge).or_default().push(triangle);
            }
        }
        edges
    }

    /// Halves edges, the longest for their place first, until none is longer than `size` of its middle. Edges whose
    /// middle lies where `size` is infinite stay. `patch` must hold every triangle of the others, and gains the new.
    pub fn refine(&mut self, patch: &mut Vec<u32>, size: impl Fn(&Point3<f64>) -> f64) {
        const ROUNDS: usize = 30;
        for _ in 0..ROUNDS {
            let edges = self.edges(patch);
            let mut long: Vec<(f64, Edge)> = edges
                .keys()
                .filter_map(|&(a, b)| {
                    let (p, q) = (self.at(a), self.at(b));
                    let ratio = (p - q).norm() / size(&nalgebra::center(p, q));
                    (ratio > 1.0).then_some((ratio, (a, b)))
                })
                .collect();
            if long.is_empty() {
                return;
            }
            long.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
            let mut touched = BTreeSet::new();
            let mut halves = BTreeMap::new();
            for (_, edge) in long {
                let around = &edges[&edge];
                if around.iter().all(|t| !touched.contains(t)) {
                    touched.extend(around.iter().copied());
                    halves.insert(edge, 0.5);
                }
            }
            self.split(patch, &halves);
        }
    }

    /// Makes the zero line of `level` a chain of edges, by splitting the edges that cross it where `inside` holds.
    /// A vertex within a fifth of an edge from the line counts as on it. Returns the places on the line.
    pub fn embed(
        &mut self,
        patch: &mut Vec<u32>,
        level: impl Fn(&Point3<f64>) -> f64,
        inside: impl Fn(&Point3<f64>) -> bool,
    ) -> BTreeSet<u32> {
        const NEAR: f64 = 0.2;
        let edges = self.edges(patch);
        let mut levels: BTreeMap<u32, f64> =
            edges.keys().flat_map(|&(a, b)| [a, b]).map(|place| (place, level(self.at(place)))).collect();
        let crossing = |levels: &BTreeMap<u32, f64>, (a, b): Edge| {
            let (from, to) = (levels[&a], levels[&b]);
            if from * to >= 0.0 {
                return None;
            }
            let t = from / (from - to);
            inside(&(self.at(a) + (self.at(b) - self.at(a)) * t)).then_some(t)
        };
        let mut near: Vec<(f64, u32)> = edges
            .keys()
            .filter_map(|&(a, b)| {
                let t = crossing(&levels, (a, b))?;
                if t < NEAR {
                    Some((t, a))
                } else if t > 1.0 - NEAR {
                    Some((1.0 - t, b))
                } else {
                    None
                }
            })
            .collect();
        near.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        let mut on: BTreeSet<u32> = levels
            .iter()
            .filter(|(place, l)| **l == 0.0 && inside(self.at(**place)))
            .map(|(p, _)| *p)
            .collect();
        for (_, place) in near {
            levels.insert(place, 0.0);
            on.insert(place);
        }
        let cuts: BTreeMap<Edge, f64> =
            edges.keys().filter_map(|&edge| Some((edge, crossing(&levels, edge)?))).collect();
        on.extend(self.split(patch, &cuts));
        on
    }

    /// Splits edges, each at a share of the way from its first place, and the triangles around them. Returns the new
    /// places.
    fn split(&mut self, patch: &mut Vec<u32>, cuts: &BTreeMap<Edge, f64>) -> Vec<u32> {
        let mut splitter =
            Splitter { cuts, vertices: BTreeMap::new(), uvs: BTreeMap::new(), places: BTreeMap::new() };
        for i in 0..patch.len() {
            let triangle = patch[i] as usize;
            let corners = self.corners(patch[i]);
            let has = std::array::from_fn::<bool, 3, _>(|k| {
                cuts.contains_key(&ordered(corners[k], corners[(k + 1) % 3]))
            });
            let count = has.iter().filter(|h| **h).count();
            if count == 0 {
                continue;
            }
            // Turned so that the cut edge, or the corner between two of them, comes first.
            let first = match count {
                1 => has.iter().position(|h| *h).unwrap_or(0),
                2 => (has.iter().position(|h| !*h).unwrap_or(0) + 2) % 3,
                _ => 0,
            };
            let turn = [first, (first + 1) % 3, (first + 2) % 3];
            let old = self.mesh.triangles[triangle];
            let old_uv = self.mesh.uv_triangles.get(triangle).copied();
            let [a, b, c] = turn.map(|k| (old[k], old_uv.map(|uv| uv[k])));
            let pieces = match count {
                1 => {
                    let m = splitter.between(self, a, b);
                    vec![[a, m, c], [m, b, c]]
                }
                2 => {
                    // Edges ab and ca are cut.
                    let (m, n) = (splitter.between(self, a, b), splitter.between(self, c, a));
                    let far = |x: Corner, y: Corner| (self.at(x.0) - self.at(y.0)).norm();
                    let mut pieces = vec![[a, m, n]];
                    pieces.extend(if far(m, c) < far(n, b) {
                        [[m, b, c], [m, c, n]]
                    } else {
                        [[m, b, n], [n, b, c]]
                    });
                    pieces
                }
                _ => {
                    let (m, n, o) = (
                        splitter.between(self, a, b),
                        splitter.between(self, b, c),
                        splitter.between(self, c, a),
                    );
                    vec![[a, m, o], [m, b, n], [o, n, c], [m, n, o]]
                }
            };
            for (piece, corners) in pieces.into_iter().enumerate() {
                let index = if piece == 0 { triangle } else { self.copy_triangle(triangle) };
                if piece > 0 {
                    patch.push(index as u32);
                }
                self.mesh.triangles[index] = corners.map(|corner| corner.0);
                if let Some(uvs) = self.mesh.uv_triangles.get_mut(index) {
                    *uvs = corners.map(|corner| corner.1.unwrap_or_default());
                }
            }
        }
        splitter.places.into_values().collect()
    }

    /// Appends a triangle like another.
    fn copy_triangle(&mut self, triangle: usize) -> usize {
        let mesh = &mut self.mesh;
        mesh.triangles.push(mesh.triangles[triangle]);
        if !mesh.uv_triangles.is_empty() {
            mesh.uv_triangles.push(mesh.uv_triangles[triangle]);
        }
        if !mesh.triangle_materials.is_empty() {
            mesh.triangle_materials.push(mesh.triangle_materials[triangle]);
        }
        mesh.triangles.len() - 1
    }

    /// Appends a vertex between two others, a place of its own until told otherwise.
    fn push_between(&mut self, a: u32, b: u32, t: f64) -> u32 {
        let mesh = &mut self.mesh;
        let (p, q) = (mesh.positions[a as usize], mesh.positions[b as usize]);
        mesh.positions.push(p + (q - p) * t);
        if !mesh.colours.is_empty() {
            let (p, q) = (mesh.colours[a as usize], mesh.colours[b as usize]);
            mesh.colours.push(std::array::from_fn(|k| p[k] + (q[k] - p[k]) * t as f32));
        }
        let vertex = mesh.positions.len() as u32 - 1;
        self.place.push(vertex);
        vertex
    }

    /// Gives some triangles vertices of their own in `places`, and returns each place with its new one. A vertex that
    /// only these triangles use is not copied.
    pub fn detach(&mut self, triangles: &[u32], places: &BTreeSet<u32>) -> BTreeMap<u32, u32> {
        let chosen: BTreeSet<u32> = triangles.iter().copied().collect();
        let kept: BTreeSet<u32> = (0_u32..)
            .zip(&self.mesh.triangles)
            .filter(|(triangle, _)| !chosen.contains(triangle))
            .flat_map(|(_, corners)| *corners)
            .filter(|&vertex| places.contains(&self.place(vertex)))
            .collect();
        let mut copies: BTreeMap<u32, u32> = BTreeMap::new();
        let mut new_place: BTreeMap<u32, u32> = BTreeMap::new();
        for &triangle in triangles {
            for k in 0..3 {
                let vertex = self.mesh.triangles[triangle as usize][k];
                let place = self.place(vertex);
                if !places.contains(&place) {
                    continue;
                }
                let copy = if let Some(copy) = copies.get(&vertex) {
                    *copy
                } else {
                    let own = !kept.contains(&vertex) && vertex != place;
                    let copy = if own { vertex } else { self.push_between(vertex, vertex, 0.0) };
                    let at = *new_place.entry(place).or_insert(copy);
                    self.place[copy as usize] = at;
                    copies.insert(vertex, copy);
                    copy
                };
                self.mesh.triangles[triangle as usize][k] = copy;
            }
        }
        new_place
    }

    /// For every vertex a number that it shares with all that the surface connects it to.
    pub fn components(&self) -> Vec<u32> {
        let mut sets = DisjointSets::new(self.mesh.positions.len());
        for corners in &self.mesh.triangles {
            let [a, b, c] = corners.map(|v| self.place(v));
            sets.join(a, b);
            sets.join(b, c);
        }
        self.place.iter().map(|&place| sets.least(place)).collect()
    }

    /// Some triangles, sorted into those that hang together at edges.
    pub fn pieces(&self, triangles: &[u32]) -> Vec<Vec<u32>> {
        let edges = self.edges(triangles);
        let mut piece: BTreeMap<u32, usize> = BTreeMap::new();
        let mut pieces = Vec::new();
        for &start in triangles {
            if piece.contains_key(&start) {
                continue;
            }
            let number = pieces.len();
            let (mut found, mut next) = (Vec::new(), vec![start]);
            piece.insert(start, number);
            while let Some(triangle) = next.pop() {
                found.push(triangle);
                for edge in triangle_edges(self.corners(triangle)) {
                    for &other in edges.get(&edge).into_iter().flatten() {
                        if piece.insert(other, number).is_none() {
                            next.push(other);
                        }
                    }
                }
            }
            found.sort_unstable();
            pieces.push(found);
        }
        pieces
    }
}

/// A corner of a triangle: its vertex and texture coordinate.
type Corner = (u32, Option<u32>);

/// New vertices of one round of splits: one for each pair of old ones, however many triangles share it.
struct Splitter<'a> {
    cuts: &'a BTreeMap<Edge, f64>,
    vertices: BTreeMap<Edge, u32>,
    uvs: BTreeMap<Edge, u32>,
    places: BTreeMap<Edge, u32>,
}

impl Splitter<'_> {
    fn between(&mut self, edit: &mut EditMesh, a: Corner, b: Corner) -> Corner {
        let edge = ordered(edit.place(a.0), edit.place(b.0));
        // The share counts from the edge's first place.
        let (a, b) = if edit.place(a.0) == edge.0 { (a, b) } else { (b, a) };
        let t = self.cuts.get(&edge).copied().unwrap_or(0.5);
        let vertex = *self.vertices.entry((a.0, b.0)).or_insert_with(|| edit.push_between(a.0, b.0, t));
        let place = *self.places.entry(edge).or_insert(vertex);
        edit.place[vertex as usize] = place;
        let uv = a.1.zip(b.1).map(|(p, q)| {
            *self.uvs.entry((p, q)).or_insert_with(|| {
                let (p, q) = (edit.mesh.uvs[p as usize], edit.mesh.uvs[q as usize]);
                edit.mesh.uvs.push(std::array::from_fn(|k| p[k] + (q[k] - p[k]) * t as f32));
                edit.mesh.uvs.len() as u32 - 1
            })
        });
        (vertex, uv)
    }
}

/// The edge between two places.
pub fn ordered(a: u32, b: u32) -> Edge {
    if a < b { (a, b) } else { (b, a) }
}

/// The three edges of a triangle.
pub fn triangle_edges([a, b, c]: [u32; 3]) -> [Edge; 3] {
    [ordered(a, b), ordered(b, c), ordered(c, a)]
}
