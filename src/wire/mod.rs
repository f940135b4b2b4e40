//! The thin wire: a performance in a few thousand bits a second, after 002 §VI.
//!
//! Contractions of muscles, the head's motion and the states of the skin are what a face is made of anew at the far end,
//! on whichever scan stands there. `docs/wire.md` describes the format byte by byte and what it does not protect from;
//! `docs/benchmarks/wire.md` says what it costs.
//!
//! [`Encoder`] turns frames into packets and [`Decoder`] packets into frames; [`Timeline`] shows a face at any moment,
//! where packets are missing too. [`WireFile`] keeps packets in a file, [`udp`] sends and receives them.

mod decoder;
mod encoder;
mod entropy;
mod error;
mod file;
mod frame;
mod group;
mod head;
mod key;
mod levels;
mod packet;
mod replay;
mod tables;
mod timeline;
pub mod udp;

pub use decoder::{Decoder, Ignored, Received};
pub use encoder::{Encoder, EncoderOptions, Packet, encode_take, file_salt};
pub use entropy::Damaged;
pub use error::WireError;
pub use file::{Opened, WireFile, write_wire_file};
pub use frame::{MUSCLE_COUNT, WireFrame};
pub use head::{HeadMeter, HeadMove};
pub use key::{SecretKey, random};
pub use levels::CHANNEL_COUNT;
pub use packet::{BadPacket, HEADER as HEADER_BYTES, MOST_PACKET, SALT as SALT_BYTES};
pub use tables::Session;
pub use timeline::Timeline;

use packet::{Envelope, Header};

#[cfg(test)]
mod tests;
