//! The texture volume of a region: its look from neutral to most expressive, in layers.

use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use super::{Area, FRAME_SIZE, FaceFrame, Region, plane::between};

/// Fewest layers of a volume: neutral, between, expressive (002 §V.iii: "three-layer textures are the minimum needed").
pub const FEWEST_LAYERS: usize = 3;
/// Most layers of a volume (002 §V.iii: "five or six layers provide perceptually smooth animations").
pub const MOST_LAYERS: usize = 6;
/// Steps of a stored ratio in one power of e: 8,192 keep ±4 to a ten-thousandth.
const STEPS: f32 = 8192.0;

/// A rectangle of pixels of the shared frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Patch {
    /// The first pixel, across and down.
    pub origin: [u16; 2],
    /// Pixels, across and down.
    pub size: [u16; 2],
}

impl Patch {
    /// The rectangle around a region's area.
    pub fn of(region: Region, frame: &FaceFrame) -> Self {
        let area = Area::of(region, frame);
        let bound = |axis: usize| {
            let (centre, reach) = (area.centre[axis], area.across[axis].abs() + area.down[axis].abs());
            let last = (FRAME_SIZE[axis] - 1) as f64;
            ((centre - reach).floor().clamp(0.0, last), (centre + reach).ceil().clamp(0.0, last))
        };
        let ((left, right), (top, bottom)) = (bound(0), bound(1));
        Self {
            origin: [left as u16, top as u16],
            size: [(right - left) as u16 + 1, (bottom - top) as u16 + 1],
        }
    }

    /// Number of its pixels.
    pub fn pixels(&self) -> usize {
        usize::from(self.size[0]) * usize::from(self.size[1])
    }

    /// The places of its pixels in the frame, row by row.
    pub fn places(&self) -> impl Iterator<Item = Point2<f64>> {
        let ([left, top], [width, height]) = (self.origin, self.size);
        (0..height).flat_map(move |y| {
            (0..width)
                .map(move |x| Point2::new(f64::from(left) + f64::from(x), f64::from(top) + f64::from(y)))
        })
    }
}

/// One layer of a volume.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Layer {
    /// Natural logarithm of luminance over that of the neutral skin, a value for each pixel of the patch.
    log_ratio: Vec<i16>,
    /// The performer's own skin, sRGB, a colour for each pixel of the patch.
    colour: Vec<[u8; 3]>,
}

impl Layer {
    /// One value of each kind for each pixel; ratios beyond ±4 are held there, what is not a number is 0.
    pub fn new(log_ratio: &[f32], colour: Vec<[u8; 3]>) -> Self {
        let stored = log_ratio.iter().map(|ratio| (ratio * STEPS).round() as i16).collect();
        Self { log_ratio: stored, colour }
    }

    /// Logarithm of luminance over the neutral's, at a pixel of the patch.
    pub fn log_ratio(&self, pixel: usize) -> f32 {
        f32::from(self.log_ratio[pixel]) / STEPS
    }

    /// The performer's own colour at a pixel of the patch, sRGB.
    pub fn colour(&self, pixel: usize) -> [u8; 3] {
        self.colour[pixel]
    }
}

/// A region's layers, neutral first (002 §V.iii).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TextureVolume {
    region: Region,
    patch: Patch,
    layers: Vec<Layer>,
}

impl TextureVolume {
    /// `None` unless there are 3 to 6 layers, all as large as the patch, which lies in the frame.
    pub fn new(region: Region, patch: Patch, layers: Vec<Layer>) -> Option<Self> {
        Some(Self { region, patch, layers }).filter(Self::is_whole)
    }

    /// Whether it keeps its own rules; what comes out of a file may not.
    pub fn is_whole(&self) -> bool {
        let within = |axis: usize| {
            let end = usize::from(self.patch.origin[axis]) + usize::from(self.patch.size[axis]);
            self.patch.size[axis] > 0 && end <= FRAME_SIZE[axis]
        };
        let pixels = self.patch.pixels();
        within(0)
            && within(1)
            && (FEWEST_LAYERS..=MOST_LAYERS).contains(&self.layers.len())
            && self.layers.iter().all(|layer| layer.log_ratio.len() == pixels && layer.colour.len() == pixels)
    }

    /// Which region.
    pub fn region(&self) -> Region {
        self.region
    }

    /// Which pixels of the frame.
    pub fn patch(&self) -> Patch {
        self.patch
    }

    /// Neutral first.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The two layers between which a state lies, and the share of the second: 0 is the first layer, 1 the last.
    pub fn between(&self, state: f32) -> (usize, usize, f32) {
        let last = self.layers.len() - 1;
        let at = state.clamp(0.0, 1.0) * last as f32;
        let lower = (at.floor() as usize).min(last - 1);
        (lower, lower + 1, at - lower as f32)
    }

    /// Logarithm of luminance over the neutral's at a place of the frame, linear across pixels and between layers; 0 beyond
    /// the patch.
    pub fn log_ratio(&self, place: &Point2<f64>, state: f32) -> f32 {
        let (lower, upper, share) = self.between(state);
        let size = self.patch.size.map(usize::from);
        let at = [0, 1].map(|axis| place[axis] - f64::from(self.patch.origin[axis]));
        let of = |layer: usize| between(size, at, |pixel| self.layers[layer].log_ratio(pixel)).unwrap_or(0.0);
        of(lower) * (1.0 - share) + of(upper) * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume() -> TextureVolume {
        let patch = Patch { origin: [10, 20], size: [3, 2] };
        let layer = |slope: f32| {
            let ratios: Vec<f32> = (0..6).map(|pixel| slope * (pixel % 3) as f32).collect();
            Layer::new(&ratios, vec![[0; 3]; 6])
        };
        TextureVolume::new(Region::Chin, patch, vec![layer(0.0), layer(0.25), layer(-0.5)]).unwrap()
    }

    #[test]
    fn layers_and_pixels_blend_in_straight_lines() {
        let volume = volume();
        let at = |x: f64, state: f32| volume.log_ratio(&Point2::new(x, 20.5), state);
        assert!((at(11.5, 0.5) - 0.375).abs() < 1e-4);
        assert!((at(12.0, 0.75) - (-0.25)).abs() < 1e-4);
        assert!(at(12.0, 0.0).abs() < 1e-6);
        assert!((at(12.0, 7.0) + 1.0).abs() < 1e-4);
        assert!(at(9.0, 1.0).abs() < 1e-6);
        assert!(volume.log_ratio(&Point2::new(f64::NAN, 20.0), 1.0).abs() < 1e-6);
    }

    #[test]
    fn broken_volumes_are_refused() {
        let good = volume();
        let patch = good.patch;
        assert!(TextureVolume::new(Region::Chin, patch, good.layers[..2].to_vec()).is_none());
        let beyond = Patch { origin: [511, 20], size: [3, 2] };
        assert!(TextureVolume::new(Region::Chin, beyond, good.layers.clone()).is_none());
        let short = Patch { size: [3, 3], ..patch };
        assert!(TextureVolume::new(Region::Chin, short, good.layers).is_none());
    }
}
