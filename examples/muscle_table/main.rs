//! Figures of `docs/benchmarks/muscles.md`.
mod camera;
mod rendered;
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
    #[arg(long)]
    scan: Option<PathBuf>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Arguments::parse();
    if let Some(scan) = &options.scan {
        return rendered(&options.takes, scan);
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

fn rendered(folder: &std::path::Path, scan: &std::path::Path) -> Result<(), Box<dyn Error>> {
    use understudy::{lift::Smoothing, pipeline::LiftMode};
    let entries = takes::index(folder)?;
    let names =
        entries.iter().find(|e| e.kind == "basis").and_then(|e| e.shapes.clone()).ok_or("no basis")?;
    for seed in [1.0, 2.0] {
        let generic = MuscleBasis::arkit();
        let own = if seed == 0.0 { generic.clone() } else { rendered::personalised(generic, seed) };
        let mut actor = rendered::Actor::new(scan, &own)?;
        let take =
            takes::Take::read(folder, entries.iter().find(|e| e.name == "exact_1_noise0").ok_or("no take")?)?;
        let reorder = |row: &Vec<f64>| -> Vec<f64> {
            own.names().map(|name| names.iter().position(|n| n == name).map_or(0.0, |k| row[k])).collect()
        };
        let weights: Vec<Vec<f64>> = take.weights().iter().map(reorder).collect();
        let turns = rendered::turns(&take.poses());
        let still = vec![vec![0.0; own.elements.len()]; turns.len()];
        for (what, weights) in [("acting", weights), ("turning", still)] {
            let film = actor.film(&rendered::script(weights, turns.clone()))?;
            for (mode, lift) in [("plane", LiftMode::Plane), ("muscles", LiftMode::default())] {
                for (kind, smoothing) in [("raw", Smoothing::Off)] {
                    let motion = actor.solve(&film, lift.clone(), smoothing)?;
                    let e = rendered::compare(&film, &motion);
                    println!(
                        "seed {seed} {what} {mode} {kind}: still {:.2} error {:.2} turn {:.2} step {:.3}",
                        e.still, e.error, e.turn, e.jitter
                    );
                }
            }
        }
    }
    Ok(())
}
