//! Ratio images: what an expression does to the light of the skin, apart from whose skin it is.
//!
//! 002 §V.iii lays a performer's own textures over one another and so shows nobody but that performer. A quotient of two
//! pictures of one face (Liu, Shan and Zhang's expression ratio image) can be put on another face.

use nalgebra::Point2;

use super::{
    DARKEST, FRAME_SIZE, FaceFrame, FaceImage, Layer, Patch, Region, TextureVolume,
    plane::{blur_within, mirrored, places, sample},
    ratio_mask,
};

/// Share of a ratio that is put on another face in the same strength of expression: errs least
/// (`docs/benchmarks/appearance.md`).
pub const TRANSFER_GAIN: f32 = 0.8;
/// Below this a side of the face says nothing, logarithm.
const SILENCE: f32 = 1e-4;

/// How a ratio is taken. Lengths are pixels of the shared frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RatioOptions {
    /// Blur of both luminances before they are divided, for lines.
    pub fine: f32,
    /// The same for folds.
    pub coarse: f32,
    /// How much of what is finer than `coarse` is kept on smooth skin; lines carry over less well than folds do.
    pub fine_share: f32,
    /// Roughness of the neutral skin, in logarithms of luminance, from which still less is kept and from which nothing
    /// is: a beard must not be printed onto another face.
    pub roughness: [f32; 2],
    /// What is wider than this is light and not skin, and is taken out.
    pub drift: f32,
    /// Where both sides of the face change alike, in a window this wide, each takes part of the other's change; where one
    /// alone does, both keep their own. 0 leaves every side to itself.
    pub symmetry: f32,
    /// The logarithm saturates towards this.
    pub limit: f32,
    /// How much of a brightening is kept; all of a darkening is.
    pub brightening: f32,
}

impl Default for RatioOptions {
    fn default() -> Self {
        Self {
            fine: 3.0,
            coarse: 10.0,
            fine_share: 0.5,
            roughness: [0.06, 0.12],
            drift: 60.0,
            symmetry: 20.0,
            limit: 0.35,
            brightening: 0.7,
        }
    }
}

/// Takes ratios in one frame.
#[derive(Debug, Clone)]
pub struct RatioFilter {
    options: RatioOptions,
    mask: Vec<f32>,
    /// 1 where pictures are compared: skin as far as the outline, so that the drift is known up to the mask's edge.
    skin: Vec<f32>,
}

impl RatioFilter {
    /// Prepares the masks.
    pub fn new(frame: &FaceFrame, options: RatioOptions) -> Self {
        let (mask, skin) = ratio_mask::of(frame);
        Self { options, mask, skin }
    }

    /// How much of a ratio is kept at a pixel: 1 on skin, 0 at eyes, lips, brows, nostrils and the outline.
    pub fn mask(&self, pixel: usize) -> f32 {
        self.mask[pixel]
    }

    /// The same at a place of the frame; 0 beyond it.
    pub fn mask_at(&self, place: &Point2<f64>) -> f32 {
        sample(&self.mask, place)
    }

    /// What an expression changes. Both are the same face in the same light; brightening the whole of one of them changes
    /// nothing.
    pub fn ratio(&self, neutral: &FaceImage, expressive: &FaceImage) -> RatioImage {
        let options = &self.options;
        let known: Vec<f32> = (0..self.skin.len())
            .map(|pixel| {
                let seen = neutral.colour(pixel).is_some() && expressive.colour(pixel).is_some();
                if seen { self.skin[pixel] } else { 0.0 }
            })
            .collect();
        let (before, after) = (luminance(neutral), luminance(expressive));
        let divided = |sigma: f32| -> Vec<f32> {
            let (before, after) = (blur_within(&before, &known, sigma), blur_within(&after, &known, sigma));
            let logarithm = |(after, before): (f32, f32)| ((after + DARKEST) / (before + DARKEST)).ln();
            after.into_iter().zip(before).map(logarithm).collect()
        };
        let (fine, mut change) = (divided(options.fine), divided(options.coarse));
        for (pixel, rough) in self.roughness(&before, &known).into_iter().enumerate() {
            change[pixel] += (fine[pixel] - change[pixel]) * options.fine_share * (1.0 - rough);
        }
        let drift = blur_within(&change, &known, options.drift);
        change.iter_mut().zip(drift).for_each(|(change, drift)| *change -= drift);
        let change = self.symmetric(change, &known);
        let kept = |pixel: usize| {
            let held = options.limit * (change[pixel] / options.limit).tanh();
            let share = if held > 0.0 { options.brightening } else { 1.0 };
            let value = held * share * self.mask[pixel] * known[pixel];
            if value.is_finite() { value } else { 0.0 }
        };
        RatioImage { log_ratio: (0..change.len()).map(kept).collect() }
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
        let pixels: Vec<usize> =
            patch.places().map(|place| place.y as usize * FRAME_SIZE[0] + place.x as usize).collect();
        let layer = |face: &FaceImage, ratio: &RatioImage| {
            let log_ratio: Vec<f32> = pixels.iter().map(|&pixel| ratio.at(pixel)).collect();
            Layer::new(&log_ratio, pixels.iter().map(|&pixel| face.srgb(pixel)).collect())
        };
        let first = layer(neutral, &RatioImage::none());
        let others = expressive.iter().map(|face| layer(face, &self.ratio(neutral, face)));
        TextureVolume::new(region, patch, std::iter::once(first).chain(others).collect())
    }

    /// How rough the neutral skin is around each pixel: 0 smooth, 1 a beard.
    fn roughness(&self, luminance: &[f32], known: &[f32]) -> Vec<f32> {
        let logarithm: Vec<f32> = luminance.iter().map(|value| (value.max(0.0) + DARKEST).ln()).collect();
        let smooth = blur_within(&logarithm, known, self.options.fine);
        let squares: Vec<f32> = logarithm.iter().zip(smooth).map(|(a, b)| (a - b) * (a - b)).collect();
        let [low, high] = self.options.roughness;
        let share = |mean: f32| ((mean.max(0.0).sqrt() - low) / (high - low)).clamp(0.0, 1.0);
        blur_within(&squares, known, self.options.coarse).into_iter().map(share).collect()
    }

    /// Moves each side towards the mean of both, the more the closer they are in strength.
    fn symmetric(&self, change: Vec<f32>, known: &[f32]) -> Vec<f32> {
        if self.options.symmetry <= 0.0 {
            return change;
        }
        let squares: Vec<f32> = change.iter().map(|value| value * value).collect();
        let energy = blur_within(&squares, known, self.options.symmetry);
        let strength = |pixel: usize| energy[pixel].max(0.0).sqrt() + SILENCE;
        let mean = |pixel: usize| {
            let here = change[pixel];
            let Some(there) = mirrored(pixel).filter(|&there| known[there] > 0.0) else { return here };
            let (own, other) = (strength(pixel), strength(there));
            here + 0.5 * own.min(other) / own.max(other) * (change[there] - here)
        };
        (0..change.len()).map(mean).collect()
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

    /// A logarithm for each place of the frame, such as the mean of several people's; what is not a number is 0.
    pub fn from_fn(log_ratio: impl Fn(&Point2<f64>) -> f32) -> Self {
        let finite = |place| Some(log_ratio(&place)).filter(|value| value.is_finite()).unwrap_or(0.0);
        Self { log_ratio: places().map(finite).collect() }
    }

    /// The logarithm at a pixel.
    pub fn at(&self, pixel: usize) -> f32 {
        self.log_ratio[pixel]
    }

    /// The logarithm at a place of the frame, linear between pixels, 0 beyond it.
    pub fn at_place(&self, place: &Point2<f64>) -> f32 {
        sample(&self.log_ratio, place)
    }

    /// The skin of another face with the expression's light on it: linear colour × exp(gain × logarithm).
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

fn luminance(face: &FaceImage) -> Vec<f32> {
    (0..face.pixels()).map(|pixel| face.luminance(pixel).unwrap_or(0.0)).collect()
}
