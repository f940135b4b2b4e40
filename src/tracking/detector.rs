//! Single-shot face detection: anchors, decoding, weighted non-maximum suppression.
//!
//! Follows MediaPipe's face detector so that the regions handed to the landmark network are its own.

use std::path::Path;

use nalgebra::Vector2;
use opencv::{core, imgproc};
use ort::{session::Session, value::TensorRef};

use super::{
    FaceRegion, Runtime, TrackingError,
    input::{Shades, fill_input, shades},
};
use crate::capture::Image;

/// Scores below are no faces.
const MINIMUM_SCORE: f64 = 0.5;
/// Boxes that overlap more than this are one face.
const SAME_FACE_OVERLAP: f64 = 0.5;
/// Box centre, box size and six keypoints.
const VALUES_PER_ANCHOR: usize = 16;

/// What a detector network expects and gives.
#[derive(Debug, Clone, Copy)]
pub struct DetectorLayout {
    /// For messages.
    pub name: &'static str,
    /// Side of the square input.
    pub input: i32,
    /// Cells along a side and anchors in each cell, in the order of the network's rows.
    pub grids: &'static [(usize, usize)],
    /// Name of the input tensor.
    pub input_name: &'static str,
    /// Name of the anchors × 16 output.
    pub boxes_name: &'static str,
    /// Name of the anchors × 1 output.
    pub scores_name: &'static str,
}

/// Faces of roughly a sixth of the picture's width and larger.
pub const SHORT_RANGE: DetectorLayout = DetectorLayout {
    name: "short-range face detector",
    input: 128,
    grids: &[(16, 2), (8, 6)],
    input_name: "input",
    boxes_name: "regressors",
    scores_name: "classificators",
};

/// Small faces too, from about a fourteenth of the picture's width.
pub const FULL_RANGE: DetectorLayout = DetectorLayout {
    name: "full-range face detector",
    input: 256,
    grids: &[(16, 2), (8, 6)],
    input_name: "input",
    boxes_name: "regressors",
    scores_name: "classificators",
};

/// A face box in image pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// 0..=1.
    pub score: f64,
    /// Top left corner.
    pub minimum: Vector2<f64>,
    /// Bottom right corner.
    pub maximum: Vector2<f64>,
    /// Right eye, left eye, nose tip, mouth, right ear, left ear.
    pub keypoints: [Vector2<f64>; 6],
}

impl Detection {
    /// Square pixels.
    pub fn area(&self) -> f64 {
        let extent = self.maximum - self.minimum;
        extent.x.max(0.0) * extent.y.max(0.0)
    }

    /// The region the landmark network should look at.
    pub fn region(&self) -> FaceRegion {
        FaceRegion::around(self.minimum, self.maximum, self.keypoints[0], self.keypoints[1])
    }

    fn overlap(&self, other: &Self) -> f64 {
        let extent = self.maximum.inf(&other.maximum) - self.minimum.sup(&other.minimum);
        let shared = extent.x.max(0.0) * extent.y.max(0.0);
        shared / (self.area() + other.area() - shared).max(f64::MIN_POSITIVE)
    }

    /// The same face in a picture that is `scale` times as large, moved by `offset`.
    fn moved(mut self, scale: f64, offset: Vector2<f64>) -> Self {
        let place = |point: Vector2<f64>| point * scale + offset;
        self.minimum = place(self.minimum);
        self.maximum = place(self.maximum);
        self.keypoints = self.keypoints.map(place);
        self
    }
}

/// A square part of the picture, in pixels.
#[derive(Debug, Clone, Copy)]
struct Window {
    left: f64,
    top: f64,
    side: f64,
}

/// A loaded detector network.
pub struct Detector {
    layout: DetectorLayout,
    session: Session,
    anchors: Vec<Vector2<f64>>,
    shades: Shades,
    input: Vec<f32>,
    crop: core::Mat,
}

impl Detector {
    /// Opens the network and checks that it has the layout's tensors.
    pub fn open(runtime: &Runtime, model: &Path, layout: DetectorLayout) -> Result<Self, TrackingError> {
        let session = runtime.open(model)?;
        for (wanted, found) in [
            (layout.input_name, session.inputs().iter().any(|tensor| tensor.name() == layout.input_name)),
            (layout.boxes_name, session.outputs().iter().any(|tensor| tensor.name() == layout.boxes_name)),
            (layout.scores_name, session.outputs().iter().any(|tensor| tensor.name() == layout.scores_name)),
        ] {
            if !found {
                return Err(TrackingError::Network {
                    path: model.into(),
                    reason: format!("the {} has no tensor '{wanted}'", layout.name),
                });
            }
        }
        let anchors =
            layout.grids.iter().flat_map(|&(cells, per_cell)| cell_centres(cells, per_cell)).collect();
        let input = vec![0.0; (layout.input * layout.input * 3) as usize];
        let shades = shades(|byte| byte / 127.5 - 1.0);
        Ok(Self { layout, session, anchors, shades, input, crop: core::Mat::default() })
    }

    /// All faces in the whole picture, best score first.
    pub fn detect(&mut self, image: &Image) -> Result<Vec<Detection>, TrackingError> {
        let (width, height) = (f64::from(image.width()), f64::from(image.height()));
        let side = width.max(height);
        self.detect_in(image, Window { left: (width - side) / 2.0, top: (height - side) / 2.0, side })
    }

    /// All faces, looked for in overlapping squares of half the picture's shorter side: slower, finds smaller ones.
    pub fn detect_tiled(&mut self, image: &Image) -> Result<Vec<Detection>, TrackingError> {
        let (width, height) = (f64::from(image.width()), f64::from(image.height()));
        let side = width.min(height) / 2.0;
        let positions = |length: f64| {
            let count = ((length - side) / (side / 2.0)).ceil().max(0.0) as usize + 1;
            (0..count).map(move |i| (i as f64 * side / 2.0).min(length - side))
        };
        let mut found = Vec::new();
        for top in positions(height) {
            for left in positions(width) {
                found.extend(self.detect_in(image, Window { left, top, side })?);
            }
        }
        Ok(suppress(found))
    }

    fn detect_in(&mut self, image: &Image, window: Window) -> Result<Vec<Detection>, TrackingError> {
        let size = self.layout.input;
        let scale = f64::from(size) / window.side;
        let map = core::Mat::from_slice_2d(&[
            [scale, 0.0, -window.left * scale],
            [0.0, scale, -window.top * scale],
        ])?;
        imgproc::warp_affine(
            image.mat(),
            &mut self.crop,
            &map,
            core::Size::new(size, size),
            imgproc::INTER_LINEAR,
            core::BORDER_CONSTANT,
            core::Scalar::default(),
        )?;
        fill_input(&self.crop, &self.shades, &mut self.input)?;
        let failed = |source| TrackingError::Inference { network: self.layout.name, source };
        let side = i64::from(size);
        let tensor =
            TensorRef::from_array_view(([1, side, side, 3], self.input.as_slice())).map_err(failed)?;
        let outputs = self.session.run(ort::inputs![self.layout.input_name => tensor]).map_err(failed)?;
        let (_, boxes) = outputs[self.layout.boxes_name].try_extract_tensor::<f32>().map_err(failed)?;
        let (_, scores) = outputs[self.layout.scores_name].try_extract_tensor::<f32>().map_err(failed)?;
        let candidates = self
            .anchors
            .iter()
            .zip(boxes.chunks_exact(VALUES_PER_ANCHOR))
            .zip(scores)
            .filter_map(|((anchor, values), &logit)| decode(*anchor, values, logit, f64::from(size)))
            .map(|detection| detection.moved(window.side, Vector2::new(window.left, window.top)))
            .collect();
        Ok(suppress(candidates))
    }
}

fn cell_centres(cells: usize, per_cell: usize) -> impl Iterator<Item = Vector2<f64>> {
    (0..cells * cells * per_cell).map(move |row| {
        let cell = row / per_cell;
        Vector2::new((cell % cells) as f64 + 0.5, (cell / cells) as f64 + 0.5) / cells as f64
    })
}

/// One row of the network, in fractions of its input square; `None` below the least score.
fn decode(anchor: Vector2<f64>, values: &[f32], logit: f32, size: f64) -> Option<Detection> {
    let score = 1.0 / (1.0 + (-f64::from(logit).clamp(-100.0, 100.0)).exp());
    if score < MINIMUM_SCORE {
        return None;
    }
    let pair = |k: usize| Vector2::new(f64::from(values[2 * k]), f64::from(values[2 * k + 1])) / size;
    let (centre, half) = (pair(0) + anchor, pair(1) / 2.0);
    Some(Detection {
        score,
        minimum: centre - half,
        maximum: centre + half,
        keypoints: std::array::from_fn(|k| pair(k + 2) + anchor),
    })
}

/// Weighted suppression: every group of overlapping boxes becomes their mean, weighted by score.
fn suppress(mut candidates: Vec<Detection>) -> Vec<Detection> {
    let mut kept = Vec::new();
    candidates.sort_by(|a, b| b.score.total_cmp(&a.score));
    while let Some(best) = candidates.first().cloned() {
        let (group, rest): (Vec<_>, Vec<_>) =
            candidates.into_iter().partition(|other| best.overlap(other) > SAME_FACE_OVERLAP);
        if group.is_empty() {
            // A degenerate box does not even overlap itself.
            return kept;
        }
        let total: f64 = group.iter().map(|member| member.score).sum();
        let mean = |value: &dyn Fn(&Detection) -> Vector2<f64>| {
            group.iter().map(|member| value(member) * (member.score / total)).sum::<Vector2<f64>>()
        };
        kept.push(Detection {
            score: best.score,
            minimum: mean(&|member| member.minimum),
            maximum: mean(&|member| member.maximum),
            keypoints: std::array::from_fn(|k| mean(&|member| member.keypoints[k])),
        });
        candidates = rest;
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(left: f64, side: f64, score: f64) -> Detection {
        Detection {
            score,
            minimum: Vector2::new(left, 0.0),
            maximum: Vector2::new(left + side, side),
            keypoints: [Vector2::zeros(); 6],
        }
    }

    #[test]
    fn overlapping_boxes_become_their_weighted_mean_and_others_stay() {
        let kept = suppress(vec![square(0.0, 10.0, 0.6), square(50.0, 10.0, 0.7), square(1.0, 10.0, 0.9)]);
        assert_eq!(kept.len(), 2);
        assert!((kept[0].minimum.x - 0.6).abs() < 1e-12 && (kept[0].score - 0.9).abs() < 1e-12);
        assert!((kept[1].minimum.x - 50.0).abs() < 1e-12);
    }

    #[test]
    fn anchors_are_cell_centres() {
        let anchors: Vec<_> = SHORT_RANGE.grids.iter().flat_map(|&(c, n)| cell_centres(c, n)).collect();
        assert_eq!(anchors.len(), 896);
        assert!((anchors[1] - Vector2::new(0.5 / 16.0, 0.5 / 16.0)).norm() < 1e-12);
        assert!((anchors[895] - Vector2::new(7.5 / 8.0, 7.5 / 8.0)).norm() < 1e-12);
    }
}
