//! What both ends must share before a frame can be told in few bits, and how a key tells it.

use super::{
    entropy::{Damaged, Learnt, Reader, Shape, Writer},
    levels::{CHANNEL_COUNT, Levels, MOST_LEVEL, channels},
};
use crate::capture::FrameRate;

/// Tenths of a millisecond in a second.
pub const TICKS: u64 = 10_000;
/// How centres are spread.
const CENTRES: Shape = Shape { zero: 4, size: 10 };

/// How one channel's levels are spread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Channel {
    /// About which level those of a packet's first frame lie.
    pub centre: i32,
    /// How they do.
    pub first: Shape,
    /// How those of a later frame lie about the frame before.
    pub later: Shape,
}

/// How every channel's levels are spread.
pub type Tables = [Channel; CHANNEL_COUNT];

/// Before anything was seen.
pub const FIRST_TABLES: Tables =
    [Channel { centre: 0, first: Shape { zero: 4, size: 7 }, later: Shape { zero: 4, size: 3 } };
        CHANNEL_COUNT];

/// What stays the same throughout a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Session {
    /// The quantiser's, µm.
    pub precision: u16,
    /// The nominal rate.
    pub rate: FrameRate,
    /// Of the performer's neutral face: another one, another performer.
    pub neutral: u32,
}

impl Session {
    /// The nominal time between frames, tenths of a millisecond.
    pub fn interval(&self) -> i64 {
        let (frames, seconds) = (u64::from(self.rate.numerator.max(1)), u64::from(self.rate.denominator));
        ((seconds * TICKS + frames / 2) / frames) as i64
    }
}

/// What a key says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    /// The session.
    pub session: Session,
    /// Under which this packet and those up to the next key are written.
    pub tables: Tables,
    /// Under which those after the next key are, where they are others.
    pub next: Option<Tables>,
}

/// Odds of a shape's parts, learnt within one key.
#[derive(Default)]
struct ShapeOdds {
    zero: [Learnt; 8],
    size: [Learnt; Shape::SIZE_COUNT as usize],
}

impl ShapeOdds {
    fn put(&mut self, writer: &mut Writer, shape: Shape) {
        writer.choice(shape.zero, &mut self.zero);
        // Whatever a silent channel says costs little.
        if shape.zero < Shape::SILENT {
            writer.choice(shape.size, &mut self.size);
        }
    }

    fn get(&mut self, reader: &mut Reader) -> Result<Shape, Damaged> {
        let zero = reader.choice(&mut self.zero)?;
        let size = if zero < Shape::SILENT { reader.choice(&mut self.size)? } else { 0 };
        Ok(Shape { zero, size })
    }
}

#[derive(Default)]
struct ChannelOdds {
    first: ShapeOdds,
    later: ShapeOdds,
}

impl ChannelOdds {
    fn put(&mut self, writer: &mut Writer, channel: &Channel) {
        writer.value(channel.centre, CENTRES);
        self.first.put(writer, channel.first);
        self.later.put(writer, channel.later);
    }

    fn get(&mut self, reader: &mut Reader) -> Result<Channel, Damaged> {
        let centre = reader.value(CENTRES)?;
        if centre.abs() > MOST_LEVEL {
            return Err(Damaged);
        }
        Ok(Channel { centre, first: self.first.get(reader)?, later: self.later.get(reader)? })
    }
}

impl Key {
    /// Writes it.
    pub fn put(&self, writer: &mut Writer) {
        let Session { precision, rate, neutral } = self.session;
        writer.bits(channels(), 32);
        writer.bits(u32::from(precision), 16);
        for word in [rate.numerator, rate.denominator, neutral] {
            writer.bits(word, 32);
        }
        let mut odds = ChannelOdds::default();
        for channel in &self.tables {
            odds.put(writer, channel);
        }
        writer.bits(u32::from(self.next.is_some()), 1);
        let Some(next) = &self.next else { return };
        let mut changes = Learnt::default();
        for (channel, next) in self.tables.iter().zip(next) {
            writer.learnt(channel != next, &mut changes);
            if channel != next {
                odds.put(writer, next);
            }
        }
    }

    /// Reads it; `None` where the sender has other channels.
    pub fn get(reader: &mut Reader) -> Result<Option<Self>, Damaged> {
        if reader.bits(32)? != channels() {
            return Ok(None);
        }
        let precision = reader.bits(16)? as u16;
        let rate = FrameRate { numerator: reader.bits(32)?, denominator: reader.bits(32)? };
        if rate.numerator == 0 || rate.denominator == 0 || !(0.1..=1000.0).contains(&rate.per_second()) {
            return Err(Damaged);
        }
        let session = Session { precision, rate, neutral: reader.bits(32)? };
        let mut odds = ChannelOdds::default();
        let mut tables = FIRST_TABLES;
        for channel in &mut tables {
            *channel = odds.get(reader)?;
        }
        let mut next = None;
        if reader.bits(1)? == 1 {
            let (mut changes, mut changed) = (Learnt::default(), tables);
            for channel in &mut changed {
                if reader.learnt(&mut changes)? {
                    *channel = odds.get(reader)?;
                }
            }
            next = Some(changed);
        }
        Ok(Some(Self { session, tables, next }))
    }
}

/// Tables that fit levels seen: `firsts` of packets' first frames, `steps` from one frame to the next. A channel whose
/// table still fits keeps it.
pub fn fitting<'a>(
    old: &Tables,
    firsts: impl Iterator<Item = &'a Levels> + Clone,
    steps: impl Iterator<Item = &'a Levels> + Clone,
) -> Tables {
    let mut sorted = Vec::new();
    std::array::from_fn(|k| {
        sorted.clear();
        sorted.extend(firsts.clone().map(|levels| levels[k]));
        sorted.sort_unstable();
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0);
        let kept = &old[k];
        let first = Shape::fitting(sorted.iter().map(|level| level - median));
        // A centre that has moved by less than a quarter of what levels differ by is no news.
        let spread = sorted.iter().map(|level| i64::from((level - median).abs())).sum::<i64>();
        let moved = i64::from((median - kept.centre).abs()) * 4 * sorted.len() as i64;
        let (centre, first) = if moved > spread { (median, first) } else { (kept.centre, first) };
        let later = Shape::fitting(steps.clone().map(|levels| levels[k]));
        Channel { centre, first: steady(kept.first, first), later: steady(kept.later, later) }
    })
}

/// The old shape where the new one is its neighbour.
fn steady(old: Shape, new: Shape) -> Shape {
    let near = |a: u8, b: u8| a.abs_diff(b) <= 1;
    let quiet = old.zero == Shape::SILENT && new.zero == Shape::SILENT;
    if quiet {
        return Shape { size: 0, ..new };
    }
    let crosses = (old.zero == Shape::SILENT) != (new.zero == Shape::SILENT);
    if !crosses && near(old.zero, new.zero) && near(old.size, new.size) { old } else { normal(new) }
}

/// As it comes back: the size of a silent channel is not told.
fn normal(shape: Shape) -> Shape {
    if shape.zero == Shape::SILENT { Shape { size: 0, ..shape } } else { shape }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn shape() -> impl Strategy<Value = Shape> {
        (0_u8..8, 0_u8..16).prop_map(|(zero, size)| normal(Shape { zero, size }))
    }

    fn tables() -> impl Strategy<Value = Tables> {
        prop::collection::vec((-200_i32..200, shape(), shape()), CHANNEL_COUNT).prop_map(|rows| {
            std::array::from_fn(|k| {
                let (centre, first, later) = rows[k];
                Channel { centre, first, later }
            })
        })
    }

    proptest! {
        #[test]
        fn keys_come_back(tables in tables(), next in prop::option::of(tables()), words in any::<[u32; 2]>()) {
            let rate = FrameRate { numerator: 30000, denominator: 1001 };
            let session = Session { precision: words[0] as u16, rate, neutral: words[1] };
            let key = Key { session, tables, next: next.filter(|next| *next != tables) };
            let mut writer = Writer::default();
            key.put(&mut writer);
            let got = Key::get(&mut Reader::new(&writer.finish()).unwrap());
            prop_assert_eq!(got, Ok(Some(key)));
        }

        #[test]
        fn garbage_is_no_key(mut bytes in prop::collection::vec(any::<u8>(), 0..400), head in any::<bool>()) {
            if head {
                // The right channels, then anything.
                let mut writer = Writer::default();
                writer.bits(channels(), 32);
                bytes.splice(0..0, writer.finish());
            }
            let _ = Key::get(&mut Reader::new(&bytes).unwrap());
        }
    }

    #[test]
    fn tables_fit_and_stay() {
        let mut firsts = Vec::new();
        for k in 0..60_i32 {
            let mut levels = [0; CHANNEL_COUNT];
            levels[0] = 100 + k % 7;
            levels[1] = if k % 10 == 0 { 12 } else { 0 };
            firsts.push(levels);
        }
        let steps = vec![[0; CHANNEL_COUNT]; 60];
        let fit = fitting(&FIRST_TABLES, firsts.iter(), steps.iter());
        assert_eq!(fit[0].centre, 103);
        assert_eq!(fit[1].centre, 0);
        assert!(fit[1].first.zero >= 4 && fit[1].first.size >= 9, "{:?}", fit[1]);
        assert_eq!(fit[2].first, Shape { zero: Shape::SILENT, size: 0 });
        assert_eq!(fitting(&fit, firsts.iter(), steps.iter()), fit);
    }
}
