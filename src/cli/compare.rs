//! `understudy compare`: how far a predicted face is from the true one.

use std::path::{Path, PathBuf};

use clap::Args;
use nalgebra::{Point3, Rotation3, Vector3};
use understudy::{
    assets::Assets,
    compare::{Comparison, DistanceKind, Framing, Whole, comparison_sheet, write_comparison},
    export::Draft,
    pipeline::{Networks, PipelineError, Target, TargetOptions},
    scan::{LengthUnit, Placement, Scan, guess_unit, read_mesh},
    tracking::TrackerOptions,
    view::{Gpu, save_png},
};

use super::{
    Outcome, inputs, progress,
    target::{ScanArgs, report},
};

const EXAMPLES: &str = "\
Examples:
  understudy compare --neutral n.obj --predicted p.obj --truth t.obj
  understudy compare --neutral n.obj --predicted p.obj --truth t.obj -o error.png -o errors.csv
  understudy compare --neutral n.obj --predicted p.obj --truth smile.ply --unit mm -o error.png

All three files are in the neutral's frame and unit. The prediction has the neutral's vertices.
Where the truth has them too, vertices are compared by their number; otherwise each by its
distance to the truth's surface, which does not see what slides along it.";

/// Radius of the ball that is shown over the outer canthal distance.
const FRAMING: f64 = 1.0;

/// Measure a predicted face against the true one, part by part
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Compare {
    /// The face at rest: .obj, .ply, .glb or .gltf
    #[arg(long, value_name = "FILE")]
    neutral: PathBuf,
    /// What a method made of it: the same mesh with its vertices moved
    #[arg(long, value_name = "FILE")]
    predicted: PathBuf,
    /// What it should have become: the same mesh, or any other surface in the same place
    #[arg(long, value_name = "FILE")]
    truth: PathBuf,
    #[command(flatten)]
    how: ScanArgs,
    /// Count every vertex of the neutral in the first row, not only those near its landmarks
    #[arg(long)]
    all: bool,
    /// What to write, by extension: .png for the errors as colours, .csv for the figures; may be given several times
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
}

/// The neutral, placed, with what is known of its face.
struct Subject {
    scan: Scan,
    /// None where no face was found.
    landmarks: Vec<Option<Point3<f64>>>,
    framing: Framing,
}

impl Compare {
    pub fn run(&self, quiet: bool) -> Outcome {
        let mut outputs = Vec::new();
        for path in &self.output {
            let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
            let is_picture = match extension.as_deref() {
                Some("png") => true,
                Some("csv") => false,
                _ => return Err(format!("cannot write {}: name it .png or .csv", path.display()).into()),
            };
            inputs::spare(path, &[&self.neutral, &self.predicted, &self.truth])?;
            drop(Draft::create(path)?);
            outputs.push((is_picture, path));
        }
        // What is read quickly is refused quickly.
        let [predicted, truth] =
            [&self.predicted, &self.truth].map(|path| Scan::read(path, Placement::identity()));
        let (predicted, truth) = (predicted?, truth?);

        let gpu = Gpu::headless()?;
        let subject = self.subject(&gpu, quiet)?;
        let neutral = &subject.scan;
        let predicted = predicted.replaced(neutral.placement);
        let truth = truth.replaced(neutral.placement);
        let whole = if self.all { Whole::Mesh } else { Whole::Face };
        let spinner = progress::spinner("comparing", quiet);
        let compared = Comparison::of(neutral, &predicted, &truth, &subject.landmarks, whole);
        spinner.finish_and_clear();
        let comparison = compared?;
        self.doubt(&comparison, &subject);
        if !quiet {
            print(&comparison);
        }
        for (is_picture, path) in outputs {
            if is_picture {
                let sheet =
                    comparison_sheet(&gpu, neutral, &predicted, &truth, &comparison, subject.framing)?;
                save_png(path, &sheet)?;
            } else {
                write_comparison(path, &comparison)?;
            }
            if !quiet {
                say!("wrote {}", path.display());
            }
        }
        Ok(())
    }

    /// Reads the neutral and finds its landmarks, if it has any.
    fn subject(&self, gpu: &Gpu, quiet: bool) -> Result<Subject, Box<dyn std::error::Error>> {
        let mut networks = Networks::load(&Assets::locate()?, TrackerOptions::default())?;
        let options = self.how.options();
        match Target::load(&self.neutral, &options, gpu, &mut networks.tracker) {
            Ok(target) => {
                if !quiet {
                    report(&target);
                }
                let (centre, eyes) = target.centre_and_eyes();
                let framing = if eyes > 0.0 {
                    Framing { centre, radius: FRAMING * eyes }
                } else {
                    whole_of(&target.scan)
                };
                Ok(Subject { landmarks: target.landmarks, framing, scan: target.scan })
            }
            Err(PipelineError::NoFaceOnScan { .. }) => bare(&self.neutral, &options),
            Err(error) => Err(error.into()),
        }
    }

    /// Warns where the prediction is so far off that it may lie in another frame or unit.
    fn doubt(&self, comparison: &Comparison, subject: &Subject) {
        let whole = comparison.whole();
        if whole.rms > subject.framing.radius / 2.0 {
            tracing::warn!(
                "{} is {:.0} mm away from {}: are both in the frame and unit of {}?",
                self.predicted.display(),
                whole.rms,
                self.truth.display(),
                self.neutral.display()
            );
        }
    }
}

/// A neutral without a face: measured as a whole.
fn bare(path: &Path, options: &TargetOptions) -> Result<Subject, Box<dyn std::error::Error>> {
    let mesh = read_mesh(path)?;
    let heights = mesh.positions.iter().map(|p| p.y);
    let height = heights.clone().fold(f64::MIN, f64::max) - heights.fold(f64::MAX, f64::min);
    let unit: LengthUnit = options.unit.or_else(|| guess_unit(height)).ok_or_else(|| {
        format!(
            "no face was found on {}, and its height of {height} is no face's in any unit. Give its unit with --unit mm, \
             cm, m or in, or its landmarks with --landmarks FILE",
            path.display()
        )
    })?;
    tracing::warn!(
        "no face was found on {}: every vertex counts, in {unit}. --landmarks FILE tells the parts of the face",
        path.display()
    );
    let placement = Placement::new(Rotation3::identity(), Vector3::zeros(), unit.millimetres_per_unit())?;
    let scan = Scan::read(path, placement)?;
    Ok(Subject { framing: whole_of(&scan), landmarks: Vec::new(), scan })
}

fn whole_of(scan: &Scan) -> Framing {
    let (centre, radius) = scan.mesh.bounding_ball();
    Framing { centre, radius }
}

fn print(comparison: &Comparison) {
    say!(
        "{}",
        match comparison.kind {
            DistanceKind::Vertex => "distance: vertex to vertex (all three meshes share their triangles)",
            DistanceKind::Surface =>
                "distance: vertex to the truth's surface (the truth is another mesh; sliding is not seen)",
        }
    );
    say!("| region | vertices | mean mm | RMS mm | 95 % mm | max mm | true motion RMS mm | of the motion |");
    say!("|---|---:|---:|---:|---:|---:|---:|---:|");
    for row in &comparison.rows {
        let share = row.share().map_or_else(|| "-".to_owned(), |share| format!("{share:.3}"));
        say!(
            "| {} | {} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {share} |",
            row.name,
            row.vertices,
            row.mean,
            row.rms,
            row.p95,
            row.max,
            row.motion_rms
        );
    }
}
