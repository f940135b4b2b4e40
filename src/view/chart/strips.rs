//! Every muscle of a take at a glance: a strip each, darker where it contracts.

use std::ops::Range;

use plotters::prelude::*;
use plotters_backend::text_anchor::{HPos, VPos};

use super::panel::{Area, Drawn, INK, LEFT, PALE_INK, RIGHT, WIDTH, shortened, whole, words};
use crate::{
    muscle::{Channel, MuscleCurves, Part},
    rows::short,
};

/// Of a strip, units.
const ROW: u32 = 26;
const GAP: u32 = 36;
const FOOT: u32 = 70;
/// What a strip fills of its row, so that paper separates strips.
const FILLED: f64 = 0.92;
/// Cells along a strip at most.
const CELLS: usize = 400;
/// Steps from relaxed to contracted.
const LEVELS: usize = 32;
/// Of one of them in the key, units.
const KEY_STEP: u32 = 8;

/// In the order of the file, the upper face first.
fn order(curves: &MuscleCurves) -> Vec<usize> {
    let mut all: Vec<usize> = (0..curves.muscles().len()).collect();
    all.sort_by_key(|&k| Part::of_name(&curves.muscles()[k]) == Part::Lower);
    all
}

pub(super) fn height(curves: &MuscleCurves) -> u32 {
    let strips = ROW * curves.muscles().len() as u32 + FOOT;
    GAP + strips.max(KEY_STEP * (LEVELS as u32 + 1) + GAP)
}

/// Draws into an area of the chart's width and [`height`]; `places` are the frames' seconds.
pub(super) fn draw<DB: DrawingBackend>(area: &Area<DB>, curves: &MuscleCurves, places: &[f64]) -> Drawn<DB> {
    let order = order(curves);
    let count = order.len();
    let (left, beside) = area.split_horizontally(WIDTH - RIGHT);
    let (plot, _) = left.split_vertically(GAP + ROW * count as u32 + FOOT);
    let range = whole(places);
    let mut chart = ChartBuilder::on(&plot)
        .margin_top(GAP)
        .y_label_area_size(LEFT)
        .x_label_area_size(FOOT)
        .build_cartesian_2d(range.clone(), 0.0..count as f64)?;
    for (row, &muscle) in order.iter().enumerate() {
        let track: Vec<f64> = curves.track(muscle).collect();
        let top = (count - row) as f64;
        chart.draw_series(cells(places, &track, &range).into_iter().map(|(stretch, level)| {
            Rectangle::new([(stretch.start, top), (stretch.end, top - FILLED)], shade(level).filled())
        }))?;
        let y = (GAP + ROW * row as u32 + ROW / 2) as i32;
        let known = curves.channels()[muscle] != Channel::Absent;
        let style = words(20, if known { INK } else { PALE_INK }, HPos::Right, VPos::Center);
        let name = shortened(&curves.muscles()[muscle]);
        area.draw(&Text::new(name, (LEFT as i32 - 12, y), style))?;
    }
    chart
        .configure_mesh()
        .disable_mesh()
        .axis_style(PALE_INK.stroke_width(2))
        .y_labels(0)
        .x_labels(14)
        .x_label_formatter(&|value| short(*value))
        .label_style(words(20, PALE_INK, HPos::Left, VPos::Top))
        .axis_desc_style(words(20, PALE_INK, HPos::Left, VPos::Top))
        .x_desc("seconds")
        .draw()?;
    key(&beside)
}

/// What the shades mean.
fn key<DB: DrawingBackend>(area: &Area<DB>) -> Drawn<DB> {
    let (left, top, step) = (24, GAP as i32, KEY_STEP as i32);
    for level in 0..=LEVELS {
        let y = top + (LEVELS - level) as i32 * step;
        area.draw(&Rectangle::new([(left, y), (left + 28, y + step)], shade(level).filled()))?;
    }
    let end = top + (LEVELS as i32 + 1) * step;
    for (y, text) in [(top + 10, "1 contracted"), (end - 10, "0 relaxed")] {
        area.draw(&Text::new(text, (left + 44, y), words(20, INK, HPos::Left, VPos::Center)))?;
    }
    Ok(())
}

/// Stretches of equal level; the strongest contraction within a cell counts, so that no blink is lost.
fn cells(places: &[f64], track: &[f64], range: &Range<f64>) -> Vec<(Range<f64>, usize)> {
    let count = CELLS.min(places.len());
    let width = (range.end - range.start) / count as f64;
    let mut strongest = vec![f64::NAN; count];
    for (&place, &value) in places.iter().zip(track) {
        let cell = (((place - range.start) / width) as usize).min(count - 1);
        strongest[cell] = strongest[cell].max(value);
    }
    let mut stretches: Vec<(Range<f64>, usize)> = Vec::new();
    let mut level = 0;
    for (cell, value) in strongest.into_iter().enumerate() {
        // A cell without a frame of its own shows the one before.
        if value.is_finite() {
            level = (value.clamp(0.0, 1.0) * LEVELS as f64).round() as usize;
        }
        let (start, end) = (range.start + cell as f64 * width, range.start + (cell + 1) as f64 * width);
        match stretches.last_mut().filter(|last| last.1 == level) {
            Some(last) => last.0.end = end,
            None => stretches.push((start..end, level)),
        }
    }
    stretches
}

/// From paper through blue to nearly black.
fn shade(level: usize) -> RGBColor {
    const STOPS: [[f64; 3]; 4] =
        [[244.0, 246.0, 248.0], [158.0, 196.0, 222.0], [47.0, 111.0, 168.0], [18.0, 42.0, 74.0]];
    let along = (STOPS.len() - 1) as f64 * level.min(LEVELS) as f64 / LEVELS as f64;
    let stop = (along as usize).min(STOPS.len() - 2);
    let [r, g, b] = [0, 1, 2].map(|k| {
        let share = along - stop as f64;
        (STOPS[stop][k] + (STOPS[stop + 1][k] - STOPS[stop][k]) * share).round() as u8
    });
    RGBColor(r, g, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_events_are_not_lost_and_equal_cells_are_one() {
        let places: Vec<f64> = (0..4000).map(f64::from).collect();
        let mut track = vec![0.0; 4000];
        track[1234] = 1.0;
        let found = cells(&places, &track, &whole(&places));
        assert_eq!(found.iter().map(|cell| cell.1).collect::<Vec<_>>(), [0, LEVELS, 0]);
        assert!(found[1].0.contains(&1234.0));
        assert_eq!(cells(&[0.0], &[0.5], &whole(&[0.0])).len(), 1);
    }
}
