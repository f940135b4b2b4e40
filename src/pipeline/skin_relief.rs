//! Wrinkles that move vertices, where a scan is dense enough to hold them.

use nalgebra::{Point2, Vector2};

use super::{PipelineError, SharedFace, Target};
use crate::{
    appearance::{
        AppearanceStates, Area, FaceChart, FaceFrame, RatioFilter, RatioOptions, Region, Relief,
        ReliefOptions, TextureVolume,
    },
    scan::Mesh,
};

/// Pixels of the shared frame: a wrinkle is some five wide, and a mean edge that is longer would alias it.
const LONGEST_EDGE: f64 = 4.0;
/// Pixels along which relief fades to the edge of its region.
const RAMP: f64 = 10.0;
/// Heights below this are none, millimetres.
const FLAT: f32 = 1e-3;

/// Heights of a target's vertices for each region, at its most expressive state.
///
/// Heights grow in a straight line with the state; the layers between are not looked at. See [`Relief`] for what they are
/// guessed from.
#[derive(Debug, Clone, Default)]
pub struct SkinRelief {
    /// Vertices and their heights, millimetres along the outward normal.
    regions: Vec<(Region, Vec<(u32, f32)>)>,
}

impl SkinRelief {
    /// Of the regions in which the target's edges are short enough, on average. `gain` multiplies the ratios' logarithms.
    pub fn new(
        target: &Target,
        face: &SharedFace,
        volumes: &[TextureVolume],
        gain: f32,
    ) -> Result<Self, PipelineError> {
        let chart = face.chart(target)?;
        Ok(Self::of_chart(&target.anatomy.mesh, face.frame(), &chart, volumes, gain))
    }

    /// The same for a mesh whose chart is known.
    pub fn of_chart(
        mesh: &Mesh,
        frame: &FaceFrame,
        chart: &FaceChart,
        volumes: &[TextureVolume],
        gain: f32,
    ) -> Self {
        // The filter's mask is only made for a scan that can show anything.
        let mut filter = None;
        let mut regions = Vec::new();
        for volume in volumes {
            let area = Area::of(volume.region(), frame);
            if volume.region().is_eye() || !is_dense(mesh, chart, &area) {
                continue;
            }
            let filter = filter.get_or_insert_with(|| RatioFilter::new(frame, RatioOptions::default()));
            let patch = volume.patch();
            let inside = |place: &Point2<f64>| {
                (0..2).all(|axis| {
                    let first = f64::from(patch.origin[axis]);
                    (first..first + f64::from(patch.size[axis])).contains(&place[axis])
                })
            };
            let mask = |place: &Point2<f64>| if inside(place) { filter.mask_at(place) } else { 0.0 };
            let relief =
                Relief::new(|place| volume.log_ratio(place, 1.0) * gain, mask, &ReliefOptions::default());
            let places = chart.places().iter().zip(chart.covers());
            let heights = (0..).zip(places).filter_map(|(vertex, (place, cover))| {
                let place = Point2::from(place.map(f64::from));
                let height = relief.height(&place) * area.alpha(&place, RAMP) as f32 * cover;
                (height.abs() > FLAT).then_some((vertex, height))
            });
            regions.push((volume.region(), heights.collect()));
        }
        Self { regions }
    }

    /// Whether it moves nothing in any state.
    pub fn is_flat(&self) -> bool {
        self.regions.iter().all(|(_, heights)| heights.is_empty())
    }

    /// Moves vertices (V × 3, millimetres) along their unit normals as far as the states say. Where two regions share a
    /// vertex, the one that moves it further counts: a fold that both saw is one fold.
    pub fn apply(&self, states: &AppearanceStates, normals: &[[f32; 3]], positions: &mut [[f32; 3]]) {
        let shown =
            self.regions.iter().map(|(region, heights)| (states.get(*region).unwrap_or(0.0), heights));
        let shown: Vec<_> = shown.filter(|(state, _)| *state > 0.0).collect();
        let raised = |at: usize, vertex: u32| {
            let (state, heights) = shown[at];
            let there = heights.binary_search_by_key(&vertex, |(vertex, _)| *vertex);
            there.map_or(0.0, |place| heights[place].1 * state)
        };
        for (at, (state, heights)) in shown.iter().enumerate() {
            for &(vertex, height) in *heights {
                let height = height * state;
                let beats = |other: usize| {
                    let rival = raised(other, vertex).abs();
                    other == at || height.abs() > rival || (height.abs() >= rival && at < other)
                };
                if (0..shown.len()).all(beats) {
                    let normal = normals[vertex as usize];
                    (0..3).for_each(|axis| positions[vertex as usize][axis] += normal[axis] * height);
                }
            }
        }
    }

    /// How far a region moves each of so many vertices in its most expressive state, millimetres; nothing if it moves none.
    pub fn deltas(&self, region: Region, normals: &[[f32; 3]], vertices: usize) -> Vec<[f32; 3]> {
        let heights = self.regions.iter().find(|(own, heights)| *own == region && !heights.is_empty());
        let Some((_, heights)) = heights else { return Vec::new() };
        let mut deltas = vec![[0.0; 3]; vertices];
        for &(vertex, height) in heights.iter().filter(|(vertex, _)| (*vertex as usize) < vertices) {
            deltas[vertex as usize] = normals[vertex as usize].map(|axis| axis * height);
        }
        deltas
    }
}

/// Whether a mesh's edges within an area of the shared frame are short enough, on average, to hold a wrinkle.
fn is_dense(mesh: &Mesh, chart: &FaceChart, area: &Area) -> bool {
    let place = |vertex: u32| Vector2::from(chart.places()[vertex as usize]);
    let within = |&vertex: &u32| {
        let at = chart.places()[vertex as usize].map(f64::from);
        chart.covers()[vertex as usize] > 0.0 && area.inside(&Point2::from(at)).amax() <= 1.0
    };
    let (mut length, mut edges) = (0.0, 0_u32);
    for corners in mesh.triangles.iter().filter(|corners| corners.iter().all(within)) {
        for k in 0..3 {
            length += f64::from((place(corners[k]) - place(corners[(k + 1) % 3])).norm());
            edges += 1;
        }
    }
    edges > 0 && length / f64::from(edges) <= LONGEST_EDGE
}
