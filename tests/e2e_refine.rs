//! `understudy refine`: a table of markers in, a better basis out, and what cannot be learned is refused.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
};

use common::{
    Run, finish, folder,
    muscle_takes::{Numbers, contractions, perturbed},
    program,
};
use nalgebra::{Rotation3, Vector3};
use understudy::muscle::{FaceBasis, MarkerBasis, MarkerSeat, MuscleBasis};

/// A muscle that the take never uses.
const IDLE: usize = 9;

/// A take in centimetres, turned and far off, whose markers say which landmark they are at: half a second of neutral, then
/// every muscle of a performer whose shapes are not the built-in ones.
fn table(path: &Path, frames: usize) {
    let performer = FaceBasis::own(&perturbed(MuscleBasis::sixteen()));
    let marked: Vec<usize> = (0..468).step_by(7).chain([168, 6, 4, 33, 263, 133, 362, 10]).collect();
    let mut names: Vec<usize> = marked;
    names.sort_unstable();
    names.dedup();
    let seats: Vec<_> = names.iter().map(|landmark| MarkerSeat::mean(&[*landmark])).collect();
    let basis = MarkerBasis::new(&performer, &seats);
    let mut text = String::from("time_s");
    for name in &names {
        write!(text, ",landmark {name}_x,landmark {name}_y,landmark {name}_z").unwrap();
    }
    text.push_str(",wand_x,wand_y,wand_z\n");
    let turn = Rotation3::from_euler_angles(0.3, -0.8, 0.1);
    let mut numbers = Numbers(19);
    let mut moved = Vec::new();
    for (t, x) in contractions(frames, 16, 1.0, &[IDLE]).iter().enumerate() {
        let rest = vec![0.0; 16];
        basis.synthesize(if t < 16 { &rest } else { x }, &mut moved);
        write!(text, "{:.4}", t as f64 / 30.0).unwrap();
        for (j, (place, v)) in basis.rest.iter().zip(&moved).enumerate() {
            let p = turn * (place.unwrap().coords + v + numbers.vector() * 0.1) * 0.1
                + Vector3::new(40.0, 9.0, -70.0);
            if (t / 30 + j) % 17 == 5 && t > 30 {
                text.push_str(",,,");
            } else {
                write!(text, ",{:.5},{:.5},{:.5}", p.x, p.y, p.z).unwrap();
            }
        }
        text.push_str(",,,\n");
    }
    fs::write(path, text).unwrap();
}

fn refine(take: &Path, output: &Path, more: &[&str]) -> Run {
    finish(program().arg("refine").arg(take).arg("-o").arg(output).args(more))
}

#[test]
fn a_table_of_markers_makes_a_better_basis() {
    let folder = folder();
    let at = |name: &str| -> PathBuf { folder.path().join(name) };
    let (take, better) = (at("take.csv"), at("better.json"));
    table(&take, 600);
    let run = refine(&take, &better, &["--basis", "sixteen"]).succeeded().warned(&["no frame shows wand"]);
    let draft = MuscleBasis::sixteen();
    let idle = &draft.elements[IDLE];
    for word in ["draft", "held out", "is kept", &format!("not exercised, as in the draft: {}", idle.name)] {
        assert!(run.stdout.contains(word), "{word:?} is not in: {}", run.stdout);
    }
    let errors =
        |line: &str| -> Vec<f64> { line.split_whitespace().filter_map(|w| w.parse().ok()).collect() };
    let line = |start: &str| run.stdout.lines().find(|line| line.starts_with(start)).unwrap();
    let (first, second) = (errors(line("draft ")), errors(line("2 ")));
    assert!(second[4] < 0.5 * first[3], "{}", run.stdout);
    let refined = MuscleBasis::read(&better).unwrap();
    assert_eq!(refined.elements.len(), 16);
    let largest = |a: &[Vector3<f64>], b: &[Vector3<f64>]| {
        a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    assert!(largest(&refined.elements[IDLE].vectors, &idle.vectors) < 0.03);
    assert!(largest(&refined.elements[15].vectors, &draft.elements[15].vectors) > 1.0);

    // Once more from there: little is left to learn, and the take is not written over.
    let json = better.display().to_string();
    refine(&take, &better, &["--basis", &json]).refused(&["better.json", "another name"]);
    refine(&take, &at("again.json"), &["--basis", &json, "--exaggerate", "--undivided"]).succeeded();
}

#[test]
fn what_cannot_be_learned_from_is_refused() {
    let folder = folder();
    let at = |name: &str| -> PathBuf { folder.path().join(name) };
    let (take, out) = (at("take.csv"), at("out.json"));
    table(&take, 36);
    refine(&take, &out, &["-q", "--basis", "sixteen"]).refused(&["too few for 16 muscles", "longer takes"]);
    refine(&take, &at("out.csv"), &[]).refused(&["name it .json"]);
    fs::write(at("map.toml"), "[markers]\nChin = 152\n").unwrap();
    let map = at("map.toml").display().to_string();
    refine(&take, &out, &["-q", "--basis", "sixteen", "--map", &map])
        .refused(&["no take has a marker called Chin"]);
    let empty = at("empty.csv");
    fs::write(&empty, "time_s,Chin_x,Chin_y,Chin_z\n").unwrap();
    refine(&empty, &out, &["--basis", "sixteen"]).refused(&["empty.csv", "no frame"]);
    let mut twins = MuscleBasis::sixteen().clone();
    twins.elements[3].vectors = twins.elements[2].vectors.clone();
    let names = [twins.elements[2].name.clone(), twins.elements[3].name.clone()];
    understudy::export::write_basis(&at("twins.json"), &twins).unwrap();
    let json = at("twins.json").display().to_string();
    refine(&take, &out, &["--basis", &json]).refused(&[&names[0], &names[1], "mixture"]);
    assert!(!out.exists());
}
