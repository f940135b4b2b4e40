//! Time as integers: nothing here is ever a float.

use std::{fmt, str::FromStr};

use super::CaptureError;

/// Nanoseconds since the first frame of the clip, from the container's own clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Timestamp(pub i64);

impl Timestamp {
    /// For formulas in seconds (filters, exports); never stored.
    pub fn seconds(self) -> f64 {
        self.0 as f64 * 1e-9
    }

    /// Decimal seconds as integer nanoseconds, exact up to nine decimals; further ones are cut. `None` where `text` is
    /// not that, or too long ago or ahead.
    pub fn from_decimal(text: &str) -> Option<Self> {
        let (negative, size) = text.strip_prefix('-').map_or((false, text), |rest| (true, rest));
        let (whole, fraction) = size.split_once('.').unwrap_or((size, ""));
        let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
        if whole.is_empty() || !digits(whole) || !digits(fraction) {
            return None;
        }
        let mut total = i128::from(whole.parse::<i64>().ok()?) * 1_000_000_000;
        let mut unit = 100_000_000;
        for digit in fraction.bytes().take(9) {
            total += i128::from(digit - b'0') * unit;
            unit /= 10;
        }
        i64::try_from(if negative { -total } else { total }).ok().map(Self)
    }
}

/// Frames per second as a fraction, so that 29.97 stays 30000/1001.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameRate {
    /// Frames.
    pub numerator: u32,
    /// In this many seconds; never 0.
    pub denominator: u32,
}

impl FrameRate {
    /// The fraction a floating-point rate stands for: whole, over 1001 (NTSC), or in thousandths; 25 where there is none.
    pub fn nearest(per_second: f64) -> Self {
        if !(per_second.is_finite() && (0.1..=1000.0).contains(&per_second)) {
            return Self { numerator: 25, denominator: 1 };
        }
        let whole = per_second.round();
        let ntsc = (per_second * 1.001).round();
        if (per_second - whole).abs() < 1e-4 * whole {
            Self { numerator: whole as u32, denominator: 1 }
        } else if (per_second - ntsc / 1.001).abs() < 1e-4 * ntsc {
            Self { numerator: (ntsc * 1000.0) as u32, denominator: 1001 }
        } else {
            Self { numerator: (per_second * 1000.0).round() as u32, denominator: 1000 }
        }
    }

    /// When tick `index` of a constant-rate stream is shown.
    pub fn tick(self, index: u64) -> Timestamp {
        let nanoseconds = i128::from(index) * i128::from(self.denominator) * 1_000_000_000
            / i128::from(self.numerator.max(1));
        Timestamp(nanoseconds as i64)
    }

    /// The value for displays and formats that only take a float.
    pub fn per_second(self) -> f64 {
        f64::from(self.numerator) / f64::from(self.denominator)
    }
}

impl fmt::Display for FrameRate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.denominator {
            1 => write!(formatter, "{}", self.numerator),
            denominator => write!(formatter, "{}/{denominator}", self.numerator),
        }
    }
}

impl FromStr for FrameRate {
    type Err = CaptureError;

    /// Reads `25`, `29.97` or `30000/1001`.
    fn from_str(text: &str) -> Result<Self, CaptureError> {
        let bad = || CaptureError::BadRate { text: text.to_owned() };
        let rate = if let Some((numerator, denominator)) = text.split_once('/') {
            Self {
                numerator: numerator.trim().parse().map_err(|_| bad())?,
                denominator: denominator.trim().parse().map_err(|_| bad())?,
            }
        } else {
            let per_second: f64 = text.trim().parse().map_err(|_| bad())?;
            if !(per_second.is_finite() && (0.1..=1000.0).contains(&per_second)) {
                return Err(bad());
            }
            Self::nearest(per_second)
        };
        if rate.numerator == 0 || rate.denominator == 0 { Err(bad()) } else { Ok(rate) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_the_fractions_they_stand_for() {
        let rate = |numerator, denominator| FrameRate { numerator, denominator };
        assert_eq!(FrameRate::nearest(29.970_029_97), rate(30000, 1001));
        assert_eq!(FrameRate::nearest(23.976_023_976), rate(24000, 1001));
        assert_eq!(FrameRate::nearest(25.0), rate(25, 1));
        assert_eq!(FrameRate::nearest(12.5), rate(12500, 1000));
        assert_eq!(FrameRate::nearest(f64::NAN), rate(25, 1));
        assert_eq!("30000/1001".parse::<FrameRate>().unwrap(), rate(30000, 1001));
        for bad in ["0", "-3", "abc", "1/0", "NaN"] {
            assert!(bad.parse::<FrameRate>().is_err(), "{bad}");
        }
    }

    #[test]
    fn times_are_read_exactly() {
        let read = Timestamp::from_decimal;
        assert_eq!(read("9223372036.854775807"), Some(Timestamp(i64::MAX)));
        assert_eq!(read("-0.000000001"), Some(Timestamp(-1)));
        assert_eq!(read("3"), Some(Timestamp(3_000_000_000)));
        assert_eq!(read("9223372036.854775808"), None);
        assert_eq!(read("170141183460469231731687303715.999999999"), None);
        assert_eq!(read("."), None);
    }

    #[test]
    fn ticks_do_not_drift() {
        let rate = FrameRate { numerator: 30000, denominator: 1001 };
        assert_eq!(rate.tick(30_000), Timestamp(1_001_000_000_000));
    }
}
