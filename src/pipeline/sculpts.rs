//! A basis that an artist sculpted (001 §3): a neutral face and one shape a muscle, on one mesh.

use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};

use super::{PipelineError, Target, TargetOptions};
use crate::{
    actions::{ActionLibrary, measure_moved},
    anatomy::SidedSkin,
    muscle::{Channel, Element, MuscleBasis, MuscleError, Part},
    scan::{read_mesh, read_morphs},
    tracking::{Tracker, index},
    view::Gpu,
};

/// What the neutral of a folder may be called.
const NEUTRALS: [&str; 4] = ["neutral", "rest", "E0", "base"];
const REMEDY: &str =
    "Give a folder with neutral.obj and one .obj a muscle on the same mesh, or a .glb with morph targets";
/// A shape that moves nothing by as much is empty, millimetres.
const LEAST: f64 = 0.2;

/// One sculpt: its muscle, and the neutral's vertices moved, own frame and unit.
type Sculpt = (String, Vec<Point3<f64>>);

/// Reads a folder of OBJ files, or a GLB with morph targets; landmarks are looked for on the neutral.
pub fn read_sculpts(
    path: &Path,
    options: &TargetOptions,
    gpu: &Gpu,
    tracker: &mut Tracker,
) -> Result<MuscleBasis, PipelineError> {
    let (neutral, sculpts) = if path.is_dir() { read_folder(path)? } else { read_glb(path)? };
    let target = Target::load(&neutral, options, gpu, tracker)?;
    let (mesh, surface) = (target.mesh(), &target.surface);
    let skin = SidedSkin::of_scan(mesh, surface, &target.landmarks)
        .ok_or_else(|| fault(path, "the neutral has no triangles".to_owned()))?;
    let library = ActionLibrary::built_in();
    let mut elements: Vec<Element> = Vec::new();
    for (name, moved) in sculpts {
        let moved: Vec<_> = moved.iter().map(|p| target.scan.placement.to_scan(*p)).collect();
        let measured = measure_moved(surface, &skin, &target.landmarks, &moved);
        let carried = measured.on_average(library).map_err(|error| fault(path, error.to_string()))?;
        let vectors: Vec<Vector3<f64>> = carried.into_iter().map(Option::unwrap_or_default).collect();
        if vectors.iter().all(|v| v.norm() < LEAST) {
            return Err(MuscleError::Idle { basis: path.display().to_string(), muscle: name }.into());
        }
        let known = [MuscleBasis::sixteen(), MuscleBasis::arkit()]
            .into_iter()
            .find_map(|basis| Some(&basis.elements[basis.index(&name)?]));
        let (part, channel) = known.map_or_else(
            || (part_of(&vectors, &library.face), Channel::Measured),
            |element| (element.part, element.channel),
        );
        elements.push(Element { name, part, channel, closure: measured.closure_of(None), vectors });
    }
    let basis = MuscleBasis {
        name: path.display().to_string(),
        face: library.face.clone(),
        elements,
        turns_jaw: true,
    };
    basis.check()?;
    Ok(basis)
}

fn fault(path: &Path, reason: String) -> MuscleError {
    MuscleError::File { path: path.into(), reason, remedy: REMEDY }
}

fn read_folder(folder: &Path) -> Result<(PathBuf, Vec<Sculpt>), PipelineError> {
    let list = std::fs::read_dir(folder).map_err(|error| fault(folder, error.to_string()))?;
    let mut files: Vec<PathBuf> = list
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj")))
        .collect();
    files.sort();
    let stem = |path: &Path| path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let is_neutral = |path: &PathBuf| NEUTRALS.iter().any(|name| name.eq_ignore_ascii_case(&stem(path)));
    let neutral = files.iter().find(|path| is_neutral(path)).cloned();
    let Some(neutral) = neutral else {
        return Err(fault(folder, "it has no neutral.obj".to_owned()).into());
    };
    let rest = read_mesh(&neutral)?;
    let mut sculpts = Vec::new();
    for file in files.iter().filter(|file| !is_neutral(file)) {
        let mesh = read_mesh(file)?;
        if mesh.positions.len() != rest.positions.len() {
            let (found, wanted) = (mesh.positions.len(), rest.positions.len());
            let reason = format!("it has {found} vertices and {} has {wanted}", neutral.display());
            return Err(fault(file, reason).into());
        }
        sculpts.push((stem(file), mesh.positions));
    }
    if sculpts.is_empty() {
        return Err(fault(folder, "it has a neutral and no muscle".to_owned()).into());
    }
    Ok((neutral, sculpts))
}

fn read_glb(path: &Path) -> Result<(PathBuf, Vec<Sculpt>), PipelineError> {
    if !path.exists() {
        return Err(fault(path, "it does not exist".to_owned()).into());
    }
    let (mesh, morphs) = read_morphs(path)?;
    if morphs.is_empty() {
        return Err(fault(path, "it has no morph targets".to_owned()).into());
    }
    let moved = |deltas: Vec<Vector3<f64>>| mesh.positions.iter().zip(deltas).map(|(p, d)| p + d).collect();
    Ok((path.into(), morphs.into_iter().map(|morph| (morph.name, moved(morph.deltas))).collect()))
}

/// Upper where most of the motion lies above the lower lids.
fn part_of(vectors: &[Vector3<f64>], face: &[Point3<f64>]) -> Part {
    let line = f64::midpoint(face[index::RIGHT_LID_LOWER].y, face[index::LEFT_LID_LOWER].y);
    let sum = |above: bool| -> f64 {
        let own = vectors.iter().zip(face).filter(|(_, p)| (p.y > line) == above);
        own.map(|(v, _)| v.norm_squared()).sum()
    };
    if sum(true) > sum(false) { Part::Upper } else { Part::Lower }
}
