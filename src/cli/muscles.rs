//! `understudy muscles`: a basis of muscles as shapes on a scan.

use std::path::{Path, PathBuf};

use clap::Args;
use understudy::{
    assets::Assets,
    export::{Draft, write_basis},
    muscle::MuscleBasis,
    pipeline::{HeadMode, MuscleShapes, Networks, Stage, muscle_motor},
    rig::WarpKind,
    tracking::TrackerOptions,
    view::{Gpu, Look, Smoothing, save_png},
};

use super::{Outcome, basis::BasisArgs, inputs, method::MethodArgs, progress, target::ScanArgs};

const EXAMPLES: &str = "\
Examples:
  understudy muscles --target scan.obj -o muscles.png
  understudy muscles --target scan.obj --basis arkit -o arkit.glb
  understudy muscles --target scan.obj -o sculpts/          one .obj a muscle, to be sculpted further
  understudy muscles --target scan.obj --basis sculpts/ -o mine.json -o mine.png

Outputs:
  .png    a picture of every muscle, fully contracted
  .glb    the scan with a morph target a muscle: Blender, Unreal, three.js
  .json   the basis for `animate --basis` and `refine --basis`
  folder  neutral.obj and one .obj a muscle, on one mesh; end its name with /";

/// Pixels of the sheet's pictures.
const SIDE: u32 = 360;

/// Show what each muscle does to a scan, or write the shapes to be sculpted further
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Muscles {
    /// The scan: .obj, .ply, .stl, .glb, .gltf or .bnt
    #[arg(short, long, value_name = "SCAN")]
    target: PathBuf,
    #[command(flatten)]
    scan: ScanArgs,
    #[command(flatten)]
    basis: BasisArgs,
    /// What to write, by extension: .png, .glb, .json, or a folder; may be given several times
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    #[command(flatten)]
    method: MethodArgs,
    /// Leave lips and eyes as they were scanned; shapes then have the scan's own mesh
    #[arg(long)]
    as_scanned: bool,
}

#[derive(Clone, Copy)]
enum Kind {
    Png,
    Glb,
    Json,
    Folder,
}

impl Kind {
    fn of(path: &Path) -> Result<Self, String> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("glb") => Ok(Self::Glb),
            Some("json") => Ok(Self::Json),
            None if !path.is_file() => Ok(Self::Folder),
            _ => Err(format!("cannot write {}: name it .png, .glb, .json, or name a folder", path.display())),
        }
    }
}

impl Muscles {
    pub fn run(&self, quiet: bool) -> Outcome {
        let mut outputs = Vec::new();
        for path in &self.output {
            let kind = Kind::of(path)?;
            inputs::spare(path, &[&self.target])?;
            if inputs::same(path, self.basis.basis.as_deref().unwrap_or(Path::new(""))) {
                return Err(format!("{} is read here. Give the output another name", path.display()).into());
            }
            if !matches!(kind, Kind::Folder) {
                drop(Draft::create(path)?);
            }
            outputs.push((kind, path));
        }
        let gpu = Gpu::headless()?;
        let mut networks = Networks::load(&Assets::locate()?, TrackerOptions::default())?;
        let basis = self.basis.read(MuscleBasis::sixteen(), &gpu, &mut networks.tracker)?;
        let method = self.method.method();
        let opens = !self.as_scanned && method.warp != WarpKind::Regions;
        let target = self.scan.open(&self.target, opens, &gpu, &mut networks.tracker, quiet)?;
        let (motor, face) = muscle_motor(&basis, &target, method)?;
        let shapes = MuscleShapes { target: &target, motor: &motor };
        for (kind, path) in outputs {
            match kind {
                Kind::Png => {
                    let (look, still) = (Look::default(), HeadMode::Still);
                    let mut stage =
                        Stage::new(&gpu, &target, &face.level, [SIDE; 2], look, still, Smoothing::Samples4)?;
                    save_png(path, &shapes.sheet(&mut stage)?)?;
                }
                Kind::Glb => shapes.write_glb(path)?,
                Kind::Json => write_basis(path, &basis)?,
                Kind::Folder => {
                    let bar = progress::bar("writing shapes", Some(basis.elements.len() as u64), quiet);
                    shapes.write_folder(path, |done| bar.set_position(done))?;
                    bar.finish_and_clear();
                }
            }
            if !quiet {
                say!("wrote {} ({} muscles)", path.display(), basis.elements.len());
            }
        }
        Ok(())
    }
}
