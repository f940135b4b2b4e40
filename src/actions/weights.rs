//! How strongly each action unit is on, at one moment.

use super::{ActionError, ActionKey, Catalogue};
use crate::lift::Side;

/// Magnitudes m of 000 eq. 5.8 and 5.10, one for each action that is on. 0 is the neutral, 1 the full expression.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ActionWeights {
    /// By ascending key, none twice.
    on: Vec<(ActionKey, f64)>,
}

impl ActionWeights {
    /// Of magnitudes in 0..=1 by ascending key, none twice.
    pub(super) fn ascending(on: Vec<(ActionKey, f64)>) -> Self {
        Self { on }
    }

    /// Sets a magnitude; outside 0..=1 is an error.
    pub fn set(&mut self, key: ActionKey, magnitude: f64) -> Result<(), ActionError> {
        if !(0.0..=1.0).contains(&magnitude) {
            return Err(ActionError::Magnitude { unit: key.to_string(), value: magnitude });
        }
        match self.on.binary_search_by_key(&key, |entry| entry.0) {
            Ok(at) => self.on[at].1 = magnitude,
            Err(at) => self.on.insert(at, (key, magnitude)),
        }
        Ok(())
    }

    /// `12=0.8`, `AU4L=0.5`, or `12`, which is 1. Later ones take precedence.
    pub fn set_text(&mut self, text: &str) -> Result<(), ActionError> {
        let (unit, magnitude) = match text.split_once('=') {
            Some((unit, number)) => {
                let value = number.trim().parse().unwrap_or(f64::NAN);
                (unit, value)
            }
            None => (text, 1.0),
        };
        for key in ActionKey::parse(unit)? {
            self.set(key, magnitude)?;
        }
        Ok(())
    }

    /// Adds the actions of an emotion of table 3-3: `happiness`, `anger=0.5`. Actions that are on more strongly already
    /// stay.
    pub fn set_emotion(&mut self, text: &str) -> Result<(), ActionError> {
        let (name, magnitude) = match text.split_once('=') {
            Some((name, number)) => (name, number.trim().parse().unwrap_or(f64::NAN)),
            None => (text, 1.0),
        };
        for au in &Catalogue::get().emotion(name)?.actions {
            for key in ActionKey::parse(&au.to_string())? {
                if magnitude.is_nan() || self.of(key) <= magnitude {
                    self.set(key, magnitude)?;
                }
            }
        }
        Ok(())
    }

    /// The magnitude of one action; 0 where it is off.
    pub fn of(&self, key: ActionKey) -> f64 {
        self.on.binary_search_by_key(&key, |entry| entry.0).map_or(0.0, |at| self.on[at].1)
    }

    /// What is on, by ascending key.
    pub fn iter(&self) -> impl Iterator<Item = (ActionKey, f64)> + '_ {
        self.on.iter().copied()
    }

    /// `share` of the way from `self` to `other`.
    #[must_use]
    pub fn towards(&self, other: &Self, share: f64) -> Self {
        let mut mixed = Self::default();
        for (key, _) in self.on.iter().chain(&other.on) {
            let (from, to) = (self.of(*key), other.of(*key));
            let value = from + (to - from) * share;
            if let Err(at) = mixed.on.binary_search_by_key(key, |entry| entry.0) {
                mixed.on.insert(at, (*key, value));
            }
        }
        mixed
    }

    /// Whether both sides of an action are on alike.
    pub fn is_even(&self, au: u8) -> bool {
        let of = |side| self.of(ActionKey { au, side: Some(side) });
        (of(Side::Right) - of(Side::Left)).abs() < 1e-9
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_set_both_sides_or_one() {
        let mut weights = ActionWeights::default();
        for text in ["12=0.8", "AU12L=0.25", "17"] {
            weights.set_text(text).unwrap();
        }
        let all: Vec<_> = weights.iter().map(|(key, m)| (key.to_string(), m)).collect();
        assert_eq!(all, [("12R".into(), 0.8), ("12L".into(), 0.25), ("17".into(), 1.0)]);
        assert!(!weights.is_even(12) && weights.is_even(4));
        for wrong in ["12=1.01", "12=-0.1", "12=NaN", "12=", "12=much"] {
            assert!(matches!(weights.set_text(wrong), Err(ActionError::Magnitude { .. })), "{wrong}");
        }
    }

    #[test]
    fn emotions_are_those_of_the_table() {
        let mut weights = ActionWeights::default();
        weights.set_text("4L=0.9").unwrap();
        weights.set_emotion("anger=0.5").unwrap();
        let on: Vec<_> = weights.iter().map(|(key, m)| format!("{key}={m}")).collect();
        assert_eq!(on.join(" "), "4R=0.5 4L=0.9 5R=0.5 5L=0.5 7R=0.5 7L=0.5 23=0.5 25=0.5");
    }

    #[test]
    fn halfway_lies_between() {
        let (mut a, mut b) = (ActionWeights::default(), ActionWeights::default());
        a.set_text("12=1").unwrap();
        b.set_text("17=0.5").unwrap();
        let on: Vec<_> = a.towards(&b, 0.5).iter().map(|(key, m)| format!("{key}={m}")).collect();
        assert_eq!(on.join(" "), "12R=0.5 12L=0.5 17=0.25");
    }
}
