//! Packets in, frames out; whatever is not a genuine, new packet changes nothing.

use std::collections::{BTreeMap, VecDeque};

use super::{
    BadPacket, Damaged, Envelope, Header, SecretKey, Session, WireFrame,
    entropy::Reader,
    group::Group,
    levels::Quantiser,
    packet::SALT,
    replay::ReplayWindow,
    tables::{Key, TICKS, Tables},
};
use crate::capture::Timestamp;

/// A session that has been silent for this long may be followed by another, nanoseconds.
const IDLE: i64 = 2_000_000_000;
/// Sessions that are over and never come back.
const MOST_PAST: usize = 1024;
/// A packet's frames are not further ahead of those before it than its own arrival is, and this; nanoseconds.
const AHEAD: i64 = 60_000_000_000;
/// Nanoseconds in a tenth of a millisecond.
const TICK: i64 = 1_000_000_000 / TICKS as i64;

/// What a packet brought.
#[derive(Debug, Clone, PartialEq)]
pub enum Received {
    /// Frames, in order; others may come before them later.
    Frames(Vec<WireFrame>),
    /// The session is over. Packets that were overtaken may still come.
    End,
}

/// Why a packet brought nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum Ignored {
    /// Something else, or too long.
    #[error("no packets of this program")]
    Foreign,
    /// Another version of the format.
    #[error("of another version of the format")]
    Version,
    /// Damaged, changed, or sealed with another key.
    #[error("damaged, changed, or sealed with another key")]
    Damaged,
    /// Encrypted, and no key was given.
    #[error("encrypted: --key FILE is wanted")]
    Sealed,
    /// Not encrypted, and a key was given.
    #[error("not encrypted, though --key asks for it")]
    NotSealed,
    /// Of a session that has not begun here, is over, or has to wait until the one that is shown is over.
    #[error("of another session")]
    OtherSession,
    /// Seen already, or far too late.
    #[error("seen already")]
    Replayed,
    /// Before the key that it needs.
    #[error("before the key that they need")]
    UnknownTables,
    /// The sender has other channels.
    #[error("of a program with other channels; both ends want the same version")]
    OtherChannels,
    /// It says something else than the session's other packets.
    #[error("at odds with the packets before them")]
    Contradiction,
    /// Its frames are far ahead of their time.
    #[error("far ahead of their time")]
    Hasty,
}

impl From<BadPacket> for Ignored {
    fn from(bad: BadPacket) -> Self {
        match bad {
            BadPacket::Foreign => Self::Foreign,
            BadPacket::Version => Self::Version,
            BadPacket::Damaged => Self::Damaged,
        }
    }
}

impl From<Damaged> for Ignored {
    fn from(_: Damaged) -> Self {
        Self::Damaged
    }
}

/// What is known of the session that is shown.
#[derive(Clone)]
struct Current {
    envelope: Envelope,
    replay: ReplayWindow,
    known: Option<(Session, Quantiser)>,
    tables: BTreeMap<u8, Box<Tables>>,
    /// Of the newest key.
    key: Option<u32>,
    /// When a packet last came, and the time of the newest frame then.
    heard: Timestamp,
    newest: Option<Timestamp>,
    count: u64,
    over: bool,
}

impl Current {
    fn new(envelope: Envelope, now: Timestamp) -> Self {
        Self {
            envelope,
            replay: ReplayWindow::default(),
            known: None,
            tables: BTreeMap::new(),
            key: None,
            heard: now,
            newest: None,
            count: 0,
            over: false,
        }
    }

    /// Opens and reads a packet. Where that fails, `self` is left half changed and must not be kept.
    fn take(&mut self, header: &Header, packet: &[u8], now: Timestamp) -> Result<Received, Ignored> {
        let content = self.envelope.open(header, packet)?;
        self.replay.note(header.sequence);
        self.count += 1;
        let waited = now.0.saturating_sub(self.heard.0).max(0);
        self.heard = self.heard.max(now);
        if header.end {
            if !content.is_empty() {
                return Err(Ignored::Damaged);
            }
            self.over = true;
            return Ok(Received::End);
        }
        let mut reader = Reader::new(&content)?;
        if header.key {
            let key = Key::get(&mut reader)?.ok_or(Ignored::OtherChannels)?;
            self.learn(header, &key)?;
        }
        let (Some((session, quantiser)), Some(tables)) = (&self.known, self.tables.get(&header.epoch)) else {
            return Err(Ignored::UnknownTables);
        };
        let group = Group::get(i64::from(header.time), tables, session.interval(), &mut reader)?;
        let frames: Vec<WireFrame> = group
            .0
            .iter()
            .map(|(time, levels)| quantiser.frame(Timestamp(time.saturating_mul(TICK)), levels))
            .collect();
        if let Some(last) = frames.last() {
            let ahead = AHEAD.saturating_add(waited);
            if self.newest.is_some_and(|newest| last.time.0.saturating_sub(newest.0) > ahead) {
                return Err(Ignored::Hasty);
            }
            self.newest = self.newest.max(Some(last.time));
        }
        Ok(Received::Frames(frames))
    }

    fn learn(&mut self, header: &Header, key: &Key) -> Result<(), Ignored> {
        match &self.known {
            Some((session, _)) if *session != key.session => return Err(Ignored::Contradiction),
            Some(_) => {}
            None => self.known = Some((key.session, Quantiser::new(key.session.precision))),
        }
        let epoch = header.epoch;
        if self.key.is_none_or(|newest| header.sequence > newest) {
            self.key = Some(header.sequence);
            // Epochs are counted anew after 256.
            self.tables.retain(|known, _| known.wrapping_sub(epoch).wrapping_add(2) < 4);
        }
        let following = key.next.map(|next| (epoch.wrapping_add(1), next));
        for (epoch, tables) in [(epoch, key.tables)].into_iter().chain(following) {
            if **self.tables.entry(epoch).or_insert_with(|| Box::new(tables)) != tables {
                return Err(Ignored::Contradiction);
            }
        }
        Ok(())
    }
}

/// Receives one session after another.
pub struct Decoder {
    key: Option<SecretKey>,
    current: Option<Current>,
    past: VecDeque<[u8; SALT]>,
}

impl Decoder {
    /// With a key, only what was sealed with it counts; without, only what is not sealed.
    pub fn new(key: Option<SecretKey>) -> Self {
        Self { key, current: None, past: VecDeque::new() }
    }

    /// Takes a datagram that came at `now`, on a clock that does not go back; of a file's packets 0 will do. What is
    /// ignored leaves everything as it was.
    pub fn receive(&mut self, packet: &[u8], now: Timestamp) -> Result<Received, Ignored> {
        let (header, salt) = Header::read(packet)?;
        match (header.sealed, &self.key) {
            (true, None) => return Err(Ignored::Sealed),
            (false, Some(_)) => return Err(Ignored::NotSealed),
            _ => {}
        }
        let is_current = |current: &&Current| {
            current.envelope.tag() == header.tag && salt.is_none_or(|salt| salt == *current.envelope.salt())
        };
        let (mut changed, follows) = match (self.current.as_ref().filter(is_current), salt) {
            (Some(current), _) => (current.clone(), false),
            (None, Some(salt)) if self.may_begin(&salt, now) => {
                (Current::new(Envelope::new(salt, self.key.as_ref()), now), true)
            }
            _ => return Err(Ignored::OtherSession),
        };
        if !changed.replay.is_new(header.sequence) {
            return Err(Ignored::Replayed);
        }
        let received = changed.take(&header, packet, now)?;
        let before = self.current.replace(changed).filter(|_| follows);
        if let Some(before) = before {
            self.past.push_back(*before.envelope.salt());
            while self.past.len() > MOST_PAST {
                self.past.pop_front();
            }
        }
        Ok(received)
    }

    fn may_begin(&self, salt: &[u8; SALT], now: Timestamp) -> bool {
        let free = self
            .current
            .as_ref()
            .is_none_or(|shown| shown.over || now.0.saturating_sub(shown.heard.0) > IDLE);
        free && !self.past.contains(salt)
    }

    /// What the session that is shown says of itself.
    pub fn session(&self) -> Option<&Session> {
        Some(&self.current.as_ref()?.known.as_ref()?.0)
    }

    /// Which session is shown: another one, another salt.
    pub fn salt(&self) -> Option<&[u8; SALT]> {
        self.current.as_ref().map(|current| current.envelope.salt())
    }

    /// Packets of the shown session that came, and the number of those that were sent up to the newest.
    pub fn counts(&self) -> (u64, u64) {
        let sent = |current: &Current| current.replay.newest().map_or(0, |newest| u64::from(newest) + 1);
        self.current.as_ref().map_or((0, 0), |current| (current.count, sent(current)))
    }
}
