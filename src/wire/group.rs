//! The frames of one packet: they need the session's tables, and no other packet.
//!
//! The first frame is told about the channels' centres, the last about the first, and those between about where their
//! neighbours put them: halfway frames first. A packet that is lost therefore takes its own frames with it and no others.

use super::{
    entropy::{Damaged, Reader, Shape, Writer},
    levels::{CHANNEL_COUNT, HEAD_CHANNELS, Levels, MOST_LEVEL, Steps, levels_after, levels_between},
    tables::{Channel, Tables, twin},
};

/// Frames in a packet at most.
pub const MOST_FRAMES: usize = 8;
/// No frame is shown longer before the next one of its packet, tenths of a millisecond.
pub const MOST_INTERVAL: i64 = 10_000;
/// How frames lie about the place between their neighbours.
const BETWEEN: Shape = Shape { zero: 6, size: 0 };
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
        for (place, told) in order(self.0.len()) {
            let levels = &self.0[place].1;
            let between = told.between(place, &self.0);
            for (k, channel) in tables.iter().enumerate() {
                let (about, shape) = expected(k, *channel, levels, &between);
                writer.value(levels[k] - about, shape);
            }
        }
    }

    /// Rounds frames so that they cost little; `before` are the levels last told.
    pub fn of(frames: &[(i64, Steps)], before: Option<&Levels>) -> Self {
        let mut group = Self(frames.iter().map(|(time, _)| (*time, [0; CHANNEL_COUNT])).collect());
        for (place, told) in order(frames.len()) {
            let steps = &frames[place].1;
            group.0[place].1 = match told.between(place, &group.0) {
                About::Centres => levels_after(steps, before),
                About::First(first) => levels_after(steps, Some(&first)),
                About::Between(levels) => levels_between(steps, &levels),
            };
        }
        group
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
        let mut group = Self(times.into_iter().map(|time| (time, [0; CHANNEL_COUNT])).collect());
        for (place, told) in order(group.0.len()) {
            let between = told.between(place, &group.0);
            let levels = &mut group.0[place].1;
            for (k, channel) in tables.iter().enumerate() {
                let (about, shape) = expected(k, *channel, levels, &between);
                let told = i64::from(about) + i64::from(reader.value(shape)?);
                let told = i32::try_from(told).ok().filter(|level| level.abs() <= MOST_LEVEL);
                levels[k] = told.ok_or(Damaged)?;
            }
        }
        Ok(group)
    }
}

/// From which frames of its packet a frame is foretold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Told {
    First,
    Last,
    Between(usize, usize),
}

/// About which levels a frame is told.
enum About {
    Centres,
    First(Levels),
    Between(Levels),
}

impl Told {
    fn between(self, place: usize, frames: &[(i64, Levels)]) -> About {
        match self {
            Self::First => About::Centres,
            Self::Last => About::First(frames[0].1),
            Self::Between(from, to) => {
                let ((_, a), (_, b)) = (&frames[from], &frames[to]);
                let (part, whole) = ((place - from) as i32, (to - from) as i32);
                About::Between(std::array::from_fn(|k| {
                    // What is told by names of levels has none between.
                    let moved = if k < HEAD_CHANNELS.end { (b[k] - a[k]) * part } else { 0 };
                    a[k] + (2 * moved + whole).div_euclid(2 * whole)
                }))
            }
        }
    }
}

/// In which order the frames of a packet are told.
fn order(count: usize) -> Vec<(usize, Told)> {
    let mut order: Vec<(usize, Told)> = Vec::with_capacity(count);
    if count > 0 {
        order.push((0, Told::First));
    }
    if count > 1 {
        order.push((count - 1, Told::Last));
    }
    let mut spans = vec![(0, count.saturating_sub(1))];
    while let Some((from, to)) = spans.pop() {
        if to - from > 1 {
            let middle = from.midpoint(to);
            order.push((middle, Told::Between(from, to)));
            spans.extend([(middle, to), (from, middle)]);
        }
    }
    order
}

/// About which level a channel's lies, and how. Of `levels` only those before it are looked at.
fn expected(k: usize, channel: Channel, levels: &Levels, about: &About) -> (i32, Shape) {
    let [first, later] = channel.shapes();
    match (about, twin(k, channel)) {
        (About::Centres, None) => (channel.centre, first),
        (About::Centres, Some(left)) => (levels[left], first),
        (About::First(before), None) => (before[k], later),
        (About::First(before), Some(left)) => (before[k] + levels[left] - before[left], later),
        (About::Between(between), _) => (between[k], BETWEEN),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_frame_is_told_once_after_those_that_foretell_it() {
        for count in 0..=MOST_FRAMES {
            let mut known = Vec::new();
            for (place, told) in order(count) {
                assert!(!known.contains(&place));
                match told {
                    Told::First => assert_eq!(place, 0),
                    Told::Last => assert_eq!(place, count - 1),
                    Told::Between(from, to) => {
                        assert!(from < place && place < to && known.contains(&from) && known.contains(&to));
                    }
                }
                known.push(place);
            }
            known.sort_unstable();
            assert!(known.into_iter().eq(0..count));
        }
    }

    #[test]
    fn frames_between_lie_where_their_neighbours_put_them() {
        let with = |value: i32| {
            let mut levels = [value; CHANNEL_COUNT];
            levels[CHANNEL_COUNT - 1] = 2;
            levels
        };
        let frames = [(0, with(-3)), (1, with(0)), (2, with(0)), (3, with(7))];
        let About::Between(levels) = Told::Between(0, 3).between(1, &frames) else { panic!() };
        assert_eq!((levels[0], levels[CHANNEL_COUNT - 1]), (0, 2));
        let About::Between(levels) = Told::Between(1, 3).between(2, &frames) else { panic!() };
        assert_eq!(levels[0], 4);
        let skin = HEAD_CHANNELS.end;
        assert_eq!(levels[skin], 0);
    }
}
