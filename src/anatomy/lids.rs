//! The lids as sheets of skin over the eyeball.
//!
//! Around the axis through the eye's corners every place has an angle and a distance. Closing turns the upper rim down
//! and the lower rim a little up until both lie on one line, no nearer to the axis than the ball; skin between rim and
//! brow follows less and less, so the lid's texture is that of the fold above it. The ball and its iris stay.

use nalgebra::{Point3, Vector3};

use super::{
    edit::EditMesh,
    eye_hole::EyeHole,
    eyeball::{Eyeball, smooth},
    regions::EyeLandmarks,
};

/// How much of the way the lower lid comes up.
const LOWER_SHARE: f64 = 0.15;
/// Thickness of a lid over the ball, eye widths.
const THICKNESS: f64 = 0.035;
/// How far the upper lid overlaps the lower one when shut, eye widths: hides the line between two polygons.
const OVERLAP: f64 = 0.008;
/// The upper lid reaches this share of the way to the brow's lower edge.
const TO_BROW: f64 = 0.85;
/// The lower lid reaches this far down, radians.
const DOWN: f64 = 0.65;
/// Skin farther from the axis than this is no lid, radii of the ball.
const FARTHEST: f64 = 2.2;
/// Closures for which the shape is worked out; between them it is interpolated. 0 is the scan's own.
pub const CLOSURES: [f64; 5] = [-0.35, 0.25, 0.5, 0.75, 1.0];

/// How the skin around one eye moves with its closure.
#[derive(Debug, Clone, PartialEq)]
pub struct LidShapes {
    /// The vertices that move, ascending.
    pub vertices: Vec<u32>,
    /// For each of [`CLOSURES`] the displacement of each of these vertices, in the axes of the face, millimetres.
    pub shapes: [Vec<Vector3<f64>>; CLOSURES.len()],
    /// Millimetres between the rims in the middle of the eye at rest.
    pub aperture: f64,
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
        Polar { along, angle: a.angle + (b.angle - a.angle) * t, distance: a.distance + (b.distance - a.distance) * t }
    }
}

/// What lies at one place along the axis.
struct Section {
    upper: Polar,
    lower: Polar,
    /// Where both rims meet.
    meeting: Polar,
    /// Where the lids end, radians.
    top: f64,
    bottom: f64,
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
    let inside = (first + 0.04 * width)..(last - 0.04 * width);
    for &place in &hole.rim {
        let p = axis.enter(edit.at(place));
        if inside.contains(&p.along) {
            if is_upper(hole, edit.at(place)) { &mut upper } else { &mut lower }.push(p);
        }
    }
    if upper.len() < 7 || lower.len() < 7 {
        return None;
    }
    let (upper, lower) = (Rim::new(upper), Rim::new(lower));
    let brow: Vec<Polar> = eye.brow.iter().filter_map(|&i| Some(axis.enter(&landmarks[i]?))).collect();
    let brow = if brow.len() > 1 { Some(Rim::new(brow)) } else { None };
    let section = |along: f64| {
        let (u, l) = (upper.at(along), lower.at(along));
        let angle = l.angle + LOWER_SHARE * (u.angle - l.angle);
        let distance = f64::midpoint(u.distance, l.distance).max(axis.ball(along) + THICKNESS * width);
        let usual_top = u.angle + 0.7;
        let top = brow.as_ref().map_or(usual_top, |b| u.angle + TO_BROW * (b.at(along).angle - u.angle));
        Section {
            upper: u,
            lower: l,
            meeting: Polar { along, angle, distance },
            top: top.max(u.angle + 0.25),
            bottom: l.angle - DOWN,
        }
    };
    let painted: std::collections::BTreeSet<u32> = hole.painted.iter().copied().collect();
    let rim: std::collections::BTreeSet<u32> = hole.rim.iter().copied().collect();
    let mut vertices = Vec::new();
    let mut shapes: [Vec<Vector3<f64>>; CLOSURES.len()] = Default::default();
    for (vertex, point) in (0_u32..).zip(&edit.mesh().positions) {
        if painted.contains(&vertex) {
            continue;
        }
        let p = axis.enter(point);
        let reached = p.along > first && p.along < last && p.distance < FARTHEST * ball.radius;
        if !reached || p.angle.abs() > 1.5 {
            continue;
        }
        let section = section(p.along);
        let on_rim = rim.contains(&edit.place(vertex));
        let is_upper = if on_rim {
            is_upper(hole, point)
        } else {
            p.angle > f64::midpoint(section.upper.angle, section.lower.angle)
        };
        let follow = if on_rim { 1.0 } else { following(&section, &p, is_upper) };
        if follow <= 0.0 {
            continue;
        }
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

/// How much of its rim's motion a place follows, 0..=1.
fn following(section: &Section, p: &Polar, is_upper: bool) -> f64 {
    let away = if is_upper {
        (p.angle - section.upper.angle) / (section.top - section.upper.angle)
    } else {
        (section.lower.angle - p.angle) / (section.lower.angle - section.bottom)
    };
    1.0 - smooth(away.clamp(0.0, 1.0))
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
    // An opening eye lifts its upper lid; the lower one hardly gives way.
    let closure = if closure < 0.0 && !is_upper { 0.4 * closure } else { closure };
    let way = meeting.angle - rim.angle;
    let shut = closure.max(0.0) * follow;
    let overlap = if is_upper { -OVERLAP * width / meeting.distance * shut * tapered(section) } else { 0.0 };
    let over = if is_upper { 0.5 * OVERLAP * width * shut } else { 0.0 };
    let distance = p.distance + shut * (meeting.distance - rim.distance) + over;
    // Skin that moves over the ball keeps off it.
    let off_the_ball = axis.ball(p.along) + THICKNESS * width;
    let least = p.distance + (off_the_ball - p.distance).max(0.0) * (4.0 * shut).min(1.0);
    Polar {
        along: p.along,
        angle: p.angle + closure * follow * way + overlap,
        distance: distance.max(least),
    }
}

/// Less overlap where the lids meet anyway.
fn tapered(section: &Section) -> f64 {
    ((section.upper.angle - section.lower.angle) / 0.2).clamp(0.0, 1.0)
}
