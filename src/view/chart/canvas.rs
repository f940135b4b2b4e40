//! A picture that plotters draws on: lines by how far pixels lie from them, text in Noto Sans Mono.
//!
//! No fonts of the system are used, so that a chart has the same pixels everywhere.

use std::convert::Infallible;

use image::RgbaImage;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
    text_anchor::{HPos, VPos},
};

use crate::view::overlay::blend;

const WEIGHT: FontWeight = FontWeight::Regular;

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

/// Draws on a picture; (0, 0) is the top left.
pub(super) struct Canvas<'a>(pub &'a mut RgbaImage);

impl Canvas<'_> {
    fn ink(&mut self, (x, y): BackendCoord, colour: BackendColor, share: f64) {
        let place = u32::try_from(x).ok().zip(u32::try_from(y).ok());
        if let Some(pixel) = place.and_then(|(x, y)| self.0.get_pixel_mut_checked(x, y)) {
            let (r, g, b) = colour.rgb;
            blend(pixel, [r, g, b, 255], share * colour.alpha);
        }
    }
}

impl DrawingBackend for Canvas<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.0.dimensions()
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, point: BackendCoord, colour: BackendColor) -> Drawn {
        self.ink(point, colour, 1.0);
        Ok(())
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        self.draw_path([from, to], style)
    }

    /// Every pixel is inked once, as much as the nearest stretch of the path covers it.
    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let (width, height) = self.get_size();
        let radius = f64::from(style.stroke_width()) / 2.0;
        let points: Vec<BackendCoord> = path.into_iter().collect();
        let reach = radius.ceil() as i32 + 1;
        let span = |of: fn(&BackendCoord) -> i32, side: u32| {
            let low = points.iter().map(of).min().unwrap_or(0).saturating_sub(reach).max(0);
            let high = points.iter().map(of).max().unwrap_or(0).saturating_add(reach).min(side as i32 - 1);
            (low, high)
        };
        let ((left, right), (top, bottom)) = (span(|p| p.0, width), span(|p| p.1, height));
        if left > right || top > bottom {
            return Ok(());
        }
        let columns = (right - left + 1) as usize;
        let mut cover = vec![0.0_f32; columns * (bottom - top + 1) as usize];
        for pair in points.windows(2) {
            let ends = [pair[0], pair[1]].map(|(x, y)| (f64::from(x), f64::from(y)));
            let rows = pair[0].1.min(pair[1].1) - reach..=pair[0].1.max(pair[1].1) + reach;
            let across = pair[0].0.min(pair[1].0) - reach..=pair[0].0.max(pair[1].0) + reach;
            for y in rows.filter(|y| (top..=bottom).contains(y)) {
                for x in across.clone().filter(|x| (left..=right).contains(x)) {
                    let near = distance((f64::from(x), f64::from(y)), ends);
                    let cell = &mut cover[(y - top) as usize * columns + (x - left) as usize];
                    *cell = cell.max((radius + 0.5 - near).clamp(0.0, 1.0) as f32);
                }
            }
        }
        for (k, &share) in cover.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            let place = (left + (k % columns) as i32, top + (k / columns) as i32);
            self.ink(place, style.color(), f64::from(share));
        }
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, (left, top): BackendCoord) -> Drawn {
        let height = raster(style.size());
        let step = get_raster_width(WEIGHT, height) as i32;
        let (wide, high) = (step * text.chars().count() as i32, height.val() as i32);
        let dx = match style.anchor().h_pos {
            HPos::Left => 0,
            HPos::Center => -wide / 2,
            HPos::Right => -wide,
        };
        let dy = match style.anchor().v_pos {
            VPos::Top => 0,
            VPos::Center => -high / 2,
            VPos::Bottom => -high,
        };
        let turn = style.transform();
        for (k, letter) in (0..).zip(text.chars()) {
            let glyph = get_raster(letter, WEIGHT, height).or_else(|| get_raster('?', WEIGHT, height));
            let Some(glyph) = glyph else { continue };
            for (y, row) in (0..).zip(glyph.rows()) {
                for (x, &ink) in (0..).zip(row.iter()).filter(|(_, ink)| **ink > 0) {
                    let (x, y) = turn.transform(dx + k * step + x, dy + y);
                    self.ink((left + x, top + y), style.color(), f64::from(ink) / 255.0);
                }
            }
        }
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let height = raster(style.size());
        let letters = text.chars().count() as u32;
        Ok((letters * get_raster_width(WEIGHT, height) as u32, height.val() as u32))
    }
}

/// The nearest size that there are letters of.
fn raster(size: f64) -> RasterHeight {
    match size {
        ..18.0 => RasterHeight::Size16,
        18.0..22.0 => RasterHeight::Size20,
        22.0..28.0 => RasterHeight::Size24,
        _ => RasterHeight::Size32,
    }
}

/// From a point to the stretch between two others.
fn distance((x, y): (f64, f64), [(ax, ay), (bx, by)]: [(f64, f64); 2]) -> f64 {
    let (dx, dy) = (bx - ax, by - ay);
    let length = dx * dx + dy * dy;
    let share = if length > 0.0 { ((x - ax) * dx + (y - ay) * dy) / length } else { 0.0 };
    let share = share.clamp(0.0, 1.0);
    (x - ax - share * dx).hypot(y - ay - share * dy)
}

#[cfg(test)]
mod tests {
    use super::Canvas;
    use image::{Rgba, RgbaImage};
    use plotters::{
        prelude::*,
        style::text_anchor::{HPos, Pos, VPos},
    };

    fn drawn(draw: impl Fn(&DrawingArea<Canvas<'_>, plotters::coord::Shift>)) -> RgbaImage {
        let mut picture = RgbaImage::from_pixel(100, 60, Rgba([255, 255, 255, 255]));
        draw(&Canvas(&mut picture).into_drawing_area());
        picture
    }

    fn dark(picture: &RgbaImage) -> Vec<(u32, u32)> {
        picture.enumerate_pixels().filter(|(.., p)| p[0] < 128).map(|(x, y, _)| (x, y)).collect()
    }

    #[test]
    fn a_straight_line_is_as_wide_as_was_asked() {
        for width in [1, 3, 5] {
            let picture = drawn(|area| {
                let line = PathElement::new([(10, 20), (89, 20)], BLACK.stroke_width(width));
                area.draw(&line).unwrap();
            });
            let column = (0..60).filter(|&y| picture.get_pixel(50, y)[0] < 128).count();
            assert_eq!(column, width as usize);
        }
    }

    #[test]
    fn text_stands_where_its_anchor_says_and_turns_with_it() {
        let words = |style: TextStyle<'static>| {
            dark(&drawn(move |area| area.draw(&Text::new("Hm", (50, 30), style.clone())).unwrap()))
        };
        let style = ("sans-serif", 24).into_font().color(&BLACK);
        let right = words(style.pos(Pos::new(HPos::Right, VPos::Center)));
        assert!(!right.is_empty() && right.iter().all(|&(x, y)| x < 50 && (18..42).contains(&y)));
        let turned = style.transform(FontTransform::Rotate270).pos(Pos::new(HPos::Left, VPos::Top));
        let turned = words(turned);
        assert!(!turned.is_empty() && turned.iter().all(|&(x, y)| x >= 50 && y <= 30));
    }

    #[test]
    fn what_lies_outside_is_cut() {
        let picture = drawn(|area| {
            area.draw(&PathElement::new([(-500, -500), (600, 700)], BLACK.stroke_width(3))).unwrap();
            area.draw(&PathElement::new([(-5, -50), (600, -50)], BLACK.stroke_width(3))).unwrap();
        });
        assert!(!dark(&picture).is_empty());
    }
}
