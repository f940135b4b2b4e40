//! Ratio images in the frame of the canonical face: folds that were painted come back, light and people do not.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use std::sync::LazyLock;

use image::{Rgb, RgbImage};
use nalgebra::{Point2, Vector2};
use proptest::prelude::*;
use understudy::{
    appearance::{
        Area, FRAME_SIZE, FaceFrame, FaceImage, RatioFilter, RatioImage, RatioOptions, Region, Relief,
        ReliefOptions,
    },
    assets::Assets,
    capture::Image,
    pipeline::{canonical_skin, read_canonical_face},
};

static FRAME: LazyLock<FaceFrame> = LazyLock::new(|| {
    let canonical = Assets::locate().unwrap().verified("canonical_face").unwrap();
    let face = read_canonical_face(&canonical).unwrap();
    FaceFrame::new(&face, canonical_skin(&canonical, &face).unwrap().triangles()).unwrap()
});
static FILTER: LazyLock<RatioFilter> = LazyLock::new(|| RatioFilter::new(&FRAME, RatioOptions::default()));

const PIXELS: usize = FRAME_SIZE[0] * FRAME_SIZE[1];

fn place(pixel: usize) -> Point2<f64> {
    Point2::new((pixel % FRAME_SIZE[0]) as f64, (pixel / FRAME_SIZE[0]) as f64)
}

fn painted(light: impl Fn(&Point2<f64>) -> f32) -> FaceImage {
    let mut face = FaceImage::unknown();
    for (pixel, anchor) in FRAME.anchors().iter().enumerate() {
        if anchor.is_some() {
            let value = light(&place(pixel));
            face.set(pixel, [value, value * 0.7, value * 0.6]);
        }
    }
    face
}

/// Skin with some shading.
fn skin(place: &Point2<f64>) -> f32 {
    0.4 + 0.1 * (place.x / 90.0).sin() as f32 * (place.y / 70.0).cos() as f32
}

/// A dark fold along a nasolabial area, 5 pixels wide.
fn fold(region: Region, place: &Point2<f64>) -> f32 {
    let inside = Area::of(region, &FRAME).inside(place);
    let across = inside.x * 40.0;
    if inside.y.abs() < 0.8 { (-(across / 5.0).powi(2) / 2.0).exp() as f32 } else { 0.0 }
}

fn largest(ratio: &RatioImage) -> f32 {
    (0..PIXELS).map(|pixel| ratio.at(pixel).abs()).fold(0.0, f32::max)
}

#[test]
fn the_same_face_has_no_ratio_in_any_light() {
    let face = painted(skin);
    assert!(largest(&FILTER.ratio(&face, &face)) < 1e-6);
    // Half a stop brighter: what is added to black leaves a little of the shading.
    let brighter = painted(|place| 1.4 * skin(place));
    let ratio = FILTER.ratio(&face, &brighter);
    assert!(largest(&ratio) < 0.004, "{}", largest(&ratio));
    // A lamp that moves.
    let sidelong = painted(|place| skin(place) * (0.8 + place.x as f32 / 1280.0));
    let ratio = FILTER.ratio(&face, &sidelong);
    assert!(largest(&ratio) < 0.05, "{}", largest(&ratio));
}

#[test]
fn a_painted_fold_comes_back_where_it_was() {
    let (face, region) = (painted(skin), Region::NasolabialLeft);
    let folded = painted(|place| skin(place) * (1.0 - 0.25 * fold(region, place)));
    let ratio = FILTER.ratio(&face, &folded);
    let area = Area::of(region, &FRAME);
    let at = |x: f64, y: f64| ratio.at_place(&area.place(&Vector2::new(x, y)));
    for y in [-0.4, 0.0, 0.4] {
        assert!(at(0.0, y) < -0.09, "{}", at(0.0, y));
        assert!(at(0.0, y) < 3.0 * at(0.5, y).min(0.0), "{} beside {}", at(0.0, y), at(0.5, y));
    }
    // One side alone was folded: the other hardly knows of it.
    let other = Area::of(Region::NasolabialRight, &FRAME);
    assert!(ratio.at_place(&other.centre).abs() < 0.02, "{}", ratio.at_place(&other.centre));
    // Dark is deep.
    let relief =
        Relief::new(|place| ratio.at_place(place), |place| FILTER.mask_at(place), &ReliefOptions::default());
    assert!(relief.height(&area.centre) < -0.05, "{}", relief.height(&area.centre));
}

#[test]
fn ratios_are_bounded_and_kept_to_the_skin() {
    let face = painted(skin);
    let garish = painted(|place| if (place.x / 24.0) as i32 % 2 == 0 { 0.01 } else { 1.0 });
    let ratio = FILTER.ratio(&face, &garish);
    let options = RatioOptions::default();
    for pixel in 0..PIXELS {
        let bound = FILTER.mask(pixel) * options.limit;
        assert!(ratio.at(pixel) >= -bound - 1e-6 && ratio.at(pixel) <= bound * options.brightening + 1e-6);
    }
    assert!(largest(&ratio) > 0.3);
    // Middles of the pupils, lips, a brow, a nostril, the outline; cheek and forehead for comparison.
    for landmark in [159, 386, 13, 105, 334, 98, 152, 234, 454, 10] {
        assert!(ratio.at_place(&FRAME.points()[landmark]).abs() < 1e-6, "landmark {landmark}");
    }
    for landmark in [50, 280, 151, 206, 426] {
        let at = FRAME.points()[landmark];
        assert!(FILTER.mask(at.y as usize * FRAME_SIZE[0] + at.x as usize) > 0.9, "landmark {landmark}");
    }
}

#[test]
fn gains_are_linear_in_the_logarithm() {
    let (face, region) = (painted(skin), Region::NasolabialRight);
    let ratio = FILTER.ratio(&face, &painted(|place| skin(place) * (1.0 - 0.2 * fold(region, place))));
    let centre = Area::of(region, &FRAME).centre;
    let pixel = centre.y as usize * FRAME_SIZE[0] + centre.x as usize;
    let logarithm = |gain: f32| {
        (ratio.applied(&face, gain).luminance(pixel).unwrap() / face.luminance(pixel).unwrap()).ln()
    };
    assert!(logarithm(1.0) < -0.05);
    for gain in [-1.0, 0.0, 0.5, 2.0] {
        assert!((logarithm(gain) - gain * logarithm(1.0)).abs() < 1e-5);
    }
}

#[test]
fn stubble_is_not_printed() {
    // Two pictures of one beard never lie on one another to the hair.
    let hair = |place: &Point2<f64>, shift: f64| {
        let (x, y) = (place.x + shift, place.y);
        0.5 + 0.5 * ((x * 0.65).sin() * (y * 0.5 + x * 0.15).sin()) as f32
    };
    let grown = |shift: f64| painted(move |place| skin(place) * (1.0 - 0.6 * hair(place, shift)));
    let strength = |options: RatioOptions| {
        let ratio = RatioFilter::new(&FRAME, options).ratio(&grown(0.0), &grown(2.4));
        let squares: f64 = (0..PIXELS).map(|pixel| f64::from(ratio.at(pixel)).powi(2)).sum();
        (squares / PIXELS as f64).sqrt()
    };
    let kept = strength(RatioOptions { roughness: [90.0, 99.0], ..RatioOptions::default() });
    let spared = strength(RatioOptions::default());
    assert!(spared < 0.3 * kept, "{spared} of {kept}");
}

#[test]
fn both_kinds_of_pictures_on_any_threads_are_one_face() {
    let rgb = RgbImage::from_fn(520, 580, |x, y| Rgb([(x / 3) as u8, (y / 3) as u8, ((x * y) % 251) as u8]));
    let rgba: Vec<u8> = rgb.pixels().flat_map(|pixel| [pixel[0], pixel[1], pixel[2], 255]).collect();
    let landmarks: Vec<_> = FRAME.points().iter().map(|point| point.coords).collect();
    let neutral = painted(skin);
    let taken = |threads: i32| {
        opencv::core::set_num_threads(threads).unwrap();
        let image = Image::from_rgba(520, 580, &rgba).unwrap();
        let face = FaceImage::of_image(&image, &landmarks, &FRAME).unwrap();
        let ratio = FILTER.ratio(&neutral, &face);
        (face, ratio)
    };
    assert_eq!(taken(1), taken(8));
    assert_eq!(taken(1).0, FaceImage::of_rgb(&rgb, &landmarks, &FRAME).unwrap());
}

#[test]
fn volumes_begin_neutral_and_keep_their_colours() {
    let (face, region) = (painted(skin), Region::NasolabialLeft);
    let folded = |depth: f32| painted(move |place| skin(place) * (1.0 - depth * fold(region, place)));
    let expressive = [folded(0.1), folded(0.25)];
    let volume = FILTER.volume(region, &FRAME, &face, &expressive).unwrap();
    let centre = Area::of(region, &FRAME).centre;
    assert!(volume.log_ratio(&centre, 0.0).abs() < 1e-6);
    assert!(volume.log_ratio(&centre, 1.0) < volume.log_ratio(&centre, 0.5) - 0.02);
    let (middle, patch) = (volume.patch().pixels() / 2, volume.patch());
    let at = patch.places().nth(middle).unwrap();
    let pixel = at.y as usize * FRAME_SIZE[0] + at.x as usize;
    assert_eq!(volume.layers()[2].colour(middle), expressive[1].srgb(pixel));
    assert!(FILTER.volume(region, &FRAME, &face, &expressive[..1]).is_none());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn garbage_is_survived(
        bytes in prop::collection::vec(any::<u8>(), 64 * 3),
        broken in prop::collection::vec((0_usize..468, prop::num::f64::ANY), 0..40),
        scale in 0.01_f64..3.0,
    ) {
        let picture = RgbImage::from_fn(8, 8, |x, y| {
            let at = ((y * 8 + x) * 3) as usize;
            Rgb([bytes[at], bytes[at + 1], bytes[at + 2]])
        });
        let mut landmarks: Vec<_> = FRAME.points().iter().map(|p| p.coords * 0.014 * scale).collect();
        let whole = FaceImage::of_rgb(&picture, &landmarks, &FRAME).unwrap();
        for (landmark, value) in broken {
            landmarks[landmark] = Vector2::new(value, -value);
        }
        let face = FaceImage::of_rgb(&picture, &landmarks, &FRAME).unwrap();
        let ratio = FILTER.ratio(&whole, &face);
        let limit = RatioOptions::default().limit;
        prop_assert!((0..PIXELS).all(|pixel| ratio.at(pixel).abs() <= limit));
    }
}
