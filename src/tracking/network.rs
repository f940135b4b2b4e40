//! The landmark network: a crop in, 478 landmarks in image pixels out.

use std::path::Path;

use nalgebra::{Vector2, Vector3};
use opencv::core;
use ort::{session::Session, value::TensorRef};

use super::{
    FaceRegion, Runtime, TrackingError,
    input::{Shades, fill_input, shades},
    landmarks::{LANDMARK_COUNT, LandmarkState, Landmarks},
};
use crate::capture::Image;

const INPUT: i32 = 256;
const INPUT_NAME: &str = "input_12";
const POINTS_NAME: &str = "Identity";
const PRESENCE_NAME: &str = "Identity_1";
/// Landmarks farther outside the picture than this fraction of the region are not seen.
const OUTSIDE: f64 = 0.01;

/// The loaded network.
pub struct LandmarkNetwork {
    session: Session,
    shades: Shades,
    input: Vec<f32>,
    crop: core::Mat,
}

impl LandmarkNetwork {
    /// Opens the network and checks that it has the expected tensors.
    pub fn open(runtime: &Runtime, model: &Path) -> Result<Self, TrackingError> {
        let session = runtime.open(model)?;
        let fits = session.inputs().iter().any(|tensor| tensor.name() == INPUT_NAME)
            && [POINTS_NAME, PRESENCE_NAME]
                .iter()
                .all(|name| session.outputs().iter().any(|tensor| tensor.name() == *name));
        if !fits {
            return Err(TrackingError::Network {
                path: model.into(),
                reason: format!("it lacks the tensors {INPUT_NAME}, {POINTS_NAME} and {PRESENCE_NAME}"),
            });
        }
        let input = vec![0.0; (INPUT * INPUT * 3) as usize];
        let shades = shades(|byte| byte / 255.0);
        Ok(Self { session, shades, input, crop: core::Mat::default() })
    }

    /// Landmarks of the face in `region`; whether there is one, `presence` tells.
    pub fn run(&mut self, image: &Image, region: FaceRegion) -> Result<Landmarks, TrackingError> {
        region.cut(image, INPUT, &mut self.crop)?;
        fill_input(&self.crop, &self.shades, &mut self.input)?;
        let failed = |source| TrackingError::Inference { network: "landmark", source };
        let side = i64::from(INPUT);
        let tensor =
            TensorRef::from_array_view(([1, side, side, 3], self.input.as_slice())).map_err(failed)?;
        let outputs = self.session.run(ort::inputs![INPUT_NAME => tensor]).map_err(failed)?;
        let (_, values) = outputs[POINTS_NAME].try_extract_tensor::<f32>().map_err(failed)?;
        let (_, presence) = outputs[PRESENCE_NAME].try_extract_tensor::<f32>().map_err(failed)?;

        let (linear, half) = (region.linear(INPUT), Vector2::repeat(f64::from(INPUT) / 2.0));
        let depth_scale = region.side / f64::from(INPUT);
        let points: Vec<_> = values
            .chunks_exact(3)
            .take(LANDMARK_COUNT)
            .map(|p| {
                let pixel = region.centre + linear * (Vector2::new(f64::from(p[0]), f64::from(p[1])) - half);
                Vector3::new(pixel.x, pixel.y, f64::from(p[2]) * depth_scale)
            })
            .collect();
        let slack = OUTSIDE * region.side;
        let inside = |p: &Vector3<f64>| {
            p.x > -slack
                && p.y > -slack
                && p.x < f64::from(image.width()) + slack
                && p.y < f64::from(image.height()) + slack
        };
        let states = points
            .iter()
            .map(|p| if inside(p) { LandmarkState::Observed } else { LandmarkState::Absent })
            .collect();
        let logit = presence.first().map_or(f64::NEG_INFINITY, |&value| f64::from(value));
        Ok(Landmarks { points, states, presence: 1.0 / (1.0 + (-logit).exp()) })
    }
}
