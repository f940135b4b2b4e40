//! What living skin shows at a place of the shared frame: the regions, blended to the neutral and with one another.
//!
//! The device composes the same (`view::LivingModel`); this is for textures that are baked, and to hold the device against.

use nalgebra::{Point2, Vector3};

use super::{AppearanceStates, Area, FaceFrame, TextureVolume};

/// Pixels of the shared frame from a region's edge to where it shows wholly (002 §V.iii: "a ten-pixel linear alpha mask").
pub const ALPHA_RAMP: f64 = 10.0;

/// Volumes and where they lie.
#[derive(Debug, Clone)]
pub struct Composition<'a> {
    volumes: Vec<(&'a TextureVolume, Area)>,
}

impl<'a> Composition<'a> {
    /// Of volumes in a frame.
    pub fn new(frame: &FaceFrame, volumes: &'a [TextureVolume]) -> Self {
        Self { volumes: volumes.iter().map(|volume| (volume, Area::of(volume.region(), frame))).collect() }
    }

    /// Logarithm of luminance over the neutral's. Where regions overlap, both of which are shown, it is their mean and not
    /// their sum: what lies in both is one fold.
    pub fn log_ratio(&self, place: &Point2<f64>, states: &AppearanceStates) -> f32 {
        let (mut sum, mut share) = (0.0, 0.0);
        for (volume, alpha, state) in self.shown(place, states) {
            sum += alpha * volume.log_ratio(place, state);
            share += alpha * state;
        }
        sum / share.max(1.0)
    }

    /// The performer's own colour, linear light, and the share of it in 0..=1: the rest is the target's own. Between the
    /// neutral layer and the next one the colour is the next one's and the share rises, so that the target's neutral is
    /// its own.
    pub fn own(&self, place: &Point2<f64>, states: &AppearanceStates) -> (Vector3<f32>, f32) {
        let (mut sum, mut share) = (Vector3::zeros(), 0.0);
        for (volume, alpha, state) in self.shown(place, states) {
            let (lower, upper, towards) = volume.between(state);
            for (layer, weight) in [(lower, 1.0 - towards), (upper, towards)] {
                if layer > 0 {
                    sum += colour(volume, layer, place) * (alpha * weight);
                    share += alpha * weight;
                }
            }
        }
        let most = share.max(1.0);
        // The device blends squares of what is stored, and so does this.
        let squared = sum / share.max(f32::MIN_POSITIVE);
        (squared.map(|value| value.sqrt().powf(2.2)), share / most)
    }

    /// Volumes that show at a place, how much, and in which state.
    fn shown(
        &self,
        place: &Point2<f64>,
        states: &AppearanceStates,
    ) -> impl Iterator<Item = (&'a TextureVolume, f32, f32)> {
        self.volumes.iter().filter_map(move |(volume, area)| {
            let state = states.get(volume.region()).filter(|state| *state > 0.0)?;
            let alpha = area.alpha(place, ALPHA_RAMP) as f32;
            (alpha > 0.0).then_some((*volume, alpha, state))
        })
    }
}

/// A layer's colour, squared, linear across pixels and held beyond the patch's edge.
fn colour(volume: &TextureVolume, layer: usize, place: &Point2<f64>) -> Vector3<f32> {
    let patch = volume.patch();
    let [(left, right, u), (top, bottom, v)] = std::array::from_fn(|axis| {
        let last = f64::from(patch.size[axis] - 1);
        let at = (place[axis] - f64::from(patch.origin[axis])).clamp(0.0, last);
        let lower = at.floor();
        (lower as usize, (lower + 1.0).min(last) as usize, (at - lower) as f32)
    });
    let width = usize::from(patch.size[0]);
    let at = |x: usize, y: usize| {
        let stored = volume.layers()[layer].colour(y * width + x);
        Vector3::from(stored.map(|channel| (f32::from(channel) / 255.0).powi(2)))
    };
    (at(left, top) * (1.0 - u) + at(right, top) * u) * (1.0 - v)
        + (at(left, bottom) * (1.0 - u) + at(right, bottom) * u) * v
}
