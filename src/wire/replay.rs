//! Which packets of a session have come already.

/// Packets that may overtake each other by less are told apart; what is older counts as seen.
const WINDOW: u32 = 128;

/// The newest sequence numbers seen.
#[derive(Debug, Clone, Copy, Default)]
pub struct ReplayWindow {
    newest: Option<u32>,
    /// Bit k: newest − k was seen.
    seen: u128,
}

impl ReplayWindow {
    /// Whether a packet is neither here yet nor too old to tell.
    pub fn is_new(&self, sequence: u32) -> bool {
        match self.newest {
            None => true,
            Some(newest) if sequence > newest => true,
            Some(newest) => newest - sequence < WINDOW && self.seen >> (newest - sequence) & 1 == 0,
        }
    }

    /// Notes a packet, once it has proved genuine.
    pub fn note(&mut self, sequence: u32) {
        let newest = self.newest.unwrap_or(sequence);
        if sequence > newest {
            self.seen = self.seen.checked_shl(sequence - newest).unwrap_or(0);
        }
        let newest = newest.max(sequence);
        self.newest = Some(newest);
        if newest - sequence < WINDOW {
            self.seen |= 1 << (newest - sequence);
        }
    }

    /// The highest sequence number.
    pub fn newest(&self) -> Option<u32> {
        self.newest
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn each_packet_is_new_once(order in prop::collection::vec(0_u32..400, 1..300), base in 0_u32..u32::MAX - 400) {
            let (mut window, mut seen) = (ReplayWindow::default(), BTreeSet::new());
            for sequence in order.into_iter().map(|k| base + k) {
                let newest = seen.last().copied().unwrap_or(sequence);
                let too_old = newest >= sequence + 128;
                prop_assert_eq!(window.is_new(sequence), !too_old && !seen.contains(&sequence));
                window.note(sequence);
                prop_assert!(!window.is_new(sequence));
                seen.insert(sequence);
            }
        }
    }
}
