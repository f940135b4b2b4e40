//! Gaussian blur of what is known of the shared frame.

use image::{ImageBuffer, Luma, imageops};

use super::FRAME_SIZE;

/// Below this share of its weights a blurred value stands on nothing.
const LEAST_WEIGHT: f32 = 1e-3;

/// Blurs values over those pixels alone that have weight (normalised convolution): what is unknown does not bleed in.
/// `values` and `weights` have one number for each pixel of the frame; 0 where there is no weight in reach.
pub(super) fn blur_within(values: &[f32], weights: &[f32], sigma: f32) -> Vec<f32> {
    let weighted = values.iter().zip(weights).map(|(value, weight)| value * weight).collect();
    let (sums, shares) = (blur(weighted, sigma), blur(weights.to_vec(), sigma));
    let divide = |(sum, share): (f32, f32)| if share > LEAST_WEIGHT { sum / share } else { 0.0 };
    sums.into_iter().zip(shares).map(divide).collect()
}

/// A Gaussian of `sigma` pixels; beyond the frame the values at its edge go on. Nothing is done for 0 or what is no number.
pub(super) fn blur(values: Vec<f32>, sigma: f32) -> Vec<f32> {
    if !(sigma.is_normal() && sigma > 0.0) {
        return values;
    }
    let [width, height] = FRAME_SIZE.map(|side| side as u32);
    let Some(picture) = ImageBuffer::<Luma<f32>, _>::from_raw(width, height, values) else {
        return Vec::new();
    };
    imageops::blur(&picture, sigma).into_raw()
}
