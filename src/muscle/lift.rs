//! Lifting by muscles: what a frame's landmarks say of head, contractions, and every landmark in space.

use nalgebra::{Vector2, Vector3};

use super::{
    CameraFit, CameraSolver, FaceBasis, Muscle, MuscleBasis, MuscleError, marker_error::MarkerError,
};
use crate::{
    head::HeadPose,
    lift::{Displacements, Performer},
    rig::SourceFace,
    tracking::{LANDMARK_COUNT, LandmarkState, Landmarks, SKIN_LANDMARK_COUNT},
};

/// How much of what the basis leaves unexplained in the picture is added there: all of it. What moves in the picture is then
/// what moved, and the basis gives depth. With half of it, renderings are tracked a little better and mouths are too narrow
/// (`docs/benchmarks/muscles.md`).
const UNEXPLAINED: f64 = 1.0;
/// Where the eyes look is measured by itself, and their skin hardly shows it.
const LEFT_OUT: &str = "eyeLook";

/// Lifts frame after frame of one performer.
#[derive(Debug, Clone)]
pub struct MuscleLift {
    solver: CameraSolver,
    contractions: Vec<f64>,
    pixels: Vec<Vector2<f64>>,
    error: MarkerError,
}

/// One frame.
#[derive(Debug, Clone)]
pub struct Lifted {
    /// The head.
    pub pose: HeadPose,
    /// One for each muscle of [`MuscleLift::basis`], 0..=1.
    pub contractions: Vec<f64>,
    /// What the contractions make of the 478 landmarks, and what they leave unexplained in the picture.
    pub displacements: Displacements,
    /// Mean distance in the picture's plane of the landmarks from where the contractions put them, upper and lower face
    /// without the outline, millimetres; none where nothing of one was seen.
    pub marker_error: Option<[f64; 2]>,
}

impl MuscleLift {
    /// The elements of a basis by which a performer is lifted.
    pub fn lifting(basis: &MuscleBasis) -> MuscleBasis {
        basis.only(|element| !element.name.starts_with(LEFT_OUT))
    }

    /// For a performer's neutral and a basis that is carried there.
    pub fn new(performer: &Performer, basis: &MuscleBasis) -> Result<Self, MuscleError> {
        let face = FaceBasis::new(basis, &SourceFace::performer(performer))?.of_landmarks();
        let contractions = vec![0.0; face.count()];
        let solver = CameraSolver::new(*performer.camera(), face, CameraFit::default());
        Ok(Self { solver, contractions, pixels: Vec::new(), error: MarkerError::new(performer) })
    }

    /// The shapes on the performer.
    pub fn basis(&self) -> &FaceBasis {
        self.solver.basis()
    }

    /// Of each muscle whether it moves the lids, which are quick.
    pub fn quick(&self) -> Vec<bool> {
        self.basis().muscles.iter().map(Muscle::is_quick).collect()
    }

    /// Adds what contractions make of the landmarks, times `sign`, to what they leave unexplained.
    pub fn add(&self, contractions: &[f64], sign: f64, displacements: &mut Displacements) {
        let mut fitted = Vec::new();
        self.basis().synthesize(contractions, &mut fitted);
        for (vector, fitted) in displacements.vectors.iter_mut().zip(&fitted) {
            *vector += fitted * sign;
        }
    }

    /// Forgets the last frame, as when the face was lost.
    pub fn reset(&mut self) {
        self.contractions.fill(0.0);
    }

    /// Solves one frame; `start` is a pose near by, from the rigid points. Landmarks that are absent do not count.
    pub fn lift(&mut self, performer: &Performer, landmarks: &Landmarks, start: &HeadPose) -> Lifted {
        self.pixels.clear();
        self.pixels.extend((0..SKIN_LANDMARK_COUNT).map(|i| {
            let absent = landmarks.states[i] == LandmarkState::Absent;
            if absent { Vector2::repeat(f64::NAN) } else { landmarks.pixel(i) }
        }));
        let pose = self.solver.solve(&self.pixels, start, &mut self.contractions);
        let mut vectors = Vec::with_capacity(LANDMARK_COUNT);
        self.solver.basis().synthesize(&self.contractions, &mut vectors);
        vectors.resize(LANDMARK_COUNT, Vector3::zeros());
        self.error.clear();
        for (i, (vector, neutral)) in vectors.iter_mut().zip(performer.neutral()).enumerate() {
            if landmarks.states[i] == LandmarkState::Absent {
                continue;
            }
            let depth = pose.to_camera(&(neutral + *vector)).z;
            let seen = pose.to_scan(&performer.camera().at_depth(landmarks.pixel(i), depth)) - neutral;
            let unexplained = seen - *vector;
            self.error.add(i, unexplained.norm());
            *vector += unexplained * UNEXPLAINED;
        }
        let displacements = Displacements { vectors, states: landmarks.states.clone() };
        let marker_error = self.error.means();
        Lifted { pose, contractions: self.contractions.clone(), displacements, marker_error }
    }
}
