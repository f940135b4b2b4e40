//! Displacements in space from one camera's landmarks: nothing, the plane, the basis.

use std::{collections::BTreeMap, error::Error, fmt::Write as _, path::Path};

use nalgebra::{Point3, Rotation3, Vector2, Vector3};
use understudy::{
    actions::Catalogue,
    head::{Camera, HeadPose, PoseSolver},
    muscle::{CameraFit, CameraSolver, Channel, Element, FaceBasis, MuscleBasis, Part},
    rig::SourceFace,
    tracking::{Region, SKIN_LANDMARK_COUNT, index, landmark_table},
};

use super::takes::{Entry, Take};

/// Sums of squares over frames and landmarks.
#[derive(Default, Clone, Copy)]
pub struct Rms(f64, f64);

impl Rms {
    pub fn add(&mut self, square: f64) {
        if square.is_finite() {
            self.0 += square;
            self.1 += 1.0;
        }
    }

    pub fn get(self) -> f64 {
        (self.0 / self.1.max(1.0)).sqrt()
    }
}

/// Whether a landmark is counted: the outline is another line in every view.
pub fn is_scored(landmark: usize) -> bool {
    landmark_table()[landmark].region != Region::Oval
}

pub fn face_of(neutral: &[Point3<f64>]) -> SourceFace {
    let mut points = neutral.to_vec();
    points.resize(understudy::tracking::LANDMARK_COUNT, Point3::origin());
    SourceFace {
        points: Catalogue::get().place_between(&points),
        level: Rotation3::identity(),
        closed_lips: [0.0; index::UPPER_INNER.len()],
        has_depth: true,
    }
}

/// How much of what the muscles leave unexplained is added, in the columns of the table; the program's is the second.
const PARTS: [f64; 3] = [0.0, 0.7, 1.0];
/// No motion, plane, muscles with each part, pose of the rigid points and with muscles, contractions.
const COLUMNS: usize = 4 + PARTS.len() + 1;

/// The generic shapes on a face, vector for vector.
fn own_shapes(generic: &Take, points: &[Point3<f64>]) -> MuscleBasis {
    let shapes = generic.displacements("shapes");
    let names = generic.entry.shapes.clone().unwrap_or_default();
    let elements = names.into_iter().zip(shapes).filter(|(name, _)| !name.starts_with("eyeLook")).map(
        |(name, mut vectors)| {
            vectors.resize(points.len(), Vector3::zeros());
            Element { name, part: Part::Lower, channel: Channel::Measured, closure: [0.0; 2], vectors }
        },
    );
    MuscleBasis {
        name: "generic".into(),
        face: points.to_vec(),
        elements: elements.collect(),
        turns_jaw: false,
    }
}

/// Root mean squares of one take.
fn measure(
    take: &Take,
    generic: &Take,
    basis: Option<&MuscleBasis>,
) -> Result<[f64; COLUMNS], Box<dyn Error>> {
    let neutral = take.neutral();
    let truth = take.displacements("truth");
    let (pixels, poses, weights) = (take.pixels(), take.poses(), take.weights());
    let [width, height] = take.entry.size.ok_or("no size")?;
    let focal = take.entry.focal.ok_or("no focal length")?;
    let centre = Vector2::new(f64::from(width - 1) / 2.0, f64::from(height - 1) / 2.0);
    let camera = Camera { focal, centre };
    let face = face_of(&neutral);
    let on_face = match basis {
        Some(basis) => FaceBasis::new(basis, &face)?,
        None => FaceBasis::own(&own_shapes(generic, &face.points)),
    };
    let mut solver = CameraSolver::new(camera, on_face.of_landmarks(), CameraFit::default());
    let shapes = generic.entry.shapes.clone().unwrap_or_default();
    let places: Vec<_> =
        solver.basis().muscles.iter().map(|m| shapes.iter().position(|shape| *shape == m.name)).collect();
    let mut x = vec![0.0; places.len()];
    let mut fitted = Vec::new();
    let mut sums = [Rms::default(); COLUMNS];
    for (t, pixels) in pixels.iter().enumerate() {
        let seen: Vec<usize> = (0..SKIN_LANDMARK_COUNT).filter(|&i| pixels[i].x.is_finite()).collect();
        let rigid_weights = seen.iter().map(|&i| landmark_table()[i].pose_weight).collect();
        let rigid = PoseSolver::new(camera, seen.iter().map(|&i| neutral[i]).collect(), rigid_weights);
        let start = rigid.solve(&seen.iter().map(|&i| pixels[i]).collect::<Vec<_>>(), None)?;
        let pose = solver.solve(pixels, &start, &mut x);
        solver.basis().synthesize(&x, &mut fitted);
        for i in (0..SKIN_LANDMARK_COUNT).filter(|&i| is_scored(i)) {
            let truth = truth[t][i];
            let flat = |pose: &HeadPose, base: Vector3<f64>| {
                let depth = pose.to_camera(&(neutral[i] + base)).z;
                pose.to_scan(&camera.at_depth(pixels[i], depth)) - neutral[i]
            };
            sums[0].add(truth.norm_squared());
            sums[1].add((flat(&start, Vector3::zeros()) - truth).norm_squared());
            let left = flat(&pose, fitted[i]) - fitted[i];
            for (sum, part) in sums[2..].iter_mut().zip(PARTS) {
                // Markers that are not there have no truth; `add` passes them over.
                sum.add((fitted[i] + left * part - truth).norm_squared());
            }
        }
        let turned = |pose: &HeadPose| pose.rotation.angle_to(&poses[t].0).to_degrees().powi(2);
        sums[5].add(turned(&start));
        sums[6].add(turned(&pose));
        for (own, place) in x.iter().zip(&places) {
            if let Some(place) = place {
                sums[7].add((own - weights[t][*place]).powi(2));
            }
        }
    }
    Ok(sums.map(Rms::get))
}

/// Takes of one kind and noise are one row.
pub fn section(folder: &Path, entries: &[Entry]) -> Result<String, Box<dyn Error>> {
    let generic = entries.iter().find(|e| e.kind == "basis").ok_or("no basis")?;
    let generic = Take::read(folder, generic)?;
    let arkit = MuscleBasis::arkit().only(|element| !element.name.starts_with("eyeLook"));
    let straight = MuscleBasis { turns_jaw: false, ..arkit.clone() };
    let bases = [
        ("program's", Some(&arkit)),
        ("program's, straight jaw", Some(&straight)),
        ("ICT's own vectors", None),
    ];
    let mut rows: BTreeMap<(String, usize), Vec<[f64; COLUMNS]>> = BTreeMap::new();
    for entry in entries.iter().filter(|e| e.size.is_some()) {
        let take = Take::read(folder, entry)?;
        let key = match entry.name.find("_noise") {
            Some(at) if entry.kind != "markers" => format!("{}{}", entry.kind, &entry.name[at..]),
            _ => entry.name.clone(),
        };
        for (k, (_, basis)) in bases.iter().enumerate() {
            rows.entry((key.clone(), k)).or_default().push(measure(&take, &generic, *basis)?);
        }
    }
    let mut text = String::from(
        "| takes | shapes | no motion | plane | muscles | + 0.7 | + all | pose, rigid | pose, muscles | contractions |\n\
         |---|---|---:|---:|---:|---:|---:|---:|---:|---:|\n",
    );
    for ((name, basis), takes) in &rows {
        let mean = |column: usize| {
            let squares: f64 = takes.iter().map(|take| take[column] * take[column]).sum();
            (squares / takes.len() as f64).sqrt()
        };
        let _ = write!(text, "| {} ({}) | {} |", name.replace('_', " "), takes.len(), bases[*basis].0);
        for column in 0..COLUMNS {
            let _ = write!(text, " {:.2} |", mean(column));
        }
        text.push('\n');
    }
    Ok(text)
}
