//! Contractions come back from the displacements that they made.

mod common;

use common::muscle_takes::{Numbers, apart, contractions, played, seats};
use nalgebra::Vector3;
use understudy::muscle::{Analyser, FaceBasis, MarkerBasis, MuscleBasis, Part};

type Frame = Vec<Option<Vector3<f64>>>;

fn basis() -> MarkerBasis {
    apart(MarkerBasis::new(&FaceBasis::own(MuscleBasis::sixteen()), &seats()))
}

/// The largest error of any contraction.
fn error(analyser: &mut Analyser, frames: &[Frame], wanted: &[Vec<f64>]) -> f64 {
    let mut most = 0.0_f64;
    for (frame, wanted) in frames.iter().zip(wanted) {
        analyser.solve(frame);
        for (x, wanted) in analyser.contractions().iter().zip(wanted) {
            most = most.max((x - wanted).abs());
        }
    }
    most
}

#[test]
fn known_contractions_come_back_with_the_jaw_on_its_arc() {
    let wanted = contractions(150, 16, 1.0, &[]);
    let frames = played(&basis(), &wanted, 0.0);
    let mut analyser = Analyser::new(basis(), false);
    assert!(error(&mut analyser, &frames, &wanted) < 1e-6);
    let fit = analyser.solve(&frames[100]);
    assert!(fit.upper.error < 1e-5 && fit.lower.error < 1e-5, "{fit:?}");
    assert!(fit.upper.seen > 20 && fit.upper.seen + fit.lower.seen == 117, "{fit:?}");
}

#[test]
fn where_parts_are_not_divided_muscles_may_move_both() {
    let basis = MarkerBasis::new(&FaceBasis::own(MuscleBasis::sixteen()), &seats()).undivided();
    let wanted = contractions(150, 16, 1.0, &[]);
    let frames = played(&basis, &wanted, 0.0);
    assert!(error(&mut Analyser::new(basis, false), &frames, &wanted) < 1e-6);
}

#[test]
fn what_moves_above_is_nothing_below() {
    let basis = basis();
    let frames = played(&basis, &contractions(20, 16, 1.0, &[]), 0.5);
    let (mut plain, mut shaken) = (Analyser::new(basis.clone(), false), Analyser::new(basis.clone(), false));
    let mut numbers = Numbers(3);
    for frame in frames {
        let mut other = frame.clone();
        for (d, part) in other.iter_mut().zip(&basis.parts) {
            if *part == Some(Part::Upper) {
                *d = Some(numbers.vector() * 9.0);
            }
        }
        plain.solve(&frame);
        shaken.solve(&other);
        let mut changed = false;
        for (i, muscle) in basis.muscles.iter().enumerate() {
            let (a, b) = (plain.contractions()[i], shaken.contractions()[i]);
            match muscle.part {
                Part::Upper => changed |= a.to_bits() != b.to_bits(),
                Part::Lower => assert_eq!(a.to_bits(), b.to_bits(), "{}", muscle.name),
            }
        }
        assert!(changed);
    }
}

#[test]
fn missing_markers_cost_nothing_while_the_rest_tells() {
    let wanted = contractions(60, 16, 1.0, &[]);
    let whole = played(&basis(), &wanted, 0.0);
    let mut numbers = Numbers(5);
    for share in [0.1, 0.7] {
        let mut frames = whole.clone();
        for frame in &mut frames {
            // One is never seen.
            frame[40] = None;
            for d in frame.iter_mut() {
                if numbers.next() < 2.0 * share - 1.0 {
                    *d = None;
                }
            }
        }
        let mut analyser = Analyser::new(basis(), false);
        let error = error(&mut analyser, &frames, &wanted);
        assert!(error < 1e-5, "{share}: {error}");
    }
}

#[test]
fn a_part_without_markers_keeps_its_contractions() {
    let basis = basis();
    let frames = played(&basis, &contractions(60, 16, 1.0, &[]), 0.0);
    let mut analyser = Analyser::new(basis.clone(), false);
    analyser.solve(&frames[50]);
    let before = analyser.contractions().to_vec();
    let mut frame = frames[55].clone();
    for (d, part) in frame.iter_mut().zip(&basis.parts) {
        if *part == Some(Part::Upper) {
            *d = None;
        }
    }
    let fit = analyser.solve(&frame);
    assert_eq!((fit.upper.seen, fit.upper.error), (0, 0.0));
    for (i, muscle) in basis.muscles.iter().enumerate() {
        if muscle.part == Part::Upper {
            assert_eq!(before[i].to_bits(), analyser.contractions()[i].to_bits());
        }
    }
    assert_ne!(before, analyser.contractions());
}

#[test]
fn exaggeration_exceeds_one_where_it_is_allowed() {
    let wanted = contractions(90, 16, 1.6, &[]);
    let frames = played(&basis(), &wanted, 0.0);
    assert!(error(&mut Analyser::new(basis(), true), &frames, &wanted) < 1e-6);
    let mut bounded = Analyser::new(basis(), false);
    for frame in &frames {
        bounded.solve(frame);
        assert!(bounded.contractions().iter().all(|x| (0.0..=1.0).contains(x)));
    }
}

#[test]
fn the_way_there_does_not_matter() {
    let frames = played(&basis(), &contractions(60, 16, 1.0, &[]), 1.0);
    let (mut there, mut back) = (Analyser::new(basis(), false), Analyser::new(basis(), false));
    let forwards: Vec<Vec<f64>> = frames
        .iter()
        .map(|frame| {
            there.solve(frame);
            there.contractions().to_vec()
        })
        .collect();
    for (frame, wanted) in frames.iter().zip(forwards).rev() {
        back.solve(frame);
        assert!(back.contractions().iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6));
    }
}
