//! What examples and benchmarks stand on: the networks, a device, an opened scan, clips that were tracked and solved.

#![allow(dead_code, reason = "each program uses its own part of this file")]

use std::{
    error::Error,
    path::{Path, PathBuf},
};

use understudy::{
    assets::Assets,
    capture::{self, FrameRate},
    pipeline::{
        Motion, Networks, Performance, SolveOptions, Stopwatch, Target, TargetOptions, read_canonical_face,
    },
    tracking::TrackerOptions,
    view::Gpu,
};

/// Of pictures without a time of their own; films bring theirs.
pub const RATE: FrameRate = FrameRate { numerator: 25, denominator: 1 };

/// Everything up to the first clip.
pub struct Stand {
    pub assets: Assets,
    pub gpu: Gpu,
    pub networks: Networks,
    pub target: Target,
}

/// A tracked and solved clip.
pub struct Take {
    pub path: PathBuf,
    pub name: String,
    pub performance: Performance,
    pub motion: Motion,
}

impl Stand {
    /// Opens a scan: the scan james if none is named.
    pub fn new(scan: Option<PathBuf>) -> Result<Self, Box<dyn Error>> {
        let assets = Assets::locate()?;
        let gpu = Gpu::headless()?;
        let mut networks = Networks::load(&assets, TrackerOptions::default())?;
        let scan = match scan {
            Some(scan) => scan,
            None => james(&assets)?,
        };
        let mut target = Target::load(&scan, &TargetOptions::default(), &gpu, &mut networks.tracker)?;
        target.prepare(&gpu)?;
        Ok(Self { assets, gpu, networks, target })
    }

    /// The clips that are named, or of the set-up's those that are called so.
    pub fn clips(&self, named: Vec<PathBuf>, otherwise: &[&str]) -> Result<Vec<PathBuf>, Box<dyn Error>> {
        if named.is_empty() {
            Ok(otherwise.iter().map(|name| self.assets.verified(name)).collect::<Result<_, _>>()?)
        } else {
            Ok(named)
        }
    }

    /// Tracks and solves a clip.
    pub fn solve(&mut self, clip: &Path, options: &SolveOptions) -> Result<Take, Box<dyn Error>> {
        solve(clip, &self.assets, &mut self.networks, options)
    }
}

/// Tracks and solves a clip.
pub fn solve(
    clip: &Path,
    assets: &Assets,
    networks: &mut Networks,
    options: &SolveOptions,
) -> Result<Take, Box<dyn Error>> {
    let average = read_canonical_face(&assets.verified("canonical_face")?)?;
    let mut watch = Stopwatch::default();
    let source = capture::open(clip, RATE)?;
    let performance = Performance::track(source, &mut networks.tracker, 2, &mut watch, |_| {})?;
    let motion = Motion::solve(&performance, &average, &mut networks.blendshapes, options)?;
    let name = clip.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Take { path: clip.into(), name, performance, motion })
}

/// The scan that the set-up brings, verified with its material and its texture.
fn james(assets: &Assets) -> Result<PathBuf, Box<dyn Error>> {
    for companion in ["james_mtl", "james_jpg"] {
        assets.verified(companion)?;
    }
    Ok(assets.verified("james_obj")?)
}
