//! An eyeball behind the lids: fitted to the painted eye, textured from it.

use image::{ImageBuffer, Rgb, RgbImage};
use nalgebra::{Point2, Point3, Vector2};

use super::{
    FrontView, edit::EditMesh, eye_hole::EyeHole, outline::Outline, part::PartMesh, regions::EyeLandmarks,
};

/// Radius over the width of the eye: 12 mm of 30.
const RADIUS: f64 = 0.40;
/// Radius of an iris over the eyeball's.
const IRIS: f64 = 0.49;
/// How far from the pole the cap reaches, radians: enough for a turned eye.
const REACH: f64 = 1.45;
const RINGS: usize = 16;
const SPOKES: usize = 32;
/// In an empty socket the ball is a little smaller, and so far behind the lids' edges, eye widths.
const SOCKET: f64 = 0.9;
const IN_SOCKET: f64 = 0.09;
/// Pixels of the texture's sides.
const SIDE: u32 = 256;
/// The painted eye lies this far behind the ball, eye widths.
const BACKING: f64 = 0.06;
/// Over this distance from the rim it sinks there, eye widths.
const SINKING: f64 = 0.10;
/// Colours nearer to the rim than this are lashes or skin, eye widths.
const MARGIN: f64 = 0.035;
/// Skin beside the hole stays about this far before the ball, and the ball goes back for it by so much, eye widths.
const CLEARANCE: f64 = 0.03;
const AROUND: f64 = 0.25;
const DEEPER: f64 = 0.10;
/// Of what is seen of the white, so many places count.
const WHITES: usize = 160;
/// sRGB of the white of an eye, and of an iris of no one's.
const SCLERA: [f64; 3] = [0.80, 0.77, 0.74];
const DEFAULT_IRIS: [f64; 3] = [0.33, 0.30, 0.26];

/// One eyeball.
#[derive(Debug, Clone, PartialEq)]
pub struct Eyeball {
    /// In the axes of the face, millimetres.
    pub centre: Point3<f64>,
    /// Millimetres.
    pub radius: f64,
}

impl Eyeball {
    /// Fits the ball to the painted eye, pushed back until the skin around the hole lies before it.
    pub fn fit(edit: &EditMesh, hole: &EyeHole) -> Self {
        let [outer, inner] = hole.corners;
        let width = (outer.xy() - inner.xy()).norm();
        let radius = RADIUS * width;
        let middle = nalgebra::center(&outer, &inner).xy();
        let from_middle = |p: &Point3<f64>| (p.xy() - middle).norm();
        let mut backs: Vec<f64> = hole
            .painted
            .iter()
            .chain(&hole.rim)
            .map(|&v| edit.at(v))
            .filter(|p| from_middle(p) < 0.35 * width)
            .map(|p| p.z - (radius * radius - from_middle(p).powi(2)).max(0.0).sqrt())
            .collect();
        backs.sort_by(f64::total_cmp);
        let mut z = backs.get(backs.len() / 2).copied().unwrap_or(outer.z - radius);
        let (clearance, deepest) = (CLEARANCE * width, z - DEEPER * width);
        // Skin that nearly touches the ball would let it through when it moves.
        let (low, high) = hole.outline.bounds();
        let margin = AROUND * width;
        let skin = edit.patch(
            &Point3::new(low.x, low.y - margin, z),
            &Point3::new(high.x, high.y + margin, z + 2.0 * radius),
        );
        let painted: std::collections::BTreeSet<u32> =
            hole.painted.iter().chain(&hole.deep).map(|&v| edit.place(v)).collect();
        for place in skin.iter().flat_map(|&t| edit.corners(t)).filter(|place| !painted.contains(place)) {
            let p = edit.at(place);
            let away = -hole.outline.inside(&p.xy());
            if away < margin && p.z > z {
                let front = (radius * radius - from_middle(p).powi(2)).max(0.0).sqrt();
                let wanted = clearance * (0.5 + away / margin);
                z = z.min(p.z - wanted - front).max(deepest);
            }
        }
        Self { centre: Point3::new(middle.x, middle.y, z), radius }
    }

    /// A ball for an empty socket: amid the corners, behind lids whose edges lie at the depth `front`.
    pub fn in_socket(corners: [Point3<f64>; 2], front: f64) -> Self {
        let width = (corners[0].xy() - corners[1].xy()).norm();
        let radius = SOCKET * RADIUS * width;
        let middle = nalgebra::center(&corners[0], &corners[1]).xy();
        // Where the lids stand open the ball's front may come up to their edges.
        Self { centre: Point3::new(middle.x, middle.y, front - IN_SOCKET * width - radius), radius }
    }

    /// Where a vertex of the painted eye goes: behind the ball, but on the rim where it is.
    pub fn behind(&self, hole: &EyeHole, point: &Point3<f64>) -> Point3<f64> {
        let width = self.radius / RADIUS;
        let share = (hole.outline.inside(&point.xy()) / (SINKING * width)).clamp(0.0, 1.0);
        let sunk = self.sunk(point);
        point + (sunk - point) * smooth(share)
    }

    /// Where a vertex goes that must not be before the ball.
    pub fn sunk(&self, point: &Point3<f64>) -> Point3<f64> {
        let across = (point.xy() - self.centre.xy()).norm_squared();
        let front = self.centre.z + (self.radius * self.radius - across).max(0.0).sqrt();
        Point3::new(point.x, point.y, point.z.min(front - BACKING * self.radius / RADIUS))
    }

    /// The visible part of the ball.
    pub fn mesh(&self) -> PartMesh {
        PartMesh::cap(&self.centre, self.radius, REACH, RINGS, SPOKES)
    }

    /// The ball's picture, as [`PartMesh::cap`] lays it out. Where the scan shows the eye it is the scan's; the iris is
    /// completed by its mirror image and its rings, the white by its neighbourhood. Without a view it is no one's.
    pub fn texture(
        &self,
        outline: Option<&Outline>,
        landmarks: &[Option<Point3<f64>>],
        eye: &EyeLandmarks,
        view: Option<&FrontView>,
    ) -> RgbImage {
        // Through no opening nothing of the eye is seen.
        let view = view.zip(outline);
        let iris = if outline.is_some() {
            self.iris(landmarks, eye)
        } else {
            (self.centre.xy(), IRIS * self.radius)
        };
        let painter = Painter { ball: self, iris, view, seen: Seen::gather(self, iris, view) };
        let raw: ImageBuffer<Rgb<f32>, Vec<f32>> = ImageBuffer::from_fn(SIDE, SIDE, |column, row| {
            let colour = painter.colour(&self.texel(column, row));
            Rgb(colour.map(|c| c as f32))
        });
        let mut picture = RgbImage::new(SIDE, SIDE);
        for (to, from) in picture.pixels_mut().zip(raw.pixels()) {
            to.0 = from.0.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
        }
        picture
    }

    /// Place of a texel in the plane of the face, as the ball stands at rest.
    fn texel(&self, column: u32, row: u32) -> Point2<f64> {
        let half = f64::from(SIDE) / 2.0;
        let offset = Vector2::new(f64::from(column) + 0.5 - half, half - f64::from(row) - 0.5) / half;
        let share = offset.norm();
        let direction = if share > 1e-9 { offset / share } else { Vector2::zeros() };
        // Beyond a quarter turn the plane shows nothing new: the angle is unrolled instead.
        let angle = share * REACH;
        self.centre.xy() + direction * (self.radius * angle.min(std::f64::consts::FRAC_PI_2).sin())
    }

    /// Centre in the plane of the face and radius of the iris.
    fn iris(&self, landmarks: &[Option<Point3<f64>>], eye: &EyeLandmarks) -> (Point2<f64>, f64) {
        let usual = IRIS * self.radius;
        let Some(centre) = landmarks[eye.iris].map(|p| p.xy()) else { return (self.centre.xy(), usual) };
        if (centre - self.centre.xy()).norm() > 0.7 * self.radius {
            return (self.centre.xy(), usual);
        }
        let rims: Vec<f64> =
            eye.iris_rim.iter().filter_map(|&i| Some((landmarks[i]?.xy() - centre).norm())).collect();
        let mean = rims.iter().sum::<f64>() / rims.len().max(1) as f64;
        let radius = if rims.len() == 4 { mean.clamp(0.8 * usual, 1.25 * usual) } else { usual };
        (centre, radius)
    }
}

/// What of the eye the scan shows.
struct Seen {
    /// Mean colour of each ring of the iris, from its centre out to its rim; `None` where none of it is seen.
    rings: Vec<Option<[f64; 3]>>,
    /// Places and colours of the white.
    white: Vec<(Point2<f64>, [f64; 3])>,
    /// The white's own colour.
    mean_white: [f64; 3],
}

const IRIS_RINGS: usize = 24;

impl Seen {
    fn gather(ball: &Eyeball, iris: (Point2<f64>, f64), view: Option<(&FrontView, &Outline)>) -> Self {
        let mut sums = vec![([0.0; 3], 0.0_f64); IRIS_RINGS];
        let mut white = Vec::new();
        let margin = MARGIN * ball.radius / RADIUS;
        if let Some((view, outline)) = view {
            for row in (0..SIDE).step_by(2) {
                for column in (0..SIDE).step_by(2) {
                    let place = ball.texel(column, row);
                    if outline.inside(&place) < margin {
                        continue;
                    }
                    let colour = view.colour(place.x, place.y);
                    let share = (place - iris.0).norm() / iris.1;
                    if share < 1.0 {
                        let (sum, count) = &mut sums[(share * IRIS_RINGS as f64) as usize];
                        *sum = add(*sum, colour, 1.0);
                        *count += 1.0;
                    } else if share > 1.15 {
                        white.push((place, colour));
                    }
                }
            }
        }
        let rings =
            sums.into_iter().map(|(sum, count)| (count > 0.0).then(|| sum.map(|c| c / count))).collect();
        white.sort_by(|a, b| luma(&b.1).total_cmp(&luma(&a.1)));
        // The brighter half: the rest lies in the lid's shadow.
        let bright = &white[..white.len() / 2];
        let mean_white = if bright.len() > 10 {
            let sum = bright.iter().fold([0.0; 3], |sum, (_, colour)| add(sum, *colour, 1.0));
            let mean = sum.map(|c| c / bright.len() as f64);
            // Painted whites are often skin: half of it is an eye's own colour, at the scan's own brightness.
            let level = (luma(&mean) / luma(&SCLERA)).clamp(0.45, 1.1);
            std::array::from_fn(|k| 0.5 * mean[k] + 0.5 * SCLERA[k] * level)
        } else {
            SCLERA
        };
        Self { rings, white, mean_white }
    }

    /// The nearest ring of the iris that is seen.
    fn ring(&self, share: f64) -> Option<[f64; 3]> {
        let at = ((share * IRIS_RINGS as f64) as usize).min(IRIS_RINGS - 1);
        (0..IRIS_RINGS).find_map(|off| {
            let inwards = at.checked_sub(off).and_then(|i| self.rings[i]);
            inwards.or_else(|| self.rings.get(at + off).copied().flatten())
        })
    }
}

struct Painter<'a> {
    ball: &'a Eyeball,
    iris: (Point2<f64>, f64),
    view: Option<(&'a FrontView, &'a Outline)>,
    seen: Seen,
}

impl Painter<'_> {
    fn colour(&self, place: &Point2<f64>) -> [f64; 3] {
        let width = self.ball.radius / RADIUS;
        let made_up = self.made_up(place, width);
        let Some((view, outline)) = self.view else { return made_up };
        let inside = outline.inside(place);
        let known = smooth(((inside - 0.5 * MARGIN * width) / (MARGIN * width)).clamp(0.0, 1.0));
        mix(made_up, view.colour(place.x, place.y), known)
    }

    /// The colour where the scan shows lid, or nothing.
    fn made_up(&self, place: &Point2<f64>, width: f64) -> [f64; 3] {
        let share = (place - self.iris.0).norm() / self.iris.1;
        let white = self.white(place, width);
        if share > 1.1 {
            return white;
        }
        let iris = self
            .mirrored(place, width)
            .or_else(|| self.seen.ring(share))
            .unwrap_or_else(|| default_iris(share));
        // A soft limbus.
        mix(iris, white, smooth(((share - 0.93) / 0.17).clamp(0.0, 1.0)))
    }

    /// The iris below its centre stands for what the upper lid hides, and the other way round.
    fn mirrored(&self, place: &Point2<f64>, width: f64) -> Option<[f64; 3]> {
        let (view, outline) = self.view?;
        let twin = Point2::new(place.x, 2.0 * self.iris.0.y - place.y);
        (outline.inside(&twin) > MARGIN * width).then(|| view.colour(twin.x, twin.y))
    }

    /// The white near what is seen of it, and its mean beyond.
    fn white(&self, place: &Point2<f64>, width: f64) -> [f64; 3] {
        let reach = 0.18 * width;
        let (mut sum, mut total) = ([0.0; 3], 0.0);
        for (seen, colour) in self.seen.white.iter().step_by(self.seen.white.len() / WHITES + 1) {
            let weight = (-(seen - place).norm_squared() / (0.18 * reach * reach)).exp();
            sum = add(sum, *colour, weight);
            total += weight;
        }
        // Towards the sides an eyeball darkens.
        let edge = ((place - self.ball.centre.xy()).norm() / self.ball.radius).clamp(0.0, 1.0);
        let far = self.seen.mean_white.map(|c| c * (1.0 - 0.25 * edge.powi(4)));
        let near = total / (total + 1.0);
        if total > 1e-9 { mix(far, sum.map(|c| c / total), near) } else { far }
    }
}

/// A dark pupil in an iris that lightens outwards to a dark rim.
fn default_iris(share: f64) -> [f64; 3] {
    let pupil = smooth(((share - 0.30) / 0.10).clamp(0.0, 1.0));
    let rim = 1.0 - 0.6 * smooth(((share - 0.75) / 0.25).clamp(0.0, 1.0));
    DEFAULT_IRIS.map(|c| 0.03 + pupil * rim * (c * (0.75 + 0.5 * share) - 0.03))
}

fn luma(colour: &[f64; 3]) -> f64 {
    0.299 * colour[0] + 0.587 * colour[1] + 0.114 * colour[2]
}

fn add(sum: [f64; 3], colour: [f64; 3], weight: f64) -> [f64; 3] {
    std::array::from_fn(|k| sum[k] + colour[k] * weight)
}

fn mix(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
}

/// The cubic step over 0..=1.
pub(super) fn smooth(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}
