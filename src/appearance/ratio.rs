//! Ratio images: what an expression does to the light of the skin, apart from whose skin it is.

use nalgebra::Point2;

use super::{
    DARKEST, FRAME_SIZE, FaceFrame, FaceImage, Layer, Patch, Region, TextureVolume, blur::blur_within,
    ratio_mask,
};

/// How a ratio is taken. Lengths are pixels of the shared frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RatioOptions {
    /// Blur of both luminances before they are divided, on smooth skin.
    pub fine: f32,
    /// The same where the neutral skin is rough: a beard must not be printed onto another face.
    pub coarse: f32,
    /// Roughness of the neutral skin, in logarithms of luminance, from which the blur rises and at which it is full.
    pub roughness: [f32; 2],
    /// What is wider than this is light and not skin, and is taken out.
    pub drift: f32,
    /// The logarithm saturates towards this.
    pub limit: f32,
    /// How much of a brightening is kept; all of a darkening is.
    pub brightening: f32,
}

impl Default for RatioOptions {
    fn default() -> Self {
        Self { fine: 3.0, coarse: 12.0, roughness: [0.06, 0.12], drift: 40.0, limit: 0.35, brightening: 0.4 }
    }
}

/// Takes ratios in one frame.
#[derive(Debug, Clone)]
pub struct RatioFilter {
    options: RatioOptions,
    /// 0 where a ratio is never taken (eyes, lips, brows, nostrils, the outline), 1 on skin.
    mask: Vec<f32>,
}

impl RatioFilter {
    /// Prepares the mask.
    pub fn new(frame: &FaceFrame, options: RatioOptions) -> Self {
        Self { options, mask: ratio_mask::of(frame) }
    }

    /// How much of a ratio is kept at a pixel: 1 on skin, 0 at eyes, lips, brows, nostrils and the outline.
    pub fn mask(&self, pixel: usize) -> f32 {
        self.mask[pixel]
    }

    /// What an expression changes. Both are the same face in the same light.
    pub fn ratio(&self, neutral: &FaceImage, expressive: &FaceImage) -> RatioImage {
        let options = &self.options;
        let known: Vec<f32> = (0..neutral.pixels())
            .map(|pixel| {
                let both = neutral.colour(pixel).is_some() && expressive.colour(pixel).is_some();
                if both && self.mask[pixel] > 0.0 { 1.0 } else { 0.0 }
            })
            .collect();
        let luminance = |face: &FaceImage| -> Vec<f32> {
            (0..face.pixels()).map(|pixel| face.luminance(pixel).unwrap_or(0.0)).collect()
        };
        let (before, after) = (luminance(neutral), luminance(expressive));
        let divided = |sigma: f32| -> Vec<f32> {
            let (before, after) = (blur_within(&before, &known, sigma), blur_within(&after, &known, sigma));
            after
                .iter()
                .zip(before)
                .map(|(after, before)| ((after + DARKEST) / (before + DARKEST)).ln())
                .collect()
        };
        let (fine, coarse) = (divided(options.fine), divided(options.coarse));
        let rough = self.roughness(&before, &known);
        let mixed: Vec<f32> =
            (0..fine.len()).map(|pixel| fine[pixel] + (coarse[pixel] - fine[pixel]) * rough[pixel]).collect();
        let drift = blur_within(&mixed, &known, options.drift);
        let log_ratio = (0..mixed.len()).map(|pixel| {
            let change = options.limit * ((mixed[pixel] - drift[pixel]) / options.limit).tanh();
            let kept = if change > 0.0 { options.brightening } else { 1.0 };
            change * kept * self.mask[pixel] * known[pixel]
        });
        RatioImage { log_ratio: log_ratio.collect() }
    }

    /// How rough the neutral skin is around each pixel: 0 smooth, 1 a beard.
    fn roughness(&self, luminance: &[f32], known: &[f32]) -> Vec<f32> {
        let logarithm: Vec<f32> = luminance.iter().map(|value| (value.max(0.0) + DARKEST).ln()).collect();
        let smooth = blur_within(&logarithm, known, self.options.fine);
        let squares: Vec<f32> = logarithm.iter().zip(smooth).map(|(a, b)| (a - b) * (a - b)).collect();
        let [low, high] = self.options.roughness;
        let energy = blur_within(&squares, known, self.options.coarse);
        energy.into_iter().map(|mean| ((mean.max(0.0).sqrt() - low) / (high - low)).clamp(0.0, 1.0)).collect()
    }

    /// The texture volume of a region: the neutral, then the expressive pictures in the order of their states (002 §V.iii),
    /// with the performer's own colours. `None` unless that makes 3 to 6 layers.
    pub fn volume(
        &self,
        region: Region,
        frame: &FaceFrame,
        neutral: &FaceImage,
        expressive: &[FaceImage],
    ) -> Option<TextureVolume> {
        let patch = Patch::of(region, frame);
        let pixels: Vec<usize> = patch.places().map(|place| pixel_of(&place)).collect();
        let layer = |face: &FaceImage, ratio: &RatioImage| {
            let log_ratio: Vec<f32> = pixels.iter().map(|&pixel| ratio.at(pixel)).collect();
            Layer::new(&log_ratio, pixels.iter().map(|&pixel| face.srgb(pixel)).collect())
        };
        let first = layer(neutral, &RatioImage::none());
        let others = expressive.iter().map(|face| layer(face, &self.ratio(neutral, face)));
        TextureVolume::new(region, patch, std::iter::once(first).chain(others).collect())
    }
}

/// Natural logarithm of an expressive luminance over the neutral's, for each pixel of the shared frame.
#[derive(Debug, Clone, PartialEq)]
pub struct RatioImage {
    log_ratio: Vec<f32>,
}

impl RatioImage {
    /// Nothing changes.
    pub fn none() -> Self {
        Self { log_ratio: vec![0.0; FRAME_SIZE[0] * FRAME_SIZE[1]] }
    }

    /// The logarithm at a pixel.
    pub fn at(&self, pixel: usize) -> f32 {
        self.log_ratio[pixel]
    }

    /// The skin of another face with the expression's light on it: colour × exp(gain × logarithm).
    pub fn applied(&self, face: &FaceImage, gain: f32) -> FaceImage {
        let mut changed = FaceImage::unknown();
        for pixel in 0..face.pixels() {
            if let Some(colour) = face.colour(pixel) {
                let factor = (gain * self.log_ratio[pixel]).exp();
                changed.set(pixel, colour.map(|value| value * factor));
            }
        }
        changed
    }
}

fn pixel_of(place: &Point2<f64>) -> usize {
    place.y as usize * FRAME_SIZE[0] + place.x as usize
}
