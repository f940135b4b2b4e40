//! A sheet of the take's most different moments, performer beside avatar.

use image::RgbaImage;

use super::{Animation, PipelineError, Stage, performer_view::PerformerView};
use crate::{
    capture::FrameSource,
    view::{as_picture, beside, contact_sheet},
};

/// Moments shown.
const MOMENTS: usize = 6;
const COLUMNS: u32 = 3;
/// Height of each picture, pixels.
const HEIGHT: u32 = 360;

/// Draws the sheet.
pub fn preview_sheet(
    animation: &Animation,
    stage: &mut Stage,
    clip: Box<dyn FrameSource>,
) -> Result<RgbaImage, PipelineError> {
    let mut performer = PerformerView::new(clip);
    let width = performer.width_at(HEIGHT);
    let mut frame = animation.rig.new_frame();
    let mut cells = Vec::new();
    for index in most_different(animation) {
        let moment = &animation.motion.frames[index];
        animation.rig.pose(&moment.expression, &mut frame)?;
        animation.show(index, stage);
        let drawn = stage.picture(&frame)?;
        let avatar = image::imageops::thumbnail(&drawn, drawn.width() * HEIGHT / drawn.height(), HEIGHT);
        let seen = as_picture([width, HEIGHT], performer.picture(moment.index, [width, HEIGHT])?)?;
        cells.push((beside(&seen, &avatar), format!("{:.2} s", moment.timestamp.seconds())));
    }
    let cells: Vec<_> = cells.iter().map(|(picture, caption)| (picture, caption.as_str())).collect();
    Ok(contact_sheet(&cells, COLUMNS))
}

/// Frames in order of time: the calmest, then each time the one least like those chosen.
fn most_different(animation: &Animation) -> Vec<usize> {
    let controls = animation.control_motion().controls;
    let calmest = (0..controls.len()).min_by(|&a, &b| controls[a].norm().total_cmp(&controls[b].norm()));
    let mut chosen: Vec<usize> = calmest.into_iter().collect();
    let mut distances = vec![f64::INFINITY; controls.len()];
    while chosen.len() < MOMENTS.min(controls.len()) {
        let last = &controls[chosen[chosen.len() - 1]];
        for (distance, moved) in distances.iter_mut().zip(&controls) {
            *distance = distance.min((moved - last).norm());
        }
        let Some(next) = (0..controls.len()).max_by(|&a, &b| distances[a].total_cmp(&distances[b])) else {
            break;
        };
        chosen.push(next);
    }
    chosen.sort_unstable();
    chosen.dedup();
    chosen
}
