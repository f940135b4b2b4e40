//! Vertices as they were sent and as they arrive.

use std::{error::Error, fmt::Write as _};

use nalgebra::Point3;
use understudy::{
    pipeline::{Play as _, Target, WirePlay},
    rig::{AvatarFrame, Method},
    wire::{Timeline, udp::HEADERS},
};

use crate::{
    channel::{Channel, Far},
    take::{RATE, Take},
};

/// Of the histogram of distances, millimetres.
const BIN: f64 = 0.005;
const BINS: usize = 4000;

/// Distances of vertices.
#[derive(Clone)]
struct Distances {
    squares: f64,
    count: u64,
    bins: Vec<u64>,
}

impl Distances {
    fn new() -> Self {
        Self { squares: 0.0, count: 0, bins: vec![0; BINS] }
    }

    fn add(&mut self, distance: f64) {
        self.squares += distance * distance;
        self.count += 1;
        self.bins[((distance / BIN) as usize).min(BINS - 1)] += 1;
    }

    fn rms(&self) -> f64 {
        (self.squares / self.count.max(1) as f64).sqrt()
    }

    fn percentile(&self, share: f64) -> f64 {
        let wanted = (self.count as f64 * share) as u64;
        let mut seen = 0;
        let bin = self.bins.iter().position(|count| {
            seen += count;
            seen > wanted
        });
        bin.unwrap_or(BINS) as f64 * BIN
    }

    fn join(&mut self, other: &Self) {
        self.squares += other.squares;
        self.count += other.count;
        for (to, from) in self.bins.iter_mut().zip(&other.bins) {
            *to += from;
        }
    }
}

/// One clip on one channel.
#[derive(Clone)]
pub struct Measured {
    pub channel: Channel,
    seconds: f64,
    /// Payload, payload sealed.
    bytes: [usize; 2],
    packets: usize,
    /// Within the head, and with its motion.
    face: Distances,
    whole: Distances,
}

impl Measured {
    fn join(&mut self, other: &Self) {
        self.seconds += other.seconds;
        self.packets += other.packets;
        for (to, from) in self.bytes.iter_mut().zip(other.bytes) {
            *to += from;
        }
        self.face.join(&other.face);
        self.whole.join(&other.whole);
    }

    fn row(&self, title: &str, setting: &str) -> String {
        let rate = |bytes: usize| bytes as f64 * 8e-3 / self.seconds;
        let headers = self.packets * HEADERS;
        let [open, sealed] = self.bytes;
        format!(
            "| {title} | {setting} | {:.2} | {:.2} | {:.2} | {:.2} | {:.3} | {:.3} | {:.3} | {:.3} | {:.0} |\n",
            rate(open),
            rate(open + headers),
            rate(sealed),
            rate(sealed + headers),
            self.face.rms(),
            self.face.percentile(0.99),
            self.whole.rms(),
            self.whole.percentile(0.99),
            self.channel.delay() * 1000.0,
        )
    }
}

/// One take on every channel; every `every`-th frame is looked at.
pub fn measure(
    take: &Take,
    target: &Target,
    channels: &[Channel],
    every: usize,
) -> Result<Vec<Measured>, Box<dyn Error>> {
    let play = WirePlay::new(Timeline::default(), RATE, target, Method::default())?;
    let mut far = Vec::new();
    let mut measured = Vec::new();
    for channel in channels {
        let end = Far::of(*channel, &take.frames)?;
        measured.push(Measured {
            channel: *channel,
            seconds: take.frames.len() as f64 / RATE.per_second(),
            bytes: end.bytes,
            packets: end.count,
            face: Distances::new(),
            whole: Distances::new(),
        });
        far.push(end);
    }
    let (mut sent, mut got) = (play.puppet().new_frame(), play.puppet().new_frame());
    for (k, frame) in take.frames.iter().enumerate() {
        let is_measured = k % every == 0;
        if is_measured {
            play.pose_frame(frame, &mut sent);
            play.puppet().place(&mut sent)?;
        }
        for (end, measured) in far.iter_mut().zip(&mut measured) {
            let shown = end.show(frame.time);
            if is_measured {
                play.pose_frame(&shown, &mut got);
                play.puppet().place(&mut got)?;
                compare(&sent, &got, measured);
            }
        }
    }
    Ok(measured)
}

fn compare(sent: &AvatarFrame, got: &AvatarFrame, measured: &mut Measured) {
    for (a, b) in sent.positions.iter().zip(&got.positions) {
        let (a, b) = (Point3::from(a.map(f64::from)), Point3::from(b.map(f64::from)));
        measured.face.add((a - b).norm());
        measured.whole.add((sent.head * a - got.head * b).norm());
    }
}

/// A table with a row for each clip and setting, and for all clips.
pub fn table(
    names: &[&str],
    rows: &[Vec<Measured>],
    title: &str,
    setting: impl Fn(&Channel) -> String,
) -> String {
    let mut text = format!(
        "| clip | {title} | kbit/s | with headers | sealed | with headers | face RMS, mm | 99 % | with the head | 99 % | delay, ms |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n"
    );
    for (name, row) in names.iter().zip(rows) {
        for measured in row {
            let _ = write!(text, "{}", measured.row(name, &setting(&measured.channel)));
        }
    }
    let Some(first) = rows.first().filter(|_| rows.len() > 1) else { return text };
    for (k, measured) in first.iter().enumerate() {
        let mut all = measured.clone();
        for row in &rows[1..] {
            all.join(&row[k]);
        }
        let _ = write!(text, "{}", all.row("**all**", &setting(&all.channel)));
    }
    text
}
