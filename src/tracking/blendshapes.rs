//! The blendshape network's scores: a second opinion on smiles, used to judge a neutral face.

use std::path::Path;

use ort::{session::Session, value::TensorRef};

use super::{Landmarks, Runtime, TrackingError};

const INPUT_NAME: &str = "serving_default_input_points:0";

/// Landmarks the network reads, in its order.
const READ: [usize; 146] = [
    0, 1, 4, 5, 6, 7, 8, 10, 13, 14, 17, 21, 33, 37, 39, 40, 46, 52, 53, 54, 55, 58, 61, 63, 65, 66, 67, 70,
    78, 80, 81, 82, 84, 87, 88, 91, 93, 95, 103, 105, 107, 109, 127, 132, 133, 136, 144, 145, 146, 148, 149,
    150, 152, 153, 154, 155, 157, 158, 159, 160, 161, 162, 163, 168, 172, 173, 176, 178, 181, 185, 191, 195,
    197, 234, 246, 249, 251, 263, 267, 269, 270, 276, 282, 283, 284, 285, 288, 291, 293, 295, 296, 297, 300,
    308, 310, 311, 312, 314, 317, 318, 321, 323, 324, 332, 334, 336, 338, 356, 361, 362, 365, 373, 374, 375,
    377, 378, 379, 380, 381, 382, 384, 385, 386, 387, 388, 389, 390, 397, 398, 400, 402, 405, 409, 415, 454,
    466, 468, 469, 470, 471, 472, 473, 474, 475, 476, 477,
];

/// Scores of 52 facial shapes, each 0..=1.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeScores(Vec<f32>);

impl ShapeScores {
    /// The stronger of the two mouth corners' smile.
    pub fn smile(&self) -> f64 {
        self.strongest(&[44, 45])
    }

    /// One score by its place in the network's list; 0 for a place that is not there.
    pub fn score(&self, shape: usize) -> f64 {
        self.0.get(shape).copied().map_or(0.0, f64::from)
    }

    fn strongest(&self, indices: &[usize]) -> f64 {
        indices.iter().filter_map(|&i| self.0.get(i)).fold(0.0, |most, &score| most.max(f64::from(score)))
    }
}

/// The loaded network.
pub struct BlendshapeNetwork {
    session: Session,
}

impl BlendshapeNetwork {
    /// Opens the network and checks its input.
    pub fn open(runtime: &Runtime, model: &Path) -> Result<Self, TrackingError> {
        let session = runtime.open(model)?;
        let name = session.inputs().first().map(|tensor| tensor.name().to_owned());
        if name.as_deref() != Some(INPUT_NAME) {
            return Err(TrackingError::Network {
                path: model.into(),
                reason: format!("its input is {name:?}, not {INPUT_NAME}"),
            });
        }
        Ok(Self { session })
    }

    /// Scores the face.
    pub fn run(&mut self, landmarks: &Landmarks) -> Result<ShapeScores, TrackingError> {
        let failed = |source| TrackingError::Inference { network: "blendshape", source };
        let pixels: Vec<f32> =
            READ.iter().flat_map(|&i| [landmarks.points[i].x as f32, landmarks.points[i].y as f32]).collect();
        let tensor =
            TensorRef::from_array_view(([1_i64, READ.len() as i64, 2], pixels.as_slice())).map_err(failed)?;
        let outputs = self.session.run(ort::inputs![INPUT_NAME => tensor]).map_err(failed)?;
        let (_, scores) = outputs[0].try_extract_tensor::<f32>().map_err(failed)?;
        Ok(ShapeScores(scores.to_vec()))
    }
}
