//! A clip as it is sent.

use std::{error::Error, path::Path};

use understudy::{
    assets::Assets,
    capture::{self, FrameRate, Timestamp},
    lift::Smoothing,
    pipeline::{Motion, Networks, Performance, SolveOptions, Stopwatch, read_canonical_face},
    wire::{Timeline, WireFrame},
};

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
    pub fn of(
        clip: &Path,
        assets: &Assets,
        networks: &mut Networks,
        causal: bool,
    ) -> Result<Self, Box<dyn Error>> {
        let source = capture::open(clip, FrameRate::nearest(25.0))?;
        let mut watch = Stopwatch::default();
        let performance = Performance::track(source, &mut networks.tracker, 2, &mut watch, |_| {})?;
        let smoothing = if causal { Smoothing::Causal } else { Smoothing::ZeroPhase };
        let options = SolveOptions { smoothing, ..SolveOptions::default() };
        let face = read_canonical_face(&assets.verified("canonical_face")?)?;
        let motion = Motion::solve(&performance, &face, &mut networks.blendshapes, &options)?;
        let mut timeline = Timeline::default();
        for frame in motion.wire_frames(&[])? {
            timeline.add(frame);
        }
        let end = timeline.frames().last().map_or(0.0, |frame| frame.time.seconds());
        let ticks = (end * RATE.per_second()).floor() as u64;
        let frames = (0..=ticks).map(|tick| timeline.show(Timestamp(RATE.tick(tick).0)));
        let name = clip.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { name, frames: frames.collect() })
    }
}
