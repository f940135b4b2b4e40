//! Curves of performer and avatar, one below the other.

use std::{error::Error, ops::Range, path::Path};

use plotters::prelude::*;

use super::{
    Curves,
    readings::{MEASURES, Reading},
};

const WIDTH: u32 = 1200;
/// Of one measure.
const HEIGHT: u32 = 150;
const HEAD: u32 = 40;
/// The time's labels stand below the last measure.
const FOOT: u32 = 30;
const PERFORMER: RGBColor = RGBColor(0xd9, 0x5f, 0x02);
const AVATAR: RGBColor = RGBColor(0x1b, 0x6c, 0xa8);
const FONT: &str = "sans-serif";

/// Draws a clip's curves as SVG.
pub fn draw(path: &Path, clip: &str, scan: &str, curves: &Curves) -> Result<(), Box<dyn Error>> {
    let size = (WIDTH, HEAD + HEIGHT * MEASURES.len() as u32 + FOOT);
    let root = SVGBackend::new(path, size).into_drawing_area();
    root.fill(&WHITE)?;
    let (head, mut rest) = root.split_vertically(HEAD);
    let title = format!("{scan} driven by {clip}:");
    head.draw(&Text::new(title, (12, 12), (FONT, 17).into_font()))?;
    for (x, colour, name) in
        [(520, PERFORMER, "performer's landmarks, as tracked"), (860, AVATAR, "avatar's vertices")]
    {
        head.draw(&PathElement::new([(x - 34, 21), (x - 8, 21)], colour.stroke_width(3)))?;
        head.draw(&Text::new(name, (x, 12), (FONT, 17).into_font()))?;
    }
    for (row, measure) in MEASURES.iter().enumerate() {
        let is_last = row + 1 == MEASURES.len();
        let (panel, below) = rest.split_vertically(HEIGHT + if is_last { FOOT } else { 0 });
        rest = below;
        let [performer, avatar] =
            [&curves.tracked, &curves.avatar].map(|readings| points(curves, readings, row));
        let time = 0.0..curves.seconds.last().copied().unwrap_or(1.0);
        let mut chart = ChartBuilder::on(&panel)
            .margin_right(16)
            .margin_top(8)
            .y_label_area_size(84)
            .x_label_area_size(if is_last { FOOT + 14 } else { 6 })
            .build_cartesian_2d(time, range(&[&performer, &avatar]))?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(RGBColor(0xdd, 0xdd, 0xdd))
            .y_labels(4)
            .x_labels(if is_last { 16 } else { 0 })
            .label_style((FONT, 13))
            .axis_desc_style((FONT, 14))
            .y_desc(format!("{}, {}", measure.name, measure.unit))
            .x_desc(if is_last { "seconds" } else { "" })
            .draw()?;
        for (curve, colour) in [(performer, PERFORMER), (avatar, AVATAR)] {
            // A stretch without a value is a gap.
            for stretch in curve.split(|point| point.1.is_nan()).filter(|stretch| stretch.len() > 1) {
                chart.draw_series(LineSeries::new(stretch.iter().copied(), colour.stroke_width(1)))?;
            }
        }
    }
    root.present()?;
    Ok(())
}

fn points(curves: &Curves, readings: &[Reading], row: usize) -> Vec<(f64, f64)> {
    curves.seconds.iter().copied().zip(readings.iter().map(|reading| reading[row])).collect()
}

/// What all values lie in, with a little room.
fn range(curves: &[&[(f64, f64)]]) -> Range<f64> {
    let values =
        || curves.iter().flat_map(|curve| curve.iter()).map(|point| point.1).filter(|v| v.is_finite());
    let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    let room = 0.06 * (high - low).max(1e-3);
    if low > high { 0.0..1.0 } else { low - room..high + room }
}
