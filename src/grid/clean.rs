//! What of a scan is the face: background, other parts and spikes taken away.

use nalgebra::Point3;

use super::{spikes, weld};

/// How far behind the tip of the nose the face still reaches, in outer canthal distances: past the ears.
const BEHIND: f64 = 1.6;
/// How far before the tip of the nose.
const BEFORE: f64 = 0.3;

/// A box around the face in its own axes (x to the subject's left, y up, z out of the face), millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaceBox {
    /// Least coordinates.
    pub low: Point3<f64>,
    /// Greatest coordinates.
    pub high: Point3<f64>,
}

impl FaceBox {
    /// Around `landmarks` with `margin` millimetres to the sides. In depth it reaches from 0.3 of the outer canthal
    /// distance `eyes` before the foremost landmark, which is the tip of the nose, to 1.6 of it behind. `None` without
    /// landmarks.
    pub fn around(landmarks: &[Point3<f64>], eyes: f64, margin: f64) -> Option<Self> {
        let first = *landmarks.first()?;
        let (mut low, mut high) =
            landmarks.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
        let nose = high.z;
        for axis in 0..2 {
            low[axis] -= margin;
            high[axis] += margin;
        }
        (low.z, high.z) = (nose - BEHIND * eyes, nose + BEFORE * eyes);
        Some(Self { low, high })
    }

    /// Whether a point lies inside, by depth alone.
    fn holds_depth(&self, p: &Point3<f64>) -> bool {
        (self.low.z..=self.high.z).contains(&p.z)
    }

    /// Whether some of a triangle may be seen inside.
    fn may_hold(&self, corners: &[Point3<f64>; 3]) -> bool {
        let [a, b, c] = corners;
        let (low, high) = (a.inf(b).inf(c), a.sup(b).sup(c));
        (0..2).all(|axis| high[axis] >= self.low[axis] && low[axis] <= self.high[axis])
    }
}

/// A cleaned scan: which of its triangles are the face, and how many things were taken away.
#[derive(Debug, Clone, PartialEq)]
pub struct Cleaned {
    /// V places, spikes drawn back; the rest as they were.
    pub positions: Vec<Point3<f64>>,
    /// T: whether a triangle is of the face.
    pub kept: Vec<bool>,
    /// Parts of the scan on which no landmark lies.
    pub other_parts: usize,
    /// Triangles of the face's own parts too far before or behind it.
    pub far_triangles: usize,
    /// Points inside the surface that were set to the median of their neighbours.
    pub spikes_drawn_back: usize,
    /// Points on a rim whose triangles were dropped.
    pub spikes_removed: usize,
}

impl Cleaned {
    /// Numbers and corners of the face's triangles.
    pub fn triangles<'a>(&'a self, all: &'a [[u32; 3]]) -> impl Iterator<Item = (u32, [u32; 3])> + 'a {
        (0..)
            .zip(all)
            .zip(&self.kept)
            .filter(|(_, kept)| **kept)
            .map(|((number, corners), _)| (number, *corners))
    }
}

/// Takes from a scan whatever is not the face.
///
/// `positions` (V × 3) are in the face's own axes and millimetres, `triangles` T × 3. `seeds` are triangles on which the
/// landmarks lie: the parts that have none are dropped. Then whatever lies outside `face`, and spikes. Holes stay holes.
pub fn clean(positions: Vec<Point3<f64>>, triangles: &[[u32; 3]], seeds: &[u32], face: &FaceBox) -> Cleaned {
    let welded = weld::welded(&positions);
    let parts = weld::parts(triangles, &welded);
    let sorted = |mut numbers: Vec<u32>| {
        numbers.sort_unstable();
        numbers.dedup();
        numbers
    };
    let wanted = sorted(seeds.iter().filter_map(|seed| parts.get(*seed as usize).copied()).collect());
    let other_parts = sorted(parts.clone()).len() - wanted.len();
    let mut kept: Vec<bool> = parts.iter().map(|part| wanted.binary_search(part).is_ok()).collect();

    let mut positions = positions;
    // Spikes are judged before the rest goes, since a cut makes rims. What is nowhere near the face is not looked at.
    let near: Vec<bool> = triangles
        .iter()
        .zip(&kept)
        .map(|(t, kept)| *kept && face.may_hold(&t.map(|v| positions[v as usize])))
        .collect();
    let spikes = spikes::draw_back(&mut positions, triangles, &near, &welded);
    let mut far_triangles = 0;
    for ((keep, near), corners) in kept.iter_mut().zip(near).zip(triangles) {
        if *keep && near {
            let inside = corners.iter().all(|v| face.holds_depth(&positions[*v as usize]));
            far_triangles += usize::from(!inside);
            *keep =
                inside && corners.iter().all(|v| spikes.removed.binary_search(&welded[*v as usize]).is_err());
        } else {
            *keep = false;
        }
    }
    Cleaned {
        positions,
        kept,
        other_parts,
        far_triangles,
        spikes_drawn_back: spikes.drawn_back,
        spikes_removed: spikes.removed.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: u32 = 41;

    /// A dome of 41 × 41 points 2.5 mm apart, with a wall far behind it and a speck before it.
    fn scene() -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let mut positions = Vec::new();
        let mut triangles = Vec::new();
        for (z, bulge) in [(0.0, 30.0), (-400.0, 0.0)] {
            let first = positions.len() as u32;
            for row in 0..SIDE {
                for column in 0..SIDE {
                    let (x, y) = (f64::from(column) * 2.5 - 50.0, f64::from(row) * 2.5 - 50.0);
                    positions.push(Point3::new(x, y, z - (x * x + y * y) / 5000.0 * bulge));
                    if row > 0 && column > 0 {
                        let at = first + row * SIDE + column;
                        triangles.extend([[at, at - 1, at - SIDE - 1], [at, at - SIDE - 1, at - SIDE]]);
                    }
                }
            }
        }
        let first = positions.len() as u32;
        positions.extend([[0.0, 0.0, 20.0], [1.0, 0.0, 20.0], [0.0, 1.0, 20.0]].map(Point3::from));
        triangles.push([first, first + 1, first + 2]);
        (positions, triangles)
    }

    fn face() -> FaceBox {
        let landmarks = [[-45.0, -45.0, -20.0], [45.0, 45.0, 0.0]].map(Point3::from);
        FaceBox::around(&landmarks, 90.0, 5.0).unwrap()
    }

    #[test]
    fn other_parts_go_and_a_clean_surface_stays() {
        let (positions, triangles) = scene();
        let cleaned = clean(positions.clone(), &triangles, &[5, 900], &face());
        assert_eq!((cleaned.other_parts, cleaned.far_triangles), (2, 0));
        assert_eq!((cleaned.spikes_drawn_back, cleaned.spikes_removed), (0, 0));
        assert_eq!(cleaned.positions, positions);
        assert_eq!(cleaned.triangles(&triangles).count(), 40 * 40 * 2);
        // The wall, when a landmark lies on it, is too far away all the same.
        let wall = 40 * 40 * 2 + 3;
        let cleaned = clean(positions, &triangles, &[5, wall], &face());
        assert_eq!((cleaned.other_parts, cleaned.far_triangles), (1, 40 * 40 * 2));
        assert!(!cleaned.kept[wall as usize]);
    }

    #[test]
    fn spikes_are_drawn_back_and_on_the_rim_removed() {
        let (clean_positions, triangles) = scene();
        let mut positions = clean_positions.clone();
        let at = |row: u32, column: u32| (row * SIDE + column) as usize;
        for (vertex, height) in
            [(at(20, 20), 15.0), (at(10, 30), -12.0), (at(30, 8), 18.0), (at(30, 9), 17.0)]
        {
            positions[vertex].z += height;
        }
        positions[at(0, 12)].z += 40.0;
        let cleaned = clean(positions, &triangles, &[5], &face());
        assert_eq!((cleaned.spikes_drawn_back, cleaned.spikes_removed), (4, 1));
        for (row, column) in [(20, 20), (10, 30), (30, 8), (30, 9)] {
            let off = (cleaned.positions[at(row, column)] - clean_positions[at(row, column)]).norm();
            assert!(off < 1.0, "{row} {column}: {off}");
        }
        assert!(cleaned.triangles(&triangles).all(|(_, t)| !t.contains(&12)));
    }
}
