//! Transfer as the program does it: a library measured on the source face, tied to the target, with landmarks at known
//! places or found by the networks on pictures of both.

use std::{io::Write, path::Path};

use nalgebra::{Point3, Vector3};
use understudy::{
    actions::{ActionKey, ActionLibrary, ActionWeights, Merge, measure_moved},
    anatomy::{Anatomy, SidedSkin},
    pipeline::{Networks, Target, TargetOptions},
    rig::{ActionRig, Method, TargetFace, WarpKind, facing},
    scan::{Mesh, Surface},
    tracking::{LANDMARK_COUNT, Region, landmark_table},
    view::Gpu,
};

use crate::protocol::{Face, Outcome, Protocol};

pub type Landmarks = Vec<Option<Point3<f64>>>;

/// The landmarks at the vertices that the protocol names.
pub fn known(protocol: &Protocol, mesh: &Mesh) -> Landmarks {
    let mut landmarks: Landmarks = protocol.landmarks_468.iter().map(|&v| Some(mesh.positions[v])).collect();
    landmarks.resize(LANDMARK_COUNT, None);
    landmarks
}

/// Finds landmarks on pictures of a face.
pub struct Finder<'a> {
    pub gpu: &'a Gpu,
    pub networks: &'a mut Networks,
}

impl Finder<'_> {
    /// The landmarks that the networks find. The model has no eyes, and no network finds lids around empty sockets, so it
    /// is photographed with balls in them; `None` where no face is found at all.
    pub fn find(&mut self, protocol: &Protocol, mesh: &Mesh) -> Outcome<Option<Landmarks>> {
        let file = tempfile::Builder::new().suffix(".obj").tempfile()?;
        write_with_eyes(file.path(), protocol, mesh)?;

        let loaded =
            Target::load(file.path(), &TargetOptions::default(), self.gpu, &mut self.networks.tracker);
        let Ok(target) = loaded else { return Ok(None) };
        let surface = Surface::new(mesh)?;
        let own = |p: &Point3<f64>| Some(surface.nearest(target.scan.placement.to_own(*p))?.position);
        Ok(Some(target.landmarks.iter().map(|p| own(p.as_ref()?)).collect()))
    }
}

/// Skin, brows and lips: the model has no texture, and no scan is without.
fn paint(protocol: &Protocol, mesh: &Mesh, point: &Point3<f64>) -> String {
    const SKIN: [f64; 3] = [0.72, 0.56, 0.48];
    /// Full colour up to so many millimetres from a landmark of brows or lips, none from as many more.
    const FULL: f64 = 3.0;
    let distance = |i: usize| (mesh.positions[protocol.landmarks_468[i]] - point).norm();
    let nearest = (0..protocol.landmarks_468.len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
    let (region, away) = nearest.map_or((Region::Other, 0.0), |i| (landmark_table()[i].region, distance(i)));
    let colour = match region {
        Region::Brows => [0.38, 0.27, 0.2],
        Region::Lips => [0.68, 0.38, 0.36],
        _ => SKIN,
    };
    let share = (2.0 - away / FULL).clamp(0.0, 1.0);
    let mixed: Vec<String> =
        SKIN.iter().zip(colour).map(|(skin, own)| format!("{:.3}", skin + (own - skin) * share)).collect();
    mixed.join(" ")
}

/// The mesh in the colours of a face, with white balls that have irises.
fn write_with_eyes(path: &Path, protocol: &Protocol, mesh: &Mesh) -> Outcome<()> {
    const STEPS: usize = 24;
    let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
    for p in &mesh.positions {
        writeln!(file, "v {} {} {} {}", p.x, p.y, p.z, paint(protocol, mesh, p))?;
    }
    let mut faces = mesh.triangles.clone();
    let mut first = mesh.positions.len() as u32;
    for eye in ["right_eye", "left_eye"] {
        let Some(rim) = protocol.rims.get(eye) else { continue };
        let rim: Vec<_> =
            rim.upper.iter().chain(&rim.lower).chain(&rim.corners).map(|&v| mesh.positions[v]).collect();
        let middle = rim.iter().map(|p| p.coords).sum::<Vector3<f64>>() / rim.len() as f64;
        let width = rim.iter().map(|p| (p.coords - middle).norm()).fold(0.0, f64::max);
        let radius = 0.82 * width;
        let centre = middle - Vector3::z() * (0.62 * radius);
        for i in 0..=STEPS {
            // From the pupil backwards.
            let polar = std::f64::consts::PI * i as f64 / STEPS as f64;
            let colour = match polar {
                p if p < 0.2 => "0.02 0.02 0.02",
                p if p < 0.5 => "0.25 0.17 0.1",
                _ => "0.85 0.85 0.85",
            };
            for j in 0..STEPS {
                let around = std::f64::consts::TAU * j as f64 / STEPS as f64;
                let p = centre
                    + Vector3::new(polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos())
                        * radius;
                writeln!(file, "v {} {} {} {colour}", p.x, p.y, p.z)?;
            }
        }
        let at = |i: usize, j: usize| first + (i * STEPS + j % STEPS) as u32;
        for i in 0..STEPS {
            for j in 0..STEPS {
                faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                faces.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        first += ((STEPS + 1) * STEPS) as u32;
    }
    for [a, b, c] in faces {
        writeln!(file, "f {} {} {}", a + 1, b + 1, c + 1)?;
    }
    Ok(file.flush()?)
}

/// A source's expressions as a library, an action each.
pub fn library(source: &Face, landmarks: &Landmarks, average: &ActionLibrary) -> Outcome<ActionLibrary> {
    let surface = Surface::new(&source.mesh)?;
    let skin = SidedSkin::of_scan(&source.mesh, &surface, landmarks).ok_or("a source without triangles")?;
    let mut library = average.empty("source");
    for (index, motion) in source.motions.iter().enumerate() {
        let moved: Vec<_> = source.mesh.positions.iter().zip(motion).map(|(p, v)| p + v).collect();
        let measured = measure_moved(&surface, &skin, landmarks, &moved);
        // The source's own face takes the average's place; where a landmark is missing the average fills in.
        for (place, found) in library.face.iter_mut().zip(&measured.places) {
            *place = found.unwrap_or(*place);
        }
        library.add(key(index), &measured.vectors, [0.0; 2], "source");
    }
    Ok(library)
}

fn key(index: usize) -> ActionKey {
    ActionKey { au: index as u8, side: None }
}

/// The motion of every vertex of a target for each of a library's actions.
pub fn carried(
    library: &ActionLibrary,
    target: &Mesh,
    landmarks: &Landmarks,
    method: Method,
) -> Outcome<Vec<Vec<Vector3<f64>>>> {
    let surface = Surface::new(target)?;
    let face = TargetFace::new(landmarks.clone(), facing(library, landmarks))?;
    let mut anatomy = Anatomy::as_scanned(target);
    if method.warp != WarpKind::Regions {
        // The model's mouth is open and its sockets are empty: of what the program prepares, the lips' sides count.
        let prepared = Anatomy::prepare(target, &surface, landmarks, None);
        anatomy.lower_side.copy_from_slice(&prepared.lower_side[..target.positions.len()]);
    }
    let rig = ActionRig::new(library, &face, &anatomy, &surface, method, Merge::Sum)?;
    let mut frame = rig.new_frame();
    let mut motions = Vec::new();
    for index in 0..library.actions.len() {
        let mut weights = ActionWeights::default();
        weights.set(key(index), 1.0)?;
        rig.pose(&weights, &mut frame)?;
        let moved = frame.positions.iter().zip(rig.puppet().rest()).take(target.positions.len());
        motions.push(
            moved
                .map(|(p, rest)| Vector3::from(std::array::from_fn(|k| f64::from(p[k] - rest[k]))))
                .collect(),
        );
    }
    Ok(motions)
}
