//! A clip as it is sent.

use std::{error::Error, path::Path};

use understudy::{
    capture::{FrameRate, Timestamp},
    lift::Smoothing,
    pipeline::SolveOptions,
    wire::{Timeline, WireFrame},
};

use super::stand::Stand;

/// At which all are sent.
pub const RATE: FrameRate = FrameRate { numerator: 30, denominator: 1 };

/// A performance.
pub struct Take {
    /// The clip's.
    pub name: String,
    /// At `RATE`.
    pub frames: Vec<WireFrame>,
}

impl Take {
    pub fn of(clip: &Path, stand: &mut Stand, causal: bool) -> Result<Self, Box<dyn Error>> {
        let smoothing = if causal { Smoothing::Causal } else { Smoothing::ZeroPhase };
        let options = SolveOptions { smoothing, ..SolveOptions::default() };
        let solved = stand.solve(clip, &options)?;
        let mut timeline = Timeline::default();
        for frame in solved.motion.wire_frames(&[])? {
            timeline.add(frame);
        }
        let end = timeline.frames().last().map_or(0.0, |frame| frame.time.seconds());
        let ticks = (end * RATE.per_second()).floor() as u64;
        let frames = (0..=ticks).map(|tick| timeline.show(Timestamp(RATE.tick(tick).0)));
        Ok(Self { name: solved.name, frames: frames.collect() })
    }
}
