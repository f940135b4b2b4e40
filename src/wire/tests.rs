//! Encoder and decoder together: what comes back, and what losses, late joiners and hostile packets do.

use proptest::prelude::*;

use super::*;
use crate::{
    appearance::{AppearanceStates, Region},
    capture::{FrameRate, Timestamp},
    lift::FaceState,
};

const RATE: FrameRate = FrameRate { numerator: 30, denominator: 1 };
const KEY: [u8; 32] = [3; 32];
const EACH: usize = EncoderOptions::FRAMES_PER_PACKET;

/// A face that talks, blinks and nods.
fn act(count: u64) -> Vec<WireFrame> {
    let frame = |index: u64| {
        let time = RATE.tick(index);
        let t = time.seconds();
        let mut frame = WireFrame::neutral(time);
        frame.state = FaceState::Tracking;
        for (k, value) in frame.contractions.iter_mut().enumerate() {
            let k = k as f64;
            *value = if k % 3.0 == 0.0 { (t * (0.5 + 0.11 * k) + k).sin().max(0.0).powi(2) } else { 0.0 };
        }
        for k in 0..3 {
            frame.head.angles[k] = 0.2 * (t + k as f64).sin();
            frame.head.shift[k] = 0.1 * (0.7 * t + k as f64).cos();
        }
        frame
    };
    (0..count).map(frame).collect()
}

fn options(sealed: bool) -> EncoderOptions {
    let key = sealed.then(|| SecretKey::new(KEY));
    EncoderOptions { key, ..EncoderOptions::new(RATE, [5; SALT_BYTES]) }
}

fn packets(frames: &[WireFrame], sealed: bool) -> Vec<Vec<u8>> {
    encode_take(frames, &options(sealed), 1).unwrap().into_iter().map(|packet| packet.bytes).collect()
}

fn decoder(sealed: bool) -> Decoder {
    Decoder::new(sealed.then(|| SecretKey::new(KEY)))
}

fn play(decoder: &mut Decoder, packets: &[Vec<u8>]) -> Vec<WireFrame> {
    let mut timeline = Timeline::default();
    for packet in packets {
        if let Ok(Received::Frames(frames)) = decoder.receive(packet, Timestamp(0)) {
            timeline.extend(frames);
        }
    }
    timeline.frames().to_vec()
}

/// The farthest that a contraction is off, and an angle.
fn off(sent: &WireFrame, got: &WireFrame) -> [f64; 2] {
    let most = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    [most(&sent.contractions, &got.contractions), most(&sent.head.angles, &got.head.angles)]
}

#[test]
fn what_is_sent_arrives() {
    let frames = act(301);
    for sealed in [false, true] {
        let packets = packets(&frames, sealed);
        let mut decoder = decoder(sealed);
        let got = play(&mut decoder, &packets);
        assert_eq!(got.len(), frames.len());
        for (sent, got) in frames.iter().zip(&got) {
            assert!((sent.time.0 - got.time.0).abs() <= 50_000, "{} {}", sent.time.0, got.time.0);
            let [contraction, angle] = off(sent, got);
            // The coarsest step, and what rounding of the place between adds.
            assert!(contraction <= 0.11 && angle < 0.003, "{contraction} {angle}");
            assert_eq!((got.state, got.appearance), (FaceState::Tracking, None));
        }
        assert_eq!(decoder.counts(), (packets.len() as u64, packets.len() as u64));
        assert_eq!(decoder.session().unwrap().rate, RATE);
        assert_eq!(packets, self::packets(&frames, sealed), "another run, other bytes");
    }
}

#[test]
fn a_still_face_costs_its_envelopes_and_skin_that_is_not_told_nothing() {
    let mut still: Vec<_> = act(1).into_iter().cycle().take(600).collect();
    for (k, frame) in (0..).zip(&mut still) {
        frame.time = RATE.tick(k);
    }
    let size = |frames: &[WireFrame]| packets(frames, false).iter().map(Vec::len).sum::<usize>();
    let quiet = size(&still);
    let envelopes = 600 / EACH * (HEADER_BYTES + 4);
    assert!(quiet < envelopes + 3500, "{quiet} bytes, {envelopes} of them envelopes");
    // Skin that is told and does not change costs little more.
    let mut skin = AppearanceStates::default();
    for region in Region::ALL {
        skin.set(region, Some(0.4));
    }
    for frame in &mut still {
        frame.appearance = Some(skin);
    }
    let told = size(&still);
    println!("{quiet} bytes still, {told} with skin, {envelopes} of envelopes");
    assert!(told < quiet + 1200, "{told} bytes where {quiet} were");
    let got = play(&mut decoder(false), &packets(&still, false));
    assert_eq!(got[599].appearance.unwrap(), skin);
}

#[test]
fn whoever_joins_late_sees_a_face_within_a_second() {
    let frames = act(300);
    for sealed in [false, true] {
        let packets = packets(&frames, sealed);
        for joined in 0..250 / EACH {
            let got = play(&mut decoder(sealed), &packets[joined..]);
            let missed = got[0].time.seconds() - frames[EACH * joined].time.seconds();
            assert!(missed < 0.91, "joined at packet {joined}, saw a face {missed} s later");
            // From then on nothing is missing.
            assert_eq!(got.len(), frames.len() - (got[0].time.seconds() * 30.0).round() as usize);
        }
    }
}

#[test]
fn a_lost_packet_takes_its_own_frames_alone() {
    let frames = act(300);
    let packets = packets(&frames, false);
    let whole = play(&mut decoder(false), &packets);
    // Every packet but the first, in turn; keys too, whose tables were announced.
    for lost in 1..packets.len() - 1 {
        let mut left = packets.clone();
        left.remove(lost);
        let got = play(&mut decoder(false), &left);
        let wanted: Vec<_> = whole
            .iter()
            .enumerate()
            .filter(|(k, _)| k / EACH != lost)
            .map(|(_, frame)| frame.clone())
            .collect();
        assert!(got == wanted, "packet {lost}");
    }
}

#[test]
fn a_key_is_missed_once_and_not_twice() {
    let frames = act(600);
    let packets = packets(&frames, false);
    let keys: Vec<usize> = (0..packets.len()).filter(|k| packets[*k][2] & 1 == 1).collect();
    let changes = keys.iter().filter(|k| packets[**k][3] != packets[*k - usize::from(**k > 0)][3]).count();
    assert!(keys.len() >= 20 && changes > 0, "{} keys, {changes} changes of tables", keys.len());
    let mut decoder = decoder(false);
    let mut unknown = 0;
    for (k, packet) in packets.iter().enumerate() {
        if keys[1..3].contains(&k) {
            continue;
        }
        match decoder.receive(packet, Timestamp(0)) {
            Err(Ignored::UnknownTables) => unknown += 1,
            received => assert!(received.is_ok(), "{received:?}"),
        }
    }
    // Up to the next key, and no further.
    assert!(unknown <= keys[3] - keys[1], "{unknown} packets");
}

#[test]
fn order_and_repetition_change_nothing() {
    let frames = act(200);
    let packets = packets(&frames, true);
    let whole = play(&mut decoder(true), &packets);
    let mut stirred = packets.clone();
    for k in (1..stirred.len() - 4).step_by(7) {
        stirred.swap(k, k + 3);
    }
    let twice: Vec<_> = stirred.iter().flat_map(|packet| [packet.clone(), packet.clone()]).collect();
    let mut decoder = decoder(true);
    assert!(play(&mut decoder, &twice) == whole);
    for packet in &packets {
        assert_eq!(decoder.receive(packet, Timestamp(0)), Err(Ignored::Replayed));
    }
}

#[test]
fn sessions_follow_each_other_and_do_not_come_back() {
    let frames = act(60);
    let of = |salt: u8| {
        let options = EncoderOptions { salt: [salt; SALT_BYTES], ..options(true) };
        let packets = encode_take(&frames, &options, 1).unwrap();
        packets.into_iter().map(|packet| packet.bytes).collect::<Vec<_>>()
    };
    let (first, second) = (of(1), of(2));
    let mut decoder = decoder(true);
    let at = |seconds: i64| Timestamp(seconds * 1_000_000_000);
    assert!(matches!(decoder.receive(&first[0], at(0)), Ok(Received::Frames(_))));
    // While one is shown, another has to wait.
    assert_eq!(decoder.receive(&second[0], at(1)), Err(Ignored::OtherSession));
    assert!(decoder.receive(&first[1], at(1)).is_ok());
    // It may follow after a silence.
    assert!(decoder.receive(&second[0], at(4)).is_ok());
    assert_eq!(decoder.receive(&first[2], at(4)), Err(Ignored::OtherSession));
    assert_eq!(decoder.receive(&first[0], at(9)), Err(Ignored::OtherSession));
    // Or after an end, at once; what is over stays so.
    assert_eq!(decoder.receive(second.last().unwrap(), at(9)), Ok(Received::End));
    assert!(decoder.receive(&of(3)[0], at(9)).is_ok());
    assert_eq!(decoder.receive(&second[0], at(20)), Err(Ignored::OtherSession));
}

#[test]
fn the_wrong_ends_of_a_seal_hear_nothing() {
    let frames = act(21);
    let (open, sealed) = (packets(&frames, false), packets(&frames, true));
    let with = |key: u8| Decoder::new(Some(SecretKey::new([key; 32])));
    for packet in &sealed {
        assert_eq!(decoder(false).receive(packet, Timestamp(0)), Err(Ignored::Sealed));
    }
    assert_eq!(with(4).receive(&sealed[0], Timestamp(0)), Err(Ignored::Damaged));
    assert_eq!(with(3).receive(&open[0], Timestamp(0)), Err(Ignored::NotSealed));
    // One session, of which an end of the other kind is told by somebody else.
    let mut decoder = with(3);
    assert!(decoder.receive(&sealed[0], Timestamp(0)).is_ok());
    assert_eq!(decoder.receive(open.last().unwrap(), Timestamp(0)), Err(Ignored::NotSealed));
}

#[test]
fn times_that_cannot_be_are_refused() {
    let mut encoder = Encoder::new(&options(false));
    let mut frame = act(1).remove(0);
    frame.time = Timestamp(-1_000_000);
    assert!(encoder.push(&frame).is_err());
    frame.time = Timestamp(1_000_000_000);
    assert!(encoder.push(&frame).is_ok());
    let said = encoder.push(&frame).unwrap_err().to_string();
    assert!(said.contains("1 s"), "{said}");
    frame.time = Timestamp(500 * 3600 * 1_000_000_000);
    assert!(encoder.push(&frame).unwrap_err().to_string().contains("100 hours"));
    // A packet far ahead of its time is hostile, unless as much time has passed.
    let mut encoder = Encoder::new(&options(false));
    let mut sent = Vec::new();
    for seconds in [0, 1, 5000, 5001] {
        frame.time = Timestamp(seconds * 1_000_000_000);
        sent.extend(encoder.push(&frame).unwrap());
        sent.extend(encoder.flush());
    }
    let mut decoder = decoder(false);
    assert!(decoder.receive(&sent[0].bytes, Timestamp(0)).is_ok());
    assert_eq!(decoder.receive(&sent[2].bytes, Timestamp(0)), Err(Ignored::Hasty));
    assert!(decoder.receive(&sent[1].bytes, Timestamp(1_000_000_000)).is_ok());
    assert!(decoder.receive(&sent[2].bytes, Timestamp(5000 * 1_000_000_000)).is_ok());
}

/// Packets whose envelopes are sound and whose contents are not.
fn forged(base: &[u8], content: &[u8], sequence: u32) -> Vec<u8> {
    let (header, salt) = Header::read(base).unwrap();
    let envelope = Envelope::new(salt.unwrap_or([5; SALT_BYTES]), None);
    envelope.close(Header { sequence, ..header }, content)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn nothing_that_is_not_genuine_changes_anything(
        at in 0_usize..40,
        noise in prop::collection::vec((any::<prop::sample::Index>(), 1_u8..=255), 1..4),
        garbage in prop::collection::vec(any::<u8>(), 0..1400),
        content in prop::collection::vec(any::<u8>(), 0..300),
        sealed in any::<bool>(),
    ) {
        let frames = act(100);
        let packets = packets(&frames, sealed);
        let whole = play(&mut decoder(sealed), &packets);
        let mut decoder = decoder(sealed);
        let mut got = Timeline::default();
        for (k, packet) in packets.iter().enumerate() {
            if k >= at {
                let mut changed = packet.clone();
                for (place, bits) in &noise {
                    let place = place.index(changed.len());
                    changed[place] ^= bits;
                }
                let long = [packet.as_slice(), &[0; MOST_PACKET]].concat();
                let mut with_magic = garbage.clone();
                with_magic.splice(0..0, packet[..6].iter().copied());
                for hostile in [&changed, &garbage, &with_magic, &long, &packet[..packet.len() / 2].to_vec()] {
                    if hostile != packet {
                        prop_assert!(decoder.receive(hostile, Timestamp(0)).is_err());
                    }
                }
                if !sealed {
                    // What is forged well enough may be shown, and must not panic; the genuine one is then a replay.
                    let mut other = Decoder::new(None);
                    let _ = other.receive(&packets[0], Timestamp(0));
                    let _ = other.receive(&forged(packet, &content, 1000 + k as u32), Timestamp(0));
                }
            }
            if let Ok(Received::Frames(frames)) = decoder.receive(packet, Timestamp(0)) {
                got.extend(frames);
            }
        }
        prop_assert!(got.frames() == whole);
    }

    #[test]
    fn any_times_and_values_make_the_way(
        steps in prop::collection::vec((1_i64..400, prop::option::weighted(0.3, -2.0_f64..3.0)), 1..60),
        frames_per_packet in 1_usize..=8,
        precision in 1_u16..2000,
    ) {
        let mut now = 0;
        let mut frames = Vec::new();
        for (milliseconds, value) in &steps {
            let mut frame = WireFrame::neutral(Timestamp(now));
            frame.contractions.fill(value.unwrap_or(0.0));
            frame.head.shift[1] = value.unwrap_or(0.0);
            frames.push(frame);
            now += milliseconds * 1_000_000;
        }
        let options = EncoderOptions { precision, frames_per_packet, ..options(false) };
        let packets = encode_take(&frames, &options, 1).unwrap();
        let packets: Vec<_> = packets.into_iter().map(|packet| packet.bytes).collect();
        prop_assert!(packets.iter().all(|packet| packet.len() <= MOST_PACKET));
        let got = play(&mut decoder(false), &packets);
        prop_assert_eq!(got.len(), frames.len());
        for (sent, got) in frames.iter().zip(&got) {
            prop_assert_eq!(sent.time, got.time);
            let [contraction, angle] = off(sent, got);
            prop_assert!(contraction <= 0.151 && angle <= 0.04);
        }
    }
}
