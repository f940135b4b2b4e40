//! Figures of `docs/benchmarks/muscles.md`.
mod camera;
mod refinement;
mod takes;

use std::{error::Error, path::PathBuf};

use clap::Parser;
use understudy::muscle::{CameraFit, MuscleBasis};

#[derive(Parser)]
struct Arguments {
    /// What `benches/peers/muscle_takes.py` wrote
    takes: PathBuf,
    #[arg(long, default_value_t = 10.0)]
    ridge: f64,
    #[arg(long, default_value_t = 2.0)]
    outlier: f64,
    #[arg(long, default_value_t = 1.5)]
    accuracy: f64,
    #[arg(long, default_value_t = 0.2)]
    share: f64,
    #[arg(long, default_value_t = 1.0)]
    part: f64,
    #[arg(long, default_value_t = 3)]
    rounds: usize,
    #[arg(long, default_value_t = 0.25)]
    outline: f64,
    #[arg(long, default_value_t = 1.0)]
    lids: f64,
    #[arg(long)]
    straight: bool,
    #[arg(long, default_value = "")]
    only: String,
    #[arg(long)]
    generic: bool,
    /// Print the section on refinement alone
    #[arg(long)]
    refinement: bool,
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Arguments::parse();
    if options.refinement {
        print!("{}", refinement::report(&options.takes)?);
        return Ok(());
    }
    let mut basis = MuscleBasis::arkit().clone();
    basis.turns_jaw = !options.straight;
    let fit = CameraFit {
        ridge: options.ridge,
        outlier: options.outlier,
        accuracy: options.accuracy,
        share: options.share,
        rounds: options.rounds,
        outline: options.outline,
        lids: options.lids,
    };
    let entries = takes::index(&options.takes)?;
    let generic =
        takes::Take::read(&options.takes, entries.iter().find(|e| e.kind == "basis").ok_or("no basis")?)?;
    let names = generic.entry.shapes.clone().unwrap_or_default();
    let mut groups: std::collections::BTreeMap<String, Vec<[f64; 7]>> = Default::default();
    println!("take still plane basis mixed | rigid pose | weights");
    for entry in entries {
        if entry.size.is_none() || !entry.name.contains(&options.only) {
            continue;
        }
        let take = takes::Take::read(&options.takes, &entry)?;
        let start = std::time::Instant::now();
        let e =
            camera::measure(&take, &names, &basis, options.generic.then_some(&generic), fit, options.part)?;
        let key = if entry.kind == "markers" {
            entry.name.clone()
        } else {
            format!("{}{}", entry.kind, &entry.name[entry.name.find("_noise").unwrap_or(0)..])
        };
        groups.entry(key).or_default().push([
            e.still,
            e.plane,
            e.basis,
            e.mixed,
            e.rigid_pose,
            e.pose,
            e.weights,
        ]);
        if options.rounds > 90 {
            println!(
                "{:32} {:.2} {:.2} {:.2} {:.2} | {:.2} {:.2} | {:.3}  {:.2} ms",
                entry.name,
                e.still,
                e.plane,
                e.basis,
                e.mixed,
                e.rigid_pose,
                e.pose,
                e.weights,
                start.elapsed().as_secs_f64() * 1e3 / take.frames() as f64
            );
        }
    }
    for (key, rows) in groups {
        let mean: Vec<String> = (0..7)
            .map(|k| {
                format!("{:.3}", (rows.iter().map(|r| r[k] * r[k]).sum::<f64>() / rows.len() as f64).sqrt())
            })
            .collect();
        println!("{key:32} {}", mean.join(" "));
    }
    Ok(())
}
