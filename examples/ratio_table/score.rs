//! A smile on another's skin against that person's own smile.

use std::fmt::Write;

use image::{ImageBuffer, Luma, imageops};
use nalgebra::{Point2, Vector2};
use understudy::appearance::{
    FRAME_SIZE, FaceFrame, FaceImage, RatioFilter, RatioImage, RatioOptions, TRANSFER_GAIN,
};
use understudy::tracking::index;

use super::people::Person;

/// A donor that smiles less is not enlarged beyond this.
const MOST_AMPLIFIED: f64 = 1.5;
/// Controls move the ratio by this, pixels of the frame.
const SHIFT: f64 = 35.0;
/// The structural similarity's window and constants (Wang et al. 2004), grey levels.
const WINDOW: f32 = 1.5;
const STABLE: [f32; 2] = [6.5025, 58.5225];

/// Where and how two faces are compared: grey levels (sRGB of the luminance) over cheeks and folds.
pub struct Scale {
    region: Vec<usize>,
}

impl Scale {
    /// Skin between the lower lids and the lower lip, apart from nose, lips and outline.
    pub fn new(frame: &FaceFrame, filter: &RatioFilter) -> Self {
        let at = |landmark: usize| frame.points()[landmark];
        let (top, bottom) = (at(index::RIGHT_LID_LOWER).y + 12.0, at(17).y + 20.0);
        let (nose, base, middle) = ([at(129).x, at(358).x], at(2).y + 6.0, FRAME_SIZE[0] as f64 / 2.0);
        let counts = |pixel: &usize| {
            let (x, y) = ((pixel % FRAME_SIZE[0]) as f64, (pixel / FRAME_SIZE[0]) as f64);
            let beside_nose = x < nose[0] || x > nose[1] || y > base;
            let beside_mouth = (x - middle).abs() > 40.0;
            filter.mask(*pixel) >= 0.5 && y > top && y < bottom && beside_nose && beside_mouth
        };
        Self { region: (0..FRAME_SIZE[0] * FRAME_SIZE[1]).filter(counts).collect() }
    }

    /// Mean absolute error and mean structural similarity.
    fn compare(&self, predicted: &FaceImage, truth: &FaceImage) -> [f64; 2] {
        let (a, b) = (grey(predicted), grey(truth));
        let similar = similarity(&a, &b);
        let mean = |value: &dyn Fn(usize) -> f32| {
            self.region.iter().map(|&pixel| f64::from(value(pixel))).sum::<f64>() / self.region.len() as f64
        };
        [mean(&|pixel| (a[pixel] - b[pixel]).abs()), mean(&|pixel| similar[pixel])]
    }
}

/// Scores of one prediction, without and with the ratio.
struct Pair {
    /// Whether the donor smiles at least as strongly.
    stronger: bool,
    without: [f64; 2],
    with: [f64; 2],
}

/// The table: for each group the product, the first recipe, controls, and the mean of all other donors.
pub fn report(scale: &Scale, frame: &FaceFrame, groups: &[(&str, &Vec<&Person>)]) -> String {
    let first_recipe = RatioOptions {
        coarse: 12.0,
        fine_share: 1.0,
        drift: 40.0,
        symmetry: 0.0,
        brightening: 0.4,
        ..RatioOptions::default()
    };
    let mut text = String::from(
        "| people | ratio | pairs | error, none | error | change | less in | SSIM, none | SSIM | more in |\n\
         |---|---|---:|---:|---:|---:|---:|---:|---:|---:|\n",
    );
    for (group, people) in groups {
        let people = people.as_slice();
        let ratios = |options: RatioOptions| -> Vec<RatioImage> {
            let filter = RatioFilter::new(frame, options);
            people.iter().map(|person| filter.ratio(&person.neutral.face, &person.smiling.face)).collect()
        };
        let product = ratios(RatioOptions::default());
        let pairs = cross(scale, people, &product, 1.0);
        let stronger: Vec<&Pair> = pairs.iter().filter(|pair| pair.stronger).collect();
        row(&mut text, group, "as built", &pairs.iter().collect::<Vec<_>>());
        row(&mut text, group, "as built, donor smiles no less", &stronger);
        let others = from_others(scale, people, &product);
        row(&mut text, group, "as built, mean of all others", &others.iter().collect::<Vec<_>>());
        let first = cross(scale, people, &ratios(first_recipe), 1.0);
        row(&mut text, group, "first recipe", &first.iter().collect::<Vec<_>>());
        let inverted = cross(scale, people, &product, -1.0);
        row(&mut text, group, "control: inverted", &inverted.iter().collect::<Vec<_>>());
        for (name, shift) in [
            ("control: 35 px across", Vector2::new(SHIFT, 0.0)),
            ("control: 35 px down", Vector2::new(0.0, SHIFT)),
        ] {
            let shifted: Vec<RatioImage> = product
                .iter()
                .map(|ratio| RatioImage::from_fn(|place: &Point2<f64>| ratio.at_place(&(place - shift))))
                .collect();
            let pairs = cross(scale, people, &shifted, 1.0);
            row(&mut text, group, name, &pairs.iter().collect::<Vec<_>>());
        }
    }
    text
}

/// Every ordered pair of two people.
fn cross(scale: &Scale, people: &[&Person], ratios: &[RatioImage], sign: f32) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (donor, ratio) in people.iter().zip(ratios) {
        for receiver in people.iter().filter(|receiver| receiver.name != donor.name) {
            let share = (receiver.smile() / donor.smile()).min(MOST_AMPLIFIED) as f32;
            let predicted = ratio.applied(&receiver.neutral.face, sign * TRANSFER_GAIN * share);
            pairs.push(Pair {
                stronger: donor.smile() >= receiver.smile(),
                ..judge(scale, receiver, &predicted)
            });
        }
    }
    pairs
}

/// Every person with the mean of all others' ratios, each over its own strength.
fn from_others(scale: &Scale, people: &[&Person], ratios: &[RatioImage]) -> Vec<Pair> {
    let of = |receiver: &&Person| {
        let others: Vec<_> =
            people.iter().zip(ratios).filter(|(donor, _)| donor.name != receiver.name).collect();
        let mean = RatioImage::from_fn(|place| {
            let unit =
                |(donor, ratio): &(&&Person, &RatioImage)| ratio.at_place(place) / donor.smile() as f32;
            others.iter().map(unit).sum::<f32>() / others.len().max(1) as f32
        });
        let predicted = mean.applied(&receiver.neutral.face, receiver.smile() as f32);
        judge(scale, receiver, &predicted)
    };
    people.iter().map(of).collect()
}

fn judge(scale: &Scale, receiver: &Person, predicted: &FaceImage) -> Pair {
    let truth = &receiver.smiling.face;
    Pair {
        stronger: false,
        without: scale.compare(&receiver.neutral.face, truth),
        with: scale.compare(predicted, truth),
    }
}

fn row(text: &mut String, group: &str, name: &str, pairs: &[&Pair]) {
    let count = pairs.len().max(1) as f64;
    let mean = |value: &dyn Fn(&Pair) -> f64| pairs.iter().map(|pair| value(pair)).sum::<f64>() / count;
    let share = |better: &dyn Fn(&Pair) -> bool| mean(&|pair| if better(pair) { 100.0 } else { 0.0 });
    let (before, after) = (mean(&|pair| pair.without[0]), mean(&|pair| pair.with[0]));
    let _ = writeln!(
        text,
        "| {group} | {name} | {} | {before:.2} | {after:.2} | {:+.1} % | {:.0} % | {:.4} | {:.4} | {:.0} % |",
        pairs.len(),
        100.0 * (after / before - 1.0),
        share(&|pair| pair.with[0] < pair.without[0]),
        mean(&|pair| pair.without[1]),
        mean(&|pair| pair.with[1]),
        share(&|pair| pair.with[1] > pair.without[1]),
    );
}

/// Luminance as a picture stores it, unrounded; 0 where nothing is known.
fn grey(face: &FaceImage) -> Vec<f32> {
    let stored = |light: f32| {
        let light = light.clamp(0.0, 1.0);
        255.0 * if light <= 0.003_130_8 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
    };
    (0..face.pixels()).map(|pixel| face.luminance(pixel).map_or(0.0, stored)).collect()
}

fn similarity(a: &[f32], b: &[f32]) -> Vec<f32> {
    let product = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<f32>>();
    let (aa, bb, ab) = (blur(product(a, a)), blur(product(b, b)), blur(product(a, b)));
    let (a, b) = (blur(a.to_vec()), blur(b.to_vec()));
    let at = |pixel: usize| {
        let (x, y) = (a[pixel], b[pixel]);
        let (own, other, both) = (aa[pixel] - x * x, bb[pixel] - y * y, ab[pixel] - x * y);
        (2.0 * x * y + STABLE[0]) * (2.0 * both + STABLE[1])
            / ((x * x + y * y + STABLE[0]) * (own + other + STABLE[1]))
    };
    (0..a.len()).map(at).collect()
}

fn blur(values: Vec<f32>) -> Vec<f32> {
    let [width, height] = FRAME_SIZE.map(|side| side as u32);
    ImageBuffer::<Luma<f32>, _>::from_raw(width, height, values)
        .map_or_else(Vec::new, |picture| imageops::blur(&picture, WINDOW).into_raw())
}
