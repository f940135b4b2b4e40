//! `understudy render`: a look at a scan, or at a moment of a point cache.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use nalgebra::Isometry3;
use understudy::{
    export::Pc2Reader,
    scan::{Mesh, NormalSolver, read_mesh},
    view::{Background, Gpu, Lighting, Look, Model, Renderer, Smoothing, ViewCamera, save_png},
};

use super::{Outcome, target::parse_size};

const EXAMPLES: &str = "\
Examples:
  understudy render scan.obj -o look.png
  understudy render scan.obj -o side.png --yaw 60 --look clay
  understudy render scan.obj --pc2 avatar.pc2 --frame 200 -o moment.png
  understudy render scan.ply -o cutout.png --transparent --size 2048x2048";

/// Draw a scan, or a frame of its point cache, as a picture
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Render {
    /// Scan: .obj, .ply, .stl, .glb, .gltf or .bnt
    scan: PathBuf,
    /// The picture to write
    #[arg(short, long, value_name = "FILE.png")]
    output: PathBuf,
    /// A point cache of the scan, such as `animate` writes
    #[arg(long, value_name = "FILE.pc2")]
    pc2: Option<PathBuf>,
    /// Which frame of the point cache, from 0
    #[arg(long, default_value_t = 0, requires = "pc2")]
    frame: usize,
    /// Degrees by which the camera walks towards the subject's left
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    yaw: f64,
    /// Degrees by which the camera rises
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    pitch: f64,
    /// How the scan is lit
    #[arg(long, value_enum, default_value_t = LookArg::Lit)]
    look: LookArg,
    /// Leave the background transparent
    #[arg(long)]
    transparent: bool,
    /// Width and height, even numbers
    #[arg(long, value_name = "WxH", default_value = "960x960", value_parser = parse_size)]
    size: [u32; 2],
}

#[derive(Clone, Copy, ValueEnum)]
enum LookArg {
    /// The scan's colours under soft light
    Lit,
    /// The scan's colours as they are
    Unlit,
    /// The shape alone
    Clay,
}

impl Render {
    pub fn run(&self, quiet: bool) -> Outcome {
        let mesh = read_mesh(&self.scan)?;
        let positions = self.positions(&mesh)?;
        let normals = NormalSolver::once(&mesh.triangles, &positions);

        let gpu = Gpu::headless()?;
        let [width, height] = self.size;
        let mut renderer = Renderer::new(&gpu, width, height, Smoothing::Samples4)?;
        let model = Model::upload(&gpu, &mesh)?;
        let look = Look::default().lit_by(match self.look {
            LookArg::Lit => Lighting::Lit,
            LookArg::Unlit => Lighting::Unlit,
            LookArg::Clay => Lighting::Clay,
        });
        let look = if self.transparent { look.before(Background::Transparent) } else { look };
        let camera = camera(&mesh, self.size).orbit(self.yaw.to_radians(), self.pitch.to_radians());
        let world = Isometry3::identity().to_homogeneous();
        renderer.draw(&model, &positions, &normals, &world, &camera, &look)?;
        save_png(&self.output, &renderer.read_picture()?)?;
        if !quiet {
            say!("wrote {} (drawn by {})", self.output.display(), renderer.adapter_name());
        }
        Ok(())
    }

    /// The scan's own vertices, or those of a frame of its cache.
    fn positions(&self, mesh: &Mesh) -> Result<Vec<[f32; 3]>, Box<dyn std::error::Error>> {
        let Some(path) = &self.pc2 else {
            return Ok(mesh.positions_f32());
        };
        let mut cache = Pc2Reader::open(path)?;
        let (wanted, found) = (mesh.positions.len(), cache.points());
        if found != wanted {
            return Err(format!(
                "{} holds {found} points, but {} has {wanted} vertices: it is the cache of another scan",
                path.display(),
                self.scan.display()
            )
            .into());
        }
        if self.frame >= cache.samples() {
            return Err(format!(
                "{} has frames 0 to {}, not {}",
                path.display(),
                cache.samples().saturating_sub(1),
                self.frame
            )
            .into());
        }
        let mut positions = Vec::new();
        cache.read_sample(self.frame, &mut positions)?;
        Ok(positions)
    }
}

/// Before the scan's own +Z, so that all of it is seen.
fn camera(mesh: &Mesh, size: [u32; 2]) -> ViewCamera {
    let (centre, radius) = mesh.bounding_ball();
    ViewCamera::frame_bounds(centre, radius, size)
}
