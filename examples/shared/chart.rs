//! A target with the shared frame drawn on it: a line every 32 pixels, each region's area in its own colour.

use std::error::Error;

use image::{Rgba, RgbaImage};
use nalgebra::{Point2, Rotation3};
use understudy::{
    appearance::{ALPHA_RAMP, Area, FaceChart, Region},
    pipeline::{HeadMode, SharedFace, Stage, Target},
    rig::AvatarFrame,
    view::{Gpu, Look, Smoothing},
};

const SIDE: u32 = 640;
const SPACING: f64 = 32.0;
const TINTS: [[f64; 3]; 6] = [
    [255.0, 80.0, 80.0],
    [90.0, 220.0, 90.0],
    [80.0, 140.0, 255.0],
    [250.0, 220.0, 60.0],
    [230.0, 90.0, 230.0],
    [70.0, 230.0, 230.0],
];

/// The picture.
pub fn picture(gpu: &Gpu, target: &Target, face: &SharedFace, yaw: f64) -> Result<RgbaImage, Box<dyn Error>> {
    let chart = face.chart(target)?;
    let level = Rotation3::identity();
    let look = Look::default();
    let mut stage = Stage::new(gpu, target, &level, [SIDE; 2], look, HeadMode::Still, Smoothing::Samples4)?;
    let (centre, eyes) = target.centre_and_eyes();
    stage.look_at(centre, 1.15 * eyes, yaw.to_radians());
    let mut picture = stage.picture(&AvatarFrame::at_rest(&target.anatomy.mesh))?;
    for (x, y, pixel) in picture.enumerate_pixels_mut() {
        let (start, along) = stage.camera().ray(Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
        let Some(hit) = target.surface.cast(start, along.into_inner()) else { continue };
        let corners = target.mesh().triangles[hit.triangle as usize];
        let (place, cover) = laid(&chart, corners, hit.barycentric);
        let nearest = |value: f64| (value / SPACING).round() * SPACING;
        let line = (place.x - nearest(place.x)).abs().min((place.y - nearest(place.y)).abs()) < 1.0;
        if line && cover > 0.0 {
            mix(pixel, [0.0; 3], 0.5 * cover);
        }
        for region in Region::ALL {
            let alpha = Area::of(region, face.frame()).alpha(&place, ALPHA_RAMP);
            mix(pixel, TINTS[region.index() % TINTS.len()], 0.4 * alpha * cover);
        }
    }
    Ok(picture)
}

fn laid(chart: &FaceChart, corners: [u32; 3], weights: [f64; 3]) -> (Point2<f64>, f64) {
    let (mut place, mut cover) = (Point2::origin(), 0.0);
    for (corner, weight) in corners.into_iter().zip(weights) {
        let [x, y] = chart.places()[corner as usize].map(f64::from);
        place += nalgebra::Vector2::new(x, y) * weight;
        cover += f64::from(chart.covers()[corner as usize]) * weight;
    }
    (place, cover)
}

fn mix(pixel: &mut Rgba<u8>, colour: [f64; 3], share: f64) {
    for (channel, other) in pixel.0.iter_mut().zip(colour) {
        *channel = (f64::from(*channel) * (1.0 - share) + other * share).round() as u8;
    }
}
