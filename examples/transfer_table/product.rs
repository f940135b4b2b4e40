//! Transfer as the program does it: a library measured on the source face, tied to the target, with landmarks at known
//! places or found by the networks on pictures of both.

use nalgebra::{Point3, Vector3};
use understudy::{
    actions::{ActionKey, ActionLibrary, ActionWeights, Merge, measure_moved},
    anatomy::{Anatomy, SidedSkin},
    export::write_obj,
    pipeline::{Networks, Target, TargetOptions},
    rig::{ActionRig, Method, TargetFace, WarpKind, facing},
    scan::{Mesh, Surface},
    tracking::{LANDMARK_COUNT, Region, landmark_table},
    view::Gpu,
};

use crate::{
    eyeballs::add_eyeball,
    protocol::{Face, Outcome, Protocol},
};

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
        write_obj(file.path(), &with_eyes(protocol, mesh))?;

        let loaded =
            Target::load(file.path(), &TargetOptions::default(), self.gpu, &mut self.networks.tracker);
        let Ok(target) = loaded else { return Ok(None) };
        let surface = Surface::new(mesh)?;
        let own = |p: &Point3<f64>| Some(surface.nearest(target.scan.placement.to_own(*p))?.position);
        let landmarks: Landmarks = target.landmarks.iter().map(|p| own(p.as_ref()?)).collect();
        // A face found in a cheek is none.
        let eyes = |of: &Landmarks| of[33].zip(of[263]).map_or(0.0, |(a, b)| (a - b).norm());
        let wrong = (eyes(&landmarks) / eyes(&known(protocol, mesh)) - 1.0).abs();
        Ok(Some(landmarks).filter(|_| wrong < 0.2))
    }
}

/// Skin, brows and lips: the model has no texture, and no scan is without.
fn paint(protocol: &Protocol, mesh: &Mesh, point: &Point3<f64>) -> [f32; 3] {
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
    std::array::from_fn(|k| (SKIN[k] + (colour[k] - SKIN[k]) * share) as f32)
}

/// The mesh in the colours of a face, with white balls that have irises.
fn with_eyes(protocol: &Protocol, mesh: &Mesh) -> Mesh {
    let mut seen = Mesh {
        positions: mesh.positions.clone(),
        triangles: mesh.triangles.clone(),
        colours: mesh.positions.iter().map(|p| paint(protocol, mesh, p)).collect(),
        ..Mesh::default()
    };
    for rim in ["right_eye", "left_eye"].iter().filter_map(|eye| protocol.rims.get(*eye)) {
        let rim: Vec<_> =
            rim.upper.iter().chain(&rim.lower).chain(&rim.corners).map(|&v| mesh.positions[v]).collect();
        let middle = rim.iter().map(|p| p.coords).sum::<Vector3<f64>>() / rim.len() as f64;
        let width = rim.iter().map(|p| (p.coords - middle).norm()).fold(0.0, f64::max);
        let radius = 0.82 * width;
        add_eyeball(&mut seen, Point3::from(middle - Vector3::z() * (0.62 * radius)), radius);
    }
    seen
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
    let face = TargetFace::new(landmarks.clone(), facing(&library.face, landmarks))?;
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
