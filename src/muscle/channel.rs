//! How far a contraction can be believed.

use std::{fmt, str::FromStr};

/// What one camera tells of a muscle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Channel {
    /// Seen, and told apart from others.
    #[default]
    Measured,
    /// Seen, but the landmarks report it too small or mixed with others.
    Weak,
    /// Follows from what is seen of others, or lies along the line of sight.
    Inferred,
    /// Nothing that is seen tells of it; its value is 0.
    Absent,
}

impl Channel {
    /// One lower-case word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Weak => "weak",
            Self::Inferred => "inferred",
            Self::Absent => "absent",
        }
    }
}

impl fmt::Display for Channel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Channel {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let all = [Self::Measured, Self::Weak, Self::Inferred, Self::Absent];
        all.into_iter().find(|channel| channel.name() == text).ok_or(())
    }
}
