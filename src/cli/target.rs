//! The part of the command line that every command on a scan shares.

use std::path::{Path, PathBuf};

use clap::Args;
use understudy::{
    pipeline::{PipelineError, Target, TargetOptions},
    scan::LengthUnit,
    tracking::Tracker,
    view::Gpu,
};

/// How a scan is read.
#[derive(Args)]
pub struct ScanArgs {
    /// The scan's unit: mm, cm, m or in; guessed from the distance of the eyes if not given
    #[arg(long, value_parser = parse_unit)]
    unit: Option<LengthUnit>,
    /// The scan's landmarks: .json with 478, .pts or .ljson with 68 points, .lm3 with 22; found by the networks if not given
    #[arg(long, value_name = "FILE")]
    landmarks: Option<PathBuf>,
}

impl ScanArgs {
    pub fn options(&self) -> TargetOptions {
        TargetOptions { unit: self.unit, landmarks: self.landmarks.clone() }
    }

    /// Loads a scan, opens it if `opens`, and says what was found.
    pub fn open(
        &self,
        path: &Path,
        opens: bool,
        gpu: &Gpu,
        tracker: &mut Tracker,
        quiet: bool,
    ) -> Result<Target, PipelineError> {
        let mut target = Target::load(path, &self.options(), gpu, tracker)?;
        if opens {
            target.prepare(gpu)?;
            report_anatomy(&target);
        }
        if !quiet {
            report(&target);
        }
        Ok(target)
    }

    /// The landmark file that is read, if any.
    pub fn landmarks(&self) -> Option<&Path> {
        self.landmarks.as_deref()
    }
}

/// A unit's name.
pub fn parse_unit(text: &str) -> Result<LengthUnit, String> {
    LengthUnit::parse(text).ok_or_else(|| "write mm, cm, m or in".to_owned())
}

/// Says what was found on the scan.
pub fn report(target: &Target) {
    let (_, eyes) = target.centre_and_eyes();
    let mesh = target.mesh();
    let unit = match target.unit {
        LengthUnit::Custom(scale) => format!("units of {scale:.3} mm"),
        unit => unit.to_string(),
    };
    say!(
        "{}: {} vertices, {} triangles, {} of {} landmarks, eyes {eyes:.0} mm apart, in {unit}{}",
        target.scan.name,
        mesh.positions.len(),
        mesh.triangles.len(),
        target.landmarks.iter().flatten().count(),
        target.landmarks.len(),
        if target.unit_guessed { " (guessed from the eyes; --unit overrides)" } else { "" },
    );
}

/// Warns of what could not be made of a scan.
pub fn report_anatomy(target: &Target) {
    for omission in &target.anatomy.omissions {
        tracing::warn!("{}: {omission}", target.scan.name);
    }
}

/// A picture's size that every output can take.
pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let wanted = || "write two even numbers from 64 to 4096, such as 1280x720".to_owned();
    let (width, height) = text.split_once('x').ok_or_else(wanted)?;
    let parse = |side: &str| side.trim().parse::<u32>().ok();
    match (parse(width), parse(height)) {
        (Some(width), Some(height))
            if [width, height].iter().all(|side| (64..=4096).contains(side) && side % 2 == 0) =>
        {
            Ok([width, height])
        }
        _ => Err(wanted()),
    }
}
