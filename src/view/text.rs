//! Small text on a picture, in Noto Sans Mono.

use image::RgbaImage;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use super::overlay::blend;

const HEIGHT: RasterHeight = RasterHeight::Size16;
const WEIGHT: FontWeight = FontWeight::Regular;

/// Writes one line of text with its upper left corner at the given pixel.
///
/// The letters are 16 pixels high times `scale`, which is a whole number from 1. ASCII only: any other character
/// becomes a question mark. What lies outside the picture is cut off.
pub fn text(picture: &mut RgbaImage, [left, top]: [i64; 2], scale: u32, words: &str, colour: [u8; 4]) {
    let scale = i64::from(scale.max(1));
    let mut x = left;
    for letter in words.chars() {
        let raster = get_raster(letter, WEIGHT, HEIGHT).or_else(|| get_raster('?', WEIGHT, HEIGHT));
        let Some(raster) = raster else { continue };
        for (row, y) in raster.rows().zip((top..).step_by(scale as usize)) {
            for (&ink, x) in row.iter().zip((x..).step_by(scale as usize)).filter(|(ink, _)| **ink > 0) {
                for (u, v) in (0..scale * scale).map(|k| (x + k % scale, y + k / scale)) {
                    let place = u32::try_from(u).ok().zip(u32::try_from(v).ok());
                    if let Some(pixel) = place.and_then(|(u, v)| picture.get_pixel_mut_checked(u, v)) {
                        blend(pixel, colour, f64::from(ink) / 255.0);
                    }
                }
            }
        }
        x += get_raster_width(WEIGHT, HEIGHT) as i64 * scale;
    }
}

/// Width and height in pixels of one line of text.
pub fn text_size(words: &str, scale: u32) -> [u32; 2] {
    let letters = words.chars().count() as u32;
    [letters * get_raster_width(WEIGHT, HEIGHT) as u32, HEIGHT.val() as u32].map(|side| side * scale.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgba;

    fn ink(words: &str, place: [i64; 2], scale: u32) -> u64 {
        let mut picture = RgbaImage::from_pixel(120, 40, Rgba([0, 0, 0, 255]));
        text(&mut picture, place, scale, words, [255; 4]);
        picture.pixels().map(|p| u64::from(p[0])).sum()
    }

    #[test]
    fn letters_are_inked_inside_their_box_only() {
        let one = ink("face 42", [3, 2], 1);
        assert!(one > 5_000);
        assert_eq!(ink("face", [0, 0], 2), 4 * ink("face", [0, 0], 1));
        assert_eq!(ink("face 42", [-400, 0], 1) + ink("", [0, 0], 1) + ink("face", [0, 40], 1), 0);
        assert_eq!(ink("\u{1f600}", [0, 0], 1), ink("?", [0, 0], 1));
        assert!(ink("face 42", [-4, -4], 1) < one);
    }
}
