//! Charts of contractions (001 figs. 3 and 5), as SVG and as pictures, with the same layout.

mod canvas;
mod over_time;
mod panel;
mod snapshots;
mod strips;

use image::{ExtendedColorType, ImageEncoder as _, Rgba, RgbaImage, codecs::jpeg::JpegEncoder, imageops};
use plotters::prelude::*;

use self::{canvas::Canvas, panel::Drawn};
use super::ViewError;
use crate::muscle::MuscleCurves;

/// A picture's quality inside an SVG.
const JPEG_QUALITY: u8 = 90;
/// The longest side of a picture that is drawn.
const LONGEST: u32 = 16_000;

/// What a chart shows of a take.
pub enum Chart<'a> {
    /// The curves over time, upper and lower face apart, the marker error where there is one, and a strip for every
    /// muscle. With muscles chosen, these alone; otherwise those that move most.
    Curves {
        /// Stands above it.
        title: &'a str,
        /// The take.
        curves: &'a MuscleCurves,
        /// Places among the take's muscles.
        muscles: Option<&'a [usize]>,
    },
    /// The curves of a few muscles and the marker error, over the number of the frame (001 fig. 5).
    Error {
        /// Stands above it.
        title: &'a str,
        /// The take; its frames have errors.
        curves: &'a MuscleCurves,
        /// Places among the take's muscles; otherwise the one of either region that moves most.
        muscles: Option<&'a [usize]>,
    },
    /// Moments, each with a bar for every muscle (001 fig. 3).
    Snapshots {
        /// Stands above it.
        title: &'a str,
        /// The take.
        curves: &'a MuscleCurves,
        /// Places among the take's muscles; otherwise all, or the 20 that contract most.
        muscles: Option<&'a [usize]>,
        /// At least one.
        moments: &'a [Moment],
    },
}

/// A moment of a take, and how it looks.
#[derive(Debug, Clone)]
pub struct Moment {
    /// Among the take's frames, from 0.
    pub frame: usize,
    /// Of performer or avatar, any size.
    pub picture: Option<RgbaImage>,
}

/// A picture's place on a chart, units.
struct Inset<'a> {
    corner: (u32, u32),
    size: (u32, u32),
    picture: &'a RgbaImage,
}

impl Chart<'_> {
    /// Draws it on white, two pixels where the SVG has one.
    pub fn picture(&self) -> Result<RgbaImage, ViewError> {
        let (width, height) = self.size()?;
        let mut picture = RgbaImage::from_pixel(width, height, Rgba([255; 4]));
        self.draw(Canvas(&mut picture)).map_err(|error| ViewError::Chart { reason: error.to_string() })?;
        for inset in self.insets() {
            let (width, height) = inset.size;
            let fitted = imageops::resize(inset.picture, width, height, imageops::FilterType::CatmullRom);
            imageops::overlay(&mut picture, &fitted, i64::from(inset.corner.0), i64::from(inset.corner.1));
        }
        Ok(picture)
    }

    /// Draws it as an SVG with its pictures inside.
    pub fn svg(&self) -> Result<String, ViewError> {
        let failed = |reason: String| ViewError::Chart { reason };
        let (width, height) = self.size()?;
        let mut text = String::new();
        let backend = SVGBackend::with_string(&mut text, (width, height));
        self.draw(backend).map_err(|error| failed(error.to_string()))?;
        // Plotters counts in whole units; two of them a pixel make curves smooth.
        let (whole, half) = (size_of(width, height), size_of(width / 2, height / 2));
        let mut text = text.replacen(&whole, &half, 1);
        let end = text.rfind("</svg>").unwrap_or(text.len());
        text.truncate(end);
        for inset in self.insets() {
            let ((x, y), (width, height)) = (inset.corner, inset.size);
            let fitted = imageops::resize(inset.picture, width, height, imageops::FilterType::CatmullRom);
            let rgb = image::DynamicImage::ImageRgba8(fitted).into_rgb8();
            let mut bytes = Vec::new();
            JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY)
                .write_image(&rgb, width, height, ExtendedColorType::Rgb8)
                .map_err(|error| failed(error.to_string()))?;
            let data = base64::encode(&bytes);
            let (place, size) = (format!("x=\"{x}\" y=\"{y}\""), size_of(width, height));
            text.extend(["<image ", &place, " ", &size, " href=\"data:image/jpeg;base64,", &data, "\"/>\n"]);
        }
        text.push_str("</svg>\n");
        Ok(text)
    }

    fn size(&self) -> Result<(u32, u32), ViewError> {
        let height = match self {
            Self::Curves { curves, muscles, .. } => over_time::curves_height(curves, *muscles),
            Self::Error { curves, muscles, .. } => over_time::error_height(curves, *muscles),
            Self::Snapshots { curves, muscles, moments, .. } => snapshots::height(curves, *muscles, moments),
        };
        let reason = || "there is too much on it; choose fewer muscles or moments".to_owned();
        let fits = height <= LONGEST;
        // Even, so that half of it is whole.
        fits.then_some((panel::WIDTH, height.next_multiple_of(2)))
            .ok_or_else(|| ViewError::Chart { reason: reason() })
    }

    fn draw<DB: DrawingBackend>(&self, backend: DB) -> Drawn<DB> {
        let area = backend.into_drawing_area();
        area.fill(&WHITE)?;
        match self {
            Self::Curves { title, curves, muscles } => {
                over_time::draw_curves(&area, title, curves, *muscles)?;
            }
            Self::Error { title, curves, muscles } => over_time::draw_error(&area, title, curves, *muscles)?,
            Self::Snapshots { title, curves, muscles, moments } => {
                snapshots::draw(&area, title, curves, *muscles, moments)?;
            }
        }
        area.present()
    }

    fn insets(&self) -> Vec<Inset<'_>> {
        match self {
            Self::Snapshots { curves, muscles, moments, .. } => snapshots::insets(curves, *muscles, moments),
            _ => Vec::new(),
        }
    }
}

fn size_of(width: u32, height: u32) -> String {
    format!("width=\"{width}\" height=\"{height}\"")
}
