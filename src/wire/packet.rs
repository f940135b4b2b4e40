//! The envelope of a packet: its header, and what keeps its content from being damaged, changed or read.
//!
//! ```text
//! 0   2  magic "uW"
//! 2   1  version (4 high bits: 1) and flags (1 key, 2 sealed, 4 end)
//! 3   1  epoch: which tables the content is written under
//! 4   2  tag: the first bytes of the session's salt
//! 6   4  sequence, from 0
//! 10  4  time of the first frame, tenths of a millisecond since the session's first
//! 14  16 salt, in keys alone
//!     n  content, encrypted where sealed
//!     4  CRC-32 of salt, header and content; or 16, Poly1305's tag, where sealed
//! ```
//!
//! Numbers are big-endian.

use chacha20poly1305::{KeyInit as _, Tag, XChaCha20Poly1305, XNonce, aead::AeadInOut as _};

use super::SecretKey;

/// Packets are never longer: they pass any network in one piece.
pub const MOST_PACKET: usize = 1200;
/// Bytes of the header that every packet has.
pub const HEADER: usize = 14;
/// Bytes that tell sessions apart, and that nobody has used before.
pub const SALT: usize = 16;

const MAGIC: [u8; 2] = *b"uW";
const VERSION: u8 = 1;
const KEY: u8 = 1;
const SEALED: u8 = 2;
const END: u8 = 4;
const CHECK: usize = 4;
const TAG: usize = 16;

/// What stands before the content, in clear.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Whether the content begins with the session's key, and the salt is told.
    pub key: bool,
    /// Whether it is encrypted.
    pub sealed: bool,
    /// Whether the session ends here; there is no content then.
    pub end: bool,
    /// Which tables the content is written under.
    pub epoch: u8,
    /// The first bytes of the salt.
    pub tag: [u8; 2],
    /// From 0.
    pub sequence: u32,
    /// Of the first frame, tenths of a millisecond since the session's first.
    pub time: u32,
}

/// What speaks against an envelope.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BadPacket {
    /// Too short, too long, or something else altogether.
    #[error("no packet of this program")]
    Foreign,
    /// Of another version.
    #[error("a packet of another version of the format")]
    Version,
    /// Damaged, changed, or sealed with another key.
    #[error("damaged, changed, or sealed with another key")]
    Damaged,
}

impl Header {
    fn write(&self, out: &mut Vec<u8>) {
        out.extend(MAGIC);
        let flags = [(self.key, KEY), (self.sealed, SEALED), (self.end, END)];
        let flags: u8 = flags.into_iter().filter(|(set, _)| *set).map(|(_, flag)| flag).sum();
        out.extend([VERSION << 4 | flags, self.epoch]);
        out.extend(self.tag);
        out.extend(self.sequence.to_be_bytes());
        out.extend(self.time.to_be_bytes());
    }

    /// Reads the header of a datagram, and the salt where it is told.
    pub fn read(packet: &[u8]) -> Result<(Self, Option<[u8; SALT]>), BadPacket> {
        let Some((&header, rest)) = packet.split_first_chunk::<HEADER>() else {
            return Err(BadPacket::Foreign);
        };
        let [m0, m1, kind, epoch, t0, t1, s0, s1, s2, s3, c0, c1, c2, c3] = header;
        if [m0, m1] != MAGIC || packet.len() > MOST_PACKET {
            return Err(BadPacket::Foreign);
        }
        if kind >> 4 != VERSION || kind & 0b1000 != 0 {
            return Err(BadPacket::Version);
        }
        let header = Self {
            key: kind & KEY != 0,
            sealed: kind & SEALED != 0,
            end: kind & END != 0,
            epoch,
            tag: [t0, t1],
            sequence: u32::from_be_bytes([s0, s1, s2, s3]),
            time: u32::from_be_bytes([c0, c1, c2, c3]),
        };
        let salt = if header.key { rest.first_chunk::<SALT>().copied() } else { None };
        let lacks_salt = header.key && salt.is_none_or(|salt| salt[..2] != header.tag);
        let lacks_end = rest.len() < header.overhead() - HEADER;
        if lacks_salt || lacks_end || (header.key && header.end) {
            return Err(BadPacket::Foreign);
        }
        Ok((header, salt))
    }

    fn start(&self) -> usize {
        HEADER + if self.key { SALT } else { 0 }
    }

    fn overhead(&self) -> usize {
        self.start() + if self.sealed { TAG } else { CHECK }
    }
}

/// Closes and opens the packets of one session.
#[derive(Clone)]
pub struct Envelope {
    salt: [u8; SALT],
    cipher: Option<XChaCha20Poly1305>,
}

impl Envelope {
    /// `salt` is the session's own; with a key, packets are encrypted and nobody else can make or change one.
    pub fn new(salt: [u8; SALT], key: Option<&SecretKey>) -> Self {
        Self { salt, cipher: key.map(|key| XChaCha20Poly1305::new(key.bytes().into())) }
    }

    /// The salt's first bytes, which tell packets of other sessions.
    pub fn tag(&self) -> [u8; 2] {
        [self.salt[0], self.salt[1]]
    }

    /// The session's salt.
    pub fn salt(&self) -> &[u8; SALT] {
        &self.salt
    }

    /// Whether packets are encrypted.
    pub fn seals(&self) -> bool {
        self.cipher.is_some()
    }

    /// Salt and sequence: no two packets of one key have the same.
    fn nonce(&self, sequence: u32) -> XNonce {
        let mut nonce = XNonce::default();
        nonce[..SALT].copy_from_slice(&self.salt);
        nonce[SALT..SALT + 4].copy_from_slice(&sequence.to_be_bytes());
        nonce
    }

    fn check(&self, packet: &[u8]) -> [u8; CHECK] {
        let mut hash = crc32fast::Hasher::new();
        hash.update(&self.salt);
        hash.update(packet);
        hash.finalize().to_be_bytes()
    }

    /// A whole packet. `header.tag` and `header.sealed` are set here.
    pub fn close(&self, header: Header, content: &[u8]) -> Vec<u8> {
        let header = Header { tag: self.tag(), sealed: self.seals(), ..header };
        let mut packet = Vec::with_capacity(header.overhead() + content.len());
        header.write(&mut packet);
        if header.key {
            packet.extend(self.salt);
        }
        packet.extend(content);
        match &self.cipher {
            None => packet.extend(self.check(&packet)),
            Some(cipher) => {
                let (clear, content) = packet.split_at_mut(header.start());
                // Fails at 256 GB alone.
                let nonce = self.nonce(header.sequence);
                if let Ok(tag) = cipher.encrypt_inout_detached(&nonce, clear, content.into()) {
                    packet.extend(tag);
                }
            }
        }
        packet
    }

    /// The content of a packet that is whole and was made by whoever has the key.
    pub fn open(&self, header: &Header, packet: &[u8]) -> Result<Vec<u8>, BadPacket> {
        if header.sealed != self.seals() || packet.len() < header.overhead() {
            return Err(BadPacket::Damaged);
        }
        let start = header.start();
        let Some(cipher) = &self.cipher else {
            let (packet, check) = packet.split_at(packet.len() - CHECK);
            let intact = check == self.check(packet);
            return if intact { Ok(packet[start..].to_vec()) } else { Err(BadPacket::Damaged) };
        };
        let (packet, tag) = packet.split_at(packet.len() - TAG);
        let (clear, content) = packet.split_at(start);
        let mut content = content.to_vec();
        let tag = Tag::try_from(tag).map_err(|_| BadPacket::Damaged)?;
        let nonce = self.nonce(header.sequence);
        let opened = cipher.decrypt_inout_detached(&nonce, clear, content.as_mut_slice().into(), &tag);
        opened.map(|()| content).map_err(|_| BadPacket::Damaged)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn header(key: bool, sequence: u32) -> Header {
        let (tag, end, sealed) = ([0; 2], false, false);
        Header { key, sealed, end, epoch: 3, tag, sequence, time: 77 }
    }

    fn envelopes() -> [Envelope; 2] {
        let key = SecretKey::new([9; 32]);
        [Envelope::new([7; SALT], None), Envelope::new([7; SALT], Some(&key))]
    }

    #[test]
    fn the_header_stands_where_it_is_documented() {
        let packet = envelopes()[0].close(header(true, 0x0102_0304), b"content");
        assert_eq!(packet[..14], *b"uW\x11\x03\x07\x07\x01\x02\x03\x04\0\0\0\x4d");
        assert_eq!(packet[14..30], [7; 16]);
        assert_eq!(packet[30..37], *b"content");
        assert_eq!(packet.len(), 41);
        let sealed = envelopes()[1].close(header(false, 1), b"content");
        assert_eq!((sealed[2], sealed.len()), (0x12, 14 + 7 + 16));
        assert!(!sealed.windows(7).any(|window| window == b"content"));
    }

    #[test]
    fn every_changed_bit_and_every_cut_is_found() {
        for envelope in envelopes() {
            for key in [false, true] {
                let packet = envelope.close(header(key, 5), b"the content");
                let open = |packet: &[u8]| {
                    let (header, _) = Header::read(packet)?;
                    envelope.open(&header, packet)
                };
                assert_eq!(open(&packet).unwrap(), b"the content");
                for bit in 0..packet.len() * 8 {
                    let mut changed = packet.clone();
                    changed[bit / 8] ^= 1 << (bit % 8);
                    assert!(open(&changed).is_err(), "bit {bit} of a key {key}");
                }
                for length in 0..packet.len() {
                    assert!(open(&packet[..length]).is_err(), "{length} bytes");
                }
            }
        }
    }

    #[test]
    fn another_key_another_salt_and_none_open_nothing() {
        let [open, sealed] = envelopes();
        let other = Envelope::new([7; SALT], Some(&SecretKey::new([8; 32])));
        let salted = Envelope::new([6; SALT], Some(&SecretKey::new([9; 32])));
        let packet = sealed.close(header(false, 5), b"the content");
        let (head, _) = Header::read(&packet).unwrap();
        assert!(sealed.open(&head, &packet).is_ok());
        for wrong in [&open, &other, &salted] {
            assert_eq!(wrong.open(&head, &packet), Err(BadPacket::Damaged));
        }
        let packet = open.close(header(false, 5), b"the content");
        let (head, _) = Header::read(&packet).unwrap();
        assert_eq!(sealed.open(&head, &packet), Err(BadPacket::Damaged));
    }

    #[test]
    fn the_cipher_is_the_published_one() {
        // draft-irtf-cfrg-xchacha-03, A.3.1: key, nonce, text and tag, here through the crate as the envelope uses it.
        let key: [u8; 32] = std::array::from_fn(|k| 0x80 + k as u8);
        let cipher = XChaCha20Poly1305::new((&key).into());
        let mut nonce = XNonce::default();
        for (to, byte) in nonce.iter_mut().zip(0x40_u8..0x58) {
            *to = byte;
        }
        let aad = [0x50, 0x51, 0x52, 0x53, 0xc0, 0xc1, 0xc2, 0xc3, 0xc4, 0xc5, 0xc6, 0xc7];
        let mut text =
            *b"Ladies and Gentlemen of the class of '99: If I could offer you only one tip for the \
                          future, sunscreen would be it.";
        let tag = cipher.encrypt_inout_detached(&nonce, &aad, text.as_mut_slice().into()).unwrap();
        assert_eq!(text[..4], [0xbd, 0x6d, 0x17, 0x9d]);
        let wanted =
            [0xc0, 0x87, 0x59, 0x24, 0xc1, 0xc7, 0x98, 0x79, 0x47, 0xde, 0xaf, 0xd8, 0x78, 0x0a, 0xcf, 0x49];
        assert_eq!(tag[..], wanted);
    }

    proptest! {
        #[test]
        fn garbage_is_refused(bytes in prop::collection::vec(any::<u8>(), 0..1500), magic in any::<bool>()) {
            let mut bytes = bytes;
            if magic && bytes.len() > 3 {
                bytes[..3].copy_from_slice(b"uW\x11");
            }
            if let Ok((header, _)) = Header::read(&bytes) {
                for envelope in envelopes() {
                    prop_assert_eq!(envelope.open(&header, &bytes), Err(BadPacket::Damaged));
                }
            }
        }
    }
}
