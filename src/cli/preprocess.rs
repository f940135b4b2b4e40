//! `understudy preprocess`: a scan in, a clean quad grid of its face out, normalised if wanted.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use clap::{Args, ValueEnum};
use nalgebra::Point3;
use understudy::{
    assets::Assets,
    export::{Draft, ExportError, obj_files, write_obj, write_quad_obj},
    grid::{FaceGrid, Normalisation, TransformRecord},
    pipeline::{GridOptions, GriddedFace, Networks, PipelineError, ReferenceFace, Target, grid_picture},
    scan::{Material, Mesh, Texture, TextureFormat, read_mesh, write_landmarks},
    tracking::TrackerOptions,
    view::{Gpu, save_png},
};

use super::{
    Outcome, inputs,
    target::{ScanArgs, report},
};

const EXAMPLES: &str = "\
Examples:
  understudy preprocess scan.obj -o grid.obj -o picture.png
  understudy preprocess bs000_N_N_0.bnt --landmarks bs000_N_N_0.lm3 -o grid.obj
  understudy preprocess scan.obj --normalise affine -o grid.obj
  understudy preprocess scan.obj --normalise similarity --to average.obj -o grid.obj
  understudy preprocess --undo grid.transform.json moved.obj -o back.obj

Outputs:
  .obj  the face as a quad grid, with its texture (.mtl, .png), its landmarks (.landmarks.json) and the way back to the
        scan (.transform.json) beside it
  .png  the scan, the grid, and the grid with its colours and landmarks";

/// Make a clean quad grid of a scan's face, and bring it to an average face
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Preprocess {
    /// The scan: .obj, .ply, .stl, .glb, .gltf or .bnt; with --undo a mesh in the frame of the grid
    scan: PathBuf,
    #[command(flatten)]
    how: ScanArgs,
    /// Grid points across and down
    #[arg(long, value_name = "NxM", default_value = "150x150", value_parser = parse_grid)]
    grid: [usize; 2],
    /// Millimetres of face around the outermost landmarks
    #[arg(long, value_name = "MM", default_value_t = 10.0, value_parser = parse_margin)]
    margin: f64,
    /// Pixels of the baked texture's longer side
    #[arg(long, value_name = "PIXELS", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(16..=8192))]
    texture: u32,
    /// How the face is brought to the average face
    #[arg(long, value_enum, default_value_t = Method::None)]
    normalise: Method,
    /// The average face: an .obj with its .landmarks.json beside it, as `average` writes them; MediaPipe's canonical
    /// face if not given
    #[arg(long, value_name = "AVERAGE")]
    to: Option<PathBuf>,
    /// Bring SCAN back to the frame of the scan from which this transform was made
    #[arg(long, value_name = "FILE.transform.json",
        conflicts_with_all = ["landmarks", "unit", "to", "normalise", "grid", "margin", "texture"])]
    undo: Option<PathBuf>,
    /// What to write, by extension: .obj, .png; may be given several times
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Method {
    /// Not at all: the grid lies on the scan
    None,
    /// Outer eye corners, chin and nose tip fall on the average's exactly; may shear the face (thesis, eq. 5.1-5.4)
    Affine,
    /// Turned, scaled and shifted so that all landmarks come near the average's
    Similarity,
}

impl Method {
    fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Affine => "affine",
            Self::Similarity => "similarity",
        }
    }
}

/// An output's place, by what it is.
enum Output<'a> {
    Grid(&'a Path),
    Picture(&'a Path),
}

impl Preprocess {
    pub fn run(&self, quiet: bool) -> Outcome {
        if let Some(record) = &self.undo {
            return self.undo(record, quiet);
        }
        let outputs = self.outputs()?;
        if self.to.is_some() && self.normalise == Method::None {
            return Err(
                "--to names an average face, but --normalise says none. Add --normalise affine or similarity"
                    .into(),
            );
        }
        let assets = Assets::locate()?;
        let reference = match (self.normalise, &self.to) {
            (Method::None, _) => None,
            (_, Some(path)) => Some(ReferenceFace::read(path)?),
            (_, None) => Some(ReferenceFace::canonical(&assets.verified("canonical_face")?)?),
        };
        let gpu = Gpu::headless()?;
        let mut networks = Networks::load(&assets, TrackerOptions::default())?;
        let target = Target::load(&self.scan, &self.how.options(), &gpu, &mut networks.tracker)?;
        if !quiet {
            report(&target);
        }
        let [columns, rows] = self.grid;
        let options = GridOptions { columns, rows, margin: self.margin, texture: self.texture };
        let mut face = target.grid(&gpu, &options)?;
        if !quiet {
            report_grid(&target, &face);
        }
        let pictured = outputs.iter().any(|output| matches!(output, Output::Picture(_)));
        let picture = pictured.then(|| grid_picture(&gpu, &target, &face)).transpose()?;
        let record = self.normalised(&target, &mut face, reference.as_ref())?;
        if !quiet && self.normalise != Method::None {
            report_record(&record);
        }
        for output in &outputs {
            match output {
                Output::Grid(path) => self.write_grid(path, &target, &face, &record, quiet)?,
                Output::Picture(path) => {
                    if let Some(picture) = &picture {
                        save_png(path, picture)?;
                        wrote(path, quiet);
                    }
                }
            }
        }
        Ok(())
    }

    /// The outputs, refused early where they cannot be written or would meet each other.
    fn outputs(&self) -> Result<Vec<Output<'_>>, Box<dyn std::error::Error>> {
        let mut read: Vec<&Path> = vec![&self.scan];
        read.extend(self.to.as_deref());
        read.extend(self.how.landmarks());
        let mut outputs = Vec::new();
        let mut places: Vec<PathBuf> = Vec::new();
        for path in &self.output {
            let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
            let made = match extension.as_deref() {
                Some("obj") => {
                    outputs.push(Output::Grid(path));
                    let beside = ["landmarks.json", "transform.json"];
                    let mut made = obj_files(path, &textured());
                    made.extend(beside.iter().map(|e| path.with_extension(e)));
                    made
                }
                Some("png") => {
                    outputs.push(Output::Picture(path));
                    vec![path.clone()]
                }
                _ => return Err(format!("cannot write {}: name it .obj or .png", path.display()).into()),
            };
            for place in made {
                if places.contains(&place) {
                    return Err(format!(
                        "{} would be written twice: an .obj has its texture beside it as .png. Give the outputs \
                         different names",
                        place.display()
                    )
                    .into());
                }
                inputs::spare(&place, &read)?;
                drop(Draft::create(&place)?);
                places.push(place);
            }
        }
        Ok(outputs)
    }

    /// Moves the face to the average face, and says how.
    fn normalised(
        &self,
        target: &Target,
        face: &mut GriddedFace,
        reference: Option<&ReferenceFace>,
    ) -> Result<TransformRecord, Box<dyn std::error::Error>> {
        let landmarks = &face.landmarks;
        let found = match (self.normalise, reference) {
            (Method::Affine, Some(to)) => Normalisation::affine(landmarks, &to.landmarks),
            (Method::Similarity, Some(to)) => Normalisation::similarity(landmarks, &to.landmarks),
            _ => Ok(Normalisation::none()),
        };
        let at_fault = |source| PipelineError::Grid { scan: self.scan.clone(), source };
        let found = found.map_err(at_fault)?;
        let own = (format!("own frame of {}", file_name(&self.scan)), target.unit.millimetres_per_unit());
        let to =
            reference.map_or_else(|| own.clone(), |to| (format!("{}, nose tip at the origin", to.name), 1.0));
        let record = TransformRecord::new(
            self.normalise.name(),
            &found.matrix,
            own,
            to,
            found.condition_number,
            found.landmarks,
        )
        .ok_or_else(|| {
            format!("{}: the face cannot be normalised and returned. Check --unit", self.scan.display())
        })?;
        face.transform(&record.matrix());
        Ok(record)
    }

    /// The grid with everything that stands beside it.
    fn write_grid(
        &self,
        path: &Path,
        target: &Target,
        face: &GriddedFace,
        record: &TransformRecord,
        quiet: bool,
    ) -> Outcome {
        let textures: Vec<PathBuf> = target
            .mesh()
            .materials
            .iter()
            .filter_map(|material| Some(self.scan.with_file_name(&material.texture.as_ref()?.name)))
            .collect();
        let textures: Vec<&Path> = textures.iter().map(PathBuf::as_path).collect();
        let files = obj_files(path, &face.mesh);
        for file in &files {
            inputs::spare(file, &textures)?;
        }
        let landmarks = path.with_extension("landmarks.json");
        write_landmarks(&landmarks, &face.landmark_file(&stem(path)))?;
        let transform = path.with_extension("transform.json");
        write_whole(&transform, &record.to_json()?)?;
        write_quad_obj(path, &face.mesh, &face.quads)?;
        for file in [landmarks, transform].iter().chain(&files) {
            wrote(file, quiet);
        }
        Ok(())
    }

    /// Brings a mesh back.
    fn undo(&self, record: &Path, quiet: bool) -> Outcome {
        let [output] = &self.output[..] else {
            return Err("--undo writes one .obj. Give -o once".into());
        };
        if output.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("obj")) {
            return Err(format!("cannot write {}: name it .obj", output.display()).into());
        }
        inputs::spare(output, &[&self.scan, record])?;
        drop(Draft::create(output)?);
        let text = fs::read_to_string(record)
            .map_err(|error| format!("cannot read {}: {error}. Check the path", record.display()))?;
        let transform =
            TransformRecord::parse(&text).map_err(|error| format!("{}: {error}", record.display()))?;
        let moved = read_mesh(&self.scan)?;
        let back = |p: &Point3<f64>| transform.undo(p);
        let mesh = Mesh { positions: moved.positions.iter().map(back).collect(), ..moved };
        for file in obj_files(output, &mesh) {
            inputs::spare(&file, &[&self.scan, record])?;
        }
        write_obj(output, &mesh)?;
        if !quiet {
            say!("{} vertices brought back to the {}", mesh.positions.len(), transform.from);
        }
        wrote(output, quiet);
        Ok(())
    }
}

fn report_grid(target: &Target, face: &GriddedFace) {
    let (cleaned, grid) = (&face.cleaned, &face.grid);
    say!(
        "cleaned: {} parts that are not the face, {} triangles before or behind it, {} spikes drawn back, {} removed",
        cleaned.other_parts,
        cleaned.far_triangles,
        cleaned.spikes_drawn_back,
        cleaned.spikes_removed,
    );
    say!(
        "grid: {} on the face, {} quads, {} left out at jumps in depth",
        extent(grid),
        grid.cells.len(),
        grid.jumps,
    );
    let [mean, largest] = face.snapped;
    say!(
        "landmarks: {} on the nearest grid vertex, moved by {mean:.2} mm, at most {largest:.2}",
        face.landmarks.iter().flatten().count()
    );
    if face.beside > 0 {
        tracing::warn!(
            "{}: {} landmarks lie beside the grid and are left out",
            target.scan.name,
            face.beside
        );
    }
}

fn report_record(record: &TransformRecord) {
    let [a, b, c] = record.singular_values;
    say!(
        "normalised: {} over {} landmarks to {}; scales {a:.3}, {b:.3}, {c:.3}; condition number {:.2}",
        record.method,
        record.landmarks.len(),
        record.to,
        record.condition_number,
    );
}

/// A mesh with a texture, of which only the files' names are asked.
fn textured() -> Mesh {
    let texture = Texture { name: String::new(), format: TextureFormat::Png, bytes: Vec::new() };
    let material =
        Material { name: String::new(), base_colour: [1.0; 4], texture: Some(Arc::new(texture)), gloss: 0.0 };
    Mesh { materials: vec![material], ..Mesh::default() }
}

fn write_whole(path: &Path, text: &str) -> Result<(), ExportError> {
    let mut draft = Draft::create(path)?;
    draft.append(text.as_bytes())?;
    draft.commit()
}

fn wrote(path: &Path, quiet: bool) {
    if !quiet {
        say!("wrote {}", path.display());
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

/// Where a grid lies and how much of it is on the face, for a sentence to go on.
pub fn extent(grid: &FaceGrid) -> String {
    let step = grid.raster.step();
    let share = 100.0 * grid.valid() as f64 / grid.raster.len() as f64;
    let [columns, rows] = [grid.raster.columns, grid.raster.rows];
    format!("{columns}x{rows} points {:.2} x {:.2} mm apart, {} ({share:.1} %)", step.x, step.y, grid.valid())
}

/// Two numbers such as `150x150`.
pub fn parse_grid(text: &str) -> Result<[usize; 2], String> {
    let sides =
        text.split_once('x').and_then(|(a, b)| Some([a.trim().parse().ok()?, b.trim().parse().ok()?]));
    sides
        .filter(|sides: &[usize; 2]| sides.iter().all(|side| (2..=2000).contains(side)))
        .ok_or_else(|| "write two numbers from 2 to 2000, such as 150x150".to_owned())
}

/// Millimetres that may surround a face.
pub fn parse_margin(text: &str) -> Result<f64, String> {
    let margin = text.parse().ok().filter(|margin: &f64| (-50.0..=500.0).contains(margin));
    margin.ok_or_else(|| "write millimetres from -50 to 500, such as 10".to_owned())
}
