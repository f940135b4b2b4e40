//! The landmark network's part of the error: a scan acts known expressions, is drawn, and is tracked.

use std::{
    error::Error,
    fmt::Write as _,
    path::{Path, PathBuf},
};

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use understudy::{
    anatomy::{Lip, SidedSkin},
    assets::Assets,
    capture::{ClipInfo, FrameRate, Image},
    head::{rotation_between, true_turn},
    lift::{Smoothing, upright},
    muscle::{MuscleBasis, MuscleMotor},
    pipeline::{
        HeadMode, LiftMode, Motion, Networks, Performance, SolveOptions, Stage, Target, TargetOptions,
        TrackedFrame, read_canonical_face,
    },
    rig::{Method, Motor, TargetFace, facing},
    tracking::{SKIN_LANDMARK_COUNT, TrackerOptions, is_still},
    view::{Gpu, Look, Projection, Smoothing as Edges},
};

use super::{
    camera::{Rms, is_scored},
    takes::{Entry, Take},
};

const SIZE: [u32; 2] = [640, 480];
const RATE: FrameRate = FrameRate { numerator: 30, denominator: 1 };
/// Neutral frames before the acting begins.
const STILL: usize = 30;

/// What a scan acts: contractions and how the head is turned, in the level frame.
struct Script {
    contractions: Vec<Vec<f64>>,
    turns: Vec<Rotation3<f64>>,
}

/// A scan that acts before the camera.
struct Actor {
    gpu: Gpu,
    networks: Networks,
    target: Target,
    face: TargetFace,
    motor: MuscleMotor,
    average: Vec<Point3<f64>>,
}

/// What was acted, and what the network saw.
struct Film {
    performance: Performance,
    focal: f64,
    /// For each frame the landmarks' displacements, the scan's own frame, millimetres.
    truth: Vec<Vec<Vector3<f64>>>,
    turns: Vec<Rotation3<f64>>,
    neutral: Vec<Point3<f64>>,
}

/// Root mean squares: true motion, error, turn of the head against the truth, the same after `true_turn`.
struct Errors([f64; 4]);

impl Actor {
    fn new(scan: &Path, basis: &MuscleBasis) -> Result<Self, Box<dyn Error>> {
        let assets = Assets::locate()?;
        let gpu = Gpu::headless()?;
        let mut networks = Networks::load(&assets, TrackerOptions::default())?;
        let mut target = Target::load(scan, &TargetOptions::default(), &gpu, &mut networks.tracker)?;
        target.prepare(&gpu)?;
        let face = TargetFace::new(target.landmarks.clone(), facing(&basis.face, &target.landmarks))?;
        let motor = MuscleMotor::new(basis, &face, &target.anatomy, &target.surface, Method::default())?;
        let average = read_canonical_face(&assets.verified("canonical_face")?)?;
        Ok(Self { gpu, networks, target, face, motor, average })
    }

    fn film(&mut self, script: &Script) -> Result<Film, Box<dyn Error>> {
        let Self { gpu, networks, target, face, motor, .. } = self;
        let level = face.level;
        let mut stage =
            Stage::new(gpu, target, &level, SIZE, Look::default(), HeadMode::Follow, Edges::Samples4)?;
        let Projection::Perspective { vertical_fov } = stage.camera().projection else {
            return Err("no perspective".into());
        };
        let focal = f64::from(SIZE[1]) / 2.0 / (vertical_fov / 2.0).tan();
        let (centre, eyes) = target.centre_and_eyes();
        let pivot = centre.coords - level.inverse() * Vector3::z() * (0.9 * eyes);
        let mesh = &target.anatomy.mesh;
        let skin = SidedSkin::new(
            &mesh.positions,
            &mesh.triangles[target.anatomy.parts[0].triangles.clone()],
            &target.anatomy.lower_side,
        )
        .ok_or("no skin")?;
        let places: Vec<_> = (0..SKIN_LANDMARK_COUNT)
            .map(|i| skin.nearest(Lip::of(i), target.landmarks[i].unwrap_or_else(Point3::origin)))
            .collect();
        let neutral = places.iter().map(|p| p.map_or_else(Point3::origin, |p| p.position)).collect();
        let mut frame = motor.puppet().new_frame();
        let info = ClipInfo {
            name: "rendering".into(),
            width: 640,
            height: 480,
            rate: RATE,
            announced_frames: None,
        };
        let (mut frames, mut truth) = (Vec::new(), Vec::new());
        networks.tracker.reset();
        for (index, (contractions, turn)) in (0..).zip(script.contractions.iter().zip(&script.turns)) {
            let eyes = motor.eyes(contractions);
            motor.pose_contractions(contractions, &eyes, &mut frame);
            motor.puppet().place(&mut frame)?;
            let own = UnitQuaternion::from_rotation_matrix(&(level.inverse() * turn * level));
            frame.head = Isometry3::from_parts(Translation3::from(pivot - own * pivot), own);
            let moved: Vec<_> = frame.positions.iter().map(|p| Point3::from(p.map(f64::from))).collect();
            let step = |place: &Option<understudy::anatomy::SkinPlace>| {
                place.and_then(|p| Some(p.on(&moved)? - p.position)).unwrap_or_default()
            };
            truth.push(places.iter().map(step).collect());
            let picture = stage.picture(&frame)?;
            let image = Image::from_rgba(640, 480, picture.as_raw())?;
            let landmarks = networks.tracker.track(&image)?;
            frames.push(TrackedFrame { index, timestamp: RATE.tick(index), landmarks });
        }
        let performance = Performance { info, frames, faces_seen: 1 };
        Ok(Film { performance, focal, truth, turns: script.turns.clone(), neutral })
    }

    fn solve(&mut self, film: &Film, lift: LiftMode, smoothing: Smoothing) -> Result<Motion, Box<dyn Error>> {
        let field_of_view = 2.0 * (f64::from(SIZE[0]) / 2.0 / film.focal).atan().to_degrees();
        let neutral = Some((0.0, (STILL - 2) as f64 / 30.0));
        let options = SolveOptions { lift, smoothing, field_of_view, neutral, accept_neutral: true };
        Ok(Motion::solve(&film.performance, &self.average, &mut self.networks.blendshapes, &options)?)
    }
}

/// Neutral frames first, then the acting.
fn script(contractions: Vec<Vec<f64>>, turns: Vec<Rotation3<f64>>) -> Script {
    let rest = vec![0.0; contractions[0].len()];
    let contractions = std::iter::repeat_n(rest, STILL).chain(contractions).collect();
    let turns = std::iter::repeat_n(Rotation3::identity(), STILL).chain(turns).collect();
    Script { contractions, turns }
}

/// The head's turns of a take, in the level frame.
fn turns(poses: &[(Rotation3<f64>, Vector3<f64>)]) -> Vec<Rotation3<f64>> {
    poses.iter().map(|(rotation, _)| upright() * rotation).collect()
}

fn compare(film: &Film, motion: &Motion) -> Errors {
    let neutral = motion.performer.neutral();
    let (from, to): (Vec<_>, Vec<_>) = (0..SKIN_LANDMARK_COUNT)
        .filter(|&i| is_still(i))
        .map(|i| (neutral[i].coords, film.neutral[i].coords))
        .unzip();
    let turn = rotation_between(&from, &to);
    let eyes = |points: &[Point3<f64>]| (points[33] - points[263]).norm();
    let scale = eyes(&film.neutral) / eyes(neutral);
    let rest = motion.performer.rest().rotation.inverse();
    let mut sums = [Rms::default(); 4];
    for (t, frame) in motion.frames.iter().enumerate().skip(STILL) {
        for i in (0..SKIN_LANDMARK_COUNT).filter(|&i| is_scored(i)) {
            let truth = film.truth[t][i];
            sums[0].add(truth.norm_squared());
            sums[1].add((turn * frame.expression.displacements.vectors[i] * scale - truth).norm_squared());
        }
        let found = upright() * frame.expression.pose.rotation * rest * upright();
        sums[2].add(found.angle_to(&film.turns[t]).to_degrees().powi(2));
        sums[3].add(true_turn(&found).angle_to(&film.turns[t]).to_degrees().powi(2));
    }
    Errors(sums.map(Rms::get))
}

/// A basis that is not the one the face is solved with: every shape stretched and bent differently in different places, as
/// every person's is.
fn personalised(basis: &MuscleBasis, seed: f64) -> MuscleBasis {
    let mut own = basis.clone();
    for (k, element) in own.elements.iter_mut().enumerate() {
        // A few waves of some 8 cm, fixed by the seed.
        let phase = |n: f64| {
            ((seed * 12.9898 + k as f64 * 78.233 + n * 37.719).sin() * 43_758.547).fract()
                * std::f64::consts::TAU
        };
        let all = 1.0 + 0.25 * phase(0.0).sin();
        for (vector, place) in element.vectors.iter_mut().zip(&basis.face) {
            let wave = |n: f64, axis: Vector3<f64>| (axis.dot(&place.coords) / 13.0 + phase(n)).sin();
            let gain = all * (1.0 + 0.2 * wave(1.0, Vector3::x()) + 0.2 * wave(2.0, Vector3::y()));
            let bend =
                Vector3::new(wave(3.0, Vector3::y()), wave(4.0, Vector3::x()), wave(5.0, Vector3::y())) * 0.3;
            *vector = Rotation3::new(bend) * *vector * gain;
        }
    }
    own
}

/// For each scan the lifts side by side, with the scan's own shapes changed as every person's are (three performers).
pub fn section(folder: &Path, entries: &[Entry], scans: &[PathBuf]) -> Result<String, Box<dyn Error>> {
    let names =
        entries.iter().find(|e| e.kind == "basis").and_then(|e| e.shapes.clone()).ok_or("no basis")?;
    let take = entries.iter().find(|e| e.name == "exact_1_noise0").ok_or("no take")?;
    let take = Take::read(folder, take)?;
    let turns = turns(&take.poses());
    let generic = MuscleBasis::arkit();
    let reordered = |row: &Vec<f64>| -> Vec<f64> {
        let place = |name: &str| names.iter().position(|n| n == name).map_or(0.0, |k| row[k]);
        generic.names().map(place).collect()
    };
    let acting: Vec<Vec<f64>> = take.weights().iter().map(reordered).collect();
    let still = vec![vec![0.0; generic.elements.len()]; turns.len()];
    let mut text = String::from(
        "| scan | performance | lift | true motion, mm | error, mm | turn, ° | turn, corrected, ° |\n|---|---|---|---:|---:|---:|---:|\n",
    );
    for scan in scans {
        for (what, contractions, seeds) in [("acting", &acting, 1..4), ("neutral, turning", &still, 1..2)] {
            let mut sums = [[0.0; 4]; 2];
            let performers = seeds.len() as f64;
            for seed in seeds {
                let mut actor = Actor::new(scan, &personalised(generic, f64::from(seed)))?;
                let film = actor.film(&script(contractions.clone(), turns.clone()))?;
                for (sum, lift) in sums.iter_mut().zip([LiftMode::Plane, LiftMode::default()]) {
                    let Errors(errors) = compare(&film, &actor.solve(&film, lift, Smoothing::Off)?);
                    sum.iter_mut().zip(errors).for_each(|(sum, error)| *sum += error * error / performers);
                }
            }
            let stem = scan.file_stem().unwrap_or_default().to_string_lossy();
            for (lift, sum) in ["plane", "muscles"].iter().zip(sums) {
                let [motion, error, turn, corrected] = sum.map(f64::sqrt);
                let _ = writeln!(
                    text,
                    "| {stem} | {what} | {lift} | {motion:.2} | {error:.2} | {turn:.2} | {corrected:.2} |"
                );
            }
        }
    }
    Ok(text)
}
