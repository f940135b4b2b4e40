//! `understudy receive`: what was sent over the wire, on a scan.

use std::{
    net::SocketAddr,
    path::{Path, PathBuf},
    time::Duration,
};

use clap::Args;
use understudy::{
    assets::Assets,
    capture::FrameRate,
    export::{Draft, write_muscle_csv},
    pipeline::{Networks, PlayedTake, Target, WirePlay, wire_curves},
    rig::WarpKind,
    tracking::TrackerOptions,
    view::Gpu,
    wire::{Decoder, Timeline, WireFile, udp},
};

use super::{
    Outcome,
    curve_files::CurveFile,
    express::{Kind, write_take},
    inputs,
    method::MethodArgs,
    progress,
    send::KeyArgs,
    skin::SkinArgs,
    target::{ScanArgs, parse_size},
};

const EXAMPLES: &str = "\
Examples:
  understudy receive take.uwire --target scan.obj -o avatar.mp4 -o avatar.glb
  understudy receive take.uwire --target scan.obj --skin me.skin -o avatar.mp4
  understudy receive --listen 7331 --target scan.obj -o avatar.mp4
  understudy receive --listen 0.0.0.0:7331 --key my.key --seconds 60 -o take.muscles.csv
  understudy receive --new-key my.key

Without an address, --listen hears this machine alone. Whoever can reach another address can send to it: give --key, which
`send` and `receive` must share.

Outputs:
  .mp4  a film                     .png  a sheet of moments
  .glb  morph targets              .obj  the last moment
  .pc2  every vertex of every frame
  .muscles.csv  the contractions that arrived; needs no --target";

/// Receive a performance from a file or over UDP, and show it on a scan
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Receive {
    /// A file that `send` wrote
    #[arg(value_name = "FILE.uwire", conflicts_with = "listen")]
    file: Option<PathBuf>,
    /// Where to listen: a port of this machine, or ADDRESS:PORT; port 0 is any free one
    #[arg(long, value_name = "PORT", value_parser = udp::address)]
    listen: Option<SocketAddr>,
    /// The scan: .obj, .ply, .stl, .glb or .gltf
    #[arg(short, long, value_name = "SCAN")]
    target: Option<PathBuf>,
    #[command(flatten)]
    scan: ScanArgs,
    /// What to write, by extension: .mp4, .glb, .pc2, .png, .obj, .muscles.csv; may be given several times
    #[arg(short, long, value_name = "FILE", required_unless_present = "new_key")]
    output: Vec<PathBuf>,
    #[command(flatten)]
    skin: SkinArgs,
    #[command(flatten)]
    key: KeyArgs,
    /// Stop this long after the first frame; without it when the sender is done or silent
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, requires = "listen")]
    seconds: Option<Duration>,
    /// How long to wait for a sender
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = parse_seconds)]
    wait: Duration,
    /// A sender that is silent for this long is done
    #[arg(long, value_name = "SECONDS", default_value = "5", value_parser = parse_seconds)]
    idle: Duration,
    #[command(flatten)]
    method: MethodArgs,
    /// Leave lips and eyes as they were scanned; outputs then have the scan's own mesh
    #[arg(long)]
    as_scanned: bool,
    /// Width and height of pictures, even numbers
    #[arg(long, value_name = "WxH", default_value = "720x720", value_parser = parse_size)]
    size: [u32; 2],
}

/// A scan, and what draws it.
struct Scene {
    target: Target,
    gpu: Gpu,
}

/// What came, and at which nominal rate.
struct Heard {
    timeline: Timeline,
    rate: FrameRate,
}

fn parse_seconds(text: &str) -> Result<Duration, String> {
    let seconds: Option<f64> = text.parse().ok().filter(|seconds| (0.1..=86_400.0).contains(seconds));
    seconds.map(Duration::from_secs_f64).ok_or_else(|| "write seconds from 0.1 to 86400".to_owned())
}

impl Receive {
    pub fn run(&self, quiet: bool) -> Outcome {
        let (curves, shown) = self.outputs()?;
        if self.output.is_empty() {
            self.key.secret()?;
            if let (Some(path), false) = (self.key.made(), quiet) {
                say!("wrote {}: `send --key` needs it, and nobody else should have it", path.display());
            }
            return Ok(());
        }
        if self.file.is_none() && self.listen.is_none() {
            return Err(
                "name a file that `understudy send` wrote, or listen for one with --listen PORT".into()
            );
        }
        let key = self.key.secret()?;
        // What is wrong with a file or a port shows before the scan is worked on.
        let file = self
            .file
            .as_deref()
            .map(|path| Ok::<_, Box<dyn std::error::Error>>((path, WireFile::read(path)?)));
        let file = file.transpose()?;
        let listener = self.listen.map(udp::Listener::bind).transpose()?;
        let opened = file.as_ref().map(|(path, file)| file.open(path, key.as_ref())).transpose()?;
        let skin = if self.skin.path().is_some() { self.skin.read(&Assets::locate()?)? } else { None };
        let scene = if shown.is_empty() { None } else { Some(self.scene(quiet)?) };
        let mut heard = None;
        if let (Some((path, file)), Some(opened)) = (file, opened) {
            if file.beyond > 0 {
                tracing::warn!(
                    "{}: it was cut off; {} whole packets are shown, and {} bytes are not",
                    path.display(),
                    file.packets.len(),
                    file.beyond
                );
            }
            if let Some((count, first)) = opened.ignored {
                tracing::warn!("{}: {count} packets are ignored: {first}", path.display());
            }
            if !quiet {
                say!("{}: {} frames", path.display(), opened.timeline.frames().len());
            }
            heard = Some(Heard { timeline: opened.timeline, rate: opened.session.rate });
        } else if let Some(listener) = listener {
            heard = Some(self.hear(&listener, Decoder::new(key), quiet)?);
        }
        let Some(heard) = heard else { return Ok(()) };
        for path in &curves {
            write_muscle_csv(path, &wire_curves(&heard.timeline, heard.rate)?)?;
            if !quiet {
                say!("wrote {}", path.display());
            }
        }
        if let Some(Scene { target, gpu }) = scene {
            let play = WirePlay::new(heard.timeline, heard.rate, &target, self.method.method())?;
            let level = *play.level();
            let relief = skin.as_ref().map(|skin| skin.relief(&target)).transpose()?.unwrap_or_default();
            let take = PlayedTake { target: &target, play: &play, rate: heard.rate, relief: &relief };
            write_take(&take, &level, self.size, &gpu, skin.as_ref(), &shown, quiet)?;
        }
        Ok(())
    }

    /// Listens until the session is over.
    fn hear(
        &self,
        listener: &udp::Listener,
        mut decoder: Decoder,
        quiet: bool,
    ) -> Result<Heard, Box<dyn std::error::Error>> {
        let address = listener.address();
        if !quiet {
            say!("listening at {address}");
        }
        if !address.ip().is_loopback() && self.key.read().or(self.key.made()).is_none() {
            tracing::warn!("whoever reaches {address} can send a face, for want of --key");
        }
        let limits = udp::Limits { wait: self.wait, idle: self.idle, longest: self.seconds };
        let bar = progress::bar("receiving", None, quiet);
        let collected = listener.collect(&mut decoder, limits, |frames| bar.set_position(frames))?;
        bar.finish_and_clear();
        for (reason, count) in &collected.ignored {
            tracing::warn!("{address}: {count} packets are ignored: {reason}");
        }
        let (came, sent) = decoder.counts();
        if !quiet {
            let frames = collected.timeline.frames().len();
            let end = if collected.ended {
                "the sender is done"
            } else {
                "stopped before the sender said that it is done"
            };
            say!("{frames} frames in {came} of {sent} packets; {end}");
        }
        let rate = decoder.session().map_or(FrameRate::nearest(30.0), |session| session.rate);
        Ok(Heard { timeline: collected.timeline, rate })
    }

    fn scene(&self, quiet: bool) -> Result<Scene, Box<dyn std::error::Error>> {
        let path = self.target.as_deref().ok_or("name the scan to show it on: --target SCAN")?;
        let assets = Assets::locate()?;
        let gpu = Gpu::headless()?;
        let mut networks = Networks::load(&assets, TrackerOptions::default())?;
        let opens = !self.as_scanned && self.method.method().warp != WarpKind::Regions;
        let target = self.scan.open(path, opens, &gpu, &mut networks.tracker, quiet)?;
        Ok(Scene { target, gpu })
    }

    /// Tables of contractions, and what shows a scan.
    #[allow(clippy::type_complexity, reason = "two lists of paths")]
    fn outputs(&self) -> Result<(Vec<&PathBuf>, Vec<(Kind, &PathBuf)>), Box<dyn std::error::Error>> {
        let read = [self.file.as_deref(), self.target.as_deref(), self.skin.path(), self.key.read()];
        let read: Vec<&Path> = read.into_iter().flatten().collect();
        let (mut curves, mut shown) = (Vec::new(), Vec::new());
        for path in &self.output {
            match CurveFile::of(path) {
                Some(CurveFile::Muscles) => curves.push(path),
                _ => shown.push((Kind::of(path)?, path)),
            }
            inputs::spare(path, &read)?;
            drop(Draft::create(path)?);
        }
        Ok((curves, shown))
    }
}
