//! What both ends must share before a frame can be told in few bits, and how a key tells it.

use std::sync::LazyLock;

use super::{
    entropy::{Damaged, Learnt, Reader, Shape, Tally, Writer},
    levels::{CHANNEL_COUNT, HEAD_CHANNELS, Levels, MOST_LEVEL, channels},
};
use crate::{capture::FrameRate, muscle::ARKIT_SHAPES};

/// Tenths of a millisecond in a second.
pub const TICKS: u64 = 10_000;
/// How centres that are not 0 are spread.
const CENTRES: Shape = Shape { zero: 0, size: 10 };
/// A channel's table changes where that would have saved as many bits in what was sent lately: some eight seconds, in
/// which it is told nine times.
const NEWS: u64 = 40;

const fn form(zero: u8, size: u8, later_zero: u8, later_size: u8) -> [Shape; 2] {
    [Shape { zero, size }, Shape { zero: later_zero, size: later_size }]
}

/// How levels can be spread: those of a packet's first frame about their centre, and those of its last frame about the first. From channels that never move to a head that is followed finely.
pub const FORMS: [[Shape; 2]; 16] = [
    form(7, 0, 7, 0),
    form(6, 4, 6, 0),
    form(5, 3, 5, 0),
    form(5, 7, 4, 3),
    form(4, 4, 4, 0),
    form(3, 5, 4, 2),
    form(3, 8, 3, 3),
    form(2, 3, 3, 0),
    form(1, 4, 3, 1),
    form(1, 7, 2, 3),
    form(0, 5, 3, 1),
    form(0, 7, 2, 3),
    form(0, 9, 1, 4),
    form(0, 11, 1, 6),
    form(0, 13, 1, 7),
    form(0, 15, 0, 10),
];

/// How one channel's levels are spread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Channel {
    /// About which level those of a packet's first frame lie; 0 where they lie about the twin's.
    pub centre: i32,
    /// Whether it goes with its twin, the same muscle on the left.
    pub twin: bool,
    /// Which of `FORMS`.
    pub form: u8,
}

impl Channel {
    const fn of(form: u8) -> Self {
        Self { centre: 0, twin: false, form }
    }

    /// Of a packet's first frame, and of its last.
    pub fn shapes(self) -> [Shape; 2] {
        FORMS[usize::from(self.form)]
    }
}

/// How every channel's levels are spread.
pub type Tables = [Channel; CHANNEL_COUNT];

/// Before anything was seen: muscles that move, a head that moves more, skin that nobody tells of.
pub const FIRST_TABLES: Tables = {
    let mut tables = [Channel::of(0); CHANNEL_COUNT];
    let mut k = 0;
    while k < HEAD_CHANNELS.end {
        tables[k] = Channel::of(if k < HEAD_CHANNELS.start { 6 } else { 13 });
        k += 1;
    }
    tables
};

/// For the muscles of the right half, and the gaze of the right eye, the channel on the left that is told before.
static TWINS: LazyLock<[Option<usize>; CHANNEL_COUNT]> = LazyLock::new(|| {
    let twin = |k: usize| {
        let stem = ARKIT_SHAPES.get(k).filter(|_| k < HEAD_CHANNELS.start)?.strip_suffix("Right")?;
        // Both eyes look to one side.
        let stem = match stem {
            "eyeLookIn" => "eyeLookOut",
            "eyeLookOut" => "eyeLookIn",
            stem => stem,
        };
        let left = format!("{stem}Left");
        ARKIT_SHAPES.iter().position(|name| *name == left).filter(|left| *left < k)
    };
    std::array::from_fn(twin)
});

/// The channel with which `k` goes, where it has one and `channel` says so.
pub fn twin(k: usize, channel: Channel) -> Option<usize> {
    TWINS[k].filter(|_| channel.twin)
}

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

    fn put(&self, writer: &mut Writer) {
        writer.bits(u32::from(self.precision), 16);
        writer.bits(self.neutral, 32);
        let FrameRate { numerator, denominator } = self.rate;
        let is_short = numerator < 1 << 16 && denominator < 1 << 11;
        writer.bits(u32::from(!is_short), 1);
        let [most, least] = if is_short { [16, 11] } else { [32, 32] };
        writer.bits(numerator, most);
        writer.bits(denominator, least);
    }

    fn get(reader: &mut Reader) -> Result<Self, Damaged> {
        let precision = reader.bits(16)? as u16;
        let neutral = reader.bits(32)?;
        let [most, least] = if reader.bits(1)? == 0 { [16, 11] } else { [32, 32] };
        let rate = FrameRate { numerator: reader.bits(most)?, denominator: reader.bits(least)? };
        let is_rate = rate.numerator > 0 && rate.denominator > 0;
        if !is_rate || !(0.1..=1000.0).contains(&rate.per_second()) {
            return Err(Damaged);
        }
        Ok(Self { precision, rate, neutral })
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

/// Odds of a table's parts, learnt within one key.
#[derive(Default)]
struct ChannelOdds {
    form: [Learnt; FORMS.len()],
    twin: Learnt,
    centred: Learnt,
}

impl ChannelOdds {
    fn put(&mut self, writer: &mut Writer, k: usize, channel: Channel) {
        writer.choice(channel.form, &mut self.form);
        if TWINS[k].is_some() {
            writer.learnt(channel.twin, &mut self.twin);
        }
        if !channel.twin {
            writer.learnt(channel.centre != 0, &mut self.centred);
            if channel.centre != 0 {
                writer.value(channel.centre, CENTRES);
            }
        }
    }

    fn get(&mut self, reader: &mut Reader, k: usize) -> Result<Channel, Damaged> {
        let form = reader.choice(&mut self.form)?;
        let twin = TWINS[k].is_some() && reader.learnt(&mut self.twin)?;
        let has_centre = !twin && reader.learnt(&mut self.centred)?;
        let centre = if has_centre { reader.value(CENTRES)? } else { 0 };
        if centre.abs() > MOST_LEVEL {
            return Err(Damaged);
        }
        Ok(Channel { centre, twin, form })
    }
}

impl Key {
    /// Writes it.
    pub fn put(&self, writer: &mut Writer) {
        writer.bits(channels(), 32);
        self.session.put(writer);
        let mut odds = ChannelOdds::default();
        for (k, channel) in self.tables.iter().enumerate() {
            odds.put(writer, k, *channel);
        }
        writer.bits(u32::from(self.next.is_some()), 1);
        let Some(next) = &self.next else { return };
        let mut changes = Learnt::default();
        for (k, (channel, next)) in self.tables.iter().zip(next).enumerate() {
            writer.learnt(channel != next, &mut changes);
            if channel != next {
                odds.put(writer, k, *next);
            }
        }
    }

    /// Reads it; `None` where the sender has other channels.
    pub fn get(reader: &mut Reader) -> Result<Option<Self>, Damaged> {
        if reader.bits(32)? != channels() {
            return Ok(None);
        }
        let session = Session::get(reader)?;
        let mut odds = ChannelOdds::default();
        let mut tables = FIRST_TABLES;
        for (k, channel) in tables.iter_mut().enumerate() {
            *channel = odds.get(reader, k)?;
        }
        let mut next = None;
        if reader.bits(1)? == 1 {
            let (mut changes, mut changed) = (Learnt::default(), tables);
            for (k, channel) in changed.iter_mut().enumerate() {
                if reader.learnt(&mut changes)? {
                    *channel = odds.get(reader, k)?;
                }
            }
            next = Some(changed);
        }
        Ok(Some(Self { session, tables, next }))
    }
}

/// Tables that fit levels seen: `firsts` of packets' first frames, `steps` from those to the last. A channel whose
/// table still fits keeps it.
pub fn fitting<'a>(
    old: &Tables,
    firsts: &(impl Iterator<Item = &'a Levels> + Clone),
    steps: &(impl Iterator<Item = &'a Levels> + Clone),
) -> Tables {
    let mut sorted = Vec::new();
    std::array::from_fn(|k| {
        sorted.clear();
        sorted.extend(firsts.clone().map(|levels| levels[k]));
        sorted.sort_unstable();
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0);
        let tallies = |channel: Channel| {
            let left = |levels: &Levels| twin(k, channel).map_or(0, |twin| levels[twin]);
            [
                Tally::of(firsts.clone().map(|levels| levels[k] - left(levels) - channel.centre)),
                Tally::of(steps.clone().map(|levels| levels[k] - left(levels))),
            ]
        };
        let bits = |tallies: &[Tally; 2], form: u8| -> u64 {
            tallies.iter().zip(FORMS[usize::from(form)]).map(|(tally, shape)| tally.bits(shape)).sum()
        };
        let mut best = old[k];
        let mut least = bits(&tallies(best), best.form);
        let mut news = NEWS;
        let about = [(old[k].centre, false), (median, false), (0, true)];
        for (centre, twin) in about.into_iter().filter(|(_, twin)| !twin || TWINS[k].is_some()) {
            let tallies = tallies(Channel { centre, twin, form: 0 });
            for form in 0..FORMS.len() as u8 {
                let bits = bits(&tallies, form);
                if bits + news < least {
                    (best, least, news) = (Channel { centre, twin, form }, bits, 0);
                }
            }
        }
        best
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn tables() -> impl Strategy<Value = Tables> {
        prop::collection::vec((-200_i32..200, any::<bool>(), 0_u8..16), CHANNEL_COUNT).prop_map(|rows| {
            std::array::from_fn(|k| {
                let (centre, twin, form) = rows[k];
                let twin = twin && TWINS[k].is_some();
                Channel { centre: if twin { 0 } else { centre }, twin, form }
            })
        })
    }

    proptest! {
        #[test]
        fn keys_come_back(tables in tables(), next in prop::option::of(tables()), words in any::<[u32; 3]>()) {
            let rates = [(30, 1), (30000, 1001), (12345, 1000), (25 << 20, 1 << 20)];
            let (numerator, denominator) = rates[words[2] as usize % 4];
            let rate = FrameRate { numerator, denominator };
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
    fn twins_stand_before_and_look_the_same_way() {
        let at = |name: &str| ARKIT_SHAPES.iter().position(|shape| *shape == name).unwrap();
        for (right, left) in [
            ("eyeBlinkRight", Some("eyeBlinkLeft")),
            ("eyeLookInRight", Some("eyeLookOutLeft")),
            ("mouthSmileRight", Some("mouthSmileLeft")),
            ("jawRight", None),
            ("mouthRight", None),
            ("eyeBlinkLeft", None),
        ] {
            assert_eq!(TWINS[at(right)], left.map(at), "{right}");
        }
        assert_eq!(TWINS.iter().flatten().count(), 18);
    }

    #[test]
    fn tables_fit_and_stay() {
        let right = ARKIT_SHAPES.iter().position(|name| *name == "eyeBlinkRight").unwrap();
        let mut firsts = Vec::new();
        for k in 0..200_i32 {
            let mut levels = [0; CHANNEL_COUNT];
            levels[0] = 100 + k * k % 17;
            levels[right] = levels[0];
            levels[1] = if k % 10 == 0 { 12 } else { 0 };
            firsts.push(levels);
        }
        let steps = vec![[0; CHANNEL_COUNT]; 200];
        let fit = fitting(&FIRST_TABLES, &firsts.iter(), &steps.iter());
        assert!((100..117).contains(&fit[0].centre) && !fit[0].twin, "{:?}", fit[0]);
        assert_eq!(fit[right], Channel { centre: 0, twin: true, form: 0 });
        assert_eq!(fit[1].centre, 0);
        assert!((1..4).contains(&fit[1].form), "{:?}", fit[1]);
        assert_eq!(fit[2], Channel::of(0));
        assert_eq!(fitting(&fit, &firsts.iter(), &steps.iter()), fit);
    }
}
