//! What is behind the lips: a cavity that hangs from their rims, teeth in the skull and in the jaw, a tongue.
//!
//! All sizes are shares of the mouth's width. Simple shapes, since little light gets there.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

use nalgebra::{Point3, Vector3};

use super::{lip_line::LipLine, part::PartMesh};

/// Depth of the cavity.
const DEPTH: f64 = 0.95;
/// Its rows, from the rim (0) to the throat (1).
const CAVITY_ROWS: [f64; 7] = [0.0, 0.05, 0.13, 0.26, 0.45, 0.7, 1.0];
/// Points of each rim from which it hangs.
const RING: usize = 29;
/// Half its height and how much wider than the rim it gets.
const CAVITY_HEIGHT: f64 = 0.30;
const CAVITY_WIDENING: f64 = 0.25;
/// Half the width of the arches of teeth, and how far behind the lips' line their front stands.
const ARCH: f64 = 0.42;
const BEHIND_LIPS: f64 = 0.10;
/// The lower arch stands farther back and is narrower.
const OVERJET: f64 = 0.045;
/// Widths of the teeth from the middle outwards, relative to each other.
pub(super) const UPPER_TEETH: [f64; 6] = [8.5, 6.7, 7.6, 7.0, 6.8, 9.0];
pub(super) const LOWER_TEETH: [f64; 6] = [5.4, 5.9, 6.8, 7.0, 7.1, 10.0];
/// Columns of vertices in each tooth.
const TOOTH_COLUMNS: usize = 6;
/// Heights over the lips' line: the gum's far edge, the neck of the teeth, their edge.
const UPPER_HEIGHTS: [f64; 3] = [0.26, 0.135, -0.035];
const LOWER_HEIGHTS: [f64; 3] = [-0.30, -0.185, -0.035];
/// Thickness of the teeth at their neck.
const THICKNESS: f64 = 0.09;
/// The tongue's half axes, and its middle from the line's.
const TONGUE: [f64; 3] = [0.30, 0.085, 0.40];
const TONGUE_PLACE: [f64; 3] = [0.0, -0.185, -0.64];

/// Bands of the picture that all of them share, from the top, in shares of its height.
pub(super) const CAVITY_BAND: [f64; 2] = [0.0, 0.25];
pub(super) const UPPER_BAND: [f64; 2] = [0.25, 0.5];
pub(super) const LOWER_BAND: [f64; 2] = [0.5, 0.75];
pub(super) const TONGUE_BAND: [f64; 2] = [0.75, 1.0];

/// Texture coordinates of the cavity halfway to the throat.
pub(super) const DEEP: [f32; 2] = [0.5, 0.90];

/// A vertex of the cavity hangs on the lips and on the bone above or below.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Hanging {
    /// Which of the ring's points it moves with.
    pub ring: usize,
    /// How much it moves as that does, 0..=1.
    pub with_ring: f64,
    /// How much as the jaw.
    pub with_jaw: f64,
}

/// A point of the ring around the opening from which the cavity hangs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RingPoint {
    /// Where it rests.
    pub place: Point3<f64>,
    /// 0 on the upper lip, 1 on the lower one.
    pub side: f32,
}

/// The mouth from the inside, in the axes of the face.
#[derive(Debug, Clone)]
pub struct Interior {
    /// The bag between lips and throat; its inside faces the viewer.
    pub cavity: PartMesh,
    /// The ring it hangs from.
    pub ring: Vec<RingPoint>,
    /// What each of its vertices hangs on.
    pub hanging: Vec<Hanging>,
    /// Fixed to the skull.
    pub upper_teeth: PartMesh,
    /// Fixed to the jaw.
    pub lower_teeth: PartMesh,
    /// Rests on the jaw.
    pub tongue: PartMesh,
}

impl Interior {
    /// `upper` and `lower` are the rims of the lips from the subject's right to the left, `mouth` the mouth's width in
    /// millimetres, all in the axes of the face.
    pub fn new(line: &LipLine, upper: &[Point3<f64>], lower: &[Point3<f64>], mouth: f64) -> Self {
        let arch = Arch::new(line, upper, mouth);
        let (above, below) = (evenly(upper), evenly(lower));
        let ring = ring(&above, &below);
        let (cavity, hanging) = cavity(&ring, above.len(), mouth);
        Self {
            cavity,
            ring,
            hanging,
            upper_teeth: teeth(&arch, &UPPER_TEETH, UPPER_HEIGHTS, 0.0, 1.0, UPPER_BAND),
            lower_teeth: teeth(&arch, &LOWER_TEETH, LOWER_HEIGHTS, OVERJET, 0.93, LOWER_BAND),
            tongue: tongue(&arch),
        }
    }
}

/// A few points along a rim: the cavity needs fewer than the skin.
fn evenly(rim: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let mut lengths = vec![0.0];
    for pair in rim.windows(2) {
        lengths.push(lengths[lengths.len() - 1] + (pair[1] - pair[0]).norm());
    }
    let total = lengths[lengths.len() - 1];
    (0..RING)
        .map(|i| {
            let wanted = total * i as f64 / (RING - 1) as f64;
            let right = lengths.partition_point(|l| *l < wanted).clamp(1, rim.len() - 1);
            let (a, b) = (lengths[right - 1], lengths[right]);
            let t = if b > a { (wanted - a) / (b - a) } else { 0.0 };
            rim[right - 1] + (rim[right] - rim[right - 1]) * t
        })
        .collect()
}

/// Round the rims: above from the subject's right to the left, back below, and closed.
fn ring(upper: &[Point3<f64>], lower: &[Point3<f64>]) -> Vec<RingPoint> {
    let last = upper.len().saturating_sub(1);
    let above = upper.iter().enumerate().map(|(i, &place)| {
        // At the corners the lips are one.
        RingPoint { place, side: if i == 0 || i == last { 0.5 } else { 0.0 } }
    });
    let below = lower.iter().rev().skip(1).take(lower.len().saturating_sub(2));
    let below = below.map(|&place| RingPoint { place, side: 1.0 });
    let ring: Vec<RingPoint> = above.chain(below).collect();
    let first = ring.first().copied();
    ring.into_iter().chain(first).collect()
}

/// The parabola of the teeth behind the lips' line.
struct Arch {
    /// Middle of the lips' line.
    origin: Point3<f64>,
    /// To the subject's left, and up, in the plane of the face.
    along: Vector3<f64>,
    up: Vector3<f64>,
    /// z = origin.z + bend · x².
    bend: f64,
    mouth: f64,
}

impl Arch {
    fn new(line: &LipLine, rim: &[Point3<f64>], mouth: f64) -> Self {
        let middle = 0.5 * (line.corners[0] + line.corners[1]);
        let place = line.place(middle);
        // Least squares of z over x² about the middle, on the inner three quarters of the rim.
        let reach = 0.38 * (line.corners[1] - line.corners[0]);
        let (mut n, mut sx, mut sz, mut sxx, mut sxz) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for p in rim {
            let x = line.along(p) - middle;
            if x.abs() < reach {
                let q = x * x;
                n += 1.0;
                sx += q;
                sz += p.z;
                sxx += q * q;
                sxz += q * p.z;
            }
        }
        let denominator: f64 = n * sxx - sx * sx;
        let bend = if denominator.abs() > 1e-9 { (n * sxz - sx * sz) / denominator } else { 0.0 };
        // Between flat and a half circle of the arch's width.
        let bend = bend.clamp(-1.6 / mouth, -0.5 / mouth);
        let z = if n > 0.0 { (sz - bend * sx) / n } else { rim.first().map_or(0.0, |p| p.z) };
        let up = line.up();
        Self {
            origin: Point3::new(place.x, place.y, z),
            along: Vector3::new(up.y, -up.x, 0.0),
            up: Vector3::new(up.x, up.y, 0.0),
            bend,
            mouth,
        }
    }

    /// A place given along and above the lips' line and before the arch, millimetres.
    fn at(&self, x: f64, y: f64, before: f64) -> Point3<f64> {
        self.origin + self.along * x + self.up * y + Vector3::z() * (self.bend * x * x + before)
    }

    /// Outwards from the arch in its own plane.
    fn outwards(&self, x: f64) -> Vector3<f64> {
        let slope = 2.0 * self.bend * x;
        (self.along * -slope + Vector3::z()).normalize()
    }

    /// Along-coordinates at even shares of the arc from −half to half.
    fn evenly(&self, half: f64, shares: &[f64]) -> Vec<f64> {
        const STEPS: usize = 400;
        let mut lengths = vec![0.0];
        let x_at = |i: usize| (i as f64 / STEPS as f64 * 2.0 - 1.0) * half;
        for i in 0..STEPS {
            let (a, b) = (x_at(i), x_at(i + 1));
            let rise = self.bend * (b * b - a * a);
            lengths.push(lengths[i] + (b - a).hypot(rise));
        }
        let total = lengths[STEPS];
        shares
            .iter()
            .map(|share| {
                let right = lengths.partition_point(|l| *l < share * total).clamp(1, STEPS);
                let (a, b) = (lengths[right - 1], lengths[right]);
                let t = if b > a { (share * total - a) / (b - a) } else { 0.0 };
                x_at(right - 1) + (x_at(right) - x_at(right - 1)) * t
            })
            .collect()
    }
}

/// `above` points of the ring lie on the upper lip.
fn cavity(ring: &[RingPoint], above: usize, mouth: f64) -> (PartMesh, Vec<Hanging>) {
    let middle = ring.iter().map(|r| r.place.coords).sum::<Vector3<f64>>() / ring.len().max(1) as f64;
    let (mut rows, mut hanging) = (Vec::new(), Vec::new());
    for t in CAVITY_ROWS {
        let mut row = Vec::new();
        for (i, &RingPoint { place: p, side }) in ring.iter().enumerate() {
            let around = i as f64 / (ring.len() - 1).max(1) as f64;
            // Less height towards the corners: there the rims meet.
            let (start, count) = if i < above { (0, above) } else { (above, ring.len() - above) };
            let across = (i - start) as f64 / (count - 1).max(1) as f64;
            let off_corner = (2.0 * across).min(2.0 - 2.0 * across).clamp(0.0, 1.0).sqrt();
            let bulge = (PI * (0.9 * t).min(1.0)).sin();
            let upwards = 1.0 - 2.0 * f64::from(side);
            let height = upwards * CAVITY_HEIGHT * mouth * bulge * off_corner;
            let narrow = (1.0 + CAVITY_WIDENING * (PI * t).sin()) * (1.0 - 0.6 * t * t);
            let x = middle.x + (p.x - middle.x) * narrow;
            let y = p.y + (middle.y - p.y) * t.powi(3) + height;
            let z = p.z - DEPTH * mouth * t;
            let with_ring = (1.0 - t / 0.45).clamp(0.0, 1.0);
            let with_jaw = f64::from(side) * (1.0 - with_ring) * (1.0 - 0.5 * t);
            hanging.push(Hanging { ring: i, with_ring, with_jaw });
            row.push((Point3::new(x, y, z), texture_place(CAVITY_BAND, around, t)));
        }
        rows.push(row);
    }
    // The throat is closed.
    let end = Point3::new(middle.x, middle.y, middle.z - DEPTH * mouth);
    rows.push(rows[CAVITY_ROWS.len() - 1].iter().map(|&(_, uv)| (end, uv)).collect());
    hanging.extend((0..ring.len()).map(|i| Hanging { ring: i, with_ring: 0.0, with_jaw: 0.25 }));
    let mut part = PartMesh::default();
    part.push_grid(&rows);
    (part, hanging)
}

/// One arch of teeth with its gum. `heights` run from the gum's far edge to the teeth's own; `back` is how far behind
/// the upper arch it stands, `narrow` its width over that one's.
fn teeth(
    arch: &Arch,
    widths: &[f64; 6],
    heights: [f64; 3],
    back: f64,
    narrow: f64,
    band: [f64; 2],
) -> PartMesh {
    let mouth = arch.mouth;
    let [gum, neck, edge] = heights.map(|h| h * mouth);
    let total: f64 = widths.iter().sum::<f64>() * 2.0;
    // Column by column: its share of the arc, where in its tooth it lies (−1..=1), which tooth from the middle.
    let mut columns = Vec::new();
    let mut start = 0.0;
    let order: Vec<usize> = (0..6).rev().chain(0..6).collect();
    for &tooth in &order {
        for k in 0..TOOTH_COLUMNS {
            let s = k as f64 / TOOTH_COLUMNS as f64;
            columns.push(((start + s * widths[tooth]) / total, 2.0 * s - 1.0, tooth));
        }
        start += widths[tooth];
    }
    columns.push((1.0, 1.0, 5));
    let places = arch.evenly(ARCH * mouth * narrow, &columns.iter().map(|c| c.0).collect::<Vec<_>>());
    // Rows: gum, neck, belly, towards the edge, edge, and up again behind it.
    let rows =
        [(0.0, 0.0), (0.5, 0.35), (1.0, 0.6), (1.25, 0.9), (1.5, 1.0), (1.75, 0.85), (1.93, 0.5), (2.0, 0.1)];
    let behind = [(1.97, -0.25), (1.7, -0.7), (1.0, -1.0)];
    let mut grid = Vec::new();
    for (row, &(down, bulge)) in rows.iter().chain(&behind).enumerate() {
        let cells = columns
            .iter()
            .zip(&places)
            .map(|(&(share, in_tooth, tooth), &x)| {
                // Teeth get shorter to the sides, and their corners are round.
                let short = [0.0, 0.06, 0.0, 0.12, 0.16, 0.2][tooth];
                let corner = 0.10 * in_tooth.abs().powi(6);
                let edge = edge + (neck - edge) * (short + corner);
                let scallop = 0.12 * (neck - edge) * in_tooth * in_tooth;
                let neck = neck - scallop;
                let y =
                    if down < 1.0 { gum + (neck - gum) * down } else { neck + (edge - neck) * (down - 1.0) };
                let round = 1.0 - in_tooth.powi(4);
                let tooth_side = if row < 2 { 0.6 } else { 0.55 + 0.45 * round };
                let out =
                    if bulge >= 0.0 { 0.045 * mouth * bulge * tooth_side } else { THICKNESS * mouth * bulge };
                let p = arch.at(x, y, -(BEHIND_LIPS + back) * mouth) + arch.outwards(x) * out;
                let t = (row as f64 / (rows.len() + behind.len() - 1) as f64).min(1.0);
                (p, texture_place(band, share, t))
            })
            .collect();
        grid.push(cells);
    }
    let mut part = PartMesh::default();
    part.push_grid(&grid);
    if heights[0] < heights[2] {
        // Rows go up instead of down: the other side is outside.
        for triangle in &mut part.triangles {
            triangle.swap(1, 2);
        }
    }
    part
}

/// A flat dome with a groove along its middle.
fn tongue(arch: &Arch) -> PartMesh {
    const ROWS: usize = 14;
    const COLUMNS: usize = 17;
    let mouth = arch.mouth;
    let [x, y, z] = TONGUE_PLACE.map(|c| c * mouth);
    let centre = arch.at(x, y, z);
    let [width, height, length] = TONGUE.map(|c| c * mouth);
    let grid: Vec<Vec<_>> = (0..ROWS)
        .map(|row| {
            // From the throat over the tip and under it.
            let down = row as f64 / (ROWS - 1) as f64;
            let angle = PI * (0.84 - down);
            (0..COLUMNS)
                .map(|column| {
                    let across = column as f64 / (COLUMNS - 1) as f64;
                    let side = (PI * (across - 0.5)).sin();
                    let round = (1.0 - side * side).max(0.0).powf(0.4);
                    let groove = 0.16 * height * (-(side / 0.14).powi(2)).exp();
                    let p = centre
                        + arch.along * (width * side * (1.0 - 0.25 * down))
                        + arch.up * (height * round * angle.sin() - groove)
                        + Vector3::z() * (length * angle.cos() * round.max(0.2));
                    (p, texture_place(TONGUE_BAND, across, down))
                })
                .collect()
        })
        .collect();
    let mut part = PartMesh::default();
    part.push_grid(&grid);
    part
}

/// A texture coordinate in a band, kept off its borders so that bands do not run into each other from afar.
fn texture_place(band: [f64; 2], across: f64, down: f64) -> [f32; 2] {
    let margin = 0.06 * (band[1] - band[0]);
    let v = band[0] + margin + (band[1] - band[0] - 2.0 * margin) * down.clamp(0.0, 1.0);
    [(0.02 + 0.96 * across) as f32, (1.0 - v) as f32]
}
