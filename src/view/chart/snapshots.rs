//! Moments of a take, each a picture beside the bars of its contractions (001 fig. 3).

use plotters::prelude::*;
use plotters_backend::text_anchor::{HPos, VPos};

use super::{
    Inset, Moment,
    over_time::{HEAD, head},
    panel::{Area, Drawn, GRID, INK, LOWER, PALE_INK, UPPER, WIDTH, shortened, words},
};
use crate::muscle::{MuscleCurves, Part};

/// Bars that are shown if no muscles are chosen.
const SHOWN: usize = 20;
/// Of a bar with the room below it, units.
const ROW: u32 = 34;
/// Above the first bar: the moment's time.
const CAPTION: u32 = 52;
const GAP: u32 = 40;
/// Of the muscles' names.
const NAMES: u32 = 320;
/// Of the numbers behind the bars.
const NUMBERS: u32 = 70;
/// Pictures are at least as high as this many bars.
const LEAST_ROWS: u32 = 12;

/// Where everything of the chart stands.
struct Layout {
    muscles: Vec<usize>,
    /// Moments beside each other.
    columns: u32,
    /// Of a moment's cell, units.
    cell: (u32, u32),
    /// Of the part of a cell that pictures have.
    picture: u32,
    /// The contraction of a full bar.
    full: f64,
}

impl Layout {
    fn of(curves: &MuscleCurves, muscles: Option<&[usize]>, moments: &[Moment]) -> Self {
        let at = |moment: &Moment, k: usize| curves.frames()[moment.frame].contractions[k];
        let strongest = |k: usize| moments.iter().map(|moment| at(moment, k)).fold(0.0, f64::max);
        let muscles = muscles.map_or_else(|| most(curves.muscles(), strongest), <[usize]>::to_vec);
        let full = muscles.iter().map(|&k| strongest(k)).fold(1.0, f64::max);
        let has_pictures = moments.iter().any(|moment| moment.picture.is_some());
        let columns = if has_pictures { 2 } else { 4 }.min(moments.len().max(1) as u32);
        let rows = (muscles.len() as u32).max(if has_pictures { LEAST_ROWS } else { 1 });
        let cell = (WIDTH / if has_pictures { 2 } else { 4 }, CAPTION + rows * ROW + GAP);
        Self { muscles, columns, cell, picture: if has_pictures { cell.0 * 42 / 100 } else { 0 }, full }
    }

    fn height(&self, moments: usize) -> u32 {
        HEAD + self.cell.1 * (moments as u32).div_ceil(self.columns)
    }

    /// The upper left corner of a moment's cell.
    fn corner(&self, k: usize) -> (u32, u32) {
        let (k, columns) = (k as u32, self.columns);
        (k % columns * self.cell.0, HEAD + k / columns * self.cell.1)
    }
}

/// All, or those that contract most; in the order of the file, the upper face first.
fn most(names: &[String], strongest: impl Fn(usize) -> f64) -> Vec<usize> {
    let mut all: Vec<(f64, usize)> = (0..names.len()).map(|k| (strongest(k), k)).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut shown: Vec<usize> = all.into_iter().take(SHOWN).map(|(_, k)| k).collect();
    shown.sort_unstable();
    shown.sort_by_key(|&k| Part::of_name(&names[k]) == Part::Lower);
    shown
}

pub(super) fn height(curves: &MuscleCurves, muscles: Option<&[usize]>, moments: &[Moment]) -> u32 {
    Layout::of(curves, muscles, moments).height(moments.len())
}

pub(super) fn insets<'a>(
    curves: &MuscleCurves,
    muscles: Option<&[usize]>,
    moments: &'a [Moment],
) -> Vec<Inset<'a>> {
    let layout = Layout::of(curves, muscles, moments);
    let (box_width, box_height) = (layout.picture.saturating_sub(40), layout.cell.1 - CAPTION - GAP);
    let inset = |(k, moment): (usize, &'a Moment)| {
        let picture = moment.picture.as_ref()?;
        let (wide, high) = (f64::from(picture.width().max(1)), f64::from(picture.height().max(1)));
        let scale = (f64::from(box_width) / wide).min(f64::from(box_height) / high);
        let size = [wide, high].map(|side| ((side * scale) as u32).max(1));
        let (left, top) = layout.corner(k);
        // Against the bars and level with the first of them.
        Some(Inset { corner: (left + 20 + (box_width - size[0]), top + CAPTION), size: size.into(), picture })
    };
    moments.iter().enumerate().filter_map(inset).collect()
}

pub(super) fn draw<DB: DrawingBackend>(
    area: &Area<DB>,
    title: &str,
    curves: &MuscleCurves,
    muscles: Option<&[usize]>,
    moments: &[Moment],
) -> Drawn<DB> {
    head(area, title, curves)?;
    let layout = Layout::of(curves, muscles, moments);
    for (k, moment) in moments.iter().enumerate() {
        let (left, top) = layout.corner(k);
        let frame = &curves.frames()[moment.frame];
        let letter = char::from(b'a' + (k % 26) as u8);
        let caption = format!("({letter})  {:.2} s, frame {}", frame.time.seconds(), moment.frame + 1);
        let start = left + layout.picture;
        let at = (left as i32 + 20, top as i32 + 6);
        area.draw(&Text::new(caption, at, words(24, INK, HPos::Left, VPos::Top)))?;
        let (from, to) = ((start + NAMES) as i32, (left + layout.cell.0 - NUMBERS - 20) as i32);
        for (row, &muscle) in (0..).zip(&layout.muscles) {
            let y = (top + CAPTION + row * ROW) as i32;
            let middle = y + ROW as i32 / 2;
            let name = shortened(&curves.muscles()[muscle]);
            let value = frame.contractions[muscle];
            area.draw(&Text::new(name, (from - 12, middle), words(20, INK, HPos::Right, VPos::Center)))?;
            let bar = |end: i32| [(from, y + 6), (end, y + ROW as i32 - 6)];
            area.draw(&Rectangle::new(bar(to), GRID.filled()))?;
            let share = (value / layout.full).clamp(0.0, 1.0);
            let is_upper = Part::of_name(&curves.muscles()[muscle]) == Part::Upper;
            let colour = if is_upper { UPPER } else { LOWER };
            let end = from + (share * f64::from(to - from)).round() as i32;
            if end > from {
                area.draw(&Rectangle::new(bar(end), colour.filled()))?;
            }
            let style = words(20, PALE_INK, HPos::Left, VPos::Center);
            area.draw(&Text::new(format!("{value:.2}"), (to + 12, middle), style))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_strongest_are_shown_in_the_order_of_the_file() {
        let values: Vec<f64> = (0..30).map(|k| f64::from((k * 7) % 30)).collect();
        let names: Vec<String> =
            (0..30).map(|k| format!("{}{k}", if k % 2 == 0 { "jaw" } else { "brow" })).collect();
        let shown = most(&names, |k| values[k]);
        assert_eq!(shown.len(), SHOWN);
        assert!(shown.iter().all(|&k| values[k] >= 10.0));
        let (upper, lower): (Vec<usize>, Vec<usize>) = shown.iter().partition(|k| **k % 2 == 1);
        assert!(upper.is_sorted() && lower.is_sorted() && shown == [upper, lower].concat());
    }
}
