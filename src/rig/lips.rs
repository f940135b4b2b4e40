//! The lips' rims: how far they part is what the source's part, wherever the rest of the face goes.

use nalgebra::{Point3, Vector3};

use super::{SourceFace, TargetFace, Transfer};
use crate::anatomy::{INNER_CORNERS, LOWER_INNER, Mouth, OUTER_CORNERS, UPPER_INNER};

/// Stations: the right inner corner, nine pairs, the left inner corner.
const STATIONS: usize = UPPER_INNER.len() + 2;
/// The pair next to the left corner.
const LAST: usize = UPPER_INNER.len() - 1;
/// A performer whose lips are shut shows at most this gap, outer canthal distances; the network never sees none.
const SHUT: f64 = 0.035;
/// This much more than the neutral's widest gap still counts as closed, as a factor and in outer canthal distances.
const SLACK: f64 = 1.1;
const NOISE: f64 = 0.002;
/// Over this gap the lips' differences across it come in, millimetres.
const UNSTUCK: f64 = 2.0;

/// Drives pairs of controls on the rims.
#[derive(Debug, Clone)]
pub struct LipDrive {
    nodes: Vec<Node>,
    /// Unit vectors across the lips: the source's scan frame and the target's.
    up_source: Vector3<f64>,
    up_target: Vector3<f64>,
    /// Target's mouth width over the source's.
    ratio: f64,
    /// The source's positions of the pairs, neutral.
    pairs: [[Point3<f64>; 2]; UPPER_INNER.len()],
    /// The source's gaps that count as closed, millimetres.
    closed: [f64; UPPER_INNER.len()],
    /// Whether the source's displacements are made up of actions, and not seen together.
    added_up: bool,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    station: usize,
    share: f64,
    /// Gap at rest, millimetres.
    rest: f64,
}

/// What a station wants: the two lips' displacements and their gap.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wish {
    upper: Vector3<f64>,
    lower: Vector3<f64>,
    gap: f64,
}

impl LipDrive {
    /// For one source and one target's mouth.
    pub fn new(source: &SourceFace, target: &TargetFace, mouth: &Mouth) -> Self {
        let neutral = &source.points;
        // Upwards in the picture, on both: what the two faces' own axes call up may differ by their tilt.
        let up_source = source.level.inverse() * Vector3::y();
        let up_target = target.level.inverse() * Vector3::y();
        let pairs = std::array::from_fn(|k| [neutral[UPPER_INNER[k]], neutral[LOWER_INNER[k]]]);
        let [most, noise] = [SHUT, NOISE].map(|share| share * source.outer_canthal_distance());
        let closed = source.closed_lips.map(|gap| (gap * SLACK + noise).clamp(0.0, most));
        let width = (neutral[OUTER_CORNERS[0]] - neutral[OUTER_CORNERS[1]]).norm();
        let nodes = mouth
            .nodes
            .iter()
            .map(|node| Node {
                station: node.station,
                share: node.share,
                rest: (node.rest[0] - node.rest[1]).dot(&up_target),
            })
            .collect();
        Self {
            nodes,
            up_source,
            up_target,
            ratio: target.distance(OUTER_CORNERS[0], OUTER_CORNERS[1]) / width.max(f64::MIN_POSITIVE),
            pairs,
            closed,
            added_up: source.has_depth,
        }
    }

    /// Upwards in the picture, which is the direction of gaps: a unit vector in the target's scan frame.
    pub fn up(&self) -> Vector3<f64> {
        self.up_target
    }

    /// The gap that a pair of the source's inner lips asks of the target, millimetres, when its landmarks are displaced by
    /// `vectors`.
    pub fn wanted_gap(&self, pair: usize, vectors: &[Vector3<f64>]) -> f64 {
        let gap = |pair: usize| {
            let [u, l] = self.pairs[pair];
            let upper = u + vectors[UPPER_INNER[pair]];
            let lower = l + vectors[LOWER_INNER[pair]];
            self.ratio * parted((upper - lower).dot(&self.up_source), self.closed[pair])
        };
        // Added up, what actions do to the corners may part them where the middle is shut; lips part like a lens.
        match pair {
            0 if self.added_up => gap(0).min(gap(1)),
            LAST if self.added_up => gap(LAST).min(gap(LAST - 1)),
            _ => gap(pair),
        }
    }

    /// What the stations want in one frame.
    pub(super) fn wishes(&self, transfer: &Transfer, vectors: &[Vector3<f64>]) -> [Wish; STATIONS] {
        let moved = |landmark: usize| transfer.vector(landmark, &vectors[landmark]);
        let corner = |landmark: usize| Wish { upper: moved(landmark), lower: moved(landmark), gap: 0.0 };
        std::array::from_fn(|station| match station.checked_sub(1) {
            None => corner(INNER_CORNERS[0]),
            Some(pair) if pair < UPPER_INNER.len() => Wish {
                upper: moved(UPPER_INNER[pair]),
                lower: moved(LOWER_INNER[pair]),
                gap: self.wanted_gap(pair, vectors),
            },
            Some(_) => corner(INNER_CORNERS[1]),
        })
    }

    /// Displacements of a node on the upper and the lower rim, target's scan frame, millimetres.
    pub(super) fn rims(&self, node: usize, wishes: &[Wish; STATIONS]) -> [Vector3<f64>; 2] {
        let node = &self.nodes[node];
        let a = &wishes[node.station];
        let b = &wishes[(node.station + 1).min(STATIONS - 1)];
        let mix = |p: Vector3<f64>, q: Vector3<f64>| p + (q - p) * node.share;
        let (upper, lower) = (mix(a.upper, b.upper), mix(a.lower, b.lower));
        let gap = opening(a.gap, b.gap, node);
        let middle = (upper + lower) / 2.0;
        let apart = upper - lower;
        let aside = apart - self.up_target * apart.dot(&self.up_target);
        let half = (self.up_target * (gap - node.rest) + aside * unstuck(gap)) / 2.0;
        [middle + half, middle - half]
    }

    /// How far the lips have come apart at a node: 0 while they touch and must go the same way, 1 once each goes its own.
    pub(super) fn freedom(&self, node: usize, wishes: &[Wish; STATIONS]) -> f64 {
        let node = &self.nodes[node];
        let next = (node.station + 1).min(STATIONS - 1);
        unstuck(opening(wishes[node.station].gap, wishes[next].gap, node))
    }
}

fn unstuck(gap: f64) -> f64 {
    (gap / UNSTUCK).clamp(0.0, 1.0)
}

/// The gap between two stations: linear, but round towards the corners, where lips part like a lens.
fn opening(from: f64, to: f64, node: &Node) -> f64 {
    let t = node.share;
    if node.station == 0 {
        to * (t * (2.0 - t)).sqrt()
    } else if node.station + 2 == STATIONS {
        from * (1.0 - t * t).sqrt()
    } else {
        from + (to - from) * t
    }
}

/// A gap without what closed lips show of one: none up to `closed`, itself once it is several times as wide.
fn parted(gap: f64, closed: f64) -> f64 {
    let over = gap - closed;
    if over <= 0.0 {
        return 0.0;
    }
    gap - closed * (-over / (2.0 * closed.max(1e-9))).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_opens_without_a_step_and_ends_as_itself() {
        assert!(parted(0.4, 0.5).abs() < 1e-12 && parted(0.5, 0.5).abs() < 1e-12);
        let mut last = 0.0;
        for i in 0..400 {
            let gap = parted(0.05 * f64::from(i), 0.5);
            assert!(gap >= last && gap - last < 0.1);
            last = gap;
        }
        assert!((parted(15.0, 0.5) - 15.0).abs() < 1e-5);
        assert!((parted(3.0, 0.0) - 3.0).abs() < 1e-12);
    }
}
