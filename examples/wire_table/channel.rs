//! A way from sender to receiver: how it is coded, what is lost, and what is shown when.

use std::error::Error;

use understudy::{
    capture::Timestamp,
    wire::{Decoder, EncoderOptions, Packet, Received, SecretKey, Timeline, WireFrame, encode_take},
};

use crate::take::RATE;

/// When a frame is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum View {
    /// As soon as the packet that should bring it is due, whether it came or not.
    Live,
    /// When all that ever comes is there.
    Recorded,
}

/// One setting.
#[derive(Debug, Clone, Copy)]
pub struct Channel {
    /// µm.
    pub precision: u16,
    /// In a packet.
    pub frames: usize,
    /// Of a thousand packets.
    pub loss: u32,
    pub view: View,
}

impl Channel {
    pub const DEFAULT: Self = Self {
        precision: EncoderOptions::PRECISION,
        frames: EncoderOptions::FRAMES_PER_PACKET,
        loss: 0,
        view: View::Live,
    };

    /// Seconds for which the first frame of a packet waits for the last.
    pub fn delay(&self) -> f64 {
        (self.frames - 1) as f64 / RATE.per_second()
    }
}

/// The far end.
pub struct Far {
    packets: Vec<Packet>,
    next: usize,
    decoder: Decoder,
    timeline: Timeline,
    channel: Channel,
    chance: u32,
    /// Bytes of all packets, and of the same ones sealed.
    pub bytes: [usize; 2],
    pub count: usize,
}

impl Far {
    pub fn of(channel: Channel, frames: &[WireFrame]) -> Result<Self, Box<dyn Error>> {
        let open = EncoderOptions {
            precision: channel.precision,
            frames_per_packet: channel.frames,
            ..EncoderOptions::new(RATE, [1; 16])
        };
        let sealed = EncoderOptions { key: Some(SecretKey::new([1; 32])), ..open.clone() };
        let bytes = |packets: &[Packet]| packets.iter().map(|packet| packet.bytes.len()).sum();
        let packets = encode_take(frames, &open, 1)?;
        let bytes = [bytes(&packets), bytes(&encode_take(frames, &sealed, 1)?)];
        Ok(Self {
            bytes,
            count: packets.len(),
            packets,
            next: 0,
            decoder: Decoder::new(None),
            timeline: Timeline::default(),
            channel,
            chance: 12345,
        })
    }

    /// The frame that is shown for the moment `time` of the performance.
    pub fn show(&mut self, time: Timestamp) -> WireFrame {
        // A tenth of a millisecond is lost to rounding.
        let due = time.0 + (self.channel.delay() * 1e9) as i64 + 200_000;
        while let Some(packet) = self.packets.get(self.next) {
            if self.channel.view == View::Live && packet.time.0 > due {
                break;
            }
            self.next += 1;
            self.chance = self.chance.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let is_lost = (self.chance >> 8) % 1000 < self.channel.loss;
            // The first packet arrives: who joins is another question.
            if is_lost && self.next > 1 {
                continue;
            }
            if let Ok(Received::Frames(frames)) = self.decoder.receive(&packet.bytes, packet.time) {
                self.timeline.extend(frames);
            }
        }
        if self.channel.view == View::Live {
            self.timeline.forget_before(Timestamp(time.0 - 2_000_000_000));
        }
        self.timeline.show(Timestamp((time.0 + 50_000) / 100_000 * 100_000))
    }
}
