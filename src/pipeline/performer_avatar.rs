//! The performer's own avatar: their neutral face out of a clip, for those who have no scan of themselves.

use std::sync::Arc;

use image::Rgba;

use super::{
    Motion, PipelineError,
    baked_texture::{bled, texture_of},
};
use crate::{
    appearance::{FRAME_SIZE, FaceFrame, FaceImage},
    capture::{Frame, FrameSource},
    lift::Performer,
    scan::{Material, Mesh, tessellate},
    tracking::SKIN_LANDMARK_COUNT,
};

/// Rounds of tessellation: 898 triangles become 14,368.
const ROUNDS: usize = 2;
/// Frames whose mean is the neutral look, at most: enough against noise, few enough to stay sharp.
const LOOKS: usize = 8;

/// The performer's neutral look in the shared frame: the mean of frames spread over the neutral stretch. `source` is the clip
/// from its start. Nothing is known where the clip ends before that stretch.
pub fn neutral_look(
    mut source: Box<dyn FrameSource>,
    motion: &Motion,
    frame: &FaceFrame,
) -> Result<FaceImage, PipelineError> {
    let (start, end) = motion.neutral;
    let inside: Vec<_> =
        motion.frames.iter().filter(|f| f.timestamp >= start && f.timestamp <= end).collect();
    let mut wanted = inside.iter().step_by(inside.len().div_ceil(LOOKS).max(1)).peekable();
    let mut looks = Vec::with_capacity(LOOKS);
    let mut picture = Frame::default();
    while let Some(next) = wanted.peek() {
        if !source.read(&mut picture)? {
            break;
        }
        if picture.index == next.index {
            let shown = &next.expression;
            let pixels = motion.performer.pixels(&shown.displacements, &shown.pose);
            looks.extend(FaceImage::of_image(&picture.image, &pixels, frame));
            wanted.next();
        }
    }
    Ok(FaceImage::mean(&looks.iter().collect::<Vec<_>>()).unwrap_or_else(FaceImage::unknown))
}

/// The performer's neutral landmarks as a round surface with `skin`, their neutral look in the shared frame, for its texture.
/// Scan frame, millimetres. What the landmarks do not span, the back of the head and the ears, is not there.
pub fn performer_avatar(
    performer: &Performer,
    frame: &FaceFrame,
    skin: &FaceImage,
) -> Result<Mesh, PipelineError> {
    let [width, height] = FRAME_SIZE.map(|side| side as f32);
    let triangles: Vec<[u32; 3]> = frame.triangles().iter().map(|t| t.map(u32::from)).collect();
    let coarse = Mesh {
        positions: performer.neutral()[..SKIN_LANDMARK_COUNT].to_vec(),
        uv_triangles: triangles.clone(),
        triangles,
        // Pixel centres are integers here and halves in a texture.
        uvs: frame
            .points()
            .iter()
            .map(|p| [(p.x as f32 + 0.5) / width, 1.0 - (p.y as f32 + 0.5) / height])
            .collect(),
        ..Mesh::default()
    };
    let fine = (0..ROUNDS).fold(coarse, |mesh, _| tessellate(&mesh));
    let seen = image::RgbaImage::from_fn(FRAME_SIZE[0] as u32, FRAME_SIZE[1] as u32, |x, y| {
        let pixel = y as usize * FRAME_SIZE[0] + x as usize;
        let [r, g, b] = skin.srgb(pixel);
        Rgba([r, g, b, if skin.colour(pixel).is_some() { 255 } else { 0 }])
    });
    let texture = Arc::new(texture_of(bled(seen))?);
    Ok(Mesh { materials: vec![Material::textured(texture)], ..fine })
}
