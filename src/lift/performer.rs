//! The performer's neutral scan and the lifting of 2D landmarks onto it.
//!
//! 002 §III: after pose, what is left between projected model points and tracked points is the expression; it is
//! projected back onto the model. Different here: 002 projects onto the model's surface, this onto the plane parallel
//! to the image through the posed point, moved by the network's depth hint. Tangent planes were tried and turn noise
//! on grazing skin into large motions.

use nalgebra::{Point3, Rotation3, Vector2, Vector3};

use super::{Displacements, LiftError};
use crate::{
    head::{Camera, HeadPose, PoseSolver},
    tracking::{
        LANDMARK_COUNT, Landmarks, Region, SKIN_LANDMARK_COUNT,
        index::{self, LOWER_INNER, UPPER_INNER},
        landmark_table,
    },
};

/// How far the front of the eyeball stands before the line through the eye's corners, millimetres.
const IRIS_PROTRUSION: f64 = 4.0;
/// The network's depth is a hint: farther than this from the posed neutral it is not believed, millimetres.
const DEPTH_HINT_LIMIT: f64 = 15.0;
/// The network guesses the outline, so the average face is fitted to it with less weight.
const OVAL_WEIGHT: f64 = 0.25;

/// The performer: a camera, a neutral face before it, and how the network sees that face.
#[derive(Debug, Clone)]
pub struct Performer {
    neutral: Vec<Point3<f64>>,
    solver: PoseSolver,
    rest: HeadPose,
    rest_landmarks: Landmarks,
    /// What the network's depth says of the neutral beyond the neutral's own depth, millimetres.
    depth_bias: Vec<f64>,
    /// How far apart the network sees the pairs of the lips' inner rims while neutral, millimetres.
    closed_lips: [f64; UPPER_INNER.len()],
}

impl Performer {
    /// Builds the performer's neutral scan from the average face and neutral frames.
    ///
    /// `average` has 468 points in the scan frame, millimetres (the canonical face). It is posed before the camera, and
    /// each point is moved onto the ray of its landmark at the depth it then has: as good as a true scan for
    /// displacements, while the network's own depth of the neutral is worse. `neutral_frames` are averaged after their
    /// own poses, so a slightly moving head does not blur the face.
    pub fn from_average_face(
        camera: Camera,
        average: &[Point3<f64>],
        neutral_frames: &[&Landmarks],
    ) -> Result<Self, LiftError> {
        if average.len() != SKIN_LANDMARK_COUNT {
            return Err(LiftError::AverageFace { found: average.len(), wanted: SKIN_LANDMARK_COUNT });
        }
        let Some(middle) = neutral_frames.get(neutral_frames.len() / 2) else {
            return Err(LiftError::NoFace { frames: 0 });
        };
        let table = landmark_table();
        let weights = table[..SKIN_LANDMARK_COUNT]
            .iter()
            .map(|facts| if facts.region == Region::Oval { OVAL_WEIGHT } else { 1.0 })
            .collect();
        let skin_pixels: Vec<_> = (0..SKIN_LANDMARK_COUNT).map(|i| middle.pixel(i)).collect();
        let rest = PoseSolver::new(camera, average.to_vec(), weights).solve(&skin_pixels, None)?;

        let mut performer = Self {
            neutral: place_on_rays(&camera, average, &rest, middle),
            solver: PoseSolver::new(camera, Vec::new(), Vec::new()),
            rest,
            rest_landmarks: (*middle).clone(),
            depth_bias: vec![0.0; LANDMARK_COUNT],
            closed_lips: [0.0; UPPER_INNER.len()],
        };
        performer.settle();
        performer.average_in(neutral_frames)?;
        performer.closed_lips = performer.widest_lips(neutral_frames)?;
        Ok(performer)
    }

    /// 478 points of the neutral, scan frame, millimetres.
    pub fn neutral(&self) -> &[Point3<f64>] {
        &self.neutral
    }

    /// The head's pose while neutral.
    pub fn rest(&self) -> &HeadPose {
        &self.rest
    }

    /// For each pair of the lips' inner rims the gap that the network seldom exceeds while neutral, millimetres in the level
    /// frame: it never sees lips quite shut.
    pub fn closed_lips(&self) -> &[f64; UPPER_INNER.len()] {
        &self.closed_lips
    }

    /// The network's landmarks of the neutral.
    pub fn rest_landmarks(&self) -> &Landmarks {
        &self.rest_landmarks
    }

    /// The camera before which the performer stands.
    pub fn camera(&self) -> &Camera {
        self.solver.camera()
    }

    /// From the scan frame to the frame that is level with the camera while neutral: x right in the picture, y up,
    /// z towards the camera.
    pub fn level(&self) -> Rotation3<f64> {
        upright() * self.rest.rotation
    }

    /// Millimetres between the outer eye corners.
    pub fn outer_canthal_distance(&self) -> f64 {
        (self.neutral[index::RIGHT_EYE_OUTER] - self.neutral[index::LEFT_EYE_OUTER]).norm()
    }

    /// The head's pose in a frame; `previous` saves the search for a start.
    pub fn pose(&self, landmarks: &Landmarks, previous: Option<&HeadPose>) -> Result<HeadPose, LiftError> {
        let pixels: Vec<Vector2<f64>> = landmarks.points.iter().map(Vector3::xy).collect();
        Ok(self.solver.solve(&pixels, previous)?)
    }

    /// The displacement of every landmark from the neutral.
    pub fn lift(&self, landmarks: &Landmarks, pose: &HeadPose) -> Displacements {
        let hints = self.depth_hints(landmarks, pose);
        let vectors = self
            .neutral
            .iter()
            .zip(&hints)
            .enumerate()
            .map(|(i, (neutral, hint))| {
                let depth = pose.to_camera(neutral).z + hint;
                pose.to_scan(&self.camera().at_depth(landmarks.pixel(i), depth)) - neutral
            })
            .collect();
        Displacements { vectors, states: landmarks.states.clone() }
    }

    /// Where one landmark lies in the scan frame, millimetres, if it has kept the depth of its posed neutral: lifting
    /// without the network's depth hint.
    pub fn lift_flat(&self, landmarks: &Landmarks, pose: &HeadPose, landmark: usize) -> Point3<f64> {
        let depth = pose.to_camera(&self.neutral[landmark]).z;
        pose.to_scan(&self.camera().at_depth(landmarks.pixel(landmark), depth))
    }

    /// Where displaced landmarks appear: 478 × (x, y in pixels, camera depth in millimetres).
    pub fn project(&self, displacements: &Displacements, pose: &HeadPose) -> Vec<Vector3<f64>> {
        self.neutral
            .iter()
            .zip(&displacements.vectors)
            .map(|(neutral, displacement)| {
                let placed = pose.to_camera(&(neutral + displacement));
                let pixel = self.camera().project(&placed);
                Vector3::new(pixel.x, pixel.y, placed.z)
            })
            .collect()
    }

    /// The same in the picture alone: 478 pixels.
    pub fn pixels(&self, displacements: &Displacements, pose: &HeadPose) -> Vec<Vector2<f64>> {
        self.project(displacements, pose).iter().map(Vector3::xy).collect()
    }

    /// How much deeper the network sees each landmark than the posed neutral is, millimetres.
    fn depth_hints(&self, landmarks: &Landmarks, pose: &HeadPose) -> Vec<f64> {
        let mut excess = self.depth_excess(landmarks, pose);
        for (value, bias) in excess.iter_mut().zip(&self.depth_bias) {
            *value -= bias;
        }
        // The network's depth has no origin: the rigid points keep theirs.
        let common = rigid_mean(&excess);
        excess.iter().map(|value| (value - common).clamp(-DEPTH_HINT_LIMIT, DEPTH_HINT_LIMIT)).collect()
    }

    fn depth_excess(&self, landmarks: &Landmarks, pose: &HeadPose) -> Vec<f64> {
        let millimetres_per_pixel = pose.translation.z / self.camera().focal;
        self.neutral
            .iter()
            .zip(&landmarks.points)
            .map(|(neutral, point)| point.z * millimetres_per_pixel - (pose.rotation * neutral.coords).z)
            .collect()
    }

    /// Renews what follows from the neutral points.
    fn settle(&mut self) {
        let weights = landmark_table().iter().map(|facts| facts.pose_weight).collect();
        self.solver = PoseSolver::new(*self.camera(), self.neutral.clone(), weights);
    }

    /// The gap of each pair that nine neutral frames of ten stay below.
    fn widest_lips(&self, frames: &[&Landmarks]) -> Result<[f64; UPPER_INNER.len()], LiftError> {
        let up = self.level().inverse() * Vector3::y();
        let mut gaps = vec![Vec::with_capacity(frames.len()); UPPER_INNER.len()];
        for frame in frames {
            let pose = self.pose(frame, Some(&self.rest))?;
            for ((gaps, upper), lower) in gaps.iter_mut().zip(UPPER_INNER).zip(LOWER_INNER) {
                let apart = self.lift_flat(frame, &pose, upper) - self.lift_flat(frame, &pose, lower);
                gaps.push(apart.dot(&up));
            }
        }
        for gaps in &mut gaps {
            gaps.sort_by(f64::total_cmp);
        }
        Ok(std::array::from_fn(|pair| gaps[pair][(frames.len() - 1) * 9 / 10]))
    }

    /// Moves the neutral, and how the network sees it, to the mean over all neutral frames.
    fn average_in(&mut self, frames: &[&Landmarks]) -> Result<(), LiftError> {
        let share = 1.0 / frames.len() as f64;
        let mut shift = vec![Vector3::zeros(); LANDMARK_COUNT];
        let mut points = vec![Vector3::zeros(); LANDMARK_COUNT];
        for frame in frames {
            let pose = self.pose(frame, Some(&self.rest))?;
            // The plane parallel to the image alone: the network's depth must not enter the neutral.
            for (i, neutral) in self.neutral.iter().enumerate() {
                shift[i] += (self.lift_flat(frame, &pose, i) - neutral) * share;
                points[i] += frame.points[i] * share;
            }
        }
        for (neutral, shift) in self.neutral.iter_mut().zip(shift) {
            *neutral += shift;
        }
        self.rest_landmarks.points = points;
        self.settle();
        self.rest = self.pose(&self.rest_landmarks, Some(&self.rest))?;
        self.depth_bias = self.depth_excess(&self.rest_landmarks, &self.rest);
        Ok(())
    }
}

/// From the camera's axes (y down, z forward) to upright ones (y up, z towards the camera).
pub fn upright() -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
}

/// Each landmark on its ray, at the depth of the posed average face; irises just before their eye's corners.
fn place_on_rays(
    camera: &Camera,
    average: &[Point3<f64>],
    pose: &HeadPose,
    landmarks: &Landmarks,
) -> Vec<Point3<f64>> {
    let corner_depth = |a: usize, b: usize| {
        f64::midpoint(pose.to_camera(&average[a]).z, pose.to_camera(&average[b]).z) - IRIS_PROTRUSION
    };
    let right = corner_depth(index::RIGHT_EYE_OUTER, index::RIGHT_EYE_INNER);
    let left = corner_depth(index::LEFT_EYE_OUTER, index::LEFT_EYE_INNER);
    (0..LANDMARK_COUNT)
        .map(|i| {
            let depth = match i {
                0..SKIN_LANDMARK_COUNT => pose.to_camera(&average[i]).z,
                SKIN_LANDMARK_COUNT..index::LEFT_IRIS => right,
                _ => left,
            };
            pose.to_scan(&camera.at_depth(landmarks.pixel(i), depth))
        })
        .collect()
}

fn rigid_mean(values: &[f64]) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for (value, facts) in values.iter().zip(landmark_table()) {
        sum += value * facts.pose_weight;
        total += facts.pose_weight;
    }
    sum / total.max(f64::MIN_POSITIVE)
}
