//! Time as integers: nothing here is ever a float.

use std::fmt;

/// Nanoseconds since the first frame of the clip, from the container's own clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Timestamp(pub i64);

impl Timestamp {
    /// For formulas in seconds (filters, exports); never stored.
    pub fn seconds(self) -> f64 {
        self.0 as f64 * 1e-9
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
