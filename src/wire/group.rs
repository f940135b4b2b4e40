//! The frames of one packet: they need the session's tables, and no other packet.
//!
//! The first frame is told about the channels' centres, each later one about the frame before. A packet that is lost
//! therefore takes its own frames with it and no others.

use super::{
    entropy::{Damaged, Reader, Shape, Writer},
    levels::{CHANNEL_COUNT, Levels, MOST_LEVEL},
    tables::Tables,
};

/// Frames in a packet at most.
pub const MOST_FRAMES: usize = 8;
/// No frame is shown longer before the next one of its packet, tenths of a millisecond.
pub const MOST_INTERVAL: i64 = 10_000;
/// How times differ from the nominal rate.
const TIMES: Shape = Shape { zero: 5, size: 1 };

/// Frames of one packet, with their times in tenths of a millisecond, which ascend.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Group(pub Vec<(i64, Levels)>);

impl Group {
    /// Writes them; there is one at least. `interval` is the nominal one.
    pub fn put(&self, tables: &Tables, interval: i64, writer: &mut Writer) {
        writer.bits(self.0.len().saturating_sub(1) as u32, MOST_FRAMES.ilog2());
        for pair in self.0.array_windows::<2>() {
            let [(before, _), (time, _)] = pair;
            writer.value((time - before - interval) as i32, TIMES);
        }
        let mut before: Option<&Levels> = None;
        for (_, levels) in &self.0 {
            for (k, (level, channel)) in levels.iter().zip(tables).enumerate() {
                match before {
                    None => writer.value(level - channel.centre, channel.first),
                    Some(before) => writer.value(level - before[k], channel.later),
                }
            }
            before = Some(levels);
        }
    }

    /// Reads frames of which the first is at `start`.
    pub fn get(start: i64, tables: &Tables, interval: i64, reader: &mut Reader) -> Result<Self, Damaged> {
        let count = reader.bits(MOST_FRAMES.ilog2())? + 1;
        let mut times = vec![start];
        for k in 1..count as usize {
            let step = i64::from(reader.value(TIMES)?) + interval;
            if !(1..=MOST_INTERVAL).contains(&step) {
                return Err(Damaged);
            }
            times.push(times[k - 1] + step);
        }
        let mut frames: Vec<(i64, Levels)> = Vec::with_capacity(times.len());
        for time in times {
            let mut levels = [0; CHANNEL_COUNT];
            for (k, (level, channel)) in levels.iter_mut().zip(tables).enumerate() {
                let (about, shape) = match frames.last() {
                    None => (channel.centre, channel.first),
                    Some((_, before)) => (before[k], channel.later),
                };
                let told = i64::from(about) + i64::from(reader.value(shape)?);
                *level = i32::try_from(told).ok().filter(|level| level.abs() <= MOST_LEVEL).ok_or(Damaged)?;
            }
            frames.push((time, levels));
        }
        Ok(Self(frames))
    }
}
