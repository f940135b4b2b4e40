//! Dump.
#![allow(clippy::print_stdout, reason = "an example says what it finds")]

use std::{error::Error, io::Write, path::PathBuf};

use clap::Parser;
use understudy::{
    appearance::Region,
    assets::Assets,
    capture::{self, FrameRate},
    pipeline::{
        Motion, Networks, Performance, SolveOptions, Stopwatch, observe, read_canonical_face,
        read_face_frame, speeds,
    },
    tracking::TrackerOptions,
};

#[derive(Parser)]
struct Arguments {
    clips: Vec<PathBuf>,
    #[arg(long)]
    out: PathBuf,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let assets = Assets::locate()?;
    let canonical = assets.verified("canonical_face")?;
    let face = read_canonical_face(&canonical)?;
    let frame = read_face_frame(&canonical)?;
    let mut networks = Networks::load(&assets, TrackerOptions::default())?;
    let rate = FrameRate { numerator: 25, denominator: 1 };
    for clip in &arguments.clips {
        let mut watch = Stopwatch::default();
        let performance =
            Performance::track(capture::open(clip, rate)?, &mut networks.tracker, 2, &mut watch, |_| {})?;
        let motion = Motion::solve(&performance, &face, &mut networks.blendshapes, &SolveOptions::default())?;
        let speed = speeds(&motion, 1);
        let name = clip.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut out =
            std::io::BufWriter::new(std::fs::File::create(arguments.out.join(format!("{name}.bin")))?);
        let names: Vec<&str> = motion.basis.as_ref().map(|b| b.names().collect()).unwrap_or_default();
        std::fs::write(arguments.out.join(format!("{name}.names")), names.join("\n"))?;
        let rows = observe(capture::open(clip, rate)?, &motion, &frame, false, |seen| {
            let mut row: Vec<f32> = vec![
                seen.width as f32,
                seen.motion.expression.eyes.right.closure as f32,
                seen.motion.expression.eyes.left.closure as f32,
                speed[seen.motion.index as usize] as f32,
            ];
            row.extend(seen.motion.expression.contractions.iter().map(|v| *v as f32));
            row.resize(4 + names.len(), 0.0);
            let mut bytes: Vec<u8> = row.iter().flat_map(|v| v.to_le_bytes()).collect();
            for region in Region::ALL {
                match &seen.samples[region.index()] {
                    Ok(sample) => {
                        bytes.push(1);
                        bytes.extend_from_slice(sample.luma());
                    }
                    Err(_) => {
                        bytes.push(0);
                        bytes.extend(vec![0; 34 * 34]);
                    }
                }
            }
            bytes
        })?;
        for row in rows {
            out.write_all(&row)?;
        }
        println!("{name} neutral {:?}", motion.neutral);
    }
    Ok(())
}
