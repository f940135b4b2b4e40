//! Frames in, packets out.

use std::collections::VecDeque;

use sha2::{Digest as _, Sha256};

use super::{
    Envelope, Header, SecretKey, WireError, WireFrame,
    entropy::Writer,
    group::{Group, MOST_FRAMES, MOST_INTERVAL},
    levels::{CHANNEL_COUNT, Levels, Quantiser, Steps},
    packet::{HEADER, MOST_PACKET, SALT},
    tables::{FIRST_TABLES, Key, Session, TICKS, Tables, fitting},
};
use crate::capture::{FrameRate, Timestamp};

/// A key is told again after this long, so that whoever joins sees a face within a second; tenths of a millisecond.
const KEY_INTERVAL: i64 = 9_000;
/// A packet does not wait longer for its last frame, tenths of a millisecond.
const MOST_WAIT: i64 = 2_500;
/// Packets from which tables are made: some eight seconds.
const WINDOW: usize = 128;
/// Fewer packets make no tables.
const FEWEST: usize = 5;
/// What a packet has room for, whichever its envelope.
const MOST_CONTENT: usize = MOST_PACKET - HEADER - SALT - 16;
/// Nanoseconds in a tenth of a millisecond.
const TICK: i64 = 1_000_000_000 / TICKS as i64;

/// How a performance is sent.
#[derive(Debug, Clone)]
pub struct EncoderOptions {
    /// How far one step of a channel moves the face, µm, root mean square.
    pub precision: u16,
    /// Frames in a packet, 1 to 8. All but the last wait for it.
    pub frames_per_packet: usize,
    /// The nominal rate.
    pub rate: FrameRate,
    /// Tells one performer's neutral from another's.
    pub neutral: u32,
    /// The session's own 16 bytes. With a key, never to be used for another performance.
    pub salt: [u8; SALT],
    /// With it, packets are encrypted.
    pub key: Option<SecretKey>,
}

impl EncoderOptions {
    /// µm.
    pub const PRECISION: u16 = 150;
    /// At 30 frames a second the first of three waits 67 ms.
    pub const FRAMES_PER_PACKET: usize = 3;

    /// The defaults for a rate and a session's salt, without a key.
    pub fn new(rate: FrameRate, salt: [u8; SALT]) -> Self {
        Self {
            precision: Self::PRECISION,
            frames_per_packet: Self::FRAMES_PER_PACKET,
            rate,
            neutral: 0,
            salt,
            key: None,
        }
    }
}

/// A packet and when its last frame was seen, which is when it can leave.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packet {
    /// Of its last frame.
    pub time: Timestamp,
    /// What is sent.
    pub bytes: Vec<u8>,
}

/// Sends one performance, frame after frame. The same frames give the same bytes.
pub struct Encoder {
    envelope: Envelope,
    quantiser: Quantiser,
    session: Session,
    frames_per_packet: usize,
    waiting: Vec<(i64, Steps)>,
    last: Option<Levels>,
    sequence: u32,
    epoch: u8,
    tables: Tables,
    next: Option<Tables>,
    key_due: i64,
    firsts: VecDeque<Levels>,
    laters: VecDeque<Levels>,
}

impl Encoder {
    /// A session's start.
    pub fn new(options: &EncoderOptions) -> Self {
        Self {
            envelope: Envelope::new(options.salt, options.key.as_ref()),
            quantiser: Quantiser::new(options.precision),
            session: Session { precision: options.precision, rate: options.rate, neutral: options.neutral },
            frames_per_packet: options.frames_per_packet.clamp(1, MOST_FRAMES),
            waiting: Vec::new(),
            last: None,
            sequence: 0,
            epoch: 0,
            tables: FIRST_TABLES,
            next: None,
            key_due: i64::MIN,
            firsts: VecDeque::new(),
            laters: VecDeque::new(),
        }
    }

    /// Takes the next frame; the packets that are ready then, none or one or two. Refuses frames that do not come after
    /// the one before, or more than 100 hours after the first.
    pub fn push(&mut self, frame: &WireFrame) -> Result<Vec<Packet>, WireError> {
        let refuse = |reason| Err(WireError::BadTime { seconds: frame.time.seconds(), reason });
        let time = (frame.time.0 + TICK / 2).div_euclid(TICK);
        if frame.time.0 < 0 || u32::try_from(time).is_err() {
            return refuse("times count from 0 to 100 hours");
        }
        let mut ready = Vec::new();
        if let (Some((first, _)), Some((before, _))) = (self.waiting.first(), self.waiting.last()) {
            if time <= *before {
                return refuse("it is not a tenth of a millisecond after the one before");
            }
            if time - first > MOST_WAIT.max(self.session.interval() * 2).min(MOST_INTERVAL) {
                ready.extend(self.flush());
            }
        }
        self.waiting.push((time, self.quantiser.steps(frame)));
        if self.waiting.len() == self.frames_per_packet {
            ready.extend(self.flush());
        }
        Ok(ready)
    }

    /// The packet of the frames that are still waiting, if any are; several where they do not fit into one.
    pub fn flush(&mut self) -> Vec<Packet> {
        let mut waiting = std::mem::take(&mut self.waiting);
        let mut ready = Vec::new();
        while let Some((first, _)) = waiting.first() {
            let key = (*first >= self.key_due).then(|| self.key(*first));
            let mut count = waiting.len();
            let (group, content) = loop {
                let group = Group::of(&waiting[..count], self.last.as_ref());
                let mut writer = Writer::default();
                if let Some(key) = &key {
                    key.put(&mut writer);
                }
                group.put(&self.tables, self.session.interval(), &mut writer);
                let content = writer.finish();
                // One frame always fits.
                if content.len() <= MOST_CONTENT || count == 1 {
                    break (group, content);
                }
                count /= 2;
            };
            waiting.drain(..count);
            self.remember(&group);
            let last = group.0.last().map_or(0, |(time, _)| *time);
            let bytes = self.close(key.is_some(), false, group.0[0].0 as u32, &content);
            ready.push(Packet { time: Timestamp(last * TICK), bytes });
        }
        ready
    }

    /// What a key at `time` says. The tables that the last one announced are used from here on.
    fn key(&mut self, time: i64) -> Key {
        self.key_due = time + KEY_INTERVAL;
        if let Some(next) = self.next.take() {
            self.tables = next;
            self.epoch = self.epoch.wrapping_add(1);
        }
        let fit = fitting(&self.tables, &self.firsts.iter(), &self.laters.iter());
        self.next = Some(fit).filter(|fit| *fit != self.tables && self.firsts.len() >= FEWEST);
        Key { session: self.session, tables: self.tables, next: self.next }
    }

    fn close(&mut self, key: bool, end: bool, time: u32, content: &[u8]) -> Vec<u8> {
        let (sequence, epoch) = (self.sequence, self.epoch);
        self.sequence = sequence.wrapping_add(1);
        let header = Header { key, sealed: false, end, epoch, tag: [0; 2], sequence, time };
        self.envelope.close(header, content)
    }

    /// Says that nothing follows. Where packets may be lost, it is said more than once.
    pub fn end(&mut self, time: Timestamp) -> Packet {
        let bytes = self.close(false, true, (time.0 / TICK) as u32, &[]);
        Packet { time, bytes }
    }

    fn remember(&mut self, group: &Group) {
        if let [(_, first), .., (_, last)] = group.0.as_slice() {
            self.laters.push_back(std::array::from_fn::<i32, CHANNEL_COUNT, _>(|k| last[k] - first[k]));
        }
        self.firsts.extend(group.0.first().map(|(_, levels)| *levels));
        self.last = group.0.last().map(|(_, levels)| *levels).or(self.last);
        for window in [&mut self.firsts, &mut self.laters] {
            while window.len() > WINDOW {
                window.pop_front();
            }
        }
    }
}

/// All packets of a take, and `ends` that say that nothing follows.
pub fn encode_take(
    frames: &[WireFrame],
    options: &EncoderOptions,
    ends: usize,
) -> Result<Vec<Packet>, WireError> {
    let mut encoder = Encoder::new(options);
    let mut packets = Vec::new();
    for frame in frames {
        packets.extend(encoder.push(frame)?);
    }
    packets.extend(encoder.flush());
    let end = frames.last().map_or(Timestamp(0), |frame| frame.time);
    packets.extend((0..ends).map(|_| encoder.end(end)));
    Ok(packets)
}

/// A salt that the same take, options and key have, and no other: files come out the same, and nothing is sealed twice
/// under one nonce.
pub fn file_salt(frames: &[WireFrame], options: &EncoderOptions) -> [u8; SALT] {
    let mut hash = Sha256::new();
    hash.update(b"understudy wire 1");
    hash.update(options.key.as_ref().map_or(&[0; 32], SecretKey::bytes));
    let EncoderOptions { precision, frames_per_packet, rate, neutral, .. } = options;
    for number in
        [u32::from(*precision), *frames_per_packet as u32, rate.numerator, rate.denominator, *neutral]
    {
        hash.update(number.to_be_bytes());
    }
    for frame in frames {
        hash.update(frame.time.0.to_be_bytes());
        hash.update(frame.state.name());
        for value in frame.contractions.iter().chain(&frame.head.angles).chain(&frame.head.shift) {
            hash.update(value.to_be_bytes());
        }
        for (_, state) in frame.appearance.unwrap_or_default().iter() {
            hash.update(state.unwrap_or(-1.0).to_be_bytes());
        }
    }
    let digest = hash.finalize();
    std::array::from_fn(|k| digest[k])
}
