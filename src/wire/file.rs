//! Packets in a file: `uwire 1` and a line's end, then each packet after its length in two bytes, big-endian.

use std::{fs, path::Path};

use super::{Decoder, Ignored, MOST_PACKET, Packet, Received, SecretKey, Timeline, WireError};
use crate::{capture::Timestamp, export::Draft};

const MAGIC: &[u8] = b"uwire 1\n";
/// At a thousand bytes a second, days.
const MOST_BYTES: u64 = 1 << 28;

/// Writes packets beside their place, then renames.
pub fn write_wire_file<'a>(
    path: &Path,
    packets: impl IntoIterator<Item = &'a Packet>,
) -> Result<(), WireError> {
    let mut draft = Draft::create(path)?;
    draft.append(MAGIC)?;
    for packet in packets {
        draft.append(&(packet.bytes.len() as u16).to_be_bytes())?;
        draft.append(&packet.bytes)?;
    }
    Ok(draft.commit()?)
}

/// The packets of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WireFile {
    /// In their order, unopened.
    pub packets: Vec<Vec<u8>>,
    /// What stands behind the last whole packet, bytes; 0 where the file is whole.
    pub beyond: usize,
}

/// What the packets of a file show.
#[derive(Debug, Clone)]
pub struct Opened {
    /// The frames.
    pub timeline: Timeline,
    /// The session.
    pub session: super::Session,
    /// Packets that were ignored, and why the first one was.
    pub ignored: Option<(usize, Ignored)>,
    /// Whether the sender said that nothing follows.
    pub ended: bool,
}

impl WireFile {
    /// Reads a file. One that was cut off gives its whole packets.
    pub fn read(path: &Path) -> Result<Self, WireError> {
        let fail = |source| WireError::Read { path: path.into(), source };
        let wrong = |reason: &str| WireError::NoWireFile { path: path.into(), reason: reason.into() };
        if fs::metadata(path).map_err(fail)?.len() > MOST_BYTES {
            return Err(wrong("it is far too large"));
        }
        Self::parse(&fs::read(path).map_err(fail)?)
            .ok_or_else(|| wrong("it does not begin as such a file does"))
    }

    /// The packets of a file's bytes; `None` where they do not begin as a file's do.
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let mut rest = bytes.strip_prefix(MAGIC)?;
        let mut packets = Vec::new();
        while let Some((length, after)) = rest.split_first_chunk::<2>() {
            let length = usize::from(u16::from_be_bytes(*length));
            if length == 0 || length > MOST_PACKET || length > after.len() {
                break;
            }
            let (packet, after) = after.split_at(length);
            packets.push(packet.to_vec());
            rest = after;
        }
        Some(Self { packets, beyond: rest.len() })
    }

    /// Opens the packets; `path` is for messages. Refuses a file of which nothing can be shown.
    pub fn open(&self, path: &Path, key: Option<&SecretKey>) -> Result<Opened, WireError> {
        let mut decoder = Decoder::new(key.cloned());
        let (mut timeline, mut ignored, mut ended) = (Timeline::default(), None, false);
        for packet in &self.packets {
            match decoder.receive(packet, Timestamp(0)) {
                Ok(Received::Frames(frames)) => timeline.extend(frames),
                Ok(Received::End) => ended = true,
                Err(reason) => {
                    let (count, first) = ignored.unwrap_or((0, reason));
                    ignored = Some((count + 1, first));
                }
            }
        }
        match decoder.session() {
            Some(session) if !timeline.frames().is_empty() => {
                Ok(Opened { timeline, session: *session, ignored, ended })
            }
            _ => Err(WireError::NothingToShow {
                path: path.into(),
                packets: self.packets.len(),
                reason: ignored.map_or("it is empty".into(), |(_, reason)| format!("they are {reason}")),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_file_that_is_cut_gives_its_whole_packets() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("take.uwire");
        let packet = |bytes: &[u8]| Packet { time: Timestamp(0), bytes: bytes.to_vec() };
        write_wire_file(&path, &[packet(b"one"), packet(b"three")]).unwrap();
        let bytes = fs::read(&path).unwrap();
        assert_eq!(bytes, b"uwire 1\n\0\x03one\0\x05three");
        for length in 0..=bytes.len() {
            let parsed = WireFile::parse(&bytes[..length]);
            let whole = match length {
                ..8 => {
                    assert_eq!(parsed, None);
                    continue;
                }
                8..13 => 0,
                13..20 => 1,
                _ => 2,
            };
            let parsed = parsed.unwrap();
            assert_eq!(parsed.packets.len(), whole, "{length} bytes");
            assert_eq!(parsed.beyond == 0, matches!(length, 8 | 13 | 20), "{length} bytes");
        }
        fs::write(&path, "v 1 2 3").unwrap();
        let said = WireFile::read(&path).unwrap_err().to_string();
        assert!(said.contains("take.uwire") && said.contains("understudy send"), "{said}");
    }

    proptest! {
        #[test]
        fn any_bytes_are_a_file_or_none(bytes in prop::collection::vec(any::<u8>(), 0..4000)) {
            let mut whole = MAGIC.to_vec();
            whole.extend(bytes);
            let file = WireFile::parse(&whole).unwrap();
            prop_assert!(file.open("x".as_ref(), None).is_err());
        }
    }
}
