//! `understudy average`: many scans in, their average face out.

use std::path::{Path, PathBuf};

use clap::Args;
use image::RgbaImage;
use understudy::{
    assets::Assets,
    export::{Draft, write_quad_obj},
    pipeline::{
        AverageFace, AverageOptions, FaceShape, Networks, PipelineError, Target, TargetOptions,
        average_picture,
    },
    scan::{LandmarkFile, LengthUnit, ScanError, write_landmarks},
    tracking::TrackerOptions,
    view::{Gpu, beside, heat_map, save_png},
};

use super::{
    Outcome, inputs,
    preprocess::{extent, parse_grid, parse_margin},
    progress,
    target::parse_unit,
};

/// The extension of the landmarks beside a mesh.
const LANDMARKS: &str = "landmarks.json";

const EXAMPLES: &str = "\
Examples:
  understudy average scans/*.obj -o average.obj
  understudy average scans/*.obj -o average.obj -o spread.png
  understudy average bosphorus/*_N_N_0.bnt -o average.obj
  understudy preprocess scan.obj --normalise affine --to average.obj -o grid.obj

Landmarks are read from `NAME.landmarks.json` or `NAME.lm3` beside each scan where there is one, and found by the
networks otherwise.

Outputs:
  .obj            the average face as a quad grid, millimetres, looking along +z, its landmarks' mean at the origin
  .landmarks.json beside it: where the scans' landmarks lie on it
  .png            the average face, and the standard deviation of depth in colours with a legend";

/// Average many scans: consensus landmarks, a thin-plate morph of each scan to them, the mean of depths
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Average {
    /// The scans: .obj, .ply, .stl, .glb, .gltf or .bnt
    #[arg(required = true)]
    scans: Vec<PathBuf>,
    /// What to write, by extension: .obj, .png; may be given several times
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// The scans' unit: mm, cm, m or in; guessed from the distance of the eyes, scan by scan, if not given
    #[arg(long, value_parser = parse_unit)]
    unit: Option<LengthUnit>,
    /// Grid points across and down
    #[arg(long, value_name = "NxM", default_value = "150x150", value_parser = parse_grid)]
    grid: [usize; 2],
    /// Millimetres of face around the outermost landmarks
    #[arg(long, value_name = "MM", default_value_t = 10.0, value_parser = parse_margin)]
    margin: f64,
    /// The part of the scans, 0..1, that must have a depth at a grid point
    #[arg(long, default_value_t = AverageOptions::default().share, value_parser = parse_share)]
    share: f64,
    /// How far the morph may miss its landmarks to bend less: the spline's λ in a box of side 1; 0 meets them exactly
    #[arg(long, value_name = "LAMBDA", default_value_t = AverageOptions::default().smoothness, value_parser = parse_smoothness)]
    smoothness: f64,
}

impl Average {
    pub fn run(&self, quiet: bool) -> Outcome {
        let outputs = self.outputs()?;
        let assets = Assets::locate()?;
        let gpu = Gpu::headless()?;
        let mut networks = Networks::load(&assets, TrackerOptions::default())?;

        let bar = progress::count("reading", "scans", self.scans.len() as u64, quiet);
        let (mut faces, mut last_error) = (Vec::new(), None);
        for scan in &self.scans {
            let options = TargetOptions { unit: self.unit, landmarks: landmarks_beside(scan, &outputs) };
            let face = Target::load(scan, &options, &gpu, &mut networks.tracker)
                .and_then(|target| FaceShape::of(&target, self.margin));
            match face {
                Ok(face) => faces.push(face),
                Err(error) if is_of_one_scan(&error) => {
                    bar.suspend(|| tracing::warn!("left out: {error}"));
                    last_error = Some(error);
                }
                Err(error) => return Err(error.into()),
            }
            bar.inc(1);
        }
        bar.finish_and_clear();

        if let (true, Some(error)) = (faces.is_empty(), last_error) {
            return Err(error.into());
        }
        let scans = faces.len();

        let [columns, rows] = self.grid;
        let options = AverageOptions {
            columns,
            rows,
            margin: self.margin,
            share: self.share,
            smoothness: self.smoothness,
        };
        let bar = progress::count("averaging", "scans", scans as u64, quiet);
        let average = AverageFace::of(faces, &options, || bar.inc(1))?;
        bar.finish_and_clear();
        for (name, count) in &average.missing {
            tracing::warn!("{name} lacks {count} landmarks that other scans have; they are left out for all");
        }
        for (name, off) in &average.outliers {
            tracing::warn!(
                "{name}'s landmarks are {off:.1} mm off the consensus, against {:.1} mm of all: look at them with \
                 `understudy landmark`, and leave it out or give it a .landmarks.json",
                average.consensus.residual()
            );
        }
        if !quiet {
            self.report(&average);
        }

        for path in &self.output {
            if is_picture(path) {
                save_png(path, &picture(&gpu, &average)?)?;
            } else {
                let name =
                    path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
                let landmarks = path.with_extension(LANDMARKS);
                write_landmarks(&landmarks, &LandmarkFile::new(name, average.landmarks.clone()))?;
                let (mesh, quads) = average.grid.mesh(|p| *p);
                write_quad_obj(path, &mesh, &quads)?;
                if !quiet {
                    say!("wrote {}", landmarks.display());
                }
            }
            if !quiet {
                say!("wrote {}", path.display());
            }
        }
        Ok(())
    }

    /// Every place that is written, refused early where it cannot be.
    fn outputs(&self) -> Result<Vec<PathBuf>, Box<dyn std::error::Error>> {
        let read: Vec<&Path> = self.scans.iter().map(PathBuf::as_path).collect();
        let mut places: Vec<PathBuf> = Vec::new();
        for path in &self.output {
            let mut made = vec![path.clone()];
            if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj")) {
                made.push(path.with_extension(LANDMARKS));
            } else if !is_picture(path) {
                return Err(format!("cannot write {}: name it .obj or .png", path.display()).into());
            }
            for place in made {
                if places.contains(&place) {
                    return Err(format!("{} would be written twice", place.display()).into());
                }
                inputs::spare(&place, &read)?;
                drop(Draft::create(&place)?);
                places.push(place);
            }
        }
        Ok(places)
    }

    fn report(&self, average: &AverageFace) {
        let grid = &average.grid;
        say!(
            "consensus: {} of {} scans, {} landmarks that all have, settled after {} rounds, landmarks off by {:.2} mm RMS",
            average.consensus.fits.len(),
            self.scans.len(),
            average.common.len(),
            average.consensus.rounds,
            average.consensus.residual(),
        );
        say!("average: {} covered by at least {:.0} % of the scans", extent(grid), 100.0 * self.share);
        let (mean, largest) = average.depth.spread();
        say!("standard deviation of depth: mean {mean:.2} mm, at most {largest:.2} mm");
    }
}

/// The average face beside its spread.
fn picture(gpu: &Gpu, average: &AverageFace) -> Result<RgbaImage, PipelineError> {
    let title = format!("standard deviation of depth, {} scans", average.consensus.fits.len());
    let spread = heat_map(&average.depth.deviations, average.grid.raster.columns, &title, "mm");
    Ok(beside(&average_picture(gpu, &average.grid, &average.landmarks)?, &spread))
}

/// Whether a scan can be left out because no face, or no whole one, was found on it. A file that cannot be read is the
/// user's mistake.
fn is_of_one_scan(error: &PipelineError) -> bool {
    matches!(
        error,
        PipelineError::NoFaceOnScan { .. }
            | PipelineError::Grid { .. }
            | PipelineError::Scan(ScanError::Placement { .. })
    )
}

fn is_picture(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"))
}

/// The landmark file beside a scan, unless it is one that this run writes.
fn landmarks_beside(scan: &Path, written: &[PathBuf]) -> Option<PathBuf> {
    let candidates = [LANDMARKS, "lm3"].map(|extension| scan.with_extension(extension));
    candidates.into_iter().find(|path| path.is_file() && !written.contains(path))
}

fn parse_share(text: &str) -> Result<f64, String> {
    let share = text.parse().ok().filter(|share: &f64| (0.0..=1.0).contains(share));
    share.ok_or_else(|| "write a number from 0 to 1, such as 0.5".to_owned())
}

fn parse_smoothness(text: &str) -> Result<f64, String> {
    let smoothness = text.parse().ok().filter(|smoothness: &f64| (0.0..=1e3).contains(smoothness));
    smoothness.ok_or_else(|| "write a number from 0 to 1000, such as 0.01".to_owned())
}
