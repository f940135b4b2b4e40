//! A solved take as frames of the wire, and frames of the wire played on a target.

use nalgebra::Rotation3;
use sha2::{Digest as _, Sha256};

use super::{HeadMode, Motion, PipelineError, Play, Target, muscle_motor};
use crate::{
    appearance::AppearanceStates,
    capture::{FrameRate, Timestamp},
    lift::{Eyes, Performer},
    muscle::{
        ARKIT_SHAPES, CurveFrame, CurveMap, MuscleBasis, MuscleCurves, MuscleError, MuscleLift, MuscleMotor,
        different_moments,
    },
    rig::{AvatarFrame, Method, Motor as _, Puppet, TargetFace},
    wire::{HeadMeter, MUSCLE_COUNT, Timeline, WireFrame},
};

/// Moments on the sheet.
const MOMENTS: usize = 8;
/// Times on the wire are rounded to a tenth of a millisecond; so near a tick of the nominal rate, they are the tick's.
const ROUNDING: i64 = 100_000;

impl Motion {
    /// The take as it goes over the wire: contractions, lids and gaze, the head. `appearance` has what is told of the skin
    /// in each frame; frames beyond its end tell nothing. Refused of a take that was not lifted by ARKit's muscles.
    pub fn wire_frames(
        &self,
        appearance: &[Option<AppearanceStates>],
    ) -> Result<Vec<WireFrame>, PipelineError> {
        let curves = self.curves()?;
        if curves.muscles() != ARKIT_SHAPES {
            let reason = "the wire carries ARKit's 51 contractions, and the basis has other muscles. Take --basis arkit";
            return Err(MuscleError::Curves { reason: reason.into() }.into());
        }
        let meter = HeadMeter::new(&self.performer);
        let skins = appearance.iter().copied().chain(std::iter::repeat(None));
        let frames =
            self.frames.iter().zip(curves.frames()).zip(skins).map(|((frame, curve), appearance)| {
                let row = &curve.contractions;
                WireFrame {
                    time: frame.timestamp,
                    state: frame.state,
                    contractions: std::array::from_fn::<f64, MUSCLE_COUNT, _>(|k| row[k]),
                    head: meter.measure(&frame.expression.pose),
                    appearance,
                }
            });
        Ok(frames.collect())
    }
}

/// A number that stands for a performer's neutral face.
pub fn neutral_hash(performer: &Performer) -> u32 {
    let mut hash = Sha256::new();
    for point in performer.neutral() {
        // Hundredths of a millimetre: arithmetic blurs less.
        for value in point.coords.iter() {
            hash.update(((value * 100.0).round() as i64).to_be_bytes());
        }
    }
    let digest = hash.finalize();
    u32::from_be_bytes([digest[0], digest[1], digest[2], digest[3]])
}

/// Frames of the wire tied to a target, from the first one that arrived on.
pub struct WirePlay {
    motor: MuscleMotor,
    face: TargetFace,
    map: CurveMap,
    timeline: Timeline,
    start: Timestamp,
    moments: Vec<Timestamp>,
}

impl WirePlay {
    /// Of frames that came at `rate`. Without any, the neutral face.
    pub fn new(
        timeline: Timeline,
        rate: FrameRate,
        target: &Target,
        method: Method,
    ) -> Result<Self, PipelineError> {
        let basis = MuscleLift::lifting(MuscleBasis::arkit());
        let (muscles, channels) = CurveMap::columns(&basis);
        let map = CurveMap::new(&muscles, &channels, &basis)?;
        let (motor, face) = muscle_motor(&basis, target, method)?;
        let start = timeline.frames().first().map_or(Timestamp(0), |frame| frame.time);
        let mut moments = vec![Timestamp(0)];
        if !timeline.frames().is_empty() {
            let curves = wire_curves(&timeline, rate)?;
            let chosen = different_moments(&curves, MOMENTS);
            moments = chosen.into_iter().map(|frame| curves.frames()[frame].time).collect();
        }
        Ok(Self { motor, face, map, timeline, start, moments })
    }

    /// How the target is turned to face the camera.
    pub fn level(&self) -> &Rotation3<f64> {
        &self.face.level
    }

    /// What is shown at a moment since the first frame.
    pub fn frame(&self, time: Timestamp) -> WireFrame {
        self.timeline.show(Timestamp(self.start.0.saturating_add(time.0)))
    }

    /// Moves controls, bones and head to one frame.
    pub fn pose_frame(&self, shown: &WireFrame, frame: &mut AvatarFrame) {
        let row = shown.row();
        let eyes = self.map.eyes(&row, &Eyes::default());
        self.motor.pose_contractions(&self.map.contractions(&row), &eyes, frame);
        frame.head = shown.head.on(&self.face);
    }
}

impl Play for WirePlay {
    fn puppet(&self) -> &Puppet {
        self.motor.puppet()
    }

    fn pose_controls(&self, time: Timestamp, frame: &mut AvatarFrame) {
        self.pose_frame(&self.frame(time), frame);
    }

    fn end(&self) -> Timestamp {
        self.timeline.frames().last().map_or(Timestamp(0), |frame| Timestamp(frame.time.0 - self.start.0))
    }

    fn still(&self) -> Timestamp {
        self.end()
    }

    fn moments(&self) -> Vec<Timestamp> {
        self.moments.clone()
    }

    fn states(&self, time: Timestamp) -> Option<AppearanceStates> {
        self.frame(time).appearance
    }

    fn head(&self) -> HeadMode {
        HeadMode::Follow
    }
}

/// The frames that arrived as contraction curves, from the first one on.
pub fn wire_curves(timeline: &Timeline, rate: FrameRate) -> Result<MuscleCurves, MuscleError> {
    let (muscles, channels) = CurveMap::columns(&MuscleLift::lifting(MuscleBasis::arkit()));
    let start = timeline.frames().first().map_or(0, |frame| frame.time.0);
    let frames = timeline.frames().iter().map(|frame| CurveFrame {
        time: on_tick(Timestamp(frame.time.0 - start), rate),
        state: frame.state,
        contractions: frame.row(),
        error: None,
    });
    MuscleCurves::new(muscles, channels, rate, frames.collect())
}

/// The tick of the nominal rate that was rounded, or the time itself.
fn on_tick(time: Timestamp, rate: FrameRate) -> Timestamp {
    let index = (time.seconds() * rate.per_second()).round().max(0.0) as u64;
    let tick = rate.tick(index);
    if (tick.0 - time.0).abs() <= ROUNDING { tick } else { time }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounded_times_are_those_of_the_rate() {
        let rate = FrameRate { numerator: 30000, denominator: 1001 };
        for index in 0..3000 {
            let exact = rate.tick(index);
            let rounded = Timestamp((exact.0 + 50_000) / 100_000 * 100_000);
            assert_eq!(on_tick(rounded, rate), exact);
        }
        assert_eq!(on_tick(Timestamp(10_000_000), rate), Timestamp(10_000_000));
    }
}
