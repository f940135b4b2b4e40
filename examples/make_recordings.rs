//! Makes the recordings with known truth: a scan performs a motion that is written down, and is filmed.
//!
//! ```text
//! cargo run --release --example make_recordings -- recordings
//! ```
//!
//! `recordings/README.md` says what is in them. Each film has a table beside it with the head's pose and the size of
//! every motion in every frame.

use std::{
    error::Error,
    f64::consts::{PI, TAU},
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
};

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use understudy::{
    assets::Assets,
    capture::FrameRate,
    export::{Mp4Settings, Mp4Writer},
    lift::upright,
    pipeline::{Networks, Photographer, Target, TargetOptions},
    scan::NormalSolver,
    spline::{Kernel, Options, Regularisation, Warp},
    tracking::{Region, SKIN_LANDMARK_COUNT, TrackerOptions, index, landmark_table},
    view::{Gpu, Lighting, Look, Model, Renderer, Smoothing},
};

const RATE: FrameRate = FrameRate { numerator: 25, denominator: 1 };
const SIZE: [u32; 2] = [400, 400];
/// Seconds.
const LENGTH: f64 = 6.0;
/// Radius of the framed ball over the outer canthal distance: room for a turning head.
const FRAMING: f64 = 1.75;
/// Distance over which a smile's pull on the skin fades, in outer canthal distances.
const PULL: f64 = 0.17;
/// Landmarks of the lower lip between the corners.
const LOWER_LIP: [usize; 36] = [
    146, 91, 181, 84, 17, 314, 405, 321, 375, 95, 88, 178, 87, 14, 317, 402, 318, 324, 77, 90, 180, 85, 16,
    315, 404, 320, 307, 96, 89, 179, 86, 15, 316, 403, 319, 325,
];

/// What the actor does at one moment.
#[derive(Clone, Copy, Default)]
struct Pose {
    /// Rx, Ry, Rz of the motion table: pitch, yaw and roll in the camera's frame, degrees.
    turn: [f64; 3],
    /// How far the chin is lowered, millimetres.
    jaw: f64,
    /// How far each corner of the mouth is pulled, millimetres.
    smile: f64,
    /// How far the brows are raised, millimetres.
    brow: f64,
}

/// A scan with the shares of every vertex in the three motions of its face.
struct Actor {
    target: Target,
    warp: Warp,
    /// For each control: how it moves by a millimetre of jaw, smile and brow.
    motions: Vec<[Vector3<f64>; 3]>,
}

impl Actor {
    fn new(target: Target) -> Result<Self, Box<dyn Error>> {
        let (_, eyes) = target.centre_and_eyes();
        let mut controls: Vec<Point3<f64>> = Vec::new();
        let mut motions = Vec::new();
        for landmark in 0..SKIN_LANDMARK_COUNT {
            let Some(place) = target.landmarks[landmark] else { continue };
            if controls.iter().all(|other| (other - place).norm() > 0.02) {
                controls.push(place);
                motions.push(motions_of(landmark, &place, &target, eyes));
            }
        }
        let far = |p: &Point3<f64>| controls.iter().all(|c| (c - p).norm() > 0.3 * eyes);
        let mesh = target.mesh();
        let step = (mesh.positions.len() / 2000).max(1);
        let anchors: Vec<_> =
            mesh.positions.iter().step_by(step).filter(|p| far(p)).step_by(4).copied().collect();
        let options = Options { regularisation: Regularisation::Absolute(1e-4 * eyes), ..Options::default() };
        let warp = Warp::new(Kernel::Linear, &controls, &anchors, &mesh.positions, options)?;
        Ok(Self { target, warp, motions })
    }

    /// The vertices in a pose of the face, before the head turns.
    fn vertices(&self, pose: &Pose, out: &mut Vec<[f32; 3]>) -> Result<(), Box<dyn Error>> {
        let moved: Vec<[f32; 3]> = self
            .motions
            .iter()
            .map(|[jaw, smile, brow]| jaw * pose.jaw + smile * pose.smile + brow * pose.brow)
            .map(|v| v.map(|value| value as f32).into())
            .collect();
        let rest = &self.target.mesh().positions;
        out.resize(rest.len(), [0.0; 3]);
        self.warp.apply(&moved, out)?;
        for (vertex, rest) in out.iter_mut().zip(rest) {
            *vertex = (Vector3::from(*vertex) + rest.coords.map(|value| value as f32)).into();
        }
        Ok(())
    }

    /// The head's turn about a point between the ears, in the scan's frame.
    fn head(&self, pose: &Pose) -> Isometry3<f64> {
        let (centre, eyes) = self.target.centre_and_eyes();
        let pivot = (centre - Vector3::z() * eyes).coords;
        let axis = |axis: Vector3<f64>, degrees: f64| Rotation3::new(axis * degrees.to_radians());
        let [pitch, yaw, roll] = pose.turn;
        let camera = axis(Vector3::x(), pitch) * axis(Vector3::y(), yaw) * axis(Vector3::z(), roll);
        // The camera's axes point right, down and forwards; the scan's right, up and backwards.
        let turn = UnitQuaternion::from_rotation_matrix(&(upright() * camera * upright()));
        Isometry3::from_parts(Translation3::from(pivot - turn * pivot), turn)
    }
}

/// How a landmark moves by one millimetre of jaw, smile and brow.
fn motions_of(landmark: usize, place: &Point3<f64>, target: &Target, eyes: f64) -> [Vector3<f64>; 3] {
    let at = |i: usize| target.landmarks[i].unwrap_or(*place);
    let (right, left, chin) = (at(index::MOUTH_RIGHT), at(index::MOUTH_LEFT), at(index::CHIN));
    let mouth = nalgebra::center(&right, &left);
    let region = landmark_table()[landmark].region;

    let half = (left.x - right.x) / 2.0;
    let across = (1.0 - ((place.x - mouth.x) / half).powi(2)).max(0.0).sqrt();
    let below = ((mouth.y - place.y) / (mouth.y - chin.y)).clamp(0.0, 1.0);
    let beside = (-((place.x - mouth.x) / (0.5 * eyes)).powi(2)).exp();
    let jaw = match region {
        _ if LOWER_LIP.contains(&landmark) => across,
        Region::Jaw | Region::Oval | Region::Cheeks => below.sqrt() * beside,
        _ => 0.0,
    };

    let pull = |corner: Point3<f64>, side: f64| {
        let share = (-((place - corner).norm() / (PULL * eyes)).powi(2)).exp();
        Vector3::new(0.8 * side, 0.6, -0.2) * share
    };
    let smile = match region {
        Region::Lips | Region::Cheeks | Region::Jaw => pull(right, -1.0) + pull(left, 1.0),
        _ => Vector3::zeros(),
    };

    let brows = f64::midpoint(at(index::RIGHT_BROW).y, at(index::LEFT_BROW).y);
    let brow = match region {
        Region::Brows => 1.0,
        Region::Other | Region::Oval if place.y > brows => (1.0 - (place.y - brows) / (0.5 * eyes)).max(0.0),
        _ => 0.0,
    };
    [Vector3::new(0.0, -jaw, -0.15 * jaw), smile, Vector3::new(0.0, brow, 0.0)]
}

/// 0 before `start` and after `start + length`, 1 in the middle, without a corner.
fn pulse(time: f64, start: f64, length: f64) -> f64 {
    let phase = ((time - start) / length).clamp(0.0, 1.0);
    (phase * PI).sin().powi(2)
}

/// Grows from 0 to 1 in the half second after the neutral second.
fn awake(time: f64) -> f64 {
    ((time - 1.0) / 0.5).clamp(0.0, 1.0)
}

fn turning(time: f64) -> Pose {
    let wave = |period: f64| ((time - 1.0) / period * TAU).sin() * awake(time);
    Pose { turn: [11.0 * wave(1.9), 20.0 * wave(3.1), 9.0 * wave(2.3)], ..Pose::default() }
}

fn acting(time: f64) -> Pose {
    Pose {
        jaw: 14.0 * (pulse(time, 1.0, 0.9) + 0.6 * pulse(time, 1.9, 0.7) + pulse(time, 5.0, 0.9)),
        smile: 7.0 * (pulse(time, 2.5, 1.2) + 0.6 * pulse(time, 4.9, 1.0)),
        brow: 5.0 * (pulse(time, 3.6, 1.0) + 0.7 * pulse(time, 4.5, 0.7)),
        ..Pose::default()
    }
}

fn both(time: f64) -> Pose {
    let turn = turning(time).turn.map(|angle| angle * 0.6);
    Pose { turn, ..acting(time) }
}

fn film(
    gpu: &Gpu,
    actor: &Actor,
    look: Look,
    play: fn(f64) -> Pose,
    folder: &Path,
    name: &str,
) -> Result<(), Box<dyn Error>> {
    let mesh = actor.target.mesh();
    let (centre, eyes) = actor.target.centre_and_eyes();
    let camera = Photographer::camera(centre, FRAMING * eyes, &Rotation3::identity(), SIZE);
    let model = Model::upload(gpu, mesh)?;
    let mut renderer = Renderer::new(gpu, SIZE[0], SIZE[1], Smoothing::Samples4)?;
    let solver = NormalSolver::new(&mesh.triangles, mesh.positions.len());
    let mut normals = vec![[0.0; 3]; mesh.positions.len()];
    let (mut vertices, mut rgba) = (Vec::new(), Vec::new());
    let path = folder.join(name).with_extension("mp4");
    let mut writer = Mp4Writer::create(&path, Mp4Settings::new(SIZE[0], SIZE[1], RATE))?;
    let mut truth = "frame,timestamp,pose_Rx,pose_Ry,pose_Rz,jaw_mm,smile_mm,brow_mm,eyes_mm\n".to_owned();
    for frame in 0..(LENGTH * RATE.per_second()) as u64 {
        let time = RATE.tick(frame).seconds();
        let pose = play(time);
        actor.vertices(&pose, &mut vertices)?;
        solver.update(&vertices, &mut normals);
        let world = actor.head(&pose).to_homogeneous();
        renderer.draw(&model, &vertices, &normals, &world, &camera, &look)?;
        renderer.read(&mut rgba)?;
        writer.write_picture(&rgba)?;
        let [pitch, yaw, roll] = pose.turn.map(f64::to_radians);
        writeln!(
            truth,
            "{},{time:.3},{pitch:.6},{yaw:.6},{roll:.6},{:.3},{:.3},{:.3},{eyes:.3}",
            frame + 1,
            pose.jaw,
            pose.smile,
            pose.brow
        )?;
    }
    writer.commit()?;
    fs::write(path.with_extension("csv"), truth)?;
    println!("{}: {} bytes", path.display(), fs::metadata(&path)?.len());
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).map(PathBuf::from).ok_or("name the folder to write to")?;
    let assets = Assets::locate()?;
    for companion in ["james_mtl", "james_jpg"] {
        assets.verified(companion)?;
    }
    let gpu = Gpu::headless()?;
    let mut networks = Networks::load(&assets, TrackerOptions::default())?;
    let mut cast = |asset: &str| -> Result<Actor, Box<dyn Error>> {
        let scan = assets.verified(asset)?;
        Actor::new(Target::load(&scan, &TargetOptions::default(), &gpu, &mut networks.tracker)?)
    };
    let (james, average) = (cast("james_obj")?, cast("template_ply")?);
    film(&gpu, &james, Look::default(), turning, &folder, "james_turns")?;
    film(&gpu, &james, Look::default(), acting, &folder, "james_acts")?;
    film(&gpu, &average, Look::default().lit_by(Lighting::Clay), both, &folder, "average_turns_and_acts")
}
