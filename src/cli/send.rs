//! `understudy send`: a performance in a few thousand bits a second.

use std::{
    net::SocketAddr,
    path::{Path, PathBuf},
};

use clap::Args;
use understudy::{
    appearance::{AppearanceStates, Skin},
    assets::Assets,
    export::Draft,
    muscle::{CurveMap, MuscleLift},
    pipeline::{LiftMode, neutral_hash, read_face_frame},
    wire::{
        EncoderOptions, Packet, SecretKey, WireFrame, encode_take, file_salt, random, udp, write_wire_file,
    },
};

use super::{Outcome, clip::ClipArgs, inputs, progress, skin::classify};

const EXAMPLES: &str = "\
Examples:
  understudy send clip.mp4 -o take.uwire
  understudy send clip.mp4 --to 7331                            to this machine
  understudy send clip.mp4 --to 192.168.1.20:7331 --key my.key
  understudy send clip.mp4 -o take.uwire --new-key my.key
  understudy send clip.mp4 -o take.uwire --skin me.skin         with wrinkles
  understudy send clip.mp4 -o small.uwire --precision 0.3 --frames-per-packet 4

What arrives is shown with `understudy receive`. docs/wire.md describes the packets.";

/// How often the end is told: any one of them may be lost.
const ENDS: usize = 3;

/// Send a performance over a thin wire, or into a file: contractions, gaze and head in a few kbit/s
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Send {
    #[command(flatten)]
    clip: ClipArgs,
    /// A file to keep the packets in, .uwire
    #[arg(short, long, value_name = "FILE.uwire", required_unless_present = "to")]
    output: Option<PathBuf>,
    /// Where to send them over UDP, at the clip's own pace: a port of this machine, or ADDRESS:PORT
    #[arg(long, value_name = "PORT", value_parser = udp::address)]
    to: Option<SocketAddr>,
    /// The performer's skin, from `learn-appearance`: the states of wrinkles are sent too
    #[arg(long, value_name = "FILE.skin")]
    skin: Option<PathBuf>,
    #[command(flatten)]
    key: KeyArgs,
    /// How coarsely motion is told, millimetres: what one step moves the face by
    #[arg(long, value_name = "MM", default_value = "0.15", value_parser = parse_precision)]
    precision: u16,
    /// Frames in a packet, 1 to 8: more need less rate, and all but the last wait for it
    #[arg(long, value_name = "N", default_value_t = EncoderOptions::FRAMES_PER_PACKET as u8,
          value_parser = clap::value_parser!(u8).range(1..=8))]
    frames_per_packet: u8,
}

/// How packets are sealed.
#[derive(Args)]
pub struct KeyArgs {
    /// Seal packets with the key in this file: nobody without it can read, make or change one
    #[arg(long, value_name = "FILE", conflicts_with = "new_key")]
    key: Option<PathBuf>,
    /// Make a key, write it to this file, and seal with it
    #[arg(long, value_name = "FILE")]
    new_key: Option<PathBuf>,
}

impl KeyArgs {
    /// The key that was asked for.
    pub fn secret(&self) -> Result<Option<SecretKey>, Box<dyn std::error::Error>> {
        if let Some(path) = &self.new_key {
            let key = SecretKey::random()?;
            key.write(path)?;
            return Ok(Some(key));
        }
        Ok(self.key.as_deref().map(SecretKey::read).transpose()?)
    }

    /// The file that is read.
    pub fn read(&self) -> Option<&Path> {
        self.key.as_deref()
    }

    /// The file that is made.
    pub fn made(&self) -> Option<&Path> {
        self.new_key.as_deref()
    }
}

fn parse_precision(text: &str) -> Result<u16, String> {
    let millimetres: Option<f64> = text.parse().ok().filter(|mm| (0.01..=2.0).contains(mm));
    millimetres
        .map(|mm| (mm * 1000.0).round() as u16)
        .ok_or_else(|| "write millimetres from 0.01 to 2".to_owned())
}

impl Send {
    pub fn run(&self, quiet: bool) -> Outcome {
        if let Some(path) = &self.output {
            if !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("uwire")) {
                return Err(format!("cannot write {}: name it .uwire", path.display()).into());
            }
            let read = [Some(self.clip.clip.as_path()), self.skin.as_deref(), self.key.read()];
            inputs::spare(path, &read.into_iter().flatten().collect::<Vec<_>>())?;
            drop(Draft::create(path)?);
        }
        drop(self.clip.open()?);
        let assets = Assets::locate()?;
        let mut networks = ClipArgs::networks(&assets)?;
        let lift = self.clip.lift(&mut networks)?;
        match &lift {
            LiftMode::Muscles(basis) if CurveMap::is_arkit(&MuscleLift::lifting(basis)) => {}
            LiftMode::Muscles(basis) => {
                let name = &basis.name;
                return Err(format!(
                    "the wire carries ARKit's contractions, and the basis {name} has other muscles. Take --basis arkit"
                )
                .into());
            }
            LiftMode::Plane => {
                return Err("--lift plane finds no contractions, which are what is sent. Leave it out".into());
            }
        }
        let skin = self.skin.as_deref().map(Skin::read).transpose()?;
        let key = self.key.secret()?;
        if let (Some(path), false) = (self.key.made(), quiet) {
            say!("wrote {}: whoever receives needs it, and nobody else should have it", path.display());
        }
        let mut take = self.clip.solve(&assets, networks, lift, quiet)?;
        let mut appearance: Vec<Option<AppearanceStates>> = Vec::new();
        if let Some(skin) = &skin {
            let frame = read_face_frame(&assets.verified("canonical_face")?)?;
            let frames = classify(&self.clip, &mut take, skin, &frame, quiet)?;
            appearance.extend(frames.iter().map(|frame| Some(frame.states)));
        }
        let frames = take.motion.wire_frames(&appearance)?;
        let options = EncoderOptions {
            precision: self.precision,
            frames_per_packet: usize::from(self.frames_per_packet),
            neutral: neutral_hash(&take.motion.performer),
            key,
            ..EncoderOptions::new(take.motion.info.rate, Default::default())
        };
        if let Some(path) = &self.output {
            let options = EncoderOptions { salt: file_salt(&frames, &options), ..options.clone() };
            let packets = encode_take(&frames, &options, 1)?;
            write_wire_file(path, &packets)?;
            if !quiet {
                say!("wrote {}: {}", path.display(), rates(&frames, &packets));
            }
        }
        if let Some(to) = self.to {
            let options = EncoderOptions { salt: random()?, ..options };
            let packets = encode_take(&frames, &options, ENDS)?;
            send(to, &frames, &packets, quiet)?;
        }
        if self.clip.timings {
            say!("{}", take.watch);
        }
        Ok(())
    }
}

fn send(to: SocketAddr, frames: &[WireFrame], packets: &[Packet], quiet: bool) -> Outcome {
    let mut sender = udp::Sender::new(to)?;
    if !quiet {
        say!("sending to {to}: {}", rates(frames, packets));
    }
    let bar = progress::count("sending", "packets", packets.len() as u64, quiet);
    for packet in packets {
        sender.send(packet);
        bar.inc(1);
    }
    bar.finish_and_clear();
    if sender.refused() > 0 {
        tracing::warn!(
            "{to}: {} of {} packets were refused: nobody listened there. Start `understudy receive --listen` first",
            sender.refused(),
            packets.len()
        );
    }
    Ok(())
}

/// What packets take, in words.
fn rates(frames: &[WireFrame], packets: &[Packet]) -> String {
    let bytes: usize = packets.iter().map(|packet| packet.bytes.len()).sum();
    let all = bytes + packets.len() * udp::HEADERS;
    let seconds = match frames {
        [first, .., last] => {
            (last.time.seconds() - first.time.seconds()) * frames.len() as f64 / (frames.len() - 1) as f64
        }
        _ => 1.0,
    };
    let rate = |bytes: usize| bytes as f64 * 8e-3 / seconds.max(1e-3);
    format!(
        "{} frames in {} packets, {bytes} bytes: {:.1} kbit/s, {:.1} with the headers of UDP and IP",
        frames.len(),
        packets.len(),
        rate(bytes),
        rate(all)
    )
}
