//! One panel of a chart: lines over a common axis, their names beside them.

use std::ops::Range;

use plotters::{coord::Shift, drawing::DrawingAreaErrorKind, prelude::*, style::text_anchor::Pos};
use plotters_backend::text_anchor::{HPos, VPos};

use crate::rows::short;

/// Of a whole chart, in units; two make a pixel of an SVG.
pub(super) const WIDTH: u32 = 2400;
/// Left of every panel: its name, and the numbers of its axis.
pub(super) const LEFT: u32 = 320;
/// Right of every panel: the names of its lines.
pub(super) const RIGHT: u32 = 400;
/// Between panels.
const GAP: u32 = 28;
/// Below a panel whose axis has numbers.
const FOOT: u32 = 70;
/// Of a line in a legend.
const LEGEND_ROW: u32 = 36;

pub(super) const INK: RGBColor = RGBColor(0x2b, 0x31, 0x3a);
pub(super) const PALE_INK: RGBColor = RGBColor(0x7a, 0x84, 0x90);
pub(super) const GRID: RGBColor = RGBColor(0xe6, 0xe9, 0xed);
/// Where the face was not seen.
pub(super) const UNSEEN: RGBColor = RGBColor(0xf0, 0xee, 0xea);
pub(super) const UPPER: RGBColor = RGBColor(0x2f, 0x6f, 0xa8);
pub(super) const LOWER: RGBColor = RGBColor(0xd0, 0x7a, 0x2d);
#[rustfmt::skip]
const PALETTE: [RGBColor; 8] = [
    UPPER, LOWER, RGBColor(0x4d, 0x94, 0x6c), RGBColor(0xb9, 0x4a, 0x52), RGBColor(0x78, 0x69, 0xae),
    RGBColor(0x8c, 0x71, 0x5b), RGBColor(0x3f, 0x9d, 0xa3), RGBColor(0xc4, 0x74, 0xa8),
];

pub(super) type Drawn<DB> = Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;
pub(super) type Area<DB> = DrawingArea<DB, Shift>;

/// The colour of the `k`th kind of line; the lighter one is for the other side of the same muscle.
pub(super) fn colour(k: usize, lighter: bool) -> RGBColor {
    let RGBColor(r, g, b) = PALETTE[k % PALETTE.len()];
    let light = |c: u8| if lighter { c + (255 - c) / 2 } else { c };
    RGBColor(light(r), light(g), light(b))
}

/// Text of a size in units, standing at its anchor.
pub(super) fn words(size: u32, colour: RGBColor, across: HPos, down: VPos) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&colour).pos(Pos::new(across, down))
}

/// A line of a panel, one value for each of the panel's places.
pub(super) struct Line {
    pub name: String,
    pub colour: RGBColor,
    /// NaN is a gap.
    pub values: Vec<f64>,
}

/// Lines over common places.
pub(super) struct Panel<'a> {
    pub title: &'a str,
    /// Below the title: what is measured, and its unit.
    pub unit: &'a str,
    /// Ascending.
    pub places: &'a [f64],
    /// What the places are; numbers stand below the panel if it is given.
    pub axis: Option<&'a str>,
    pub lines: Vec<Line>,
    /// The least range of values; it grows to take all.
    pub range: Range<f64>,
    /// Of the lines' field, units.
    pub field: u32,
    /// Stretches in which the face was not seen.
    pub unseen: &'a [Range<f64>],
}

impl Panel<'_> {
    /// Of field and legend, whichever needs more.
    fn field(&self) -> u32 {
        self.field.max(LEGEND_ROW * self.lines.len() as u32)
    }

    pub fn height(&self) -> u32 {
        self.field() + GAP + if self.axis.is_some() { FOOT } else { 0 }
    }

    /// Draws into an area of the chart's width and the panel's height.
    pub fn draw<DB: DrawingBackend>(&self, area: &Area<DB>) -> Drawn<DB> {
        area.draw(&Text::new(self.title, (20, GAP as i32), words(24, INK, HPos::Left, VPos::Top)))?;
        area.draw(&Text::new(self.unit, (20, GAP as i32 + 32), words(20, PALE_INK, HPos::Left, VPos::Top)))?;
        let (plot, legend) = area.split_horizontally(WIDTH - RIGHT);
        let values = self.lines.iter().flat_map(|line| &line.values).filter(|value| value.is_finite());
        let range = values.fold(self.range.clone(), |range, &v| range.start.min(v)..range.end.max(v));
        let room = 0.04 * (range.end - range.start);
        let mut chart = ChartBuilder::on(&plot)
            .margin_top(GAP)
            .y_label_area_size(LEFT)
            .x_label_area_size(if self.axis.is_some() { FOOT } else { 0 })
            .build_cartesian_2d(whole(self.places), range.start - room..range.end + room)?;
        let (low, high) = (range.start - room, range.end + room);
        let unseen = self.unseen.iter();
        chart.draw_series(
            unseen.map(|gap| Rectangle::new([(gap.start, low), (gap.end, high)], UNSEEN.filled())),
        )?;
        let labels = words(20, PALE_INK, HPos::Left, VPos::Top);
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID.stroke_width(2))
            .axis_style(PALE_INK.stroke_width(2))
            .y_labels(if self.field < 260 { 4 } else { 6 })
            .x_labels(14)
            .x_label_formatter(&|value| short(*value))
            .y_label_formatter(&|value| short(*value))
            .label_style(labels)
            .axis_desc_style(words(20, PALE_INK, HPos::Left, VPos::Top))
            .x_desc(self.axis.unwrap_or_default())
            .draw()?;
        // The first lines matter most and so lie above the others.
        for line in self.lines.iter().rev() {
            let points: Vec<(f64, f64)> =
                self.places.iter().copied().zip(line.values.iter().copied()).collect();
            for stretch in points.split(|point| point.1.is_nan()).filter(|stretch| stretch.len() > 1) {
                chart.draw_series(LineSeries::new(stretch.iter().copied(), line.colour.stroke_width(3)))?;
            }
        }
        // A line that has the panel for itself is named by its title.
        let named = self.lines.iter().filter(|line| line.name != self.title);
        for (row, line) in (0..).zip(named) {
            let y = (GAP + LEGEND_ROW / 2 + row * LEGEND_ROW) as i32;
            legend.draw(&PathElement::new([(24, y), (64, y)], line.colour.stroke_width(6)))?;
            legend.draw(&Text::new(
                shortened(&line.name),
                (78, y),
                words(20, INK, HPos::Left, VPos::Center),
            ))?;
        }
        Ok(())
    }
}

/// The range of places, never empty.
pub(super) fn whole(places: &[f64]) -> Range<f64> {
    let (first, last) = (places.first().copied().unwrap_or(0.0), places.last().copied().unwrap_or(0.0));
    if last > first { first..last } else { first..first + 1.0 }
}

/// A muscle's name, cut in its middle where it is too long: the side stands at its end.
pub(super) fn shortened(name: &str) -> String {
    /// Letters that there is room for.
    const MOST: usize = 30;
    let letters: Vec<char> = name.chars().collect();
    if letters.len() <= MOST {
        return name.to_owned();
    }
    let (start, end) = (&letters[..MOST / 2], &letters[letters.len() + 2 - MOST / 2..]);
    start.iter().chain(&['.', '.']).chain(end).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_keep_their_ends() {
        assert_eq!(shortened("levator_labii_superioris_right"), "levator_labii_superioris_right");
        let cut = shortened("levator_labii_superioris_alaeque_nasi_right");
        assert_eq!(cut, "levator_labii_s..ue_nasi_right");
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!([0.0, -0.0, 0.2, 1.0, 0.125, 1250.0].map(short), ["0", "0", "0.2", "1", "0.125", "1250"]);
    }
}
