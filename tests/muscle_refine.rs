//! A basis learns the shapes of a performer from takes whose contractions nobody told it.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use common::muscle_takes::{Numbers, RATE, apart, contractions, perturbed, played, seats};
use understudy::muscle::{
    Analyser, FaceBasis, MarkerBasis, MuscleBasis, MuscleError, RefineOptions, Refinement, Stop, Training,
    refine,
};

/// Two seconds of every muscle but this one.
const IDLE: usize = 9;

fn truth() -> MarkerBasis {
    apart(MarkerBasis::new(&FaceBasis::own(MuscleBasis::sixteen()), &seats()))
}

fn draft() -> MuscleBasis {
    perturbed(MuscleBasis::sixteen())
}

fn take(frames: usize, noise: f64) -> Training {
    let frames = played(&truth(), &contractions(frames, 16, 1.0, &[IDLE]), noise);
    Training { frames, rate: RATE }
}

fn refined(takes: &[Training]) -> Refinement {
    refine(&draft(), &seats(), takes, &RefineOptions::default(), |_| ()).unwrap()
}

#[test]
fn errors_fall_and_an_idle_muscle_stays_as_it_was_drawn() {
    let take = take(900, 0.1);
    let mut heard = 0;
    let refined =
        refine(&draft(), &seats(), std::slice::from_ref(&take), &RefineOptions::default(), |_| heard += 1)
            .unwrap();
    assert_eq!(heard, refined.rounds.len());
    let (first, last) = (refined.rounds[0], refined.rounds[refined.best]);
    assert!(last.held_out.rms < 0.5 * first.held_out.rms, "{:?}", refined.rounds);
    for pair in refined.rounds.windows(2) {
        assert!(pair[1].learned.rms <= pair[0].learned.rms * 1.002, "{:?}", refined.rounds);
    }
    let draft = draft();
    assert_eq!(refined.idle, [draft.elements[IDLE].name.clone()]);
    assert_eq!(refined.basis.elements[IDLE], draft.elements[IDLE]);
    assert_eq!(refined.frames.iter().sum::<usize>(), 900);
    assert!((150..=210).contains(&refined.frames[1]), "{:?}", refined.frames);

    // Largest contractions are 1, but for the muscle that never was.
    let shapes = MarkerBasis::new(&FaceBasis::own(&refined.basis), &seats());
    let mut analyser = Analyser::new(shapes, true);
    let mut most = [0.0_f64; 16];
    for frame in &take.frames {
        analyser.solve(frame);
        most.iter_mut().zip(analyser.contractions()).for_each(|(most, x)| *most = most.max(*x));
    }
    for (i, element) in draft.elements.iter().enumerate() {
        if i != IDLE && !refined.slight.contains(&element.name) {
            assert!((0.93..1.15).contains(&most[i]), "{} {}", element.name, most[i]);
        }
    }
    refined.basis.check().unwrap();
}

#[test]
fn the_same_takes_give_the_same_basis() {
    let take = take(300, 0.2);
    assert_eq!(
        refined(std::slice::from_ref(&take)).basis.format(),
        refined(std::slice::from_ref(&take)).basis.format()
    );
}

#[test]
fn markers_that_come_and_go_are_learned_from_while_they_are_there() {
    let mut take = take(900, 0.1);
    let mut numbers = Numbers(11);
    for (t, frame) in take.frames.iter_mut().enumerate() {
        frame[30] = None;
        for (j, d) in frame.iter_mut().enumerate() {
            if (t / 40 + j) % 9 == 0 || numbers.next() > 0.9 {
                *d = None;
            }
        }
    }
    let refined = refined(&[take]);
    let (first, last) = (refined.rounds[0], refined.rounds[refined.best]);
    assert!(last.held_out.rms < 0.5 * first.held_out.rms, "{:?}", refined.rounds);
}

#[test]
fn too_few_frames_are_refused() {
    let error = refine(&draft(), &seats(), &[take(36, 0.1)], &RefineOptions::default(), |_| ()).unwrap_err();
    assert!(matches!(error, MuscleError::Training { .. }));
    let said = error.to_string();
    assert!(
        said.contains("too few for 16 muscles, which need 32") && said.contains("longer takes"),
        "{said}"
    );
}

#[test]
fn a_take_that_shows_nothing_is_refused() {
    let mut take = take(300, 0.1);
    take.frames.iter_mut().for_each(|frame| frame.fill(None));
    assert!(refine(&draft(), &seats(), &[take], &RefineOptions::default(), |_| ()).is_err());
}

#[test]
fn noise_teaches_nothing() {
    let mut numbers = Numbers(13);
    let frames = (0..48).map(|_| (0..117).map(|_| Some(numbers.vector() * 6.0)).collect()).collect();
    let refined = refined(&[Training { frames, rate: RATE }]);
    assert_eq!(refined.stop, Stop::Overfits, "{:?}", refined.rounds);
    assert_eq!(refined.best, 0);
    assert_eq!(refined.basis, draft());
}
