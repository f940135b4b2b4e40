//! The thesis's appendix A and figure 5-12 as one sheet: what an expression is on one face, what becomes of it when it is
//! measured and shown again, and what it is on another face, beside the truth.
//!
//! `cargo run --release --example appendix -- FACES --scan scan.obj -o sheet.png`, with FACES made by
//! `scripts/export_action_faces.py`.

#[path = "shared/eyeballs.rs"]
mod eyeballs;

use std::{error::Error, path::PathBuf};

use clap::Parser;
use eyeballs::add_eyeball;
use image::RgbaImage;
use nalgebra::{Matrix4, Point3, Rotation3, Vector3};
use serde::Deserialize;
use understudy::{
    actions::{ActionKey, ActionLibrary, ActionWeights, Catalogue, Merge, measure_moved},
    anatomy::{Anatomy, SidedSkin, eye_landmarks},
    assets::Assets,
    export::Pc2Reader,
    lift::Side,
    pipeline::{HeadMode, Networks, Photographer, Stage, Target, TargetOptions},
    rig::{ActionRig, Method, TargetFace, facing},
    scan::{Mesh, NormalSolver, Surface, read_mesh},
    tracking::{LANDMARK_COUNT, TrackerOptions},
    view::{Gpu, Look, Model, Renderer, Smoothing, contact_sheet, save_png},
};

/// The thesis's action units (§5.5.1).
const UNITS: [u8; 8] = [1, 2, 4, 12, 14, 15, 17, 20];
/// Magnitudes of figure 5-12, and the units shown at them.
const MAGNITUDES: [f64; 6] = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0];
const LADDERS: [u8; 2] = [4, 12];
const SIDE: u32 = 300;

#[derive(Parser)]
struct Options {
    /// What `scripts/export_action_faces.py` wrote
    faces: PathBuf,
    /// The face that an expression is measured on
    #[arg(long, default_value = "ict_1")]
    source: String,
    /// The face that it is carried to
    #[arg(long, default_value = "ict_4")]
    target: String,
    /// A scan that shows the magnitudes
    #[arg(long)]
    scan: PathBuf,
    /// The sheet
    #[arg(short, long)]
    output: PathBuf,
}

#[derive(Deserialize)]
struct Faces {
    ict_landmarks: Vec<usize>,
    faces: Vec<Named>,
}

#[derive(Deserialize)]
struct Named {
    name: String,
    shapes: Vec<String>,
}

/// A face whose expressions are known.
struct Face {
    mesh: Mesh,
    surface: Surface,
    landmarks: Vec<Option<Point3<f64>>>,
    shapes: Vec<String>,
    cache: Pc2Reader,
}

impl Face {
    fn read(options: &Options, faces: &Faces, name: &str) -> Result<Self, Box<dyn Error>> {
        let named = faces.faces.iter().find(|face| face.name == name).ok_or("no such face")?;
        let mesh = read_mesh(&options.faces.join(format!("{name}.obj")))?;
        let mut landmarks: Vec<_> =
            faces.ict_landmarks.iter().map(|&v| mesh.positions.get(v).copied()).collect();
        landmarks.resize(LANDMARK_COUNT, None);
        Ok(Self {
            surface: Surface::new(&mesh)?,
            cache: Pc2Reader::open(&options.faces.join(format!("{name}.pc2")))?,
            shapes: named.shapes.clone(),
            landmarks,
            mesh,
        })
    }

    /// The true expression of an action unit, both sides.
    fn truth(&mut self, au: u8) -> Result<Vec<Point3<f64>>, Box<dyn Error>> {
        let facts = Catalogue::get().action(au).ok_or("unknown unit")?;
        let mut moved = self.mesh.positions.clone();
        let mut sample = Vec::new();
        for shape in &facts.shapes {
            for (index, name) in self.shapes.iter().enumerate() {
                if name == shape || [format!("{shape}_L"), format!("{shape}_R")].contains(name) {
                    self.cache.read_sample(index, &mut sample)?;
                    for ((moved, rest), now) in moved.iter_mut().zip(&self.mesh.positions).zip(&sample) {
                        *moved += Point3::from(now.map(f64::from)) - rest;
                    }
                }
            }
        }
        Ok(moved)
    }

    /// The face as a library's action moves it.
    fn animated(&self, library: &ActionLibrary, key: ActionKey) -> Result<Vec<Point3<f64>>, Box<dyn Error>> {
        let face = TargetFace::new(self.landmarks.clone(), facing(&library.face, &self.landmarks))?;
        let mut anatomy = Anatomy::as_scanned(&self.mesh);
        let prepared = Anatomy::prepare(&self.mesh, &self.surface, &self.landmarks, None);
        anatomy.lower_side.copy_from_slice(&prepared.lower_side[..self.mesh.positions.len()]);
        let rig = ActionRig::new(library, &face, &anatomy, &self.surface, Method::default(), Merge::Sum)?;
        let mut weights = ActionWeights::default();
        weights.set(key, 1.0)?;
        let mut frame = rig.new_frame();
        rig.pose(&weights, &mut frame)?;
        Ok(frame.positions.iter().map(|p| Point3::from(p.map(f64::from))).collect())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse();
    let faces: Faces = serde_json::from_str(&std::fs::read_to_string(options.faces.join("faces.json"))?)?;
    let mut source = Face::read(&options, &faces, &options.source)?;
    let mut target = Face::read(&options, &faces, &options.target)?;
    let skin = SidedSkin::of_scan(&source.mesh, &source.surface, &source.landmarks).ok_or("no triangles")?;
    let gpu = Gpu::headless()?;
    let mut easel = Easel::new(&gpu)?;
    let mut cells = Vec::new();
    for au in UNITS {
        let truth = source.truth(au)?;
        let measured = measure_moved(&source.surface, &skin, &source.landmarks, &truth);
        let mut library = ActionLibrary::built_in().empty("source");
        library.face = measured
            .places
            .iter()
            .map(|place| place.ok_or("a handle is missing"))
            .collect::<Result<_, _>>()?;
        let key = ActionKey { au, side: None };
        library.add(key, &measured.vectors, [0.0; 2], "source");
        let own = source.animated(&library, key)?;
        let carried = target.animated(&library, key)?;
        let wanted = target.truth(au)?;
        let name = &Catalogue::get().action(au).ok_or("unknown unit")?.name;
        for (face, positions, caption) in [
            (&source, &source.mesh.positions, format!("AU{au} {name}: source")),
            (&source, &own, "animated source".to_owned()),
            (&source, &truth, "true source".to_owned()),
            (&target, &target.mesh.positions, "target".to_owned()),
            (&target, &carried, "animated target".to_owned()),
            (&target, &wanted, "true target".to_owned()),
        ] {
            cells.push((easel.paint(&gpu, face, positions)?, caption));
        }
    }
    cells.extend(ladders(&options, &gpu)?);
    let cells: Vec<_> = cells.iter().map(|(picture, caption)| (picture, caption.as_str())).collect();
    save_png(&options.output, &contact_sheet(&cells, 6))?;
    Ok(())
}

/// A scan at growing magnitudes (figure 5-12).
fn ladders(options: &Options, gpu: &Gpu) -> Result<Vec<(RgbaImage, String)>, Box<dyn Error>> {
    let mut networks = Networks::load(&Assets::locate()?, TrackerOptions::default())?;
    let mut target = Target::load(&options.scan, &TargetOptions::default(), gpu, &mut networks.tracker)?;
    target.prepare(gpu)?;
    let library = ActionLibrary::built_in();
    let face = TargetFace::new(target.landmarks.clone(), facing(&library.face, &target.landmarks))?;
    let method = Method::default();
    let rig = ActionRig::new(library, &face, &target.anatomy, &target.surface, method, Merge::Parallel)?;
    let (look, still) = (Look::default(), HeadMode::Still);
    let mut stage = Stage::new(gpu, &target, &face.level, [SIDE; 2], look, still, Smoothing::Samples4)?;
    let (centre, eyes) = target.centre_and_eyes();
    stage.look_at(centre, 1.25 * eyes, 0.0);
    let mut frame = rig.new_frame();
    let mut cells = Vec::new();
    for au in LADDERS {
        for magnitude in MAGNITUDES {
            let mut weights = ActionWeights::default();
            weights.set_text(&format!("{au}={magnitude}"))?;
            rig.pose(&weights, &mut frame)?;
            cells.push((stage.picture(&frame)?, format!("AU{au}, m = {magnitude}")));
        }
    }
    Ok(cells)
}

/// Draws faces as clay, with balls in their empty sockets.
struct Easel {
    renderer: Renderer,
}

impl Easel {
    fn new(gpu: &Gpu) -> Result<Self, Box<dyn Error>> {
        Ok(Self { renderer: Renderer::new(gpu, SIDE, SIDE, Smoothing::Samples4)? })
    }

    fn paint(
        &mut self,
        gpu: &Gpu,
        face: &Face,
        positions: &[Point3<f64>],
    ) -> Result<RgbaImage, Box<dyn Error>> {
        let mut mesh =
            Mesh { positions: positions.to_vec(), triangles: face.mesh.triangles.clone(), ..Mesh::default() };
        mesh.colours = vec![[0.74, 0.6, 0.52]; positions.len()];
        for eye in Side::BOTH.map(eye_landmarks) {
            if let Some((outer, inner)) = face.landmarks[eye.outer].zip(face.landmarks[eye.inner]) {
                let radius = 0.42 * (outer - inner).norm();
                let centre = nalgebra::center(&outer, &inner) - Vector3::z() * (0.5 * radius);
                add_eyeball(&mut mesh, centre, radius);
            }
        }
        let moved = mesh.positions_f32();
        let normals = NormalSolver::once(&mesh.triangles, &moved);
        let model = Model::upload(gpu, &mesh)?;
        let at = |i: usize| face.landmarks[i].unwrap_or_else(Point3::origin);
        let centre =
            nalgebra::center(&nalgebra::center(&at(33), &at(263)), &nalgebra::center(&at(61), &at(291)));
        let radius = 1.25 * (at(33) - at(263)).norm();
        let camera = Photographer::camera(centre, radius, &Rotation3::identity(), [SIDE; 2]);
        self.renderer.draw(&model, &moved, &normals, &Matrix4::identity(), &camera, &Look::default())?;
        Ok(self.renderer.read_picture()?)
    }
}
