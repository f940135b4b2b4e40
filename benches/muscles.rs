//! Contractions of a frame from its markers: `cargo bench --bench muscles`. One thread.
//!
//! Each frame starts from the one before, along ten seconds in which every muscle comes and goes, with noise of 0.3 mm.

use divan::{Bencher, bench};
use nalgebra::Vector3;
use understudy::{
    muscle::{Analyser, FaceBasis, MarkerBasis, MarkerSeat, MuscleBasis},
    tracking::SKIN_LANDMARK_COUNT,
};

const FRAMES: usize = 300;
const NOISE: f64 = 0.3;

/// Name of the basis, markers, and whether upper and lower face are solved apart.
const CASES: [(&str, usize, bool); 8] = [
    ("sixteen", 68, true),
    ("sixteen", 468, true),
    ("arkit", 68, true),
    ("arkit", 468, true),
    ("sixteen", 68, false),
    ("sixteen", 468, false),
    ("arkit", 68, false),
    ("arkit", 468, false),
];

fn main() {
    divan::main();
}

fn basis(name: &str, markers: usize, divided: bool) -> MarkerBasis {
    let basis = if name == "arkit" { MuscleBasis::arkit() } else { MuscleBasis::sixteen() };
    let seats: Vec<_> =
        (0..markers).map(|k| MarkerSeat::mean(&[k * SKIN_LANDMARK_COUNT / markers])).collect();
    let basis = MarkerBasis::new(&FaceBasis::own(basis), &seats);
    if divided { basis } else { basis.undivided() }
}

fn frames(basis: &MarkerBasis) -> Vec<Vec<Option<Vector3<f64>>>> {
    let mut moved = Vec::new();
    let frame = |t: usize| {
        let contraction = |muscle: usize| {
            let (t, m) = (t as f64 / 30.0, muscle as f64);
            (t * (1.1 + 0.13 * m) + 2.4 * m).sin().max(0.0).powi(2)
        };
        let contractions: Vec<f64> = (0..basis.muscles.len()).map(contraction).collect();
        basis.synthesize(&contractions, &mut moved);
        let noise = |j: usize, axis: usize| NOISE * ((t * 7919 + j * 104_729 + axis * 1299) as f64).sin();
        (0..).zip(&moved).map(|(j, v)| Some(v + Vector3::from_fn(|axis, _| noise(j, axis)))).collect()
    };
    (0..FRAMES).map(frame).collect()
}

#[bench(args = CASES, sample_count = 900, sample_size = 1)]
fn analyse(bencher: Bencher<'_, '_>, (name, markers, divided): (&str, usize, bool)) {
    let basis = basis(name, markers, divided);
    let frames = frames(&basis);
    let mut analyser = Analyser::new(basis, false);
    analyser.solve(&frames[0]);
    let mut next = frames.iter().cycle().skip(1);
    bencher.bench_local(|| next.next().map(|frame| analyser.solve(frame)));
}
