//! A basis on one person's face: the shapes of eq. 1 at the points by which that face is known.

use nalgebra::{Point3, Vector3};

use super::{Channel, JawBow, MuscleBasis, MuscleError, Part};
use crate::rig::{SourceFace, TargetFace, Transfer, TransferRule};

/// The names under which a jaw turns.
const JAWS: [&str; 2] = ["jawOpen", "jaw_rotation"];

/// A muscle of one face, without its shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Muscle {
    /// As in the basis.
    pub name: String,
    /// Where it is sought.
    pub part: Part,
    /// How far it can be believed.
    pub channel: Channel,
    /// How far it closes the right and the left eye.
    pub closure: [f64; 2],
}

impl Muscle {
    /// Whether it moves the lids, which are quick.
    pub fn is_quick(&self) -> bool {
        self.closure.iter().any(|closure| closure.abs() > 0.1)
    }
}

/// Elements at the points of one face. Scan frame, millimetres.
#[derive(Debug, Clone)]
pub struct FaceBasis {
    /// P points of the neutral.
    pub points: Vec<Point3<f64>>,
    /// M muscles.
    pub muscles: Vec<Muscle>,
    /// M × P: dᵢⱼ of 001 §4.1.2.
    pub vectors: Vec<Vec<Vector3<f64>>>,
    /// The jaw's muscle and its arc.
    bow: Option<(usize, JawBow)>,
}

impl FaceBasis {
    /// Carries a basis to the handles of a face by the landmark spline.
    pub fn new(basis: &MuscleBasis, face: &SourceFace) -> Result<Self, MuscleError> {
        let target = TargetFace::of_source(face)?;
        let transfer = Transfer::new(&SourceFace::average(&basis.face), &target, TransferRule::Spline)?;
        let vectors: Vec<Vec<_>> = basis
            .elements
            .iter()
            .map(|e| (0..).zip(&e.vectors).map(|(handle, v)| transfer.vector(handle, v)).collect())
            .collect();
        Ok(Self::of_shapes(basis, face.points.clone(), vectors))
    }

    /// The basis on its own face.
    pub fn own(basis: &MuscleBasis) -> Self {
        let vectors = basis.elements.iter().map(|element| element.vectors.clone()).collect();
        Self::of_shapes(basis, basis.face.clone(), vectors)
    }

    /// Shapes that are known at the handles of a face.
    fn of_shapes(basis: &MuscleBasis, points: Vec<Point3<f64>>, vectors: Vec<Vec<Vector3<f64>>>) -> Self {
        let muscles = basis.elements.iter().map(|e| Muscle {
            name: e.name.clone(),
            part: e.part,
            channel: e.channel,
            closure: e.closure,
        });
        let jaw = JAWS.iter().find_map(|name| basis.index(name)).filter(|_| basis.turns_jaw);
        let bow = jaw.and_then(|jaw| Some((jaw, JawBow::new(&points, &vectors[jaw])?)));
        Self { points, muscles: muscles.collect(), vectors, bow }
    }

    /// The same without the control points: the 468 landmarks alone.
    #[must_use]
    pub fn of_landmarks(mut self) -> Self {
        self.points.truncate(crate::tracking::SKIN_LANDMARK_COUNT);
        for vectors in &mut self.vectors {
            vectors.truncate(crate::tracking::SKIN_LANDMARK_COUNT);
        }
        self
    }

    /// The jaw's muscle and its arc.
    pub(super) fn bow(&self) -> Option<(usize, &JawBow)> {
        self.bow.as_ref().map(|(jaw, bow)| (*jaw, bow))
    }

    /// How many muscles.
    pub fn count(&self) -> usize {
        self.muscles.len()
    }

    /// The displacements that contractions make (eq. 1), with the jaw on its arc. `out` gets one for each point.
    pub fn synthesize(&self, contractions: &[f64], out: &mut Vec<Vector3<f64>>) {
        out.clear();
        out.resize(self.points.len(), Vector3::zeros());
        for (vectors, &contraction) in self.vectors.iter().zip(contractions) {
            if contraction != 0.0 {
                for (out, vector) in out.iter_mut().zip(vectors) {
                    *out += vector * contraction;
                }
            }
        }
        if let Some((jaw, bow)) = &self.bow
            && contractions[*jaw] != 0.0
        {
            let bow = bow.at(contractions[*jaw]);
            for (point, out) in out.iter_mut().enumerate() {
                *out += bow(point);
            }
        }
    }
}
