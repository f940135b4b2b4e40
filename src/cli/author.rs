//! `understudy author`: an action unit measured from two scans of one face.

use std::path::{Path, PathBuf};

use clap::Args;
use nalgebra::{Point3, Vector3};
use understudy::{
    actions::{ActionKey, ActionLibrary, Catalogue, Expressive, Measured, measure, stray_landmarks},
    assets::Assets,
    export::{Draft, write_library},
    lift::Side,
    pipeline::{Networks, Target, TargetOptions},
    scan::{LengthUnit, Placement, Scan, read_landmarks},
    tracking::TrackerOptions,
    view::Gpu,
};

use super::{
    Outcome, inputs, progress,
    target::{parse_unit, report},
};

const EXAMPLES: &str = "\
Examples:
  understudy author --neutral rest.obj --expressive smile.obj --au 12 -o library.json
  understudy author --neutral rest.obj --expressive wink.obj --au 46L -o library.json
  understudy author --neutral rest.ply --expressive jaw.ply --au 26 --landmarks rest.json \\
      --expressive-landmarks jaw.json -o library.json

What two scans show is carried to an average face and added to the library; several pairs for one
action are averaged there. Scans that share one mesh are compared vertex by vertex and need no
landmarks on the expressive one. Others are compared by their landmarks, whose spline carries the
points between, and by their surfaces.";

/// The faces of one person differ by less than this share between two scans.
const SAME_PERSON: f64 = 0.2;
/// Shorter vectors than this, millimetres, are no expression.
const LEAST: f64 = 0.2;
/// So far from the midline of the average face a handle belongs to one side, millimetres.
const MIDDLE: f64 = 16.0;
/// A side that moves less than this share of the other hardly acts.
const HARDLY: f64 = 0.25;

/// Measure an action unit from a neutral and an expressive scan of one face
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Author {
    /// The face at rest: .obj, .ply, .stl, .glb or .gltf
    #[arg(long, value_name = "FILE")]
    neutral: PathBuf,
    /// The same face with the action at its strongest
    #[arg(long, value_name = "FILE")]
    expressive: PathBuf,
    /// Which action: its FACS number, as in 26 or AU26, with a side where only one side of the face acts, as in 12L
    #[arg(long, value_name = "UNIT")]
    au: String,
    /// The library to write, .json; one that is there is extended
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// The unit of both scans: mm, cm, m or in; guessed from the distance of the neutral's eyes if not given
    #[arg(long, value_parser = parse_unit)]
    unit: Option<LengthUnit>,
    /// The neutral's landmarks: .json with 478, .pts or .ljson with 68 points; found by the networks if not given
    #[arg(long, value_name = "FILE")]
    landmarks: Option<PathBuf>,
    /// The expressive scan's landmarks, likewise
    #[arg(long, value_name = "FILE")]
    expressive_landmarks: Option<PathBuf>,
    /// Forget what the library has of this action, instead of averaging with it
    #[arg(long)]
    replace: bool,
}

impl Author {
    pub fn run(&self, quiet: bool) -> Outcome {
        let keys = ActionKey::parse(&self.au)?;
        let mut library = self.library()?;
        // What cannot be read is refused before anything is looked at.
        for path in self.landmarks.iter().chain(&self.expressive_landmarks) {
            read_landmarks(path)?;
        }
        let expressive = Scan::read(&self.expressive, Placement::identity())?;
        let (neutral, measured) = self.measured(expressive, quiet)?;
        if !quiet {
            report_measured(&neutral, &measured);
        }
        let whole = measured.on_average(&library)?;
        let source = format!("{} to {}", stem(&self.neutral), stem(&self.expressive));
        if keys.len() > 1 {
            warn_of_one_side(&keys, &whole, &library);
        }
        for key in &keys {
            let vectors = match key.side {
                Some(side) => Measured::half(&whole, &library.face, side),
                None => whole.clone(),
            };
            if longest(&vectors).is_none_or(|(_, length)| length < LEAST) {
                return Err(self.shows_nothing(*key).into());
            }
            if self.replace {
                library.actions.retain(|action| action.key != *key);
            }
            library.add(*key, &vectors, measured.closure_of(key.side), &source);
        }
        library.prune();
        write_library(&self.output, &library)?;
        if !quiet {
            let pairs = |key: &ActionKey| -> Result<String, Box<dyn std::error::Error>> {
                let count = library.get(*key)?.pairs;
                Ok(format!("AU{key} from {count} pair{}", if count == 1 { "" } else { "s" }))
            };
            let added: Result<Vec<_>, _> = keys.iter().map(pairs).collect();
            let units: Vec<_> = library.actions.iter().map(|action| action.key.to_string()).collect();
            say!("wrote {}: {}; it has {}", self.output.display(), added?.join(", "), units.join(", "));
        }
        Ok(())
    }

    /// The library to extend, after everything about files that can be refused at once.
    fn library(&self) -> Result<ActionLibrary, Box<dyn std::error::Error>> {
        let output = self.output.display();
        if !self.output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json")) {
            return Err(format!("cannot write {output}: name it .json").into());
        }
        let mut read = vec![self.neutral.as_path(), self.expressive.as_path()];
        read.extend(self.landmarks.as_deref());
        read.extend(self.expressive_landmarks.as_deref());
        inputs::spare(&self.output, &read)?;
        if inputs::same(&self.neutral, &self.expressive) {
            return Err(format!(
                "{} is given as the neutral and as the expressive scan. Give two scans of the face",
                self.neutral.display()
            )
            .into());
        }
        let library = if self.output.exists() {
            ActionLibrary::read(&self.output)?
        } else {
            ActionLibrary::built_in().empty(&output.to_string())
        };
        drop(Draft::create(&self.output)?);
        Ok(library)
    }

    /// Reads the neutral and compares the two.
    fn measured(
        &self,
        expressive: Scan,
        quiet: bool,
    ) -> Result<(Target, Measured), Box<dyn std::error::Error>> {
        let mut networks = Networks::load(&Assets::locate()?, TrackerOptions::default())?;
        let gpu = Gpu::headless()?;
        let mut load = |path: &Path, unit, landmarks: &Option<PathBuf>| {
            let spinner = progress::spinner("looking for landmarks", quiet);
            let options = TargetOptions { unit, landmarks: landmarks.clone() };
            let loaded = Target::load(path, &options, &gpu, &mut networks.tracker);
            spinner.finish_and_clear();
            if let (Ok(target), false) = (&loaded, quiet) {
                report(target);
            }
            loaded
        };
        let neutral = load(&self.neutral, self.unit, &self.landmarks)?;
        let at_rest = (neutral.mesh(), &neutral.surface, neutral.landmarks.as_slice());
        let measured = if expressive.mesh.triangles == neutral.mesh().triangles
            && expressive.mesh.positions.len() == neutral.mesh().positions.len()
        {
            // One mesh: the neutral's landmarks and unit serve both.
            if let Some(path) = &self.expressive_landmarks {
                tracing::warn!(
                    "{} is not needed: the mesh that both scans share carries the points",
                    path.display()
                );
            }
            let expressive = expressive.replaced(neutral.scan.placement);
            let Scan { mesh, .. } = &expressive;
            measure(at_rest, &Expressive { mesh, surface: &neutral.surface, landmarks: &neutral.landmarks })?
        } else {
            let other = load(&self.expressive, Some(neutral.unit), &self.expressive_landmarks)?;
            let [(_, rest), (_, acting)] = [neutral.centre_and_eyes(), other.centre_and_eyes()];
            if rest > 0.0 && acting > 0.0 && (acting / rest - 1.0).abs() > SAME_PERSON {
                return Err(format!(
                    "the eyes are {rest:.1} mm apart on {} and {acting:.1} mm on {}, which is not one face. Bring both \
                     to one unit, or correct the landmarks",
                    self.neutral.display(),
                    self.expressive.display()
                )
                .into());
            }
            let (mesh, surface) = (other.mesh(), &other.surface);
            let mut landmarks = other.landmarks.clone();
            // Those of files are taken at their word.
            if self.landmarks.is_none() || self.expressive_landmarks.is_none() {
                let strays = stray_landmarks(&neutral.landmarks, &landmarks);
                if !strays.is_empty() {
                    tracing::warn!(
                        "landmarks {} move as no expression does and are left out; files of landmarks are taken as they \
                         are",
                        ranges(&strays)
                    );
                }
                for &i in &strays {
                    landmarks[i] = None;
                }
            }
            measure(at_rest, &Expressive { mesh, surface, landmarks: &landmarks })?
        };
        Ok((neutral, measured))
    }

    fn shows_nothing(&self, key: ActionKey) -> String {
        format!(
            "{} and {} show the same expression: nothing that AU{key} could move differs by {LEAST} mm. Give a scan on \
             which the action is at its strongest",
            self.neutral.display(),
            self.expressive.display()
        )
    }
}

/// Warns where an action of both sides was asked for and one side hardly acts.
fn warn_of_one_side(keys: &[ActionKey], vectors: &[Option<Vector3<f64>>], library: &ActionLibrary) {
    let motion = |key: &ActionKey| {
        let own = |(vector, place): (&Option<Vector3<f64>>, &Point3<f64>)| {
            let outwards = if key.side == Some(Side::Left) { place.x } else { -place.x };
            vector.filter(|_| outwards > MIDDLE)
        };
        let own: Vec<_> = vectors.iter().zip(&library.face).map(own).collect();
        longest(&own).map_or(0.0, |(_, length)| length)
    };
    let most = keys.iter().map(motion).fold(0.0, f64::max);
    for key in keys {
        let length = motion(key);
        if length < most * HARDLY {
            tracing::warn!(
                "the side of AU{key} moves {length:.1} mm at most, the other {most:.1} mm; where one side acts alone, \
                 write it, as in --au {}",
                keys.iter().filter(|other| *other != key).map(ToString::to_string).collect::<String>()
            );
        }
    }
}

/// Says how the points went, how far, and what was left out.
fn report_measured(neutral: &Target, measured: &Measured) {
    let catalogue = Catalogue::get();
    let found = measured.vectors.iter().flatten().count();
    let carried = if measured.by_mesh {
        "the mesh that both scans share".to_owned()
    } else {
        let both = (0..measured.places.len().min(neutral.landmarks.len()))
            .filter(|&i| i < understudy::tracking::SKIN_LANDMARK_COUNT && measured.vectors[i].is_some());
        format!("the spline of {} common landmarks and the expressive surface", both.count())
    };
    say!("carried {found} of {} points by {carried}", catalogue.handles());
    if let Some((handle, length)) = longest(&measured.vectors) {
        say!("largest motion {length:.1} mm, of {}", catalogue.handle_name(handle));
    }
    if !measured.missing.is_empty() {
        say!("landmarks on one of the two alone, left out: {}", ranges(&measured.missing));
    }
    let [right, left] = measured.closure_of(None);
    say!("eyes closed by {right:.2} (right) and {left:.2} (left)");
}

/// The handle that moves farthest, and how far, millimetres.
fn longest(vectors: &[Option<Vector3<f64>>]) -> Option<(usize, f64)> {
    let lengths = vectors.iter().enumerate().filter_map(|(at, v)| Some((at, (*v)?.norm())));
    lengths.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Ascending numbers, as in `0-2, 7`.
fn ranges(numbers: &[usize]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b).map(|run| match run {
        [first, .., last] => format!("{first}-{last}"),
        _ => run.iter().map(ToString::to_string).collect(),
    });
    runs.collect::<Vec<_>>().join(", ")
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_numbers_are_joined() {
        assert_eq!(ranges(&[0, 1, 2, 7, 9, 10]), "0-2, 7, 9-10");
        assert_eq!(ranges(&[]), "");
    }
}
