//! Wrinkles that nobody has: drawn after a formula into every region, for pictures and tests of living skin.

#![allow(clippy::unwrap_used, reason = "the layers are as many as a volume takes")]
#![allow(dead_code, reason = "not everyone that shares this file uses all of it")]

use nalgebra::Vector2;
use understudy::appearance::{Area, FaceFrame, Layer, Patch, Region, TextureVolume};

/// Layers of a volume.
const LAYERS: usize = 5;
/// How much darker the deepest groove is, as a logarithm.
const DEPTH: f64 = 0.45;
/// What a performer's own colours are made of, sRGB.
const SKIN: [f64; 3] = [205.0, 160.0, 138.0];

/// Pits of a chin that is pushed up, pixels from the area's middle.
const DIMPLES: [[f64; 2]; 9] = [
    [-22.0, 2.0],
    [-9.0, 8.0],
    [4.0, 3.0],
    [17.0, 9.0],
    [27.0, -1.0],
    [-15.0, 18.0],
    [-1.0, 17.0],
    [11.0, 20.0],
    [-32.0, 12.0],
];

/// A volume for every region.
pub fn volumes(frame: &FaceFrame) -> Vec<TextureVolume> {
    Region::ALL.into_iter().map(|region| volume(region, frame)).collect()
}

/// A region's volume: nothing in the first layer, the deepest wrinkles in the last.
pub fn volume(region: Region, frame: &FaceFrame) -> TextureVolume {
    let (area, patch) = (Area::of(region, frame), Patch::of(region, frame));
    let half = Vector2::new(area.across.norm(), area.down.norm());
    let layers = (0..LAYERS).map(|layer| {
        let strength = layer as f64 / (LAYERS - 1) as f64;
        let ratios: Vec<f64> = patch
            .places()
            .map(|place| {
                let mut at = area.inside(&place);
                at.x *= if region.is_left() { -1.0 } else { 1.0 };
                strength * DEPTH * shape(region, at.component_mul(&half), &half)
            })
            .collect();
        let colour = |ratio: &f64| SKIN.map(|c| (c * (ratio / 2.2).exp()).clamp(0.0, 255.0).round() as u8);
        let stored: Vec<f32> = ratios.iter().map(|ratio| *ratio as f32).collect();
        Layer::new(&stored, ratios.iter().map(colour).collect())
    });
    TextureVolume::new(region, patch, layers.collect()).unwrap()
}

/// Logarithm of luminance, −1 in the deepest groove, at a place from the area's middle, pixels; the subject's right side.
fn shape(region: Region, at: Vector2<f64>, half: &Vector2<f64>) -> f64 {
    let (u, v) = (at.x / half.x, at.y / half.y);
    let fade = |t: f64| (1.0 - t * t).max(0.0);
    match region {
        Region::Forehead => [-0.55, -0.08, 0.4]
            .iter()
            .map(|line| groove(at.y - half.y * (line + 0.16 * (2.6 * u).cos() - 0.1), 2.2) * fade(u))
            .sum(),
        Region::Glabella => [-0.34, 0.34]
            .iter()
            .map(|line| groove(at.x - half.x * line * (1.1 + 0.3 * v), 2.2) * fade(v))
            .sum(),
        Region::CrowsFeetRight | Region::CrowsFeetLeft => [-0.55, 0.0, 0.55]
            .iter()
            .map(|slope| {
                let out = half.x - at.x;
                groove(at.y - slope * out - 0.1 * half.y, 1.8) * fade((out / half.x - 1.0) * 1.02)
            })
            .sum(),
        Region::NasolabialRight | Region::NasolabialLeft => {
            let beside = at.x - half.x * (0.18 - 0.3 * v * v);
            (groove(beside, 4.5) + 0.35 * (-(beside + 16.0).powi(2) / 180.0).exp()) * fade(v)
        }
        Region::EyeRight | Region::EyeLeft => groove(at.y + half.y * (0.62 - 0.4 * u * u), 2.0) * fade(u),
        Region::MouthCornerRight | Region::MouthCornerLeft => {
            groove(at.x + half.x * (0.25 - 0.3 * v * v), 3.2) * fade(v)
        }
        Region::Chin => {
            let dimple = |[x, y]: [f64; 2]| -(-(at - Vector2::new(x, y)).norm_squared() / 22.0).exp();
            0.6 * DIMPLES.map(dimple).iter().sum::<f64>()
                + groove(at.y + half.y * (0.62 - 0.2 * u * u), 3.4) * fade(u)
        }
    }
}

/// Across a line: dark in the groove, bright on the ridges beside it.
fn groove(away: f64, width: f64) -> f64 {
    let bell = |from: f64, width: f64| (-0.5 * (from / width).powi(2)).exp();
    -bell(away, width) + 0.4 * (bell(away - 2.4 * width, 1.4 * width) + bell(away + 2.4 * width, 1.4 * width))
}
