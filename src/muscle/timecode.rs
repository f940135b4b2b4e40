//! Timecodes of Live Link Face: `HH:MM:SS:FF.mmm`.
//!
//! Seconds are those of the clock, and `FF.mmm` counts the second's fraction in frames of a nominal, whole rate, with
//! thousandths of a frame. A recording of Live Link Face at hand counts 60 a second and advances by 1.9997: its camera's 30
//! frames a second drift against the clock, and the thousandths say so. Nothing is dropped or renumbered: at 30000/1001
//! a frame lasts 1.001 nominal ones, so that of 1000 numbers one is skipped and none occurs twice.

use crate::capture::{FrameRate, Timestamp};

const DAY: i64 = 86_400;
const SECOND: i128 = 1_000_000_000;

/// What a take's timecodes count from, and in which frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimecodeBase {
    /// Frames that are counted in a second; 1 to 1000.
    pub nominal: u32,
    /// The clock's time at the take's time 0, since midnight.
    pub start: Timestamp,
}

impl TimecodeBase {
    /// Counts a take from midnight on, in frames of its rate, rounded up: 30 of 30000/1001.
    pub fn from_midnight(rate: FrameRate) -> Self {
        let nominal = rate.numerator.div_ceil(rate.denominator.max(1)).clamp(1, 1000);
        Self { nominal, start: Timestamp(0) }
    }

    /// The timecode of the take's `time`; past midnight it begins anew.
    pub fn timecode(self, time: Timestamp) -> String {
        let fine = i128::from(self.nominal) * 1000;
        let nanoseconds = i128::from(self.start.0) + i128::from(time.0);
        // To the nearest thousandth of a frame, so that times cut to nanoseconds give whole frames again.
        let thousandths = (nanoseconds * fine + SECOND / 2).div_euclid(SECOND);
        let of_day = thousandths.rem_euclid(fine * i128::from(DAY));
        let (seconds, rest) = (of_day / fine, of_day % fine);
        let (hours, minutes, frame, part) = (seconds / 3600, seconds / 60 % 60, rest / 1000, rest % 1000);
        format!("{hours:02}:{minutes:02}:{:02}:{frame:02}.{part:03}", seconds % 60)
    }
}

/// A timecode as it was read: the rate of its frames is not known yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Timecode {
    /// Since midnight.
    seconds: i64,
    /// Thousand-millionths of a frame within the second.
    nanoframes: i64,
}

impl Timecode {
    /// Reads `HH:MM:SS:FF`, with or without decimals of the frame; a semicolon may stand before it.
    pub fn read(text: &str) -> Option<Self> {
        let mut parts = text.split([':', ';']);
        let mut whole = |limit: i64| {
            let part = parts.next()?;
            let digits = (1..=2).contains(&part.len()) && part.bytes().all(|byte| byte.is_ascii_digit());
            part.parse::<i64>().ok().filter(|value| digits && *value < limit)
        };
        let (hours, minutes, seconds) = (whole(24)?, whole(60)?, whole(60)?);
        let frames = Timestamp::from_decimal(parts.next()?)?;
        let is_frame = (0..1000 * SECOND as i64).contains(&frames.0);
        (is_frame && parts.next().is_none())
            .then_some(Self { seconds: hours * 3600 + minutes * 60 + seconds, nanoframes: frames.0 })
    }

    /// How many frames a second is counted in: the lowest usual rate that has a frame of the highest number.
    ///
    /// Timecodes that do not go beyond one second may all be low; they count as Live Link Face's usual 60.
    pub fn nominal(all: &[Self]) -> u32 {
        const USUAL: [u32; 8] = [24, 25, 30, 48, 50, 60, 100, 120];
        let highest = all.iter().map(|code| (code.nanoframes / SECOND as i64) as u32).max().unwrap_or(0);
        let one_second = all.iter().all(|code| code.seconds == all[0].seconds);
        let least = if one_second && all.len() > 1 { highest.max(59) } else { highest };
        USUAL.into_iter().find(|rate| *rate > least).unwrap_or(highest + 1)
    }

    /// Since midnight.
    pub fn time(self, nominal: u32) -> Timestamp {
        Timestamp(self.seconds * SECOND as i64 + self.nanoframes / i64::from(nominal.max(1)))
    }

    /// Whether `next` is on the next day, the clock having passed midnight.
    pub fn is_day_before(self, next: Self) -> bool {
        next.seconds < self.seconds - DAY / 2
    }

    /// The length of a day.
    pub fn day() -> i64 {
        DAY * SECOND as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn base(numerator: u32, denominator: u32) -> TimecodeBase {
        TimecodeBase::from_midnight(FrameRate { numerator, denominator })
    }

    #[test]
    fn whole_rates_count_frames_and_ntsc_rates_skip_one_of_a_thousand() {
        let rate = FrameRate { numerator: 30, denominator: 1 };
        for index in 0..10_000 {
            let wanted = format!("00:{:02}:{:02}:{:02}.000", index / 1800, index / 30 % 60, index % 30);
            assert_eq!(base(30, 1).timecode(rate.tick(index)), wanted);
        }
        let ntsc = FrameRate { numerator: 30000, denominator: 1001 };
        let at = |index| base(30000, 1001).timecode(ntsc.tick(index));
        assert_eq!(
            [at(0), at(1), at(999), at(1000)],
            ["00:00:00:00.000", "00:00:00:01.001", "00:00:33:09.999", "00:00:33:11.000"]
        );
        assert_eq!(base(25, 2).nominal, 13);
        assert_eq!(base(25, 1).timecode(Timestamp(86_400_000_000_000)), "00:00:00:00.000");
    }

    #[test]
    fn what_is_no_timecode_is_not_read() {
        for text in
            ["", "1", "00:00:00", "24:00:00:00", "00:60:00:00", "00:00:00:00:00", "00:00:00:-1", "0a:0:0:0"]
        {
            assert_eq!(Timecode::read(text), None, "{text}");
        }
        assert!(Timecode::read("01:02:03;04").is_some());
    }

    #[test]
    fn the_rate_is_guessed_from_the_highest_frame() {
        let nominal = |texts: &[&str]| {
            Timecode::nominal(&texts.iter().map(|text| Timecode::read(text).unwrap()).collect::<Vec<_>>())
        };
        assert_eq!(nominal(&["13:13:04:59.648", "13:13:05:01.648"]), 60);
        assert_eq!(nominal(&["00:00:00:24.000", "00:00:01:00.000"]), 25);
        assert_eq!(nominal(&["00:00:00:01.000", "00:00:00:02.000"]), 60);
        assert_eq!(nominal(&["00:00:00:500.0", "00:00:01:02.000"]), 501);
    }

    proptest! {
        #[test]
        fn what_was_written_is_read(thousandths in 0..86_400 * 60_000_i64) {
            let nanoseconds = (i128::from(thousandths) * SECOND / 60_000) as i64;
            let text = base(60, 1).timecode(Timestamp(nanoseconds));
            let read = Timecode::read(&text).unwrap().time(60);
            prop_assert!((read.0 - nanoseconds).abs() <= 17_000);
            prop_assert_eq!(base(60, 1).timecode(read), text);
        }

        #[test]
        fn no_text_makes_it_panic(text in ".{0,24}") {
            let _ = Timecode::read(&text);
        }
    }
}
