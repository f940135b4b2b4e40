//! How well expressions are carried from one face to another, where the truth is known: `docs/benchmarks/transfer.md`.
//!
//! `cargo run --release --example transfer_table -- FACES`, with FACES made by `benches/peers/transfer_faces.py` and
//! `benches/peers/deformation_transfer.py`.

mod cross;
mod exact;
#[path = "../shared/eyeballs.rs"]
mod eyeballs;
mod product;
mod protocol;

use std::path::PathBuf;

use clap::Parser;
use exact::{Handles, Row, Spread};
use protocol::{Case, Face, Outcome, Protocol, error, motions};
use understudy::{
    actions::ActionLibrary,
    assets::Assets,
    pipeline::Networks,
    rig::{Method, TransferRule, WarpKind},
    scan::Mesh,
    spline::Kernel,
    tracking::TrackerOptions,
    view::Gpu,
};

/// The program itself: whether landmarks are found, and the method.
const PRODUCT: [(bool, Method); 4] = [
    (false, Method { rule: TransferRule::Spline, warp: WarpKind::Surface }),
    (false, Method { rule: TransferRule::Spline, warp: WarpKind::Spline }),
    (true, Method { rule: TransferRule::Spline, warp: WarpKind::Surface }),
    (true, Method::THESIS),
];

#[derive(Parser)]
struct Options {
    /// The folder of faces
    faces: PathBuf,
    /// All cases, and not only those whose identity and warp are both new
    #[arg(long)]
    all: bool,
    /// So many cases at most
    #[arg(long, default_value_t = usize::MAX)]
    cases: usize,
}

fn main() -> Outcome<()> {
    tracing_subscriber::fmt().with_max_level(tracing::Level::WARN).with_writer(std::io::stderr).init();
    let options = Options::parse();
    let protocol = Protocol::read(&options.faces)?;
    let mean = Face::read(&options.faces, "a2_source.obj", "a2_source.pc2")?;
    let assets = Assets::locate()?;
    let gpu = Gpu::headless()?;
    let mut networks = Networks::load(&assets, TrackerOptions::default())?;
    let mut finder = product::Finder { gpu: &gpu, networks: &mut networks };
    let rows = rows();
    let mut sums = vec![
        [vec![0.0; protocol.expressions.len()], vec![0.0; protocol.expressions.len()]];
        rows.len() + 2 + PRODUCT.len()
    ];
    let mut counts = vec![0.0; sums.len()];
    let chosen = protocol.cases.iter().filter(|case| options.all || case.unseen).take(options.cases);
    for facts in chosen {
        let case = Case::read(&options.faces, facts)?;
        let mut results: Vec<_> =
            exact::errors(&protocol, &case, &mean, &rows)?.into_iter().map(Some).collect();
        results.push(Some(peers(&protocol, &case, &mean, |_, source| Ok(source.motions.clone()))?));
        results.push(Some(peers(&protocol, &case, &mean, |task, _| {
            let name = format!("a{}_deformation_transfer.pc2", task + 1);
            motions(&options.faces.join(&case.name).join(name), &case.target.mesh)
        })?));
        for (found, method) in PRODUCT {
            results.push(as_program(&protocol, &case, &mean, &mut finder, found, method)?);
        }
        for ((sum, result), count) in sums.iter_mut().zip(&results).zip(&mut counts) {
            let Some(result) = result else { continue };
            *count += 1.0;
            for task in 0..2 {
                for (sum, value) in sum[task].iter_mut().zip(&result[task]) {
                    *sum += value;
                }
            }
        }
        eprintln!("{}", case.name);
    }
    let names: Vec<&str> = protocol.expressions.iter().map(|e| e.name.as_str()).collect();
    println!("| handles | rule | warp | cases | A1 | A2 | A2: {} |", names.join(" | "));
    println!("|---|---|---|---:|---:|---:|{}", "---:|".repeat(names.len()));
    let labels = rows
        .iter()
        .map(label)
        .chain(["every vertex | copy | -".into(), "every vertex | deformation transfer | -".into()])
        .chain(PRODUCT.iter().map(|(found, method)| {
            let landmarks = if *found { "found by the networks" } else { "known" };
            format!("the program, landmarks {landmarks} | {:?} | {:?}", method.rule, method.warp)
        }));
    for ((label, sum), count) in labels.zip(&sums).zip(&counts) {
        let mean = |task: usize| sum[task].iter().sum::<f64>() / count / names.len() as f64;
        let each: Vec<String> = sum[1].iter().map(|value| format!("{:.3}", value / count)).collect();
        println!("| {label} | {count} | {:.3} | {:.3} | {} |", mean(0), mean(1), each.join(" | "));
    }
    cross::print(&options.faces, &protocol, &mut finder)?;
    Ok(())
}

/// Errors of the program itself; `None` where the networks find no face, or one that is not there.
fn as_program(
    protocol: &Protocol,
    case: &Case,
    mean: &Face,
    finder: &mut product::Finder<'_>,
    found: bool,
    method: Method,
) -> Outcome<Option<[Vec<f64>; 2]>> {
    let mut landmarks = |mesh: &Mesh| {
        if found { finder.find(protocol, mesh) } else { Ok(Some(product::known(protocol, mesh))) }
    };
    let Some(on_target) = landmarks(&case.target.mesh)? else { return Ok(None) };
    let mut of_tasks = [Vec::new(), Vec::new()];
    for (task, source) in [&case.a1, mean].into_iter().enumerate() {
        let Some(on_source) = landmarks(&source.mesh)? else { return Ok(None) };
        let library = product::library(source, &on_source, ActionLibrary::built_in())?;
        let moved = product::carried(&library, &case.target.mesh, &on_target, method)?;
        for (found, truth) in moved.iter().zip(&case.target.motions) {
            of_tasks[task].push(error(found, truth, &protocol.evaluation_mask));
        }
    }
    Ok(Some(of_tasks))
}

fn rows() -> Vec<Row> {
    use Handles::{Full, Ibug68, Network468};
    use TransferRule::{Axes, Copy, Eyes, Mouth};
    let linear = Spread::Space(Kernel::Linear);
    let row = |handles, rule, spread| Row { handles, rule, spread };
    vec![
        row(Ibug68, Mouth, Spread::Regions(Kernel::ThinPlate)),
        row(Ibug68, Mouth, Spread::Regions(Kernel::Linear)),
        row(Ibug68, Copy, linear),
        row(Ibug68, TransferRule::Spline, linear),
        row(Ibug68, TransferRule::Spline, Spread::Surface),
        row(Handles::Ibug68Points, TransferRule::Spline, Spread::Surface),
        row(Network468, Mouth, Spread::Regions(Kernel::ThinPlate)),
        row(Network468, Copy, linear),
        row(Network468, TransferRule::Spline, linear),
        row(Network468, TransferRule::Spline, Spread::Surface),
        row(Handles::Muscles, TransferRule::Spline, Spread::Surface),
        row(Handles::Wrinkles, TransferRule::Spline, Spread::Surface),
        row(Full, Mouth, Spread::Regions(Kernel::ThinPlate)),
        row(Full, Copy, Spread::Surface),
        row(Full, Eyes, Spread::Surface),
        row(Full, Mouth, Spread::Surface),
        row(Full, Axes, Spread::Surface),
        row(Full, TransferRule::Spline, linear),
        row(Full, TransferRule::Spline, Spread::Space(Kernel::ThinPlate)),
        row(Full, TransferRule::Spline, Spread::Space(Kernel::Cubic)),
        row(Full, TransferRule::Spline, Spread::Space(Kernel::Hardy)),
        row(Full, TransferRule::Spline, Spread::Surface),
    ]
}

fn label(row: &Row) -> String {
    let kernel = |kernel: Kernel| match kernel {
        Kernel::Linear => "r",
        Kernel::ThinPlate => "r² ln r²",
        Kernel::Cubic => "r³",
        Kernel::Hardy => "Hardy",
        Kernel::Gaussian => "Gaussian",
    };
    let handles = match row.handles {
        Handles::Ibug68 => "68",
        Handles::Ibug68Points => "68 + muscle and wrinkle points",
        Handles::Network468 => "468",
        Handles::Muscles => "468 + muscle points",
        Handles::Wrinkles => "468 + muscle and wrinkle points",
        Handles::Full => "468 + rims + 100",
    };
    let rule = match row.rule {
        TransferRule::Spline => "landmark spline",
        TransferRule::Copy => "copy",
        TransferRule::Mouth => "mouth ratio (thesis)",
        TransferRule::Eyes => "eye distance",
        TransferRule::Axes => "per axis",
    };
    let spread = match row.spread {
        Spread::Surface => "surface".to_owned(),
        Spread::Space(k) => format!("space, {}", kernel(k)),
        Spread::Regions(k) => format!("two regions, {} (thesis)", kernel(k)),
    };
    format!("{handles} | {rule} | {spread}")
}

fn peers(
    protocol: &Protocol,
    case: &Case,
    mean: &Face,
    found: impl Fn(usize, &Face) -> Outcome<Vec<Vec<nalgebra::Vector3<f64>>>>,
) -> Outcome<[Vec<f64>; 2]> {
    let mut of_tasks = [Vec::new(), Vec::new()];
    for (task, source) in [&case.a1, mean].into_iter().enumerate() {
        for (found, truth) in found(task, source)?.iter().zip(&case.target.motions) {
            of_tasks[task].push(error(found, truth, &protocol.evaluation_mask));
        }
    }
    Ok(of_tasks)
}
