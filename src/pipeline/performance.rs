//! A clip, tracked from its first frame to its last.

use crossbeam::channel;

use super::{PipelineError, Stopwatch};
use crate::{
    capture::{CaptureError, ClipInfo, Frame, FrameSource, Timestamp},
    tracking::{Landmarks, Tracker},
};

/// Frames decoded ahead of the tracker.
const AHEAD: usize = 4;

/// One frame of the clip.
#[derive(Debug, Clone)]
pub struct TrackedFrame {
    /// From 0.
    pub index: u64,
    /// When.
    pub timestamp: Timestamp,
    /// The followed face, unfiltered, where there is one.
    pub landmarks: Option<Landmarks>,
}

/// What the networks saw of a clip.
#[derive(Debug, Clone)]
pub struct Performance {
    /// The clip.
    pub info: ClipInfo,
    /// All its frames.
    pub frames: Vec<TrackedFrame>,
    /// The most faces seen at once; the largest was followed.
    pub faces_seen: usize,
}

impl Performance {
    /// Tracks the whole clip. With more than one thread, frames are decoded while others are tracked; the result is
    /// the same. `progress` is told the number of frames done.
    pub fn track(
        mut source: Box<dyn FrameSource>,
        tracker: &mut Tracker,
        threads: usize,
        watch: &mut Stopwatch,
        mut progress: impl FnMut(u64),
    ) -> Result<Self, PipelineError> {
        tracker.reset();
        let info = source.info().clone();
        let mut frames = Vec::new();
        let mut track = |frame: &Frame, watch: &mut Stopwatch| -> Result<(), PipelineError> {
            let landmarks = watch.time("track", || tracker.track(&frame.image))?;
            frames.push(TrackedFrame { index: frame.index, timestamp: frame.timestamp, landmarks });
            progress(frames.len() as u64);
            Ok(())
        };
        if threads <= 1 {
            let mut frame = Frame::default();
            while watch.time("decode", || source.read(&mut frame))? {
                track(&frame, watch)?;
            }
        } else {
            decode_ahead(source, watch, &mut track)?;
        }
        let faces_seen = tracker.faces_seen();
        Ok(Self { info, frames, faces_seen })
    }
}

/// Decodes on a thread of its own; used frames go back to it to be filled again.
fn decode_ahead(
    mut source: Box<dyn FrameSource>,
    watch: &mut Stopwatch,
    track: &mut impl FnMut(&Frame, &mut Stopwatch) -> Result<(), PipelineError>,
) -> Result<(), PipelineError> {
    let (filled_in, filled_out) = channel::bounded::<Result<Frame, CaptureError>>(AHEAD);
    let (empty_in, empty_out) = channel::bounded::<Frame>(AHEAD + 2);
    let decoder = std::thread::spawn(move || {
        let mut watch = Stopwatch::default();
        loop {
            let mut frame = empty_out.try_recv().unwrap_or_default();
            let message = match watch.time("decode", || source.read(&mut frame)) {
                Ok(true) => Ok(frame),
                Ok(false) => break,
                Err(error) => Err(error),
            };
            let failed = message.is_err();
            if filled_in.send(message).is_err() || failed {
                break;
            }
        }
        watch
    });
    let mut outcome = Ok(());
    for message in &filled_out {
        outcome = message.map_err(PipelineError::from).and_then(|frame| {
            track(&frame, watch)?;
            // A full return channel only means that the frame is not needed again.
            let _ = empty_in.try_send(frame);
            Ok(())
        });
        if outcome.is_err() {
            break;
        }
    }
    drop(filled_out);
    match decoder.join() {
        Ok(times) => watch.merge(&times),
        Err(_) => return Err(PipelineError::StageLost { stage: "decoding" }),
    }
    outcome
}
