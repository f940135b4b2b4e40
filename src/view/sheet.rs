//! Several pictures in one.

use image::imageops::{self, FilterType};
use image::{Rgba, RgbaImage};

use super::text::{text, text_size};

/// Around and between the pictures of a sheet, pixels.
const GAP: u32 = 12;
const PAPER: Rgba<u8> = Rgba([22, 25, 30, 255]);
const INK: [u8; 4] = [214, 219, 226, 255];

/// Two pictures side by side with equal heights: the lower one is enlarged to the height of the other.
pub fn beside(left: &RgbaImage, right: &RgbaImage) -> RgbaImage {
    let height = left.height().max(right.height());
    let [left, right] = [left, right].map(|picture| to_height(picture, height));
    let mut both = RgbaImage::from_pixel(left.width() + right.width(), height, PAPER);
    imageops::overlay(&mut both, &left, 0, 0);
    imageops::overlay(&mut both, &right, i64::from(left.width()), 0);
    both
}

/// Pictures in rows of `columns`, each with its caption under it; a caption longer than its picture is cut.
///
/// Every cell is as large as the largest picture, and smaller ones stand in the middle of theirs at their own size.
pub fn contact_sheet(pictures: &[(&RgbaImage, &str)], columns: u32) -> RgbaImage {
    let columns = columns.clamp(1, pictures.len().max(1) as u32);
    let rows = (pictures.len() as u32).div_ceil(columns);
    let widest = pictures.iter().map(|(picture, _)| picture.width()).max().unwrap_or(0);
    let highest = pictures.iter().map(|(picture, _)| picture.height()).max().unwrap_or(0);
    let caption = text_size("", 1)[1] + GAP / 2;
    let [cell_width, cell_height] = [widest + GAP, highest + caption + GAP];
    let mut sheet = RgbaImage::from_pixel(columns * cell_width + GAP, rows * cell_height + GAP, PAPER);
    for (index, (picture, words)) in (0..).zip(pictures) {
        let left = GAP + index % columns * cell_width;
        let top = GAP + index / columns * cell_height;
        let x = left + (widest - picture.width()) / 2;
        let y = top + (highest - picture.height()) / 2;
        imageops::overlay(&mut sheet, *picture, i64::from(x), i64::from(y));

        let fits = (widest / text_size("m", 1)[0]) as usize;
        let words: String = words.chars().take(fits).collect();
        let indent = (widest - text_size(&words, 1)[0].min(widest)) / 2;
        text(&mut sheet, [i64::from(left + indent), i64::from(top + highest + GAP / 2)], 1, &words, INK);
    }
    sheet
}

fn to_height(picture: &RgbaImage, height: u32) -> RgbaImage {
    if picture.height() == height || picture.height() == 0 {
        return picture.clone();
    }
    let width = f64::from(picture.width()) * f64::from(height) / f64::from(picture.height());
    imageops::resize(picture, (width.round() as u32).max(1), height, FilterType::CatmullRom)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(width: u32, height: u32, grey: u8) -> RgbaImage {
        RgbaImage::from_pixel(width, height, Rgba([grey, grey, grey, 255]))
    }

    #[test]
    fn neighbours_get_equal_heights() {
        let both = beside(&flat(40, 30, 10), &flat(20, 60, 200));
        assert_eq!(both.dimensions(), (100, 60));
        assert_eq!(both.get_pixel(79, 59)[0], 10);
        assert_eq!(both.get_pixel(80, 0)[0], 200);
    }

    #[test]
    fn a_sheet_holds_every_picture_whole() {
        let (a, b) = (flat(50, 40, 90), flat(30, 20, 180));
        let sheet = contact_sheet(&[(&a, "a"), (&b, "b, much too long a caption"), (&a, "")], 2);
        let count = |grey| sheet.pixels().filter(|p| p.0 == [grey, grey, grey, 255]).count();
        assert_eq!((count(90), count(180)), (2 * 50 * 40, 30 * 20));
        assert_eq!(contact_sheet(&[], 3).dimensions(), (GAP + GAP, GAP));
    }
}
