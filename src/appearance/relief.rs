//! Relief of wrinkles out of their shading: "dark is deep".
//!
//! A ratio image says how light changes, not how the surface does. In light from the front a furrow sees less of the sky
//! than the skin beside it and is darker; the reverse is assumed here, which is a heuristic and no measurement: flushed
//! skin, a shadow or a highlight become relief too. Hence the narrow band and the low bound.

use nalgebra::Point2;

use super::plane::{blur_within, places, sample};

/// A ratio is not brought back from under less of its mask.
const LEAST_MASK: f32 = 0.05;

/// How a log ratio becomes relief.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReliefOptions {
    /// Widths of blur between which relief lies, pixels of the shared frame: a pixel is about a third of a millimetre.
    pub band: [f32; 2],
    /// Height of a change of one in the logarithm, millimetres.
    pub height: f32,
    /// No place rises or sinks by more, millimetres.
    pub bound: f32,
}

impl Default for ReliefOptions {
    fn default() -> Self {
        Self { band: [1.5, 10.0], height: 2.5, bound: 0.4 }
    }
}

/// Height over the neutral skin for each pixel of the shared frame, millimetres along the outward normal.
#[derive(Debug, Clone, PartialEq)]
pub struct Relief {
    heights: Vec<f32>,
}

impl Relief {
    /// Of a ratio, a logarithm of luminance for each place of the frame: [`RatioImage::at_place`](super::RatioImage::at_place),
    /// or a volume's [`log_ratio`](super::TextureVolume::log_ratio) in a state. `mask` is what the ratio was masked with
    /// ([`RatioFilter::mask_at`](super::RatioFilter::mask_at)): the mask's edge is no furrow. What is not a number changes nothing.
    pub fn new(
        log_ratio: impl Fn(&Point2<f64>) -> f32,
        mask: impl Fn(&Point2<f64>) -> f32,
        options: &ReliefOptions,
    ) -> Self {
        let held = |share: f32| if share > 0.0 { share.min(1.0) } else { 0.0 };
        let mask: Vec<f32> = places().map(|place| held(mask(&place))).collect();
        let whole = |(place, &mask): (Point2<f64>, &f32)| {
            let value = log_ratio(&place) / mask.max(LEAST_MASK);
            if value.is_finite() { value.clamp(-1.0, 1.0) } else { 0.0 }
        };
        let change: Vec<f32> = places().zip(&mask).map(whole).collect();
        let [fine, wide] = options.band.map(|sigma| blur_within(&change, &mask, sigma));
        let height = |pixel: usize| {
            let free = (fine[pixel] - wide[pixel]) * options.height * mask[pixel];
            if options.bound > 0.0 { options.bound * (free / options.bound).tanh() } else { 0.0 }
        };
        Self { heights: (0..mask.len()).map(height).collect() }
    }

    /// Height at a place of the frame, millimetres: a valley is below 0, beyond the frame is 0.
    pub fn height(&self, place: &Point2<f64>) -> f32 {
        sample(&self.heights, place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A dark line, 6 pixels wide, down the middle.
    fn furrow(depth: f32) -> impl Fn(&Point2<f64>) -> f32 {
        move |place| -depth * (-((place.x - 256.0) / 3.0).powi(2) / 2.0).exp() as f32
    }

    #[test]
    fn a_dark_line_is_a_valley_with_shoulders() {
        let relief = Relief::new(furrow(0.1), |_| 1.0, &ReliefOptions::default());
        let at = |x: f64| relief.height(&Point2::new(x, 300.0));
        assert!(at(256.0) < -0.1 && at(256.0) > -0.25, "{}", at(256.0));
        assert!(at(272.0) > 0.005 && (at(272.0) - at(240.0)).abs() < 1e-4);
        assert!(at(400.0).abs() < 1e-4);
        let deep = Relief::new(furrow(5.0), |_| 1.0, &ReliefOptions::default());
        assert!(deep.height(&Point2::new(256.0, 300.0)).abs() <= 0.4);
    }

    #[test]
    fn wide_shading_and_garbage_are_flat() {
        let slope = Relief::new(|place| (place.x as f32 - 256.0) * 0.002, |_| 1.0, &ReliefOptions::default());
        assert!(slope.height(&Point2::new(256.0, 300.0)).abs() < 1e-3);
        let garbage = |place: &Point2<f64>| [f32::NAN, f32::INFINITY, -9e9][place.x as usize % 3];
        let relief = Relief::new(garbage, |_| f32::NAN, &ReliefOptions::default());
        assert!(places().all(|place| relief.height(&place).abs() <= 0.4));
        assert!(slope.height(&Point2::new(-3.0, f64::NAN)).abs() < f32::EPSILON);
    }

    #[test]
    fn the_edge_of_a_mask_is_no_furrow() {
        let mask = |place: &Point2<f64>| ((place.x - 200.0) / 8.0).clamp(0.0, 1.0) as f32;
        let relief = Relief::new(|place| -0.3 * mask(place), mask, &ReliefOptions::default());
        assert!(places().all(|place| relief.height(&place).abs() < 0.02));
    }
}
