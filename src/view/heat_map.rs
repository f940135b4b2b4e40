//! Numbers on a grid as a picture in false colours, with a legend.

use image::{Rgba, RgbaImage};

use super::text::{text, text_size};

const PAPER: [u8; 4] = [22, 25, 30, 255];
const NOTHING: [u8; 4] = [44, 48, 56, 255];
const INK: [u8; 4] = [214, 219, 226, 255];
/// Height that the map is enlarged to at least, pixels.
const HEIGHT: u32 = 720;
const GAP: u32 = 24;
const BAR: u32 = 22;
/// Room for the legend's numbers.
const NUMBERS: u32 = 110;
const TICKS: u32 = 5;
/// From low to high: dark blue, blue-green, green, yellow; as light grows, so does the value (after viridis).
const SCALE: [[f64; 3]; 6] = [
    [68.0, 1.0, 84.0],
    [65.0, 68.0, 135.0],
    [42.0, 120.0, 142.0],
    [34.0, 168.0, 132.0],
    [122.0, 209.0, 81.0],
    [253.0, 231.0, 37.0],
];

/// Draws `values` (columns × rows, row 0 lowest) in colours from 0 to the largest of them. Where there is none the map is
/// grey. The legend's numbers are followed by `unit`; `title` stands above.
pub fn heat_map(values: &[Option<f64>], columns: usize, title: &str, unit: &str) -> RgbaImage {
    let columns = columns.max(1);
    let rows = values.len().div_ceil(columns).max(1);
    let largest = values.iter().flatten().copied().filter(|v| v.is_finite()).fold(0.0, f64::max);
    let zoom = HEIGHT.div_ceil(rows as u32).max(1);
    let [width, height] = [columns as u32 * zoom, rows as u32 * zoom];
    let head = text_size("", 1)[1] + GAP;
    let mut picture = RgbaImage::from_pixel(
        (GAP + width + GAP + BAR + NUMBERS).max(text_size(title, 1)[0] + 2 * GAP),
        head + height + GAP,
        Rgba(PAPER),
    );
    text(&mut picture, [i64::from(GAP), i64::from(GAP / 2)], 1, title, INK);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let number = (rows - 1 - (y / zoom) as usize) * columns + (x / zoom) as usize;
        let value = values.get(number).copied().flatten().filter(|value| value.is_finite());
        let colour = value.map_or(NOTHING, |value| colour(value / largest.max(f64::MIN_POSITIVE)));
        picture.put_pixel(GAP + x, head + y, Rgba(colour));
    }
    let left = GAP + width + GAP;
    for y in 0..height {
        let colour = colour(1.0 - f64::from(y) / f64::from(height.max(2) - 1));
        (0..BAR).for_each(|x| picture.put_pixel(left + x, head + y, Rgba(colour)));
    }
    for tick in 0..=TICKS {
        let part = f64::from(tick) / f64::from(TICKS);
        let y = f64::from(head) + (1.0 - part) * f64::from(height) - 8.0;
        let words = format!("{:.2} {unit}", part * largest);
        let y = (y as i64).min(i64::from(head + height) - 14);
        text(&mut picture, [i64::from(left + BAR + 8), y], 1, &words, INK);
    }
    picture
}

/// Between the colours of the scale; `part` is 0..=1.
fn colour(part: f64) -> [u8; 4] {
    let place = part.clamp(0.0, 1.0) * (SCALE.len() - 1) as f64;
    let lower = (place as usize).min(SCALE.len() - 2);
    let t = place - lower as f64;
    let [r, g, b] =
        std::array::from_fn(|k| (SCALE[lower][k] * (1.0 - t) + SCALE[lower + 1][k] * t).round() as u8);
    [r, g, b, 255]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn low_lies_below_and_is_dark() {
        let picture = heat_map(&[Some(0.0), None, Some(2.0), Some(1.0)], 2, "spread", "mm");
        let zoom = HEIGHT / 2;
        let head = text_size("", 1)[1] + GAP;
        let at =
            |column: u32, row: u32| picture.get_pixel(GAP + column * zoom + 5, head + (1 - row) * zoom + 5).0;
        assert_eq!(at(0, 0), colour(0.0));
        assert_eq!(at(1, 0), NOTHING);
        assert_eq!(at(0, 1), colour(1.0));
        assert_eq!(at(1, 1), colour(0.5));
        let odd = [Some(f64::NAN), None, Some(f64::INFINITY)];
        assert!(heat_map(&odd, 2, "", "").height() > 100);
        assert!(heat_map(&[], 0, "", "").height() > 100);
    }
}
