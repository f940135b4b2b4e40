//! A scan made ready to be driven: read, measured, landmarked, brought level with a performer.

use std::{path::Path, sync::Arc};

use nalgebra::{Point3, Rotation3, Vector3};

use super::{
    PipelineError,
    photographer::{Photographer, SIZE},
    scan_landmarks::{FRAMING, ScanFace, lightings},
    target_cache::{FoundFace, TargetCache},
};
use crate::{
    anatomy::{Anatomy, FaceFrame, FrontView},
    head::rotation_between,
    rig::TargetFace,
    scan::{
        LandmarkFile, LengthUnit, Mesh, Placement, Scan, ScanError, Surface,
        guess_from_outer_canthal_distance, read_landmarks, read_mesh,
    },
    tracking::{IBUG_68, LANDMARK_COUNT, LandmarkState, Landmarks, SKIN_LANDMARK_COUNT, Tracker, index},
    view::{Gpu, Lighting, Model},
};

/// Points by which the network's views of two faces are compared: they hardly move with expression.
const RIGID: [usize; 24] =
    [33, 133, 362, 263, 168, 6, 197, 195, 5, 4, 1, 19, 94, 2, 98, 327, 10, 151, 9, 8, 127, 356, 234, 454];
/// Millimetres between the outer eye corners of people and of characters drawn after them.
const PLAUSIBLE_EYES: std::ops::Range<f64> = 60.0..140.0;
/// Millimetres between the outer eye corners of an average person.
const AVERAGE_EYES: f64 = 90.0;
/// Rounds of levelling; the angle shrinks to a third in each.
const ROUNDS: usize = 5;
/// Level enough, radians.
const LEVEL: f64 = 0.005;

/// A scan with its landmarks.
pub struct Target {
    /// The scan, in the scan frame and millimetres.
    pub scan: Scan,
    /// Its surface, in the same frame.
    pub surface: Surface,
    /// 478 points on it, in the same frame.
    pub landmarks: Vec<Option<Point3<f64>>>,
    /// 478 values 0..=1.
    pub confidences: Vec<f64>,
    /// The file's unit, guessed from the eyes or given.
    pub unit: LengthUnit,
    /// Whether the unit is a guess.
    pub unit_guessed: bool,
    /// The scan as it is, until [`Target::prepare`] has opened it.
    pub anatomy: Anatomy,
    model: Arc<Model>,
    avatar_model: Arc<Model>,
    photographer: Photographer,
    lighting: Lighting,
    cache: TargetCache,
}

/// How a target is read.
#[derive(Debug, Clone, Default)]
pub struct TargetOptions {
    /// The file's unit; guessed where `None`.
    pub unit: Option<LengthUnit>,
    /// A file with 478, 468 or 68 landmarks in the scan's own frame; found by the networks where `None`.
    pub landmarks: Option<std::path::PathBuf>,
}

impl Target {
    /// Reads the scan and finds its landmarks.
    pub fn load(
        path: &Path,
        options: &TargetOptions,
        gpu: &Gpu,
        tracker: &mut Tracker,
    ) -> Result<Self, PipelineError> {
        let own = read_mesh(path)?;
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let fault = |source| PipelineError::from(ScanError::Mesh { path: path.into(), source });
        let own_surface = Surface::new(&own).map_err(fault)?;
        let model = Arc::new(Model::upload(gpu, &own)?);
        let cache = TargetCache::of(&own, options, gpu.adapter_name());
        let face = if let Some(file) = &options.landmarks {
            let landmarks = network_scheme(file, &read_landmarks(file)?)?;
            let confidences = landmarks.iter().map(|p| f64::from(u8::from(p.is_some()))).collect();
            let facing = facing_of(&landmarks);
            FoundFace { landmarks, confidences, facing, lighting: lightings(&own)[0] }
        } else if let Some(face) = cache.face() {
            face
        } else {
            let mut photographer = Photographer::new(gpu, Arc::clone(&model), &own)?;
            let found = ScanFace::find(path, &own, &own_surface, &mut photographer, tracker)?;
            let face = FoundFace {
                landmarks: found.positions(),
                confidences: found.confidences,
                facing: found.facing,
                lighting: found.lighting,
            };
            cache.keep_face(&face);
            face
        };
        let FoundFace { landmarks: own_landmarks, confidences, facing, lighting } = face;
        let eyes = eye_distance(&own_landmarks);
        let unit = options.unit.unwrap_or_else(|| guess_unit(eyes));
        let placement = Placement::new(facing, Vector3::zeros(), unit.millimetres_per_unit())
            .map_err(|source| ScanError::Placement { path: path.into(), source })?;
        let landmarks = own_landmarks.iter().map(|p| p.map(|p| placement.to_scan(p))).collect();
        let scan = Scan { path: Some(path.into()), ..Scan::new(name, own, placement).map_err(fault)? };
        let surface = Surface::new(&scan.mesh).map_err(fault)?;
        let photographer = Photographer::new(gpu, Arc::clone(&model), &scan.mesh)?;
        Ok(Self {
            anatomy: Anatomy::as_scanned(&scan.mesh),
            scan,
            surface,
            landmarks,
            confidences,
            unit,
            unit_guessed: options.unit.is_none(),
            avatar_model: Arc::clone(&model),
            model,
            photographer,
            lighting,
            cache,
        })
    }

    /// Opens mouth and eyes and adds what lies behind them, as far as the scan allows: [`Anatomy::omissions`] lists what
    /// was left out.
    pub fn prepare(&mut self, gpu: &Gpu) -> Result<(), PipelineError> {
        self.anatomy = if let Some(anatomy) = self.cache.anatomy(&self.scan.mesh) {
            anatomy
        } else {
            let view = self.front_view(gpu)?;
            let anatomy = Anatomy::prepare(&self.scan.mesh, &self.surface, &self.landmarks, view.as_ref());
            self.cache.keep_anatomy(&anatomy, &self.scan.mesh);
            anatomy
        };
        self.avatar_model = Arc::new(Model::upload(gpu, &self.anatomy.mesh)?);
        Ok(())
    }

    /// The scan's colours seen from the front, if it has any and the face is known.
    fn front_view(&self, gpu: &Gpu) -> Result<Option<FrontView>, PipelineError> {
        let mesh = &self.scan.mesh;
        let coloured = !mesh.colours.is_empty() || mesh.materials.iter().any(|m| m.texture.is_some());
        let frame = FaceFrame::of(&self.landmarks).filter(|_| coloured);
        frame.map(|frame| self.photographer.front_view(gpu, &frame)).transpose()
    }

    /// The landmarks in the file's own frame and unit, ready to be written.
    pub fn landmark_file(&self) -> LandmarkFile {
        let own = self.landmarks.iter().map(|p| p.map(|p| self.scan.placement.to_own(p))).collect();
        let mut file = LandmarkFile::new(self.scan.name.clone(), own);
        file.confidences.clone_from(&self.confidences);
        file
    }

    /// The middle of eyes and mouth and the distance of the outer eye corners, scan frame, millimetres.
    pub fn centre_and_eyes(&self) -> (Point3<f64>, f64) {
        let at = |i: usize| self.landmarks[i].unwrap_or_else(Point3::origin);
        let eyes = nalgebra::center(&at(index::RIGHT_EYE_OUTER), &at(index::LEFT_EYE_OUTER));
        let mouth = nalgebra::center(&at(index::MOUTH_RIGHT), &at(index::MOUTH_LEFT));
        (nalgebra::center(&eyes, &mouth), eye_distance(&self.landmarks))
    }

    /// The target brought level with `seen`, the network's view of the performer's neutral: the scan is turned until
    /// the network sees it in the same pose. Also returns the angle of each round, radians.
    pub fn level_with(
        &mut self,
        seen: &Landmarks,
        tracker: &mut Tracker,
    ) -> Result<(TargetFace, Vec<f64>), PipelineError> {
        let (centre, eyes) = self.centre_and_eyes();
        let wanted = upright_points(seen);
        let mut level = Rotation3::identity();
        let mut angles = Vec::new();
        for _ in 0..ROUNDS {
            let camera = Photographer::camera(centre, FRAMING * eyes, &level, SIZE);
            let Some(portrait) = self.photographer.portrait(camera, self.lighting, tracker)? else {
                tracing::warn!(
                    "{} is no longer seen as a face when turned; it stays as it was",
                    self.scan.name
                );
                break;
            };
            let turn = rotation_between(&upright_points(&portrait.landmarks), &wanted);
            angles.push(turn.angle());
            level = turn * level;
            if turn.angle() < LEVEL {
                break;
            }
        }
        Ok((TargetFace::new(self.landmarks.clone(), level)?, angles))
    }

    /// The uploaded [`Anatomy::mesh`].
    pub fn avatar_model(&self) -> &Arc<Model> {
        &self.avatar_model
    }

    /// The uploaded scan: its colours and triangles; positions are given with each picture.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The mesh in the scan frame, millimetres.
    pub fn mesh(&self) -> &Mesh {
        &self.scan.mesh
    }
}

/// The network's rigid points with y up and z towards the camera.
fn upright_points(landmarks: &Landmarks) -> Vec<Vector3<f64>> {
    RIGID.iter().map(|&i| landmarks.points[i]).map(|p| Vector3::new(p.x, -p.y, -p.z)).collect()
}

/// The known unit that makes the eyes a person's; where none does, the scale that makes them an average person's.
fn guess_unit(eyes: f64) -> LengthUnit {
    guess_from_outer_canthal_distance(eyes)
        .filter(|unit| PLAUSIBLE_EYES.contains(&(eyes * unit.millimetres_per_unit())))
        .unwrap_or(LengthUnit::Custom(AVERAGE_EYES / eyes.max(f64::MIN_POSITIVE)))
}

fn eye_distance(landmarks: &[Option<Point3<f64>>]) -> f64 {
    match (landmarks[index::RIGHT_EYE_OUTER], landmarks[index::LEFT_EYE_OUTER]) {
        (Some(right), Some(left)) => (right - left).norm(),
        _ => 0.0,
    }
}

/// A landmark file's points by the network's indices.
pub(super) fn network_scheme(
    path: &Path,
    file: &LandmarkFile,
) -> Result<Vec<Option<Point3<f64>>>, PipelineError> {
    let mut points = vec![None; LANDMARK_COUNT];
    match file.points.len() {
        LANDMARK_COUNT | SKIN_LANDMARK_COUNT => points[..file.points.len()].copy_from_slice(&file.points),
        68 => {
            for (&landmark, point) in IBUG_68.iter().zip(&file.points) {
                points[landmark] = *point;
            }
        }
        found => return Err(PipelineError::LandmarkCount { path: path.into(), found }),
    }
    for (point, state) in points.iter_mut().zip(&file.states) {
        if *state == LandmarkState::Absent {
            *point = None;
        }
    }
    Ok(points)
}

/// How to turn a face that is known by its landmarks upright: x along the eyes, y from the mouth to the eyes.
fn facing_of(landmarks: &[Option<Point3<f64>>]) -> Rotation3<f64> {
    let at = |i: usize| landmarks[i];
    let (Some(right), Some(left), Some(mouth_right), Some(mouth_left)) = (
        at(index::RIGHT_EYE_OUTER),
        at(index::LEFT_EYE_OUTER),
        at(index::MOUTH_RIGHT),
        at(index::MOUTH_LEFT),
    ) else {
        return Rotation3::identity();
    };
    let x = left - right;
    let up = nalgebra::center(&right, &left) - nalgebra::center(&mouth_right, &mouth_left);
    let z = x.cross(&up);
    if z.norm() < 1e-9 {
        return Rotation3::identity();
    }
    let facing = Rotation3::face_towards(&z, &up).inverse();
    // A scan that is nearly upright keeps its own axes.
    if facing.angle() < 0.5 { Rotation3::identity() } else { facing }
}
