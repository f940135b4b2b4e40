//! Reading the avatar: where the vertices are that stand for landmarks.

use nalgebra::{Point2, Point3, Rotation3, Vector3, center};
use understudy::{
    anatomy::{Anatomy, Eye, EyeLandmarks, LOWER_INNER, Mouth, PartKind, UPPER_INNER, eye_landmarks},
    lift::Side,
    rig::{AvatarFrame, TargetFace},
    scan::{MeshFault, Surface},
    tracking::index,
};

use super::readings::{EYES, Lens, MIDDLE, Marks, Proportions, Reading};

/// Landmarks of the upper lid at which the aperture is measured, by their place in [`eye_landmarks`]'s list: the
/// performer's is measured at the same.
const LID_PAIRS: [usize; 3] = [2, 3, 4];

/// Reads the avatar's geometry, before its head moves.
pub struct Follower {
    level: Rotation3<f64>,
    lips: [Spot; 2],
    corners: [Spot; 2],
    chin: Spot,
    /// Upper and lower rim of each eye.
    lids: [[[Spot; 2]; LID_PAIRS.len()]; 2],
    irises: [Option<Iris>; 2],
    /// Of all vertices at rest.
    positions: Vec<[f32; 3]>,
    /// Of the middle between the eyes.
    origin: Point3<f64>,
    rest: Proportions,
    rest_apertures: [f64; 2],
    rest_gaze: [f64; 2],
}

/// A place on the mesh that goes with it.
#[derive(Clone, Copy, Default)]
struct Spot {
    vertices: [usize; 3],
    weights: [f64; 3],
}

impl Spot {
    fn vertex(vertex: usize) -> Self {
        Self { vertices: [vertex; 3], weights: [1.0, 0.0, 0.0] }
    }

    fn at(&self, positions: &[[f32; 3]]) -> Point3<f64> {
        let corners = self.vertices.iter().zip(self.weights);
        corners
            .map(|(&v, weight)| Vector3::from(positions[v].map(f64::from)) * weight)
            .sum::<Vector3<f64>>()
            .into()
    }
}

/// The vertex of an eyeball in the middle of its iris.
struct Iris {
    vertex: usize,
    centre: Point3<f64>,
}

impl Follower {
    /// For a target that has been prepared, or has not. Landmarks that were not found are not read.
    pub fn new(target: &TargetFace, anatomy: &Anatomy) -> Result<Self, MeshFault> {
        let skin_part = &anatomy.parts[0];
        let skin = Surface::new(&anatomy.mesh.stretch(&skin_part.vertices, &skin_part.triangles))?;
        let landmark = |i: usize| target.landmarks[i].unwrap_or_else(Point3::origin);
        let spot_at = |place: &Point3<f64>| {
            skin.nearest(*place).map_or_else(Spot::default, |point| Spot {
                vertices: skin.triangles()[point.triangle as usize].map(|v| v as usize),
                weights: point.barycentric,
            })
        };
        let spot = |i: usize| spot_at(&landmark(i));
        let inner = [UPPER_INNER[MIDDLE], LOWER_INNER[MIDDLE]];
        let lips =
            anatomy.mouth.as_ref().and_then(|mouth| rims(mouth, anatomy)).unwrap_or_else(|| inner.map(spot));
        let lids = Side::BOTH.map(|side| {
            rims_of_eye(eye_landmarks(side), &landmark).map(|pair| {
                pair.map(|place| match anatomy.eye(side) {
                    Some(opened) => on_rim(opened, anatomy, &place),
                    None => spot_at(&place),
                })
            })
        });
        let irises = Side::BOTH.map(|side| {
            let place = target.landmarks[eye_landmarks(side).iris]?;
            iris(anatomy, side, &place)
        });
        let positions = anatomy.mesh.positions_f32();
        let eyes = EYES.map(|i| spot(i).at(&positions));
        let mut follower = Self {
            level: target.level,
            lips,
            corners: [index::MOUTH_RIGHT, index::MOUTH_LEFT].map(spot),
            chin: spot(index::CHIN),
            lids,
            irises,
            positions,
            origin: center(&eyes[0], &eyes[1]),
            rest: Proportions::default(),
            rest_apertures: [0.0; 2],
            rest_gaze: [0.0; 2],
        };
        let marks = follower.marks(&follower.positions, None);
        follower.rest = Proportions::new(&marks, eyes.map(|eye| (target.level * eye).xy()));
        follower.rest_apertures = follower.apertures(&follower.positions);
        follower.rest_gaze = follower.gaze(&follower.positions);
        Ok(follower)
    }

    /// What its face is measured in.
    pub fn proportions(&self) -> &Proportions {
        &self.rest
    }

    /// One frame, through a lens in this face's own measure.
    pub fn read(&self, frame: &AvatarFrame, lens: &Lens) -> Reading {
        let [gap, width, chin] = self.rest.measure(&self.marks(&frame.positions, Some(lens)));
        let [right, left] = self.apertures(&frame.positions);
        let [yaw, pitch] = self.gaze(&frame.positions);
        let open = [right / self.rest_apertures[0], left / self.rest_apertures[1]];
        [gap, width, open[0], open[1], chin, yaw - self.rest_gaze[0], pitch - self.rest_gaze[1]]
    }

    /// From the middle between the eyes; at rest every lens sees the same.
    fn marks(&self, positions: &[[f32; 3]], lens: Option<&Lens>) -> Marks {
        let at = |spot: Spot| {
            let [place, rest] =
                [positions, &self.positions].map(|all| self.level * (spot.at(all) - self.origin));
            Point2::from(lens.map_or(place, |lens| lens.flat(&place, &rest)).xy())
        };
        Marks { lips: self.lips.map(at), corners: self.corners.map(at), chin: at(self.chin) }
    }

    /// Distance of each eye's rims, millimetres, in the direction in which they lie apart at rest.
    fn apertures(&self, positions: &[[f32; 3]]) -> [f64; 2] {
        self.lids.map(|pairs| {
            let apart = pairs.map(|[upper, lower]| {
                let at_rest = upper.at(&self.positions) - lower.at(&self.positions);
                (upper.at(positions) - lower.at(positions)).dot(&at_rest.normalize())
            });
            apart.iter().sum::<f64>() / apart.len() as f64
        })
    }

    /// Yaw and pitch of the mean of both irises' directions, degrees.
    fn gaze(&self, positions: &[[f32; 3]]) -> [f64; 2] {
        let angles = self.irises.iter().flatten().map(|iris| {
            let out = self.level * (Spot::vertex(iris.vertex).at(positions) - iris.centre);
            [out.x.atan2(out.z), out.y.atan2(out.x.hypot(out.z))].map(f64::to_degrees)
        });
        let angles: Vec<[f64; 2]> = angles.collect();
        [0, 1].map(|axis| angles.iter().map(|eye| eye[axis]).sum::<f64>() / angles.len() as f64)
    }
}

/// The pair of rim vertices nearest to the node that the middle landmarks drive.
fn rims(mouth: &Mouth, anatomy: &Anatomy) -> Option<[Spot; 2]> {
    let positions = &anatomy.mesh.positions;
    let node = mouth.nodes.iter().find(|node| node.station == MIDDLE + 1 && node.share <= 0.0)?;
    let far = |pair: usize| {
        (0..2)
            .map(|lip| (positions[mouth.rims[lip][pair] as usize] - node.rest[lip]).norm_squared())
            .sum::<f64>()
    };
    let nearest = (0..mouth.rims[0].len()).min_by(|&a, &b| far(a).total_cmp(&far(b)))?;
    Some([0, 1].map(|lip| Spot::vertex(mouth.rims[lip][nearest] as usize)))
}

/// Places on the upper rim, each with the one straight below it: the network's own pairs stand askew on some scans.
fn rims_of_eye(
    eye: &EyeLandmarks,
    landmark: &dyn Fn(usize) -> Point3<f64>,
) -> [[Point3<f64>; 2]; LID_PAIRS.len()] {
    let (outer, inner) = (landmark(eye.outer), landmark(eye.inner));
    let along = |p: &Point3<f64>| (p - outer).dot(&(inner - outer));
    let lower: Vec<_> = std::iter::once(outer).chain(eye.lower.map(landmark)).chain([inner]).collect();
    LID_PAIRS.map(|k| {
        let upper = landmark(eye.upper[k]);
        let right = lower.iter().position(|p| along(p) > along(&upper)).unwrap_or(1).max(1);
        let (a, b) = (lower[right - 1], lower[right]);
        let share = (along(&upper) - along(&a)) / (along(&b) - along(&a)).max(f64::MIN_POSITIVE);
        [upper, a + (b - a) * share]
    })
}

/// The vertex of a lid nearest to a place; as the cut runs just outside the landmarks, it lies on the rim.
fn on_rim(eye: &Eye, anatomy: &Anatomy, place: &Point3<f64>) -> Spot {
    let far = |v: &u32| (anatomy.mesh.positions[*v as usize] - place).norm_squared();
    let nearest = eye.lids.vertices.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
    nearest.map_or_else(Spot::default, |&v| Spot::vertex(v as usize))
}

fn iris(anatomy: &Anatomy, side: Side, place: &Point3<f64>) -> Option<Iris> {
    let centre = anatomy.eye(side)?.centre;
    let ball = anatomy.parts.iter().find(|part| part.kind == PartKind::Eye(side))?;
    let direction = (place - centre).normalize();
    let off = |v: usize| (anatomy.mesh.positions[v] - centre).normalize().dot(&direction);
    let vertex = ball.vertices.clone().max_by(|&a, &b| off(a).total_cmp(&off(b)))?;
    Some(Iris { vertex, centre })
}
