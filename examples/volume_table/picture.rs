//! The performer and the ways to drive side by side, a row a moment.

use std::{error::Error, path::Path};

use image::{RgbaImage, imageops};
use understudy::{
    capture::{self, Frame},
    pipeline::{HeadMode, Stage, Target},
    rig::{DriveMode, TargetFace},
    tracking::index,
    view::{Gpu, Look, Smoothing, contact_sheet},
};

use super::{
    rig,
    stand::{RATE, Take},
};

/// Pixels of each picture's side.
const SIDE: u32 = 340;
/// Radius of what is shown, outer canthal distances.
const RADIUS: f64 = 1.1;

pub fn draw(
    output: &Path,
    gpu: &Gpu,
    take: &Take,
    target: &Target,
    face: &TargetFace,
    modes: &[(&str, DriveMode)],
    (moments, yaw): (&[f64], f64),
) -> Result<(), Box<dyn Error>> {
    let frames = &take.motion.frames;
    let shown: Vec<usize> = moments
        .iter()
        .map(|&at| frames.iter().position(|f| f.timestamp.seconds() >= at).unwrap_or(frames.len() - 1))
        .collect();
    let (look, smoothing) = (Look::default(), Smoothing::Samples4);
    let mut stage = Stage::new(gpu, target, &face.level, [SIDE; 2], look, HeadMode::Still, smoothing)?;
    let (centre, eyes) = target.centre_and_eyes();
    stage.look_at(centre, RADIUS * eyes, yaw.to_radians());
    let rigs = modes.iter().map(|(_, mode)| rig(take, target, face, *mode)).collect::<Result<Vec<_>, _>>()?;
    let mut cells: Vec<(RgbaImage, String)> = Vec::new();
    for &frame in &shown {
        let seconds = frames[frame].timestamp.seconds();
        cells.push((performer(take, frame)?, format!("{} {seconds:.2} s", take.name)));
        for ((name, _), rig) in modes.iter().zip(&rigs) {
            let mut posed = rig.new_frame();
            rig.pose(&frames[frame].expression, &mut posed)?;
            cells.push((stage.picture(&posed)?, (*name).to_owned()));
        }
    }
    let cells: Vec<_> = cells.iter().map(|(picture, caption)| (picture, caption.as_str())).collect();
    let sheet = contact_sheet(&cells, modes.len() as u32 + 1);
    image::DynamicImage::ImageRgba8(sheet).to_rgb8().save(output)?;
    Ok(())
}

/// The performer's face, cut from the clip's frame.
fn performer(take: &Take, frame: usize) -> Result<RgbaImage, Box<dyn Error>> {
    let mut source = capture::open(&take.path, RATE)?;
    let mut picture = Frame::default();
    for _ in 0..=frame {
        source.read(&mut picture)?;
    }
    let (width, height) = (take.motion.info.width as u32, take.motion.info.height as u32);
    let image = RgbaImage::from_raw(width, height, picture.image.to_rgba()?).ok_or("another size")?;
    let landmarks = take.performance.frames[frame].landmarks.as_ref().ok_or("no face in the frame")?;
    let around = [index::RIGHT_EYE_OUTER, index::LEFT_EYE_OUTER, index::MOUTH_RIGHT, index::MOUTH_LEFT];
    let centre = around.iter().map(|&i| landmarks.pixel(i)).sum::<nalgebra::Vector2<f64>>() / 4.0;
    let radius = RADIUS * landmarks.outer_canthal_distance();
    let left = (centre.x - radius).clamp(0.0, f64::from(width) - 2.0) as u32;
    let top = (centre.y - radius).clamp(0.0, f64::from(height) - 2.0) as u32;
    let side = ((2.0 * radius) as u32).min(width - left).min(height - top);
    let cut = imageops::crop_imm(&image, left, top, side, side).to_image();
    Ok(imageops::resize(&cut, SIDE, SIDE, imageops::FilterType::CatmullRom))
}
