//! The lids as sheets of skin over the eyeball.
//!
//! Around the axis through the eye's corners every place has an angle and a distance. Closing turns the upper rim down
//! and the lower rim a little up until both lie on one line, no nearer to the axis than the ball; skin between rim and
//! brow follows less and less, so the lid's texture is that of the fold above it. The ball and its iris stay.

use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Vector3};

use super::{
    distances::Distances,
    edit::EditMesh,
    eye_hole::EyeHole,
    eyeball::{Eyeball, smooth},
    regions::EyeLandmarks,
};

/// How much of the way the lower lid comes up.
const LOWER_SHARE: f64 = 0.15;
/// Thickness of a lid over the ball, eye widths.
const THICKNESS: f64 = 0.02;
/// Near the corners lids do not lie on the ball but on what is there; over this share of the eye the one gives way to
/// the other.
const CORNER: f64 = 0.2;
/// How far the upper lid overlaps the lower one when shut, eye widths: hides the line between two polygons.
const OVERLAP: f64 = 0.008;
/// The lower lid reaches this far down over the skin, eye widths; so does the upper one where no brow is known.
const REACH: f64 = 0.30;
/// The upper one reaches this share of the straight way to the brow's lower edge.
const TO_BROW: f64 = 1.0;
/// So far beyond the opening, in radians, skin that comes down no longer lies on the ball.
const BEYOND_OPENING: f64 = 0.4;
/// Rounds in which a place takes over the mean of its neighbours: ways along edges zigzag.
const SMOOTHING: usize = 12;
/// Skin farther from the axis than this is no lid, radii of the ball.
const FARTHEST: f64 = 2.2;
/// Closures for which the shape is worked out; between them it is interpolated. 0 is the scan's own.
pub const CLOSURES: [f64; 5] = [-0.35, 0.25, 0.5, 0.75, 1.0];

/// How the skin around one eye moves with its closure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LidShapes {
    /// The vertices that move, ascending.
    pub vertices: Vec<u32>,
    /// For each of [`CLOSURES`] the displacement of each of these vertices, in the axes of the face, millimetres.
    pub shapes: [Vec<Vector3<f64>>; CLOSURES.len()],
    /// Millimetres between the rims in the middle of the eye at rest.
    pub aperture: f64,
}

impl LidShapes {
    /// Lids that do not move.
    pub fn none() -> Self {
        Self { vertices: Vec::new(), shapes: Default::default(), aperture: 0.0 }
    }
}

/// How much of each of [`CLOSURES`]' shapes makes up a closure: linear between neighbours, and beyond the ends not at
/// all.
pub fn shares(closure: f64) -> [f64; CLOSURES.len()] {
    let closure = closure.clamp(CLOSURES[0], 1.0);
    let mut shares = [0.0; CLOSURES.len()];
    // The scan itself stands between the first and the second shape.
    let knots = [CLOSURES[0], 0.0, CLOSURES[1], CLOSURES[2], CLOSURES[3], CLOSURES[4]];
    for (i, pair) in knots.windows(2).enumerate() {
        if (pair[0]..=pair[1]).contains(&closure) {
            let t = (closure - pair[0]) / (pair[1] - pair[0]);
            for (knot, share) in [(i, 1.0 - t), (i + 1, t)] {
                match knot {
                    0 => shares[0] = share,
                    1 => {}
                    _ => shares[knot - 1] = share,
                }
            }
            break;
        }
    }
    shares
}

/// The polar coordinates of one eye.
struct Axis {
    centre: Point3<f64>,
    along: Vector3<f64>,
    up: Vector3<f64>,
    out: Vector3<f64>,
    radius: f64,
}

/// Along the axis, angle (0 straight ahead, positive up) and distance from it.
#[derive(Clone, Copy)]
struct Polar {
    along: f64,
    angle: f64,
    distance: f64,
}

impl Axis {
    fn of(ball: &Eyeball, hole: &EyeHole) -> Option<Self> {
        let along = (hole.corners[1] - hole.corners[0]).try_normalize(1e-9)?;
        // From the temple to the nose: to the subject's left on the right side of the face, to the right on the left.
        let up = (Vector3::y() - along * along.y).try_normalize(1e-9)?;
        let out = along.cross(&up);
        let out = if out.z < 0.0 { -out } else { out };
        Some(Self { centre: ball.centre, along, up, out, radius: ball.radius })
    }

    fn enter(&self, point: &Point3<f64>) -> Polar {
        let p = point - self.centre;
        let (up, out) = (p.dot(&self.up), p.dot(&self.out));
        Polar { along: p.dot(&self.along), angle: up.atan2(out), distance: up.hypot(out) }
    }

    fn leave(&self, p: &Polar) -> Point3<f64> {
        let (sin, cos) = p.angle.sin_cos();
        self.centre + self.along * p.along + (self.up * sin + self.out * cos) * p.distance
    }

    /// How far the ball's surface is from the axis.
    fn ball(&self, along: f64) -> f64 {
        (self.radius * self.radius - along * along).max(0.0).sqrt()
    }
}

/// A rim as a function of the place along the axis.
struct Rim(Vec<Polar>);

impl Rim {
    fn new(mut points: Vec<Polar>) -> Self {
        points.sort_by(|a, b| a.along.total_cmp(&b.along));
        Self(points)
    }

    /// Angle and distance, linear between points, constant beyond.
    fn at(&self, along: f64) -> Polar {
        let points = &self.0;
        let right = points.partition_point(|p| p.along < along).clamp(1, points.len() - 1);
        let (a, b) = (points[right - 1], points[right]);
        let width = b.along - a.along;
        let t = if width > 1e-12 { ((along - a.along) / width).clamp(0.0, 1.0) } else { 0.0 };
        Polar {
            along,
            angle: a.angle + (b.angle - a.angle) * t,
            distance: a.distance + (b.distance - a.distance) * t,
        }
    }
}

/// What lies at one place along the axis.
struct Section {
    upper: Polar,
    lower: Polar,
    /// Where both rims meet.
    meeting: Polar,
    /// 0 at the corners, 1 over the ball.
    over_ball: f64,
}

/// Works out the shapes. `landmarks` are in the axes of the face; `None` where the rim does not go round.
pub fn shape(
    edit: &EditMesh,
    hole: &EyeHole,
    ball: &Eyeball,
    landmarks: &[Option<Point3<f64>>],
    eye: &EyeLandmarks,
) -> Option<LidShapes> {
    let axis = Axis::of(ball, hole)?;
    let width = (hole.corners[0].xy() - hole.corners[1].xy()).norm();
    let corners = hole.corners.map(|corner| axis.enter(&corner));
    let (first, last) = (corners[0].along.min(corners[1].along), corners[0].along.max(corners[1].along));
    let (mut upper, mut lower) = (corners.to_vec(), corners.to_vec());
    let (mut upper_places, mut lower_places) = (Vec::new(), Vec::new());
    let inside = (first + 0.04 * width)..(last - 0.04 * width);
    for &place in &hole.rim {
        let p = axis.enter(edit.at(place));
        if inside.contains(&p.along) {
            let is_upper = is_upper(hole, edit.at(place));
            if is_upper { &mut upper } else { &mut lower }.push(p);
            if is_upper { &mut upper_places } else { &mut lower_places }.push(place);
        }
    }
    if upper.len() < 7 || lower.len() < 7 {
        return None;
    }
    let (upper, lower) = (Rim::new(upper), Rim::new(lower));
    let section = |along: f64| {
        let (u, l) = (upper.at(along), lower.at(along));
        let angle = l.angle + LOWER_SHARE * (u.angle - l.angle);
        let distance = f64::midpoint(u.distance, l.distance).max(axis.ball(along) + THICKNESS * width);
        let from_corner = (along - first).min(last - along) / (CORNER * (last - first));
        let over_ball = smooth(from_corner.clamp(0.0, 1.0));
        Section { upper: u, lower: l, meeting: Polar { along, angle, distance }, over_ball }
    };
    // How far the skin goes from the upper rim to the brow, at one place along the axis.
    let brow: Vec<Polar> = eye.brow.iter().filter_map(|&i| Some(axis.enter(&landmarks[i]?))).collect();
    let brow = (brow.len() > 1).then(|| Rim::new(brow));
    let height = |point: &Point3<f64>| {
        let along = axis.enter(point).along;
        let usual = REACH * width;
        brow.as_ref().map_or(usual, |brow| {
            let (from, to) = (axis.leave(&upper.at(along)), axis.leave(&brow.at(along)));
            (TO_BROW * (to - from).norm()).max(usual)
        })
    };
    let follow = Following::new(edit, hole, &upper_places, &lower_places, &height, width);
    let painted: BTreeSet<u32> = hole.painted.iter().copied().collect();
    let mut vertices = Vec::new();
    let mut shapes: [Vec<Vector3<f64>>; CLOSURES.len()] = Default::default();
    for (vertex, point) in (0_u32..).zip(&edit.mesh().positions) {
        let Some(&(is_upper, follow)) = follow.0.get(&edit.place(vertex)) else { continue };
        let p = axis.enter(point);
        let reached = p.along > first && p.along < last && p.distance < FARTHEST * ball.radius;
        if painted.contains(&vertex) || !reached || p.angle.abs() > 1.5 || follow <= 0.0 {
            continue;
        }
        let section = section(p.along);
        vertices.push(vertex);
        for (shape, closure) in shapes.iter_mut().zip(CLOSURES) {
            let moved = moved(&axis, &section, &p, is_upper, follow, closure, width);
            shape.push(axis.leave(&moved) - point);
        }
    }
    let middle = section(f64::midpoint(first, last));
    let aperture = (axis.leave(&middle.upper) - axis.leave(&middle.lower)).norm();
    Some(LidShapes { vertices, shapes, aperture })
}

/// Whether a place on the rim belongs to the upper lid: it lies above the line between the corners, as seen from the
/// front, where that line is bent as the rim is.
fn is_upper(hole: &EyeHole, point: &Point3<f64>) -> bool {
    hole.outline.span_at(point.x).is_some_and(|(below, above)| point.y > f64::midpoint(below, above))
}

/// For each place on a lid whether it is the upper one, and how much of its rim's motion it follows, 0..=1.
///
/// The way over the skin decides, not the height: a fold of skin that hangs over the lid lies as low as the rim but
/// belongs to the brow.
struct Following(BTreeMap<u32, (bool, f64)>);

impl Following {
    fn new(
        edit: &EditMesh,
        hole: &EyeHole,
        upper: &[u32],
        lower: &[u32],
        height: &dyn Fn(&Point3<f64>) -> f64,
        width: f64,
    ) -> Self {
        let (low, high) = hole.outline.bounds();
        let depth = hole.corners[0].z.min(hole.corners[1].z);
        let patch: Vec<u32> = edit.patch(
            &Point3::new(low.x - 0.2 * width, low.y - width, depth - width),
            &Point3::new(high.x + 0.2 * width, high.y + 1.2 * width, depth + width),
        );
        let length = |a: u32, b: u32| Some((edit.at(a) - edit.at(b)).norm());
        let from_upper = Distances::from(edit, &patch, upper, length);
        let from_lower = Distances::from(edit, &patch, lower, length);
        let places: BTreeSet<u32> = patch.iter().flat_map(|&t| edit.corners(t)).collect();
        let mut away: BTreeMap<u32, (bool, f64)> = BTreeMap::new();
        for place in places {
            let (up, down) = (from_upper.to(place), from_lower.to(place));
            if !up.min(down).is_finite() {
                continue;
            }
            let is_upper = up < down;
            let share = if is_upper { up / height(edit.at(place)) } else { down / (REACH * width) };
            away.insert(place, (is_upper, share.min(1.0)));
        }
        let fixed: BTreeSet<u32> = upper.iter().chain(lower).copied().collect();
        smooth_over(edit, &patch, &fixed, &mut away);
        // Quickly less and less: skin from under the brow would stand before the ball like a pouch.
        let follow = |(is_upper, share): (bool, f64)| (is_upper, (1.0 - share.clamp(0.0, 1.0)).powi(2));
        Self(away.into_iter().map(|(place, found)| (place, follow(found))).collect())
    }
}

/// Lets every place that is not fixed take over the mean of its neighbours on the same lid.
fn smooth_over(edit: &EditMesh, patch: &[u32], fixed: &BTreeSet<u32>, away: &mut BTreeMap<u32, (bool, f64)>) {
    let edges: Vec<(u32, u32)> = edit.edges(patch).into_keys().collect();
    for _ in 0..SMOOTHING {
        let mut sums: BTreeMap<u32, (f64, f64)> = BTreeMap::new();
        for &(a, b) in &edges {
            let (Some(&p), Some(&q)) = (away.get(&a), away.get(&b)) else { continue };
            if p.0 == q.0 {
                for (place, share) in [(a, q.1), (b, p.1)] {
                    let sum = sums.entry(place).or_default();
                    *sum = (sum.0 + share, sum.1 + 1.0);
                }
            }
        }
        for (place, (sum, count)) in sums {
            if !fixed.contains(&place)
                && let Some(known) = away.get_mut(&place)
            {
                known.1 = 0.5 * known.1 + 0.5 * sum / count;
            }
        }
    }
}

fn moved(
    axis: &Axis,
    section: &Section,
    p: &Polar,
    is_upper: bool,
    follow: f64,
    closure: f64,
    width: f64,
) -> Polar {
    let (rim, meeting) = (if is_upper { &section.upper } else { &section.lower }, &section.meeting);
    // An opening eye lifts its upper lid; the lower one stays.
    let closure = if is_upper { closure } else { closure.max(0.0) };
    let way = meeting.angle - rim.angle;
    let shut = closure.max(0.0) * follow;
    let overlap = if is_upper { -OVERLAP * width / meeting.distance * shut * tapered(section) } else { 0.0 };
    let over = if is_upper { 0.5 * OVERLAP * width * shut } else { 0.0 };
    // Away from the rim the lid's sides fade out, or its corners would stand out like a box's.
    let side = section.over_ball + (1.0 - section.over_ball) * follow.powi(6);
    let angle = p.angle + closure * follow * way * side + overlap;
    // Skin that has come down over the opening lies on the ball, however deep or proud it was; above it, skin stays as
    // far out as it was.
    let beyond = if is_upper { angle - section.upper.angle } else { section.lower.angle - angle };
    let over_opening = 1.0 - smooth((beyond / BEYOND_OPENING).clamp(0.0, 1.0));
    let on_ball = section.over_ball * over_opening;
    let distance = p.distance + shut * on_ball * (meeting.distance - p.distance) + over;
    let off_the_ball = axis.ball(p.along) + THICKNESS * width;
    let pressed = (4.0 * closure.abs() * follow).min(1.0) * on_ball;
    let least = p.distance + (off_the_ball - p.distance).max(0.0) * pressed;
    Polar { along: p.along, angle, distance: distance.max(least) }
}

/// Less overlap where the lids meet anyway.
fn tapered(section: &Section) -> f64 {
    ((section.upper.angle - section.lower.angle) / 0.2).clamp(0.0, 1.0)
}
