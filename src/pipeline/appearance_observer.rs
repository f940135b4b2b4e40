//! The looks of a clip's frames: a second pass over its pictures, beside the motion that the first one gave.

use std::path::Path;

use nalgebra::Vector2;

use super::{Motion, MotionFrame, PipelineError, canonical::read_framed_face};
use crate::{
    appearance::{Absence, FaceFrame, Picture, Region, Sampler, Samples, face_width},
    capture::{Frame, FrameSource},
    lift::FaceState,
};

/// The shared frame of skins, from the canonical face's file.
pub fn read_face_frame(canonical_face: &Path) -> Result<FaceFrame, PipelineError> {
    Ok(read_framed_face(canonical_face)?.1)
}

/// One frame as it is seen.
#[derive(Debug)]
pub struct ObservedFrame<'a> {
    /// Its motion.
    pub motion: &'a MotionFrame,
    /// Its picture; none at the end of a clip that the second pass finds shorter.
    pub picture: &'a Frame,
    /// The look of every region.
    pub samples: Samples,
    /// Pixels from cheek to cheek.
    pub width: f64,
}

/// Looks at every frame of a clip once more. `source` is the clip from its start; what `look` returns is kept for each frame of
/// the motion. Frames without a face, or for which no picture comes, have no samples. `limit` says whether regions are refused for
/// which the face is too narrow.
pub fn observe<T>(
    mut source: Box<dyn FrameSource>,
    motion: &Motion,
    frame: &FaceFrame,
    limit: bool,
    mut look: impl FnMut(ObservedFrame<'_>) -> T,
) -> Result<Vec<T>, PipelineError> {
    let sampler = Sampler::new(frame, &motion.performer).ok_or(PipelineError::NoSampler)?;
    let mut picture = Frame::default();
    let mut more = true;
    let mut seen = Vec::with_capacity(motion.frames.len());
    for shown in &motion.frames {
        more = more && source.read(&mut picture)?;
        let visible =
            matches!(shown.state, FaceState::Tracking | FaceState::Blending) && shown.confidence > 0.0;
        let pixels = Picture::of(&picture.image).filter(|_| more && visible);
        let samples = match pixels {
            Some(pixels) => sampler.sample(pixels, &motion.performer, &shown.expression, limit),
            None => Region::ALL.map(|_| Err(Absence::NoFace)),
        };
        let width = face_width(&motion.performer, &shown.expression.pose);
        seen.push(look(ObservedFrame { motion: shown, picture: &picture, samples, width }));
    }
    Ok(seen)
}

/// How fast each region's middle moves in every frame: face widths a frame, the faster of the ways from and to its neighbours.
/// What moves fast is blurred.
pub fn speeds(motion: &Motion, landmark: usize) -> Vec<f64> {
    let places: Vec<(Vector2<f64>, f64)> = motion
        .frames
        .iter()
        .map(|frame| {
            let (performer, expression) = (&motion.performer, &frame.expression);
            let point = performer.neutral()[landmark] + expression.displacements.vectors[landmark];
            let pixel = performer.camera().project(&expression.pose.to_camera(&point));
            (pixel, face_width(performer, &expression.pose).max(1.0))
        })
        .collect();
    let step = |a: usize, b: usize| match (places.get(a), places.get(b)) {
        (Some((from, width)), Some((to, _))) => (to - from).norm() / width,
        _ => 0.0,
    };
    (0..places.len())
        .map(|at| step(at, at + 1).max(at.checked_sub(1).map_or(0.0, |before| step(before, at))))
        .collect()
}
