//! Measures the built-in library of action units on faces whose expressions are known.
//!
//! `scripts/export_action_faces.py … -o FACES`, then
//! `cargo run --release --example action_library -- FACES -o models/actions.json
//! --muscles models/arkit_muscles.json`
//!
//! ICT-FaceKit's mean face is the average face. Every other face is measured on itself, carried to the average face by
//! the landmark spline, and averaged; the two halves of an action are averaged with each other's mirror images.

use std::{error::Error, path::PathBuf};

use clap::Parser;
use nalgebra::{Point3, Vector3};
use serde::Deserialize;
use understudy::{
    actions::{ActionFacts, ActionKey, ActionLibrary, Catalogue, Measured, measure_moved},
    anatomy::{Lip, SidedSkin, SkinPlace, eye_landmarks},
    assets::Assets,
    export::{Pc2Reader, write_basis, write_library},
    lift::Side,
    muscle::{Channel, Element, MuscleBasis, Part},
    pipeline::{Networks, Target, TargetOptions, read_canonical_face},
    scan::{Anchor, Mesh, Surface, read_mesh},
    spline::{Kernel, Options, Regularisation, Spline},
    tracking::{SKIN_LANDMARK_COUNT, TrackerOptions, is_outline, landmark_table},
    view::Gpu,
};

#[derive(Parser)]
struct Arguments {
    /// What `scripts/export_action_faces.py` wrote
    faces: PathBuf,
    /// The library
    #[arg(short, long)]
    output: PathBuf,
    /// The basis of ARKit's shapes
    #[arg(long)]
    muscles: PathBuf,
}

#[derive(Deserialize)]
struct Faces {
    ict_landmarks: Vec<usize>,
    faces: Vec<Face>,
}

#[derive(Deserialize)]
struct Face {
    name: String,
    rig: String,
    shapes: Vec<String>,
}

type Vectors = Vec<Option<Vector3<f64>>>;

fn main() -> Result<(), Box<dyn Error>> {
    let options = Arguments::parse();
    let text = std::fs::read_to_string(options.faces.join("faces.json"))?;
    let faces: Faces = serde_json::from_str(&text)?;
    let mut library: Option<ActionLibrary> = None;
    let mut ict: Option<Vec<Option<SkinPlace>>> = None;
    let mut makehuman: Option<Vec<Option<Anchor>>> = None;
    for face in &faces.faces {
        let path = options.faces.join(format!("{}.obj", face.name));
        let mesh = read_mesh(&path)?;
        let surface = Surface::new(&mesh)?;
        let landmarks: Vec<Option<Point3<f64>>> = if face.rig == "MakeHuman" {
            if makehuman.is_none() {
                makehuman = Some(found_landmarks(&path, &surface)?);
            }
            let anchors = makehuman.as_deref().unwrap_or_default();
            let mut landmarks: Vec<_> =
                anchors.iter().map(|anchor| surface.at(anchor.as_ref()?, &mesh.positions)).collect();
            // The head has no eyeballs: what the network takes for its lids' rims lies in the sockets.
            for eye in Side::BOTH.map(eye_landmarks) {
                for &rim in eye.upper.iter().chain(&eye.lower) {
                    landmarks[rim] = None;
                }
            }
            landmarks
        } else {
            if ict.is_none() {
                ict = Some(ict_landmarks(&faces.ict_landmarks, &mesh, &surface)?);
            }
            let places = ict.as_deref().unwrap_or_default();
            places.iter().map(|place| place.as_ref()?.on(&mesh.positions)).collect()
        };
        let mut shapes = Pc2Reader::open(&options.faces.join(format!("{}.pc2", face.name)))?;
        let skin = SidedSkin::of_scan(&mesh, &surface, &landmarks).ok_or("a face without triangles")?;
        let mut measured = Vec::new();
        let mut sample = Vec::new();
        for index in 0..face.shapes.len() {
            shapes.read_sample(index, &mut sample)?;
            let moved: Vec<_> = sample.iter().map(|p| Point3::from(p.map(f64::from))).collect();
            measured.push(measure_moved(&surface, &skin, &landmarks, &moved));
        }
        let Some(library) = &mut library else {
            // The first face is the average one; its own expressions are those of the others and are not counted again.
            let places: Option<Vec<_>> = measured[0].places.iter().copied().collect();
            let places = evened(&places.ok_or("the average face lacks landmarks")?);
            write_basis(&options.muscles, &arkit(places.clone(), &face.shapes, &measured))?;
            let face = places;
            library = Some(ActionLibrary { name: "built-in".into(), face, actions: Vec::new() });
            continue;
        };
        let carried: Result<Vec<Vectors>, _> = measured.iter().map(|m| m.on_average(library)).collect();
        let carried = carried?;
        for action in &Catalogue::get().actions {
            let sides: &[Option<Side>] =
                if action.sides { &[Some(Side::Right), Some(Side::Left)] } else { &[None] };
            let Some(parts) = sides
                .iter()
                .map(|&side| compose(action, side, &face.shapes, &carried, &measured, &library.face))
                .collect::<Option<Vec<_>>>()
            else {
                continue;
            };
            for (at, &side) in sides.iter().enumerate() {
                // What one side does, the other does in the mirror.
                let (own, closure) = &parts[at];
                let (other, mirrored_closure) = &parts[parts.len() - 1 - at];
                let vectors = mean(own, &mirrored(other));
                let key = ActionKey { au: action.au, side };
                let closure = match library.get(key) {
                    Ok(known) if face.rig == "MakeHuman" => known.closure,
                    _ => [0, 1].map(|eye| f64::midpoint(closure[eye], mirrored_closure[1 - eye])),
                };
                let source = format!("{} {}", face.rig, action.shapes.join(" + "));
                library.add(key, &vectors, closure, &source);
            }
        }
        println!("{}", face.name);
    }
    let mut library = library.ok_or("no faces")?;
    library.prune();
    for action in &library.actions {
        let longest = action.vectors.iter().map(|v| v.vector.norm()).fold(0.0, f64::max);
        let spread = action.vectors.iter().map(|v| v.spread).fold(0.0, f64::max);
        println!(
            "AU{:<4} {:>2} pairs, {:>3} handles, {longest:>5.1} mm at most, spread up to {spread:>4.1} mm, closure {:>5.2} {:>5.2}",
            action.key.to_string(),
            action.pairs,
            action.vectors.len(),
            action.closure[0],
            action.closure[1],
        );
    }
    write_library(&options.output, &library)?;
    Ok(())
}

/// ICT-FaceKit's shapes under ARKit's names, as measured on the mean face. What ARKit has as one, is added up; shapes that
/// it has not, are left out, and so is where the eyes look, which skin hardly shows.
fn arkit(face: Vec<Point3<f64>>, shapes: &[String], measured: &[Measured]) -> MuscleBasis {
    const LEFT_OUT: [&str; 3] = ["PupilDilate", "cheekRaiser", "eyeLook"];
    const WHOLE: [&str; 2] = ["browInnerUp", "cheekPuff"];
    let mut elements: Vec<Element> = Vec::new();
    let fullest = measured.iter().flat_map(|m| m.closure).fold(0.5, f64::max);
    for (shape, measured) in shapes.iter().zip(measured) {
        if LEFT_OUT.iter().any(|start| shape.starts_with(start)) {
            continue;
        }
        let stem = shape.strip_suffix("_L").map(|stem| (stem, "Left"));
        let (stem, side) =
            stem.or(shape.strip_suffix("_R").map(|stem| (stem, "Right"))).unwrap_or((shape, ""));
        let name = if WHOLE.contains(&stem) { stem.to_owned() } else { format!("{stem}{side}") };
        let vectors = measured.vectors.iter().map(|v| v.unwrap_or_default());
        let closure = measured.closure.map(|c| c / fullest).map(|c| if c.abs() < 0.03 { 0.0 } else { c });
        if let Some(known) = elements.iter_mut().find(|element| element.name == name) {
            known.vectors.iter_mut().zip(vectors).for_each(|(sum, v)| *sum += v);
            known.closure.iter_mut().zip(closure).for_each(|(sum, c)| *sum += c);
            continue;
        }
        let upper = stem.starts_with("brow") || stem.starts_with("eye") || stem == "cheekSquint";
        let part = if upper { Part::Upper } else { Part::Lower };
        elements.push(Element { channel: channel(stem), vectors: vectors.collect(), name, part, closure });
    }
    MuscleBasis { name: "ARKit".to_owned(), face, elements, turns_jaw: true }
}

/// How far one camera's landmarks tell of a shape: measured on renderings of known expressions (`docs/muscles.md`).
fn channel(stem: &str) -> Channel {
    match stem {
        "jawOpen" | "mouthSmile" | "browInnerUp" | "browOuterUp" | "browDown" | "noseSneer"
        | "cheekSquint" => Channel::Measured,
        "eyeBlink" | "eyeSquint" | "mouthUpperUp" | "mouthPucker" | "mouthRollLower" | "mouthShrugUpper"
        | "mouthClose" => Channel::Weak,
        _ => Channel::Inferred,
    }
}

/// The landmarks of ICT-FaceKit's mean face. Where its table gives one vertex to several landmarks, as around the corners of
/// the upper lip, they are carried over from the canonical face by the others.
fn ict_landmarks(
    vertices: &[usize],
    mesh: &Mesh,
    surface: &Surface,
) -> Result<Vec<Option<SkinPlace>>, Box<dyn Error>> {
    let canonical = read_canonical_face(&Assets::locate()?.verified("canonical_face")?)?;
    let own: Vec<Point3<f64>> = vertices
        .iter()
        .map(|&v| mesh.positions.get(v).copied().ok_or("no such vertex"))
        .collect::<Result<_, _>>()?;
    let is_shared = |i: usize| vertices.iter().filter(|&&v| v == vertices[i]).count() > 1;
    let (centres, values): (Vec<_>, Vec<_>) = (0..SKIN_LANDMARK_COUNT)
        .filter(|&i| !is_shared(i) && !is_outline(i))
        .map(|i| (canonical[i], own[i].coords))
        .unzip();
    let options = Options { regularisation: Regularisation::UnitBox(1e-5), ..Options::default() };
    let carry = Spline::fit(Kernel::ThinPlate, &centres, &values, options)?;
    let rough: Vec<Option<Point3<f64>>> = (0..SKIN_LANDMARK_COUNT)
        .map(|i| Some(if is_shared(i) { carry.evaluate(&canonical[i]).into() } else { own[i] }))
        .collect();
    let skin = SidedSkin::of_scan(mesh, surface, &rough).ok_or("no triangles")?;
    Ok(rough.iter().enumerate().map(|(i, place)| skin.nearest(Lip::of(i), (*place)?)).collect())
}

/// The networks' landmarks of one face, as places on the mesh that its likes share.
fn found_landmarks(path: &std::path::Path, surface: &Surface) -> Result<Vec<Option<Anchor>>, Box<dyn Error>> {
    let assets = Assets::locate()?;
    let gpu = Gpu::headless()?;
    let mut networks = Networks::load(&assets, TrackerOptions::default())?;
    let target = Target::load(path, &TargetOptions::default(), &gpu, &mut networks.tracker)?;
    let own = |p: &Point3<f64>| target.scan.placement.to_own(*p);
    Ok(target.landmarks.iter().map(|p| Some(surface.nearest(own(p.as_ref()?))?.anchor())).collect())
}

/// One action of one face on the average face: its shapes, weighted and added up. `None` where the face lacks one.
fn compose(
    action: &ActionFacts,
    side: Option<Side>,
    names: &[String],
    carried: &[Vectors],
    measured: &[Measured],
    places: &[Point3<f64>],
) -> Option<(Vectors, [f64; 2])> {
    let mut sum: Vectors = vec![Some(Vector3::zeros()); places.len()];
    let mut closure = [0.0; 2];
    // Rims have thickness: what the fullest closure of the face leaves open counts as shut.
    let fullest = measured.iter().flat_map(|m| m.closure).fold(0.5, f64::max);
    for shape in &action.shapes {
        let (weight, name) = match shape.split_once(' ') {
            Some((number, name)) if number.parse::<f64>().is_ok() => (number.parse().ok()?, name),
            _ => (1.0, shape.as_str()),
        };
        let index = |name: &str| names.iter().position(|known| known == name);
        let whole = index(name);
        let right = index(&format!("{name}_R"));
        let left = index(&format!("{name}_L"));
        let parts: Vec<(usize, Option<Side>)> = match (whole, right, left, side) {
            (_, Some(right), _, Some(Side::Right)) => vec![(right, None)],
            (_, _, Some(left), Some(Side::Left)) => vec![(left, None)],
            (_, Some(right), Some(left), None) => vec![(right, None), (left, None)],
            (Some(whole), _, _, side) => vec![(whole, side)],
            _ => return None,
        };
        for (part, half) in parts {
            let vectors = half
                .map_or_else(|| carried[part].clone(), |side| Measured::half(&carried[part], places, side));
            for (sum, vector) in sum.iter_mut().zip(vectors) {
                *sum = sum.zip(vector).map(|(sum, vector)| sum + vector * weight);
            }
            for ((sum, eye), own) in closure.iter_mut().zip(Side::BOTH).zip(measured[part].closure) {
                if half.is_none_or(|side| side == eye) {
                    *sum += own / fullest * weight;
                }
            }
        }
    }
    Some((sum, closure.map(|c| if c.abs() < 0.03 { 0.0 } else { c.clamp(-0.35, 1.0) })))
}

/// The handle on the other side of the face.
fn partner(handle: usize) -> usize {
    let Some(point) = handle.checked_sub(SKIN_LANDMARK_COUNT) else {
        return landmark_table()[handle].mirror;
    };
    let points = &Catalogue::get().points;
    let other = points.iter().position(|p| p.name == points[point].name && p.side != points[point].side);
    SKIN_LANDMARK_COUNT + other.unwrap_or(point)
}

fn mirrored(vectors: &Vectors) -> Vectors {
    let flip = |v: Vector3<f64>| Vector3::new(-v.x, v.y, v.z);
    (0..vectors.len()).map(|handle| vectors[partner(handle)].map(flip)).collect()
}

fn mean(a: &Vectors, b: &Vectors) -> Vectors {
    a.iter().zip(b).map(|(a, b)| a.zip(*b).map(|(a, b)| (a + b) / 2.0)).collect()
}

/// A face and its mirror image, averaged.
fn evened(places: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let flip = |p: Point3<f64>| Point3::new(-p.x, p.y, p.z);
    (0..places.len()).map(|h| nalgebra::center(&places[h], &flip(places[partner(h)]))).collect()
}
