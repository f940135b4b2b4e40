//! `understudy landmark`: 478 landmarks found on a scan.

use std::path::{Path, PathBuf};

use clap::Args;
use nalgebra::Point3;
use understudy::{
    assets::Assets,
    pipeline::{Networks, Target, inspection_picture},
    scan::{read_landmarks, write_landmarks},
    tracking::{IBUG_68, IBUG_REGIONS, TrackerOptions},
    view::{Gpu, save_png},
};

use super::{
    Outcome, inputs,
    target::{ScanArgs, report},
};

const EXAMPLES: &str = "\
Examples:
  understudy landmark scan.obj                         writes scan.landmarks.json beside the scan
  understudy landmark scan.obj -o picture.png          draws them for inspection
  understudy landmark james.obj --check james.ljson    compares them with 68 points placed by hand";

/// Find 478 landmarks on a scan
///
/// The networks that track the performer look at pictures of the scan from five sides, and what they find is cast back
/// onto the surface.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Landmark {
    /// Scan: .obj, .ply, .stl, .glb, .gltf or .bnt
    scan: PathBuf,
    #[command(flatten)]
    how: ScanArgs,
    /// Where to write: .json, .pts or .ljson for the landmarks, .png for a picture of them; may be given several times
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    /// 68 landmarks to compare with; prints the mean distance for each part of the face
    #[arg(long, value_name = "FILE")]
    check: Option<PathBuf>,
}

impl Landmark {
    pub fn run(&self, quiet: bool) -> Outcome {
        for output in &self.output {
            inputs::spare(output, &[&self.scan])?;
        }
        let assets = Assets::locate()?;
        let mut networks = Networks::load(&assets, TrackerOptions::default())?;
        let gpu = Gpu::headless()?;
        let target = Target::load(&self.scan, &self.how.options(), &gpu, &mut networks.tracker)?;
        if !quiet {
            report(&target);
        }
        if let Some(check) = &self.check {
            compare(&target, check)?;
        }
        let beside = [self.scan.with_extension("landmarks.json")];
        let outputs = if self.output.is_empty() && self.check.is_none() { &beside[..] } else { &self.output };
        for output in outputs {
            if output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
                save_png(output, &inspection_picture(&gpu, &target)?)?;
            } else {
                write_landmarks(output, &target.landmark_file())?;
            }
            if !quiet {
                say!("wrote {}", output.display());
            }
        }
        Ok(())
    }
}

/// Prints how far the found landmarks are from 68 points placed by hand in the scan's own frame.
fn compare(target: &Target, path: &Path) -> Outcome {
    let truth = read_landmarks(path)?.points;
    if truth.len() != IBUG_68.len() {
        return Err(format!("{} holds {} points, not 68", path.display(), truth.len()).into());
    }
    let distance = |i: usize| -> Option<f64> {
        let found: Point3<f64> = target.landmarks[IBUG_68[i]]?;
        Some((found - target.scan.placement.to_scan(truth[i]?)).norm())
    };
    let (_, eyes) = target.centre_and_eyes();
    say!("| part | points | mean mm | of the eye distance |\n|---|---:|---:|---:|");
    for (name, range) in IBUG_REGIONS.into_iter().chain([("all but the outline", 17..68)]) {
        let distances: Vec<f64> = range.filter_map(distance).collect();
        let mean = distances.iter().sum::<f64>() / distances.len().max(1) as f64;
        say!("| {name} | {} | {mean:.2} | {:.1} % |", distances.len(), 100.0 * mean / eyes.max(1e-9));
    }
    Ok(())
}
