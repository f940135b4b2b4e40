//! Refinement of a basis on performances whose contractions are known.

use std::{error::Error, fmt::Write as _, path::Path};

use nalgebra::{Point3, Vector3};
use understudy::{
    muscle::{
        Analyser, FaceBasis, MarkerBasis, MarkerSeat, MuscleBasis, RefineOptions, Refinement, Training,
        refine,
    },
    tracking::{Region, SKIN_LANDMARK_COUNT, index, landmark_table},
};

use super::{
    camera::face_of,
    takes::{Take, index as takes_of},
};

/// As many as optical studios glue on, and more.
const MARKERS: usize = 100;
/// Contractions that vary less than this over a take have no correlation.
const STIRS: f64 = 0.03;
/// Noise, and whether upper and lower face are solved apart.
const WAYS: [(&str, bool); 3] = [("measured_0.1", true), ("measured_0.3", true), ("measured_0.3", false)];

/// How contractions and motion of a take that was not learned from come out.
struct Score {
    correlation: f64,
    worst_correlation: f64,
    rmse: f64,
    worst_rmse: f64,
    /// Root mean square over frames and all landmarks, mm.
    motion: f64,
}

/// A table for each performer, before and after refinement.
pub fn report(folder: &Path) -> Result<String, Box<dyn Error>> {
    let entries = takes_of(folder)?;
    let of = |name: &str| -> Result<Take, Box<dyn Error>> {
        let entry =
            entries.iter().find(|entry| entry.name == name).ok_or_else(|| format!("no take {name}"))?;
        Take::read(folder, entry)
    };
    let shapes = of("basis")?.entry.shapes.unwrap_or_default();
    let mut out = format!(
        "## Refinement\n\nARKit's shapes on each performer's face, refined by 600 frames with white noise at {MARKERS} \
         markers; scored on a take that was not learned from, without noise. r: correlation of contractions, mean over \
         muscles that stir and worst; RMSE of all; motion: root mean square of all landmarks, mm.\n\n\
         | performer | parts | noise | rounds | learned, mm | held out, mm | r | worst | RMSE | worst | motion, mm |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n"
    );
    let mut notes = String::new();
    for kind in ["exact", "personalised"] {
        for performer in 1..=4 {
            let (training, test) =
                (of(&format!("training_{kind}_{performer}"))?, of(&format!("{kind}_{performer}_noise0"))?);
            let draft = on_face(MuscleBasis::arkit(), &test.neutral())?;
            let seats = spread(&draft.face);
            for (way, (noise, divided)) in WAYS.into_iter().enumerate() {
                let refined = learn(&draft, &seats, &training, noise, divided)?;
                let before = score(&draft, &seats, &test, &shapes, divided);
                let after = score(&refined.basis, &seats, &test, &shapes, divided);
                let (first, last) = (&refined.rounds[0], &refined.rounds[refined.best]);
                let arrow = |a: f64, b: f64, places: usize| format!("{a:.places$} → {b:.places$}");
                writeln!(
                    out,
                    "| {kind} {performer} | {} | {} | {} of {} | {} | {} | {} | {} | {} | {} | {} |",
                    if divided { "two" } else { "one" },
                    noise.trim_start_matches("measured_"),
                    refined.best,
                    refined.rounds.len() - 1,
                    arrow(first.learned.rms, last.learned.rms, 2),
                    arrow(first.held_out.rms, last.held_out.rms, 2),
                    arrow(before.correlation, after.correlation, 3),
                    arrow(before.worst_correlation, after.worst_correlation, 2),
                    arrow(before.rmse, after.rmse, 3),
                    arrow(before.worst_rmse, after.worst_rmse, 2),
                    arrow(before.motion, after.motion, 2),
                )?;
                if way == 0 {
                    let (idle, slight) = (refined.idle.join(", "), refined.slight.join(", "));
                    writeln!(
                        notes,
                        "- {kind} {performer}: {}; idle: {idle}; slight: {slight}",
                        refined.stop
                    )?;
                }
            }
        }
    }
    out.push('\n');
    out.push_str(&notes);
    Ok(out)
}

/// A basis on a performer's neutral, 468 points. The model that made the takes moves the jaw in a straight line.
fn on_face(basis: &MuscleBasis, neutral: &[Point3<f64>]) -> Result<MuscleBasis, Box<dyn Error>> {
    let face = face_of(neutral);
    let carried = FaceBasis::new(basis, &face)?;
    let mut own = MuscleBasis { face: face.points, turns_jaw: false, ..basis.clone() };
    for (element, vectors) in own.elements.iter_mut().zip(carried.vectors) {
        element.vectors = vectors;
    }
    Ok(own)
}

/// Landmarks far from each other: each next one is the farthest from those before.
fn spread(face: &[Point3<f64>]) -> Vec<Option<MarkerSeat>> {
    let free: Vec<usize> =
        (0..SKIN_LANDMARK_COUNT).filter(|&l| landmark_table()[l].region != Region::Oval).collect();
    let mut chosen = vec![index::NOSE_TIP];
    while chosen.len() < MARKERS {
        let near =
            |l: usize| chosen.iter().map(|c| (face[*c] - face[l]).norm()).fold(f64::INFINITY, f64::min);
        let Some(next) = free.iter().copied().max_by(|a, b| near(*a).total_cmp(&near(*b))) else { break };
        chosen.push(next);
    }
    chosen.into_iter().map(|landmark| MarkerSeat::mean(&[landmark])).collect()
}

/// What markers at `seats` show of the displacements of all landmarks.
fn seen(frames: &[Vec<Vector3<f64>>], seats: &[Option<MarkerSeat>]) -> Vec<Vec<Option<Vector3<f64>>>> {
    let at = |frame: &Vec<Vector3<f64>>| seats.iter().map(|s| s.as_ref().map(|s| s.vector(frame))).collect();
    frames.iter().map(at).collect()
}

fn learn(
    draft: &MuscleBasis,
    seats: &[Option<MarkerSeat>],
    training: &Take,
    noise: &str,
    divided: bool,
) -> Result<Refinement, Box<dyn Error>> {
    let take = Training { frames: seen(&training.displacements(noise), seats), rate: 30.0 };
    Ok(refine(draft, seats, &[take], &RefineOptions { divided, ..RefineOptions::default() }, |_| ())?)
}

fn score(
    basis: &MuscleBasis,
    seats: &[Option<MarkerSeat>],
    test: &Take,
    shapes: &[String],
    divided: bool,
) -> Score {
    let face = FaceBasis::own(basis);
    let markers = MarkerBasis::new(&face, seats);
    let mut analyser = Analyser::new(if divided { markers } else { markers.undivided() }, false);
    let truth = test.displacements("truth");
    let mut fitted = Vec::new();
    let (mut squared, mut points) = (0.0, 0.0);
    let mut solved = Vec::new();
    for (frame, marked) in truth.iter().zip(seen(&truth, seats)) {
        analyser.solve(&marked);
        solved.push(analyser.contractions().to_vec());
        face.synthesize(analyser.contractions(), &mut fitted);
        for (fitted, truth) in fitted.iter().zip(frame) {
            squared += (fitted - truth).norm_squared();
            points += 1.0;
        }
    }
    let weights = test.weights();
    let (mut correlations, mut errors) = (Vec::new(), Vec::new());
    for (muscle, element) in basis.elements.iter().enumerate() {
        let Some(shape) = shapes.iter().position(|name| *name == element.name) else { continue };
        let pairs: Vec<(f64, f64)> =
            solved.iter().zip(&weights).map(|(x, w)| (x[muscle], w[shape])).collect();
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / pairs.len() as f64;
        let (x, w) = (mean(&|p| p.0), mean(&|p| p.1));
        let (xx, ww) = (mean(&|p| (p.0 - x).powi(2)).sqrt(), mean(&|p| (p.1 - w).powi(2)).sqrt());
        if ww > STIRS {
            correlations.push(mean(&|p| (p.0 - x) * (p.1 - w)) / (xx * ww).max(1e-9));
        }
        errors.push(mean(&|p| (p.0 - p.1).powi(2)).sqrt());
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    Score {
        correlation: mean(&correlations),
        worst_correlation: correlations.iter().copied().fold(1.0, f64::min),
        rmse: mean(&errors),
        worst_rmse: errors.iter().copied().fold(0.0, f64::max),
        motion: f64::sqrt(squared / points),
    }
}
