//! `understudy prepare`: a scan in, an avatar that can perform out.

use std::path::PathBuf;

use clap::Args;
use understudy::{
    assets::Assets,
    export::Draft,
    pipeline::{Networks, Target, expression_sheet, write_avatar_glb},
    tracking::TrackerOptions,
    view::{Gpu, save_png},
};

use super::{
    Outcome, inputs,
    target::{ScanArgs, report, report_anatomy},
};

const EXAMPLES: &str = "\
Examples:
  understudy prepare scan.obj -o avatar.glb
  understudy prepare scan.ply -o avatar.glb -o look.png
  understudy prepare scan.obj --landmarks scan.landmarks.json -o avatar.glb

Outputs:
  .glb  the scan cut open, with mouth, teeth, tongue and eyes as nodes of their own, and morph targets that open the
        mouth and close the lids: Blender, Unreal, three.js
  .png  the avatar at rest, opening its mouth, closing and turning its eyes

`animate` prepares its target by itself; this command shows and exports what it makes of a scan.";

/// Open a scan's mouth and eyes, and add what lies behind them
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Prepare {
    /// The scan: .obj, .ply, .stl, .glb, .gltf or .bnt
    scan: PathBuf,
    #[command(flatten)]
    how: ScanArgs,
    /// What to write, by extension: .glb, .png; may be given several times
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
}

impl Prepare {
    pub fn run(&self, quiet: bool) -> Outcome {
        let mut outputs = Vec::new();
        for path in &self.output {
            let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
            let is_glb = match extension.as_deref() {
                Some("glb") => true,
                Some("png") => false,
                _ => return Err(format!("cannot write {}: name it .glb or .png", path.display()).into()),
            };
            inputs::spare(path, &[&self.scan])?;
            drop(Draft::create(path)?);
            outputs.push((is_glb, path));
        }
        let assets = Assets::locate()?;
        let gpu = Gpu::headless()?;
        let mut networks = Networks::load(&assets, TrackerOptions::default())?;
        let mut target = Target::load(&self.scan, &self.how.options(), &gpu, &mut networks.tracker)?;
        target.prepare(&gpu)?;
        report_anatomy(&target);
        if !quiet {
            report(&target);
        }
        for (is_glb, path) in outputs {
            if is_glb {
                write_avatar_glb(path, &target)?;
            } else {
                save_png(path, &expression_sheet(&gpu, &target)?)?;
            }
            if !quiet {
                say!("wrote {}", path.display());
            }
        }
        Ok(())
    }
}
