//! Ways along the edges of a mesh.

use std::collections::{BTreeMap, BinaryHeap};

use super::edit::EditMesh;

/// Lowest prices from some places to all that can be reached along the edges of a patch.
pub struct Distances {
    best: BTreeMap<u32, (f64, Option<u32>)>,
}

impl Distances {
    /// Dijkstra's algorithm; ties go to the lower number.
    pub fn from(
        mesh: &EditMesh,
        patch: &[u32],
        starts: &[u32],
        price: impl Fn(u32, u32) -> Option<f64>,
    ) -> Self {
        let mut ways: BTreeMap<u32, Vec<(u32, f64)>> = BTreeMap::new();
        for (a, b) in mesh.edges(patch).into_keys() {
            if let Some(cost) = price(a, b).filter(|cost| cost.is_finite()) {
                ways.entry(a).or_default().push((b, cost));
                ways.entry(b).or_default().push((a, cost));
            }
        }
        let mut best: BTreeMap<u32, (f64, Option<u32>)> = BTreeMap::new();
        // Prices are not negative, so their bits are ordered as they are; the heap gives the largest first.
        let mut heap = BinaryHeap::new();
        for &start in starts {
            best.insert(start, (0.0, None));
            heap.push(std::cmp::Reverse((0_u64, start)));
        }
        while let Some(std::cmp::Reverse((bits, place))) = heap.pop() {
            let so_far = f64::from_bits(bits);
            if best.get(&place).is_none_or(|known| so_far > known.0) {
                continue;
            }
            for &(next, cost) in ways.get(&place).into_iter().flatten() {
                let total = so_far + cost;
                if best.get(&next).is_none_or(|known| total < known.0) {
                    best.insert(next, (total, Some(place)));
                    heap.push(std::cmp::Reverse((total.to_bits(), next)));
                }
            }
        }
        Self { best }
    }

    /// The price of a place; infinite where no way leads.
    pub fn to(&self, place: u32) -> f64 {
        self.best.get(&place).map_or(f64::INFINITY, |known| known.0)
    }

    /// The places on the way, first to last, and its price.
    pub fn way_to(&self, end: u32) -> Option<(Vec<u32>, f64)> {
        let total = self.best.get(&end)?.0;
        let mut way = vec![end];
        while let Some(previous) = self.best[&way[way.len() - 1]].1 {
            way.push(previous);
        }
        way.reverse();
        Some((way, total))
    }
}
