//! Frames to packets and back: `cargo bench --bench wire`. One thread; a frame is a third of a packet.

use std::iter::repeat_with;

use divan::{Bencher, bench, counter::ItemsCount};
use understudy::{
    capture::{FrameRate, Timestamp},
    lift::FaceState,
    wire::{Decoder, Encoder, EncoderOptions, SecretKey, WireFrame, encode_take},
};

const RATE: FrameRate = FrameRate { numerator: 30, denominator: 1 };
/// Ten seconds.
const FRAMES: u64 = 300;

fn main() {
    divan::main();
}

/// A face that acts with a third of its muscles, and a head that moves.
fn act() -> Vec<WireFrame> {
    let frame = |index: u64| {
        let time = RATE.tick(index);
        let t = time.seconds();
        let mut frame = WireFrame { state: FaceState::Tracking, ..WireFrame::neutral(time) };
        for (k, value) in frame.contractions.iter_mut().enumerate().step_by(3) {
            *value = (t * (0.5 + 0.11 * k as f64) + k as f64).sin().max(0.0).powi(2);
        }
        for k in 0..3 {
            frame.head.angles[k] = 0.2 * (t + k as f64).sin();
            frame.head.shift[k] = 0.1 * (0.7 * t + k as f64).cos();
        }
        frame
    };
    (0..FRAMES).map(frame).collect()
}

fn options(sealed: bool) -> EncoderOptions {
    let key = sealed.then(|| SecretKey::new([7; 32]));
    EncoderOptions { key, ..EncoderOptions::new(RATE, [1; 16]) }
}

#[bench(args = [false, true])]
fn encode_ten_seconds(bencher: Bencher<'_, '_>, sealed: bool) {
    let frames = act();
    bencher
        .counter(ItemsCount::new(FRAMES))
        .with_inputs(|| Encoder::new(&options(sealed)))
        .bench_local_values(|mut encoder| {
            frames.iter().filter_map(|frame| encoder.push(frame).ok()).flatten().count()
        });
}

#[bench(args = [false, true])]
fn decode_ten_seconds(bencher: Bencher<'_, '_>, sealed: bool) {
    let packets = encode_take(&act(), &options(sealed), 1).unwrap_or_default();
    let key = || sealed.then(|| SecretKey::new([7; 32]));
    bencher.counter(ItemsCount::new(FRAMES)).with_inputs(|| Decoder::new(key())).bench_local_values(
        |mut decoder| packets.iter().map(|packet| decoder.receive(&packet.bytes, Timestamp(0))).count(),
    );
}

#[bench]
fn refuse_garbage(bencher: Bencher<'_, '_>) {
    let mut decoder = Decoder::new(None);
    let garbage: Vec<u8> = {
        let mut state = 1_u32;
        let next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        repeat_with(next).take(1000).collect()
    };
    bencher.bench_local(|| decoder.receive(&garbage, Timestamp(0)));
}
