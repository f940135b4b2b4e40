//! Wrinkles that move vertices: a furrow drawn into a volume, on a sheet that is dense enough and on one that is not.

#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use nalgebra::Point3;
use understudy::{
    appearance::{
        AppearanceStates, FRAME_SIZE, FaceChart, FaceFrame, Layer, Patch, RatioFilter, RatioOptions, Region,
        TextureVolume,
    },
    assets::Assets,
    pipeline::{SkinRelief, read_face_frame},
    scan::Mesh,
};

const UP: [f32; 3] = [0.0, 0.0, 1.0];

fn frame() -> FaceFrame {
    let canonical = Assets::locate().unwrap().verified("canonical_face").unwrap();
    read_face_frame(&canonical).unwrap()
}

/// A sheet over the whole frame with a vertex every `step` pixels.
fn sheet(step: usize) -> (Mesh, FaceChart) {
    let [columns, rows] = FRAME_SIZE.map(|side| side / step);
    let places: Vec<[f32; 2]> =
        (0..columns * rows).map(|i| [(i % columns * step) as f32, (i / columns * step) as f32]).collect();
    let at = |row: usize, column: usize| (row * columns + column) as u32;
    let cells = (0..rows - 1).flat_map(|row| (0..columns - 1).map(move |column| (row, column)));
    let triangles = cells.flat_map(|(r, c)| {
        [[at(r, c), at(r + 1, c), at(r, c + 1)], [at(r, c + 1), at(r + 1, c), at(r + 1, c + 1)]]
    });
    let triangles = triangles.collect();
    let positions = places.iter().map(|p| Point3::new(f64::from(p[0]) / 3.0, f64::from(p[1]) / -3.0, 0.0));
    let mesh = Mesh { positions: positions.collect(), triangles, ..Mesh::default() };
    let covers = vec![1.0; places.len()];
    (mesh, FaceChart::of_places(places, covers).unwrap())
}

/// A dark line across the middle of the region.
fn furrow(region: Region, frame: &FaceFrame) -> (TextureVolume, f64) {
    let patch = Patch::of(region, frame);
    // Ratios come masked.
    let filter = RatioFilter::new(frame, RatioOptions::default());
    let middle = f64::from(patch.origin[1]) + f64::from(patch.size[1]) / 2.0;
    let layer = |depth: f32| {
        let dark = |y: f64| -depth * (-((y - middle) / 3.0).powi(2) / 2.0).exp() as f32;
        let ratios: Vec<f32> = patch.places().map(|place| dark(place.y) * filter.mask_at(&place)).collect();
        Layer::new(&ratios, vec![[128; 3]; ratios.len()])
    };
    (TextureVolume::new(region, patch, vec![layer(0.0), layer(0.1), layer(0.2)]).unwrap(), middle)
}

fn raised(relief: &SkinRelief, states: &AppearanceStates, mesh: &Mesh) -> Vec<f32> {
    let mut positions = mesh.positions_f32();
    relief.apply(states, &vec![UP; positions.len()], &mut positions);
    positions.iter().map(|p| p[2]).collect()
}

#[test]
fn a_furrow_sinks_by_its_state_and_no_further_than_its_bound() {
    let (frame, (mesh, chart)) = (frame(), sheet(2));
    let (volume, middle) = furrow(Region::Forehead, &frame);
    let relief = SkinRelief::of_chart(&mesh, &frame, &chart, &[volume], 1.0);
    let mut states = AppearanceStates::default();
    assert!(raised(&relief, &states, &mesh).iter().all(|z| z.abs() < f32::EPSILON));
    states.set(Region::Forehead, Some(1.0));
    let whole = raised(&relief, &states, &mesh);
    let deepest = whole.iter().copied().fold(0.0, f32::min);
    let highest = whole.iter().copied().fold(0.0, f32::max);
    assert!((-0.4..-0.2).contains(&deepest) && highest < -deepest, "{deepest} {highest}");
    let lowest = whole.iter().position(|&z| z <= deepest).unwrap();
    assert!((f64::from(chart.places()[lowest][1]) - middle).abs() < 3.0);
    states.set(Region::Forehead, Some(0.5));
    let half = raised(&relief, &states, &mesh);
    assert!(whole.iter().zip(&half).all(|(whole, half)| (whole - 2.0 * half).abs() < 1e-5));
    let deltas = relief.deltas(Region::Forehead, &vec![UP; mesh.positions.len()], mesh.positions.len());
    assert!(deltas.iter().zip(&whole).all(|(delta, z)| (delta[2] - z).abs() < 1e-5));
    assert!(relief.deltas(Region::Chin, &[], 0).is_empty());
}

#[test]
fn a_fold_that_two_regions_share_counts_once() {
    let (frame, (mesh, chart)) = (frame(), sheet(2));
    let volumes = [furrow(Region::Forehead, &frame).0, furrow(Region::Glabella, &frame).0];
    let relief = SkinRelief::of_chart(&mesh, &frame, &chart, &volumes, 5.0);
    let mut states = AppearanceStates::default();
    states.set(Region::Forehead, Some(1.0));
    states.set(Region::Glabella, Some(1.0));
    let shown = raised(&relief, &states, &mesh);
    assert!(shown.iter().all(|z| z.abs() <= 0.4));
    assert!(shown.iter().any(|z| *z < -0.3));
}

#[test]
fn a_coarse_scan_and_lids_stay_flat() {
    let frame = frame();
    let (coarse, chart) = sheet(8);
    let (volume, _) = furrow(Region::Forehead, &frame);
    assert!(SkinRelief::of_chart(&coarse, &frame, &chart, &[volume], 1.0).is_flat());
    let (dense, chart) = sheet(2);
    let (lids, _) = furrow(Region::EyeLeft, &frame);
    assert!(SkinRelief::of_chart(&dense, &frame, &chart, &[lids], 1.0).is_flat());
}
