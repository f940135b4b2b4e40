//! The picture of the mouth's inside: cavity, teeth with their gums, and tongue, one below the other.

use image::{Rgb, RgbImage};

use super::{
    eyeball::smooth,
    interior::{CAVITY_BAND, LOWER_BAND, LOWER_TEETH, TONGUE_BAND, UPPER_BAND, UPPER_TEETH},
};

/// Pixels of the picture's sides.
const SIDE: u32 = 512;
/// sRGB.
const FLESH: [f64; 3] = [0.46, 0.17, 0.16];
const GUM: [f64; 3] = [0.66, 0.36, 0.35];
const TOOTH: [f64; 3] = [0.80, 0.76, 0.68];
const TOOTH_NECK: [f64; 3] = [0.72, 0.64, 0.52];
const TONGUE: [f64; 3] = [0.68, 0.34, 0.33];
const TONGUE_GROOVE: [f64; 3] = [0.52, 0.22, 0.22];

/// Paints it.
pub fn paint() -> RgbImage {
    RgbImage::from_fn(SIDE, SIDE, |column, row| {
        let across = (f64::from(column) + 0.5) / f64::from(SIDE);
        let down = (f64::from(row) + 0.5) / f64::from(SIDE);
        // The bands' margins repeat what stands beside them.
        let across = ((across - 0.02) / 0.96).clamp(0.0, 1.0);
        let within = |band: [f64; 2]| {
            let t = (down - band[0]) / (band[1] - band[0]);
            (0.0..1.0).contains(&t).then(|| ((t - 0.06) / 0.88).clamp(0.0, 1.0))
        };
        let colour = if let Some(depth) = within(CAVITY_BAND) {
            cavity(depth)
        } else if let Some(t) = within(UPPER_BAND) {
            tooth(across, t, &UPPER_TEETH)
        } else if let Some(t) = within(LOWER_BAND) {
            tooth(across, t, &LOWER_TEETH).map(|c| 0.92 * c)
        } else {
            within(TONGUE_BAND).map_or(FLESH, |t| tongue(across, t))
        };
        Rgb(colour.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8))
    })
}

/// Flesh that darkens towards the throat.
fn cavity(depth: f64) -> [f64; 3] {
    // The rim lies in the lips' own shadow: a slit between them is dark.
    let slit = 0.45 + 0.55 * smooth((depth / 0.06).clamp(0.0, 1.0));
    let light = slit * (0.08 + 0.72 * (1.0 - smooth((depth / 0.5).clamp(0.0, 1.0))));
    FLESH.map(|c| c * light)
}

/// Rows as the teeth's mesh has them: gum to 0.2, then tooth, its edge at 0.7, its back beyond.
fn tooth(across: f64, t: f64, widths: &[f64; 6]) -> [f64; 3] {
    let total: f64 = widths.iter().sum::<f64>() * 2.0;
    let mut place = (across * total - total / 2.0).abs();
    let mut in_tooth = 1.0;
    for width in widths {
        if place < *width {
            in_tooth = 2.0 * place / width - 1.0;
            break;
        }
        place -= width;
    }
    let groove = smooth(((in_tooth.abs() - 0.80) / 0.20).clamp(0.0, 1.0));
    let enamel = mix(TOOTH_NECK, TOOTH, smooth(((t - 0.2) / 0.25).clamp(0.0, 1.0)));
    let enamel = enamel.map(|c| c * (1.0 - 0.42 * groove));
    let is_tooth = smooth(((t - 0.17) / 0.05).clamp(0.0, 1.0));
    let gum = GUM.map(|c| c * (0.75 + 0.25 * (t / 0.2).min(1.0)));
    // Lips and cheeks shade the arch's sides, and the mouth its back.
    let side = 1.0 - 0.72 * (2.0 * (across - 0.5).abs()).powf(2.0);
    let back = 1.0 - 0.6 * smooth(((t - 0.72) / 0.2).clamp(0.0, 1.0));
    mix(gum, enamel, is_tooth).map(|c| c * side * back)
}

/// Light at the tip, dark towards the throat, with a groove along the middle.
fn tongue(across: f64, down: f64) -> [f64; 3] {
    let groove = 0.55 * (-((across - 0.5) / 0.05).powi(2)).exp();
    let forward = 0.22 + 0.78 * smooth(((down - 0.1) / 0.6).clamp(0.0, 1.0));
    let side = 1.0 - 0.45 * (2.0 * (across - 0.5).abs()).powi(3);
    mix(TONGUE, TONGUE_GROOVE, groove).map(|c| c * forward * side)
}

fn mix(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
}
