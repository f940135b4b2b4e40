//! Errors as colours, and the key to them.

use image::{Rgba, RgbaImage};

use crate::view::{text, text_size};

/// From no error to the largest shown, evenly spaced, sRGB: the lightness rises all the way, as in viridis.
const RAMP: [[u8; 3]; 6] =
    [[68, 1, 84], [65, 68, 135], [42, 120, 142], [34, 168, 132], [122, 209, 81], [253, 231, 37]];
/// What does not count.
pub(super) const UNCOUNTED: [f32; 3] = [0.45, 0.45, 0.45];
const INK: [u8; 4] = [214, 219, 226, 255];
/// Pixels of the key: the bar's height and the air around it.
const BAR: u32 = 18;
const AIR: u32 = 12;
/// Marks on the key, evenly spaced.
const MARKS: u32 = 5;

/// The sRGB colour, 0..=1, of a share of the largest error shown; shares beyond 0..=1 take the colour at the end.
pub fn error_colour(share: f64) -> [f32; 3] {
    let last = RAMP.len() - 1;
    // A share that is not a number is no error.
    let place = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) * last as f64 };
    let below = (place.floor() as usize).min(last - 1);
    let t = place - below as f64;
    std::array::from_fn(|k| {
        let [a, b] = [below, below + 1].map(|i| f64::from(RAMP[i][k]));
        ((a + (b - a) * t) / 255.0) as f32
    })
}

/// A round length, 1, 2, 3, 4, 6 or 8 times a power of ten, that is not below the given one; 1 where that is not positive.
pub(super) fn round_length(length: f64) -> f64 {
    if !(length.is_normal() && length > 0.0) {
        return 1.0;
    }
    let power = 10_f64.powf(length.log10().floor());
    let steps = [1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0];
    // A hair of tolerance, so that 0.2 stays 0.2.
    steps
        .into_iter()
        .map(|step| step * power)
        .find(|round| *round >= length * (1.0 - 1e-9))
        .unwrap_or(10.0 * power)
}

/// A strip as wide as a picture with the colours from 0 to `top` millimetres, to stand under it.
pub(super) fn key(width: u32, top: f64, paper: Rgba<u8>) -> RgbaImage {
    let [_, letters] = text_size("0", 1);
    let mut strip = RgbaImage::from_pixel(width, BAR + letters + 2 * AIR, paper);
    let (left, length) = (width / 4, (width / 2).max(1));
    for x in 0..length.min(width.saturating_sub(left)) {
        let colour = error_colour(f64::from(x) / f64::from(length)).map(|c| (c * 255.0).round() as u8);
        for y in 0..BAR {
            strip.put_pixel(left + x, y, Rgba([colour[0], colour[1], colour[2], 255]));
        }
    }
    for mark in 0..=MARKS {
        let share = f64::from(mark) / f64::from(MARKS);
        let more = if mark == MARKS { " mm or more" } else { "" };
        let words = format!("{}{more}", short(top * share));
        let middle = i64::from(left) + (share * f64::from(length)) as i64;
        let number = text_size(&short(top * share), 1)[0];
        text(&mut strip, [middle - i64::from(number / 2), i64::from(BAR + AIR / 2)], 1, &words, INK);
    }
    strip
}

/// A number with as many digits as it needs, at most four decimals.
fn short(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lightness(colour: [f32; 3]) -> f64 {
        let linear = colour.map(|c| f64::from(c).powf(2.2));
        0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    }

    #[test]
    fn lightness_rises_with_the_error() {
        let steps: Vec<f64> = (0..=100).map(|i| lightness(error_colour(f64::from(i) / 100.0))).collect();
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1]));
        let bits = |share| error_colour(share).map(f32::to_bits);
        assert_eq!((bits(-1.0), bits(f64::NAN), bits(7.0)), (bits(0.0), bits(0.0), bits(1.0)));
    }

    #[test]
    fn lengths_are_rounded_up() {
        for (length, round) in [(0.2, 0.2), (0.21, 0.3), (8.1, 10.0), (1.0, 1.0), (0.0, 1.0), (1e-4, 1e-4)] {
            assert!(
                (round_length(length) / round - 1.0).abs() < 1e-9,
                "{length} became {}",
                round_length(length)
            );
        }
        assert_eq!((short(0.4), short(10.0), short(0.0)), ("0.4".into(), "10".into(), "0".into()));
    }

    #[test]
    fn the_key_runs_through_the_colours() {
        let strip = key(400, 2.0, Rgba([1, 2, 3, 255]));
        assert_eq!(strip.get_pixel(100, 4).0, [68, 1, 84, 255]);
        assert!(strip.get_pixel(299, 4)[0] > 245);
        assert_eq!(strip.get_pixel(99, 4).0, [1, 2, 3, 255]);
        assert_eq!(key(1, 2.0, Rgba([0; 4])).width(), 1);
    }
}
