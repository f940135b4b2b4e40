//! Vertices in one place as one, and the parts into which a mesh falls.

use nalgebra::Point3;

/// For each vertex the first one in the same place: files split vertices along the seams of their textures.
pub(super) fn welded(positions: &[Point3<f64>]) -> Vec<u32> {
    let bits = |v: u32| positions[v as usize].coords.map(|c| (c + 0.0).to_bits());
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by_key(|v| (bits(*v).x, bits(*v).y, bits(*v).z, *v));
    let mut first = vec![0; positions.len()];
    let mut current = None;
    for v in order {
        let of = current.filter(|of| bits(*of) == bits(v)).unwrap_or(v);
        current = Some(of);
        first[v as usize] = of;
    }
    first
}

/// For each triangle the number of the part that it belongs to: the least of the part's vertices.
pub(super) fn parts(triangles: &[[u32; 3]], welded: &[u32]) -> Vec<u32> {
    let mut above: Vec<u32> = (0..welded.len() as u32).collect();
    let least = |above: &mut Vec<u32>, mut v: u32| {
        while above[v as usize] != v {
            above[v as usize] = above[above[v as usize] as usize];
            v = above[v as usize];
        }
        v
    };
    for corners in triangles {
        let [a, b, c] = corners.map(|v| welded[v as usize]);
        for other in [b, c] {
            let (a, b) = (least(&mut above, a), least(&mut above, other));
            above[a.max(b) as usize] = a.min(b);
        }
    }
    triangles.iter().map(|t| least(&mut above, welded[t[0] as usize])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seams_hold_together_and_islands_do_not() {
        let p = |x: f64| Point3::new(x, 0.0, 0.0);
        let positions = [p(0.0), p(1.0), p(2.0), p(2.0), p(3.0), p(-0.0), p(9.0), p(8.0), p(7.0)];
        let welded = welded(&positions);
        assert_eq!(welded, [0, 1, 2, 2, 4, 0, 6, 7, 8]);
        assert_eq!(parts(&[[0, 1, 2], [3, 4, 5], [6, 7, 8]], &welded), [0, 0, 6]);
    }
}
