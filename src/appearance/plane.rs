//! Numbers over the shared frame, one for each pixel: blur, mirror image, values between pixels.

use image::{ImageBuffer, Luma, imageops};
use nalgebra::Point2;

use super::FRAME_SIZE;

/// Below this share of its weights a blurred value stands on nothing.
const LEAST_WEIGHT: f32 = 1e-3;

/// The places of all pixels, row by row.
pub(super) fn places() -> impl Iterator<Item = Point2<f64>> {
    let [width, height] = FRAME_SIZE;
    (0..height).flat_map(move |y| (0..width).map(move |x| Point2::new(x as f64, y as f64)))
}

/// Blurs values over those pixels alone that have weight (normalised convolution): what is unknown does not bleed in.
/// 0 where there is no weight in reach.
pub(super) fn blur_within(values: &[f32], weights: &[f32], sigma: f32) -> Vec<f32> {
    let weighted = values.iter().zip(weights).map(|(value, weight)| value * weight).collect();
    let (sums, shares) = (blur(weighted, sigma), blur(weights.to_vec(), sigma));
    let divide = |(sum, share): (f32, f32)| if share > LEAST_WEIGHT { sum / share } else { 0.0 };
    sums.into_iter().zip(shares).map(divide).collect()
}

/// A Gaussian of `sigma` pixels; beyond the frame the values at its edge go on. Nothing is done for 0 or what is no number.
///
/// The image crate's blur and not OpenCV's: one thread, one order, the same on any processor.
pub(super) fn blur(values: Vec<f32>, sigma: f32) -> Vec<f32> {
    if !(sigma.is_normal() && sigma > 0.0) || values.len() != FRAME_SIZE[0] * FRAME_SIZE[1] {
        return values;
    }
    let [width, height] = FRAME_SIZE.map(|side| side as u32);
    match ImageBuffer::<Luma<f32>, _>::from_raw(width, height, values) {
        Some(picture) => imageops::blur(&picture, sigma).into_raw(),
        None => Vec::new(),
    }
}

/// The pixel on the other side of the face; the frame's middle is a column of pixels, so the first column has none.
pub(super) fn mirrored(pixel: usize) -> Option<usize> {
    let [width, _] = FRAME_SIZE;
    let (x, y) = (pixel % width, pixel / width);
    (x > 0).then(|| y * width + width - x)
}

/// The value at a place, linear between pixels; 0 beyond the frame.
pub(super) fn sample(values: &[f32], place: &Point2<f64>) -> f32 {
    between(FRAME_SIZE, [place.x, place.y], |pixel| values[pixel]).unwrap_or(0.0)
}

/// The value at a place among so many pixels, linear between their centres; `None` beyond the outermost, and of what is
/// no number.
pub(super) fn between(
    [width, height]: [usize; 2],
    [x, y]: [f64; 2],
    value: impl Fn(usize) -> f32,
) -> Option<f32> {
    if !((0.0..=(width - 1) as f64).contains(&x) && (0.0..=(height - 1) as f64).contains(&y)) {
        return None;
    }
    let (left, top) = (x as usize, y as usize);
    let (u, v) = ((x - left as f64) as f32, (y - top as f64) as f32);
    let at = |x: usize, y: usize| value(y.min(height - 1) * width + x.min(width - 1));
    let row = |y: usize| at(left, y) * (1.0 - u) + at(left + 1, y) * u;
    Some(row(top) * (1.0 - v) + row(top + 1) * v)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIXELS: usize = FRAME_SIZE[0] * FRAME_SIZE[1];

    fn pixel(x: usize, y: usize) -> usize {
        y * FRAME_SIZE[0] + x
    }

    #[test]
    fn a_point_becomes_a_gaussian() {
        let mut point = vec![0.0; PIXELS];
        point[pixel(256, 288)] = 1.0;
        for sigma in [3.0_f32, 12.0, 40.0] {
            let spread = blur(point.clone(), sigma);
            let peak = 1.0 / (2.0 * std::f32::consts::PI * sigma * sigma);
            for (dx, dy) in [(0, 0), (2, 1), (5, 4)] {
                let expected = peak * (-((dx * dx + dy * dy) as f32) / (2.0 * sigma * sigma)).exp();
                let found = spread[pixel(256 + dx, 288 + dy)];
                assert!((found / expected - 1.0).abs() < 0.01, "{sigma}: {found} for {expected}");
            }
        }
        assert_eq!(blur(point.clone(), f32::NAN), point);
    }

    #[test]
    fn the_unknown_does_not_bleed_in() {
        let mut values = vec![0.5; PIXELS];
        let mut weights = vec![1.0; PIXELS];
        for y in 200..300 {
            for x in 200..300 {
                values[pixel(x, y)] = 900.0;
                weights[pixel(x, y)] = 0.0;
            }
        }
        let blurred = blur_within(&values, &weights, 6.0);
        assert!((blurred[pixel(198, 250)] - 0.5).abs() < 1e-5);
        assert!(blurred[pixel(250, 250)].abs() < f32::EPSILON);
    }

    #[test]
    fn places_between_pixels_are_linear() {
        let ramp: Vec<f32> = places().map(|place| (place.x + 10.0 * place.y) as f32).collect();
        assert!((sample(&ramp, &Point2::new(30.25, 40.5)) - 435.25).abs() < 1e-3);
        assert!((sample(&ramp, &Point2::new(511.0, 575.0)) - 6261.0).abs() < 1e-3);
        assert!(sample(&ramp, &Point2::new(511.5, 3.0)).abs() < f32::EPSILON);
        assert!(sample(&ramp, &Point2::new(f64::NAN, 3.0)).abs() < f32::EPSILON);
        assert_eq!(mirrored(pixel(100, 7)), Some(pixel(412, 7)));
        assert_eq!(mirrored(pixel(0, 7)), None);
    }
}
