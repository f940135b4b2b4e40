//! Which action unit, and on which side.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{ActionError, Catalogue};
use crate::lift::Side;

/// An action unit on one side of the face, or one that has no sides. `12L`, `17`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ActionKey {
    /// FACS's number.
    pub au: u8,
    /// The subject's side; `None` for an action of the midline.
    pub side: Option<Side>,
}

impl ActionKey {
    /// What `12`, `AU12`, `12L` or `au12r` name: both sides of an action that has sides, unless one is given.
    pub fn parse(text: &str) -> Result<Vec<Self>, ActionError> {
        let unknown = || ActionError::Unknown { text: text.to_owned(), known: Catalogue::get().numbers() };
        let bare = text.trim().to_ascii_uppercase();
        let bare = bare.strip_prefix("AU").unwrap_or(&bare);
        let (number, side) = match bare.as_bytes().last() {
            Some(b'L') => (&bare[..bare.len() - 1], Some(Side::Left)),
            Some(b'R') => (&bare[..bare.len() - 1], Some(Side::Right)),
            _ => (bare, None),
        };
        let au: u8 = number.parse().map_err(|_| unknown())?;
        let action = Catalogue::get().action(au).ok_or_else(unknown)?;
        match (action.sides, side) {
            (true, Some(side)) => Ok(vec![Self { au, side: Some(side) }]),
            (true, None) => Ok(Side::BOTH.map(|side| Self { au, side: Some(side) }).to_vec()),
            (false, None) => Ok(vec![Self { au, side: None }]),
            (false, Some(_)) => Err(ActionError::NoSides { au, name: action.name.clone() }),
        }
    }
}

impl fmt::Display for ActionKey {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let side = match self.side {
            Some(Side::Left) => "L",
            Some(Side::Right) => "R",
            None => "",
        };
        write!(formatter, "{}{side}", self.au)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_read_with_and_without_sides() {
        let written = |text: &str| -> Vec<String> {
            ActionKey::parse(text).unwrap().iter().map(ToString::to_string).collect()
        };
        assert_eq!(written("12"), ["12R", "12L"]);
        assert_eq!(written("au04l"), ["4L"]);
        assert_eq!(written(" AU17 "), ["17"]);
        for wrong in ["", "L", "AU", "12X", "99", "-1", "3", "1.5"] {
            assert!(matches!(ActionKey::parse(wrong), Err(ActionError::Unknown { .. })), "{wrong}");
        }
        assert!(matches!(ActionKey::parse("17L"), Err(ActionError::NoSides { au: 17, .. })));
    }
}
