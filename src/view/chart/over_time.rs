//! Curves over time: the overview of a take, and chosen muscles beside the marker error.

use std::ops::Range;

use plotters::prelude::*;
use plotters_backend::text_anchor::{HPos, VPos};

use super::{
    panel::{Area, Drawn, INK, LOWER, Line, PALE_INK, Panel, UPPER, colour, words},
    strips,
};
use crate::{
    lift::FaceState,
    muscle::{MuscleCurves, Part, other_side},
};

/// Above the first panel, units.
pub(super) const HEAD: u32 = 110;
/// Muscles of a region that are shown if none are chosen; two sides count as one.
const SHOWN: usize = 5;
/// Standard deviations below this do not count as motion.
const STILL: f64 = 1e-3;
const REGIONS: [(Part, &str); 2] = [(Part::Upper, "upper face"), (Part::Lower, "lower face")];

/// Title and, small, what the take is.
pub(super) fn head<DB: DrawingBackend>(area: &Area<DB>, title: &str, curves: &MuscleCurves) -> Drawn<DB> {
    let title: String = title.chars().take(100).collect();
    area.draw(&Text::new(title, (20, 22), words(32, INK, HPos::Left, VPos::Top)))?;
    let frames = curves.frames();
    let last = frames.last().map_or(0.0, |frame| frame.time.seconds());
    let unseen = frames.iter().filter(|frame| frame.state != FaceState::Tracking).count();
    let mut about =
        format!("{} frames, {last:.1} s, {:.2} frames a second", frames.len(), curves.rate().per_second());
    if unseen > 0 {
        about = format!("{about}; face not seen in {unseen}");
    }
    area.draw(&Text::new(about, (20, 66), words(24, PALE_INK, HPos::Left, VPos::Top)))
}

/// How much a muscle moves: its standard deviation.
fn motion(curves: &MuscleCurves, muscle: usize) -> f64 {
    let count = curves.frames().len() as f64;
    let mean = curves.track(muscle).sum::<f64>() / count;
    (curves.track(muscle).map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
}

/// Those of a region that move most, most first; where one has sides, each with its other side behind it.
fn movers(curves: &MuscleCurves, region: Part, most: usize) -> Vec<usize> {
    let names = curves.muscles();
    let of_region = |k: &usize| Part::of_name(&names[*k]) == region;
    let mut all: Vec<(f64, usize)> =
        (0..names.len()).filter(of_region).map(|k| (motion(curves, k), k)).collect();
    all.retain(|(motion, _)| *motion > STILL);
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut kinds: Vec<Vec<usize>> = Vec::new();
    for (_, k) in all {
        let other = other_side(&names[k]);
        let pair = |kind: &&mut Vec<usize>| other.as_ref().is_some_and(|other| names[kind[0]] == *other);
        match kinds.iter_mut().find(pair) {
            Some(kind) => kind.push(k),
            None => kinds.push(vec![k]),
        }
    }
    kinds.into_iter().take(most).flatten().collect()
}

/// The muscles of a region's panel.
fn shown(curves: &MuscleCurves, muscles: Option<&[usize]>, region: Part) -> Vec<usize> {
    match muscles {
        None => movers(curves, region, SHOWN),
        Some(chosen) => {
            let of_region = |k: &usize| Part::of_name(&curves.muscles()[*k]) == region;
            chosen.iter().copied().filter(of_region).collect()
        }
    }
}

/// Lines of muscles; both sides of one have the same hue.
fn lines(curves: &MuscleCurves, muscles: &[usize]) -> Vec<Line> {
    let mut hues: Vec<&str> = Vec::new();
    let name = |k: usize| curves.muscles()[k].as_str();
    let line = |&k: &usize| {
        let other = other_side(name(k));
        let pair = other.and_then(|other| hues.iter().position(|hue| **hue == other));
        let hue = pair.unwrap_or_else(|| {
            hues.push(name(k));
            hues.len() - 1
        });
        let values = curves.track(k).collect();
        Line { name: name(k).to_owned(), colour: colour(hue, pair.is_some()), values }
    };
    muscles.iter().map(line).collect()
}

/// The marker errors of upper and lower face; None where no frame has one.
fn error_lines(curves: &MuscleCurves) -> Option<Vec<Line>> {
    curves.frames().iter().any(|frame| frame.error.is_some()).then(|| {
        let values = |k: usize| {
            let errors = curves.frames().iter().map(|frame| frame.error.map_or(f64::NAN, |error| error[k]));
            errors.collect()
        };
        vec![
            Line { name: "upper face".into(), colour: UPPER, values: values(0) },
            Line { name: "lower face".into(), colour: LOWER, values: values(1) },
        ]
    })
}

/// Stretches of places in which the face was not seen.
fn unseen(curves: &MuscleCurves, places: &[f64]) -> Vec<Range<f64>> {
    let mut gaps: Vec<Range<f64>> = Vec::new();
    let mut open = false;
    for (k, frame) in curves.frames().iter().enumerate() {
        let is_gap = frame.state != FaceState::Tracking;
        let end = places.get(k + 1).copied().unwrap_or(places[k]);
        match gaps.last_mut().filter(|_| open && is_gap) {
            Some(gap) => gap.end = end,
            None if is_gap => gaps.push(places[k]..end),
            None => {}
        }
        open = is_gap;
    }
    gaps
}

fn seconds(curves: &MuscleCurves) -> Vec<f64> {
    curves.frames().iter().map(|frame| frame.time.seconds()).collect()
}

/// The panels of the overview, the last one with the axis if no strips stand below.
fn curve_panels<'a>(
    curves: &MuscleCurves,
    muscles: Option<&[usize]>,
    places: &'a [f64],
    unseen: &'a [Range<f64>],
) -> Vec<Panel<'a>> {
    let mut panels = Vec::new();
    for (region, title) in REGIONS {
        let lines = lines(curves, &shown(curves, muscles, region));
        if !lines.is_empty() {
            panels.push(Panel {
                title,
                unit: "contraction",
                places,
                axis: None,
                lines,
                range: 0.0..1.0,
                field: 400,
                unseen,
            });
        }
    }
    if let Some(lines) = error_lines(curves) {
        let unit = "mean, millimetres";
        panels.push(Panel {
            title: "marker error",
            unit,
            places,
            axis: None,
            lines,
            range: 0.0..1.0,
            field: 240,
            unseen,
        });
    }
    if let Some(last) = panels.last_mut() {
        last.axis = Some("seconds");
    }
    panels
}

pub(super) fn curves_height(curves: &MuscleCurves, muscles: Option<&[usize]>) -> u32 {
    let places = seconds(curves);
    let panels = curve_panels(curves, muscles, &places, &[]);
    let strips = if muscles.is_none() { strips::height(curves) } else { 0 };
    HEAD + panels.iter().map(Panel::height).sum::<u32>() + strips
}

pub(super) fn draw_curves<DB: DrawingBackend>(
    area: &Area<DB>,
    title: &str,
    curves: &MuscleCurves,
    muscles: Option<&[usize]>,
) -> Drawn<DB> {
    let places = seconds(curves);
    let unseen = unseen(curves, &places);
    head(area, title, curves)?;
    let rest = stacked(area, &curve_panels(curves, muscles, &places, &unseen))?;
    if muscles.is_none() { strips::draw(&rest, curves, &places) } else { Ok(()) }
}

/// Draws panels below the head, one under another, and gives what is left below them.
fn stacked<DB: DrawingBackend>(
    area: &Area<DB>,
    panels: &[Panel<'_>],
) -> Result<Area<DB>, DrawingAreaErrorKind<DB::ErrorType>> {
    let (_, mut rest) = area.split_vertically(HEAD);
    for panel in panels {
        let (this, below) = rest.split_vertically(panel.height());
        panel.draw(&this)?;
        rest = below;
    }
    Ok(rest)
}

fn error_panels<'a>(
    curves: &'a MuscleCurves,
    muscles: Option<&[usize]>,
    places: &'a [f64],
    unseen: &'a [Range<f64>],
) -> Vec<Panel<'a>> {
    let chosen = muscles.map_or_else(
        || {
            let first = |region| movers(curves, region, 1).first().copied();
            REGIONS.iter().filter_map(|(region, _)| first(*region)).collect()
        },
        <[usize]>::to_vec,
    );
    let mut panels = Vec::new();
    for k in chosen {
        let name = curves.muscles()[k].as_str();
        let colour = if Part::of_name(name) == Part::Upper { UPPER } else { LOWER };
        let lines = vec![Line { name: name.to_owned(), colour, values: curves.track(k).collect() }];
        panels.push(Panel {
            title: name,
            unit: "contraction",
            places,
            axis: None,
            lines,
            range: 0.0..1.0,
            field: 260,
            unseen,
        });
    }
    let lines = error_lines(curves).unwrap_or_default();
    let (title, unit, axis) = ("marker error", "mean, millimetres", Some("frame"));
    panels.push(Panel { title, unit, places, axis, lines, range: 0.0..1.0, field: 320, unseen });
    panels
}

fn numbers(curves: &MuscleCurves) -> Vec<f64> {
    (1..=curves.frames().len()).map(|number| number as f64).collect()
}

pub(super) fn error_height(curves: &MuscleCurves, muscles: Option<&[usize]>) -> u32 {
    let places = numbers(curves);
    HEAD + error_panels(curves, muscles, &places, &[]).iter().map(Panel::height).sum::<u32>()
}

pub(super) fn draw_error<DB: DrawingBackend>(
    area: &Area<DB>,
    title: &str,
    curves: &MuscleCurves,
    muscles: Option<&[usize]>,
) -> Drawn<DB> {
    let places = numbers(curves);
    let unseen = unseen(curves, &places);
    head(area, title, curves)?;
    stacked(area, &error_panels(curves, muscles, &places, &unseen))?;
    Ok(())
}
