//! Drawn wrinkles on scans: `cargo run --release --example living_skin -- -o sheet.png --scan james.obj …`.
//!
//! A row for each scan: neutral, then each region by itself, then all of them; `--chart` draws instead where the shared
//! frame and its regions lie.

#![allow(clippy::print_stdout, reason = "an example says what it does")]

#[path = "shared/chart.rs"]
mod chart;
#[path = "shared/wrinkles.rs"]
mod wrinkles;

use std::{error::Error, path::PathBuf};

use clap::Parser;
use image::RgbaImage;
use nalgebra::Rotation3;
use understudy::{
    appearance::{AppearanceStates, Region, TextureVolume},
    assets::Assets,
    pipeline::{
        HeadMode, LivingSkin, Networks, SharedFace, SkinRelief, Stage, Target, TargetOptions, bake_skin,
    },
    rig::AvatarFrame,
    tracking::TrackerOptions,
    view::{Gpu, Look, SkinMode, Smoothing, contact_sheet, save_png},
};

#[derive(Parser)]
struct Arguments {
    /// Scans
    #[arg(long = "scan", value_name = "SCAN", required = true)]
    scans: Vec<PathBuf>,
    /// The picture to write
    #[arg(short, long)]
    output: PathBuf,
    /// What multiplies the wrinkles
    #[arg(long, default_value_t = 1.0)]
    gain: f32,
    /// Draw where the shared frame lies
    #[arg(long)]
    chart: bool,
    /// Degrees by which the camera walks towards the subject's left
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    yaw: f64,
    /// Only all regions at once, beside the neutral
    #[arg(long)]
    all: bool,
    /// Pixels of a picture
    #[arg(long, default_value_t = 480)]
    side: u32,
    /// Show the drawn skin's own colours
    #[arg(long)]
    own: bool,
    /// A folder for wrinkle maps of the last scan
    #[arg(long)]
    bake: Option<PathBuf>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let assets = Assets::locate()?;
    let gpu = Gpu::headless()?;
    let mut networks = Networks::load(&assets, TrackerOptions::default())?;
    let face = SharedFace::read(&assets.verified("canonical_face")?)?;
    let volumes = wrinkles::volumes(face.frame());
    let mut cells = Vec::new();
    for path in &arguments.scans {
        let options = TargetOptions::default();
        let mut target = Target::load(path, &options, &gpu, &mut networks.tracker)?;
        target.prepare(&gpu)?;
        println!("{}", target.scan.name);
        if arguments.chart {
            cells.push((chart::picture(&gpu, &target, &face, arguments.yaw)?, target.scan.name.clone()));
        } else {
            if let Some(folder) = &arguments.bake {
                bake_skin(folder, &target, &face, &volumes, SkinMode::Ratio, arguments.gain)?;
            }
            row(&arguments, &gpu, &target, &face, &volumes, &mut cells)?;
        }
    }
    let columns = if arguments.chart { cells.len() } else { cells.len() / arguments.scans.len() };
    let cells: Vec<_> = cells.iter().map(|(picture, caption)| (picture, caption.as_str())).collect();
    save_png(&arguments.output, &contact_sheet(&cells, columns.min(5) as u32))?;
    Ok(())
}

/// What is shown: nothing, each region, all of them.
fn shown(all: bool) -> Vec<(String, AppearanceStates)> {
    let mut everything = AppearanceStates::default();
    let mut rows = vec![("neutral".to_owned(), everything)];
    let sides = |region: &Region| !region.name().ends_with("_left");
    for region in Region::ALL.into_iter().filter(sides) {
        let name = region.name().trim_end_matches("_right");
        let mut states = AppearanceStates::default();
        for one in Region::ALL.into_iter().filter(|other| other.name().starts_with(name)) {
            states.set(one, Some(1.0));
            everything.set(one, Some(1.0));
        }
        if !all {
            rows.push((name.replace('_', " "), states));
        }
    }
    rows.push(("all".to_owned(), everything));
    rows
}

fn row(
    arguments: &Arguments,
    gpu: &Gpu,
    target: &Target,
    face: &SharedFace,
    volumes: &[TextureVolume],
    cells: &mut Vec<(RgbaImage, String)>,
) -> Result<(), Box<dyn Error>> {
    let mode = if arguments.own { SkinMode::Own } else { SkinMode::Ratio };
    let relief = SkinRelief::new(target, face, volumes, arguments.gain)?;
    let skin = LivingSkin::new(gpu, target, face, volumes, &relief, mode, arguments.gain)?;
    let level = Rotation3::identity();
    let side = arguments.side;
    let mut stage =
        Stage::new(gpu, target, &level, [side; 2], Look::default(), HeadMode::Still, Smoothing::Samples4)?
            .wearing(Some(skin));
    let (centre, eyes) = target.centre_and_eyes();
    stage.look_at(centre, 1.15 * eyes, arguments.yaw.to_radians());
    let frame = AvatarFrame::at_rest(&target.anatomy.mesh);
    for (name, states) in shown(arguments.all) {
        stage.show(&states);
        cells.push((stage.picture(&frame)?, format!("{} {name}", target.scan.name)));
    }
    Ok(())
}
