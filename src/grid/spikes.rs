//! Spikes: points that stand far off the median of their neighbours.

use nalgebra::{Point3, Vector3};

/// A point that stands off its neighbours by more than this many times their own spread is a spike: a cone steeper than
/// 56° all round.
const STEEP: f64 = 1.5;
/// On the rim the neighbours lie to one side, so that more is allowed.
const STEEP_ON_THE_RIM: f64 = 5.0;
/// Neighbours this many times farther out than half of them are not asked where the surface looks.
const OUTLIER: f64 = 3.0;
/// Millimetres below which nothing is a spike.
const LEAST: f64 = 1.5;
/// A spike of several points shrinks round by round.
const ROUNDS: usize = 4;

/// What became of the spikes.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Spikes {
    /// Points inside the surface that were set to the median of their neighbours.
    pub drawn_back: usize,
    /// Vertices on a rim whose triangles go.
    pub removed: Vec<u32>,
}

/// Draws spikes back to the median of their neighbours, where these surround them, and names those on a rim.
///
/// `positions` are millimetres; of vertices in one place (`welded`) all move. `kept` says which triangles count.
pub(super) fn draw_back(
    positions: &mut [Point3<f64>],
    triangles: &[[u32; 3]],
    kept: &[bool],
    welded: &[u32],
) -> Spikes {
    let rings = Rings::of(triangles, kept, welded);
    let mut moved = vec![false; positions.len()];
    let mut removed = Vec::new();
    for round in 0..ROUNDS {
        let mut places = Vec::new();
        for v in 0..positions.len() as u32 {
            let ring = rings.neighbours(v);
            if ring.len() < 3 {
                continue;
            }
            let at = positions[v as usize];
            let median = median_of(ring, positions);
            let mut away: Vec<f64> = ring.iter().map(|n| (positions[*n as usize] - median).norm()).collect();
            let spread = middle(&mut away);
            let rim = rings.is_rim(v);
            let height = if rim {
                (at - median).norm()
            } else {
                let normal = rings.normal(v, positions, &median, OUTLIER * spread);
                (at - median).dot(&normal.unwrap_or_else(Vector3::zeros)).abs()
            };
            let limit = spread * if rim { STEEP_ON_THE_RIM } else { STEEP };
            if height > limit.max(LEAST) {
                if rim && round == 0 {
                    removed.push(v);
                } else if !rim {
                    places.push((v, median));
                }
            }
        }
        if places.is_empty() {
            break;
        }
        for (v, median) in places {
            positions[v as usize] = median;
            moved[v as usize] = true;
        }
    }
    for v in 0..positions.len() {
        positions[v] = positions[welded[v] as usize];
    }
    Spikes { drawn_back: moved.into_iter().filter(|moved| *moved).count(), removed }
}

/// The edges around each vertex, all in one list.
struct Rings {
    starts: Vec<u32>,
    /// For each triangle at a vertex, the other two corners in its order.
    opposite: Vec<[u32; 2]>,
    neighbours: Vec<Vec<u32>>,
}

impl Rings {
    fn of(triangles: &[[u32; 3]], kept: &[bool], welded: &[u32]) -> Self {
        let count = welded.len();
        let counted = || {
            let all = triangles.iter().zip(kept).filter(|(_, kept)| **kept);
            all.map(|(t, _)| t.map(|v| welded[v as usize])).filter(|[a, b, c]| a != b && b != c && c != a)
        };
        let mut starts = vec![0_u32; count + 1];
        for v in counted().flatten() {
            starts[v as usize + 1] += 1;
        }
        for v in 0..count {
            starts[v + 1] += starts[v];
        }
        let mut next = starts.clone();
        let mut opposite = vec![[0; 2]; starts[count] as usize];
        for [a, b, c] in counted() {
            for (v, others) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
                opposite[next[v as usize] as usize] = others;
                next[v as usize] += 1;
            }
        }
        let mut rings = Self { starts, opposite, neighbours: Vec::new() };
        rings.neighbours = (0..count as u32)
            .map(|v| {
                let mut ring: Vec<u32> = rings.fan(v).iter().flatten().copied().collect();
                ring.sort_unstable();
                ring.dedup();
                ring
            })
            .collect();
        rings
    }

    fn fan(&self, v: u32) -> &[[u32; 2]] {
        &self.opposite[self.starts[v as usize] as usize..self.starts[v as usize + 1] as usize]
    }

    fn neighbours(&self, v: u32) -> &[u32] {
        &self.neighbours[v as usize]
    }

    /// A closed fan has as many neighbours as triangles.
    fn is_rim(&self, v: u32) -> bool {
        self.neighbours(v).len() != self.fan(v).len()
    }

    /// The unit normal of the polygon of neighbours, whatever the height of the vertex within it. Neighbours farther than
    /// `limit` from their `median` are spikes themselves and count as if they stood there.
    fn normal(
        &self,
        v: u32,
        positions: &[Point3<f64>],
        median: &Point3<f64>,
        limit: f64,
    ) -> Option<Vector3<f64>> {
        let from_median = |n: u32| {
            let away = positions[n as usize] - median;
            if away.norm() > limit { Vector3::zeros() } else { away }
        };
        let edge = |[a, b]: &[u32; 2]| from_median(*a).cross(&from_median(*b));
        self.fan(v).iter().map(edge).sum::<Vector3<f64>>().try_normalize(1e-12)
    }
}

fn median_of(ring: &[u32], positions: &[Point3<f64>]) -> Point3<f64> {
    Point3::from(Vector3::from_fn(|axis, _| {
        middle(&mut ring.iter().map(|v| positions[*v as usize][axis]).collect::<Vec<_>>())
    }))
}

/// The median; the mean of the middle two where there are two. Of nothing 0.
fn middle(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let half = values.len() / 2;
    match (values.len() % 2, values.get(half)) {
        (_, None) => 0.0,
        (1, Some(value)) => *value,
        (_, Some(value)) => f64::midpoint(values[half - 1], *value),
    }
}
