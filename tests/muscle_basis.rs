//! The built-in bases, what is refused of a basis, and the file it is kept in.

use nalgebra::Vector3;
use understudy::{
    muscle::{ARKIT_SHAPES, FaceBasis, MuscleBasis, MuscleError, Part},
    tracking::index,
};

#[test]
fn the_fuller_basis_carries_the_names_of_arkit() {
    let basis = MuscleBasis::arkit();
    assert_eq!(basis.elements.len(), 51);
    let mut missing: Vec<&str> = Vec::new();
    for shape in ARKIT_SHAPES {
        let name = format!("{}{}", shape[..1].to_lowercase(), &shape[1..]);
        if basis.index(&name).is_none() {
            missing.push(shape);
        }
    }
    assert_eq!(missing, ["tongueOut"]);
    basis.check().unwrap();
    let moved = |name: &str, landmark: usize| basis.elements[basis.index(name).unwrap()].vectors[landmark];
    // Left is the subject's: +x. The jaw's own directions have no side.
    assert!(moved("mouthSmileLeft", index::MOUTH_LEFT).y > 5.0);
    assert!(moved("mouthSmileLeft", index::MOUTH_RIGHT).norm() < 2.0);
    assert!(moved("jawLeft", index::CHIN).x > 3.0 && moved("jawRight", index::CHIN).x < -3.0);
    assert!(moved("jawForward", index::CHIN).z > 3.0);
    let blink = &basis.elements[basis.index("eyeBlinkRight").unwrap()];
    assert!(blink.closure[0] > 0.9 && blink.closure[1].abs() < 1e-9 && blink.part == Part::Upper);
}

#[test]
fn a_basis_comes_back_from_its_file() {
    let basis = MuscleBasis::sixteen();
    let again = MuscleBasis::parse(&basis.format()).unwrap();
    assert!(again.names().eq(basis.names()));
    for (own, read) in basis.elements.iter().zip(&again.elements) {
        assert_eq!((own.part, own.channel), (read.part, read.channel));
        let far = own.vectors.iter().zip(&read.vectors).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(far < 0.021, "{}: {far}", own.name);
    }
    assert_eq!(MuscleBasis::parse(&again.format()).unwrap(), again);
}

#[test]
fn files_that_are_no_basis_are_refused_with_a_reason() {
    let good = MuscleBasis::sixteen().format();
    let reason = |text: &str| MuscleBasis::parse(text).unwrap_err();
    assert!(reason("").contains("EOF"));
    assert!(reason(&good.replace("understudy muscles 1", "understudy muscles 9")).contains("format"));
    assert!(reason(&good.replace("corrugator_right", "corrugator_left")).contains("twice"));
    assert!(reason(&good.replace("\"measured\"", "\"certain\"")).contains("certain"));
    assert!(reason(&good.replacen("[0,", "[99999,", 1)).contains("handle"));
    assert!(!reason(&good[..good.len() / 2]).is_empty());
}

#[test]
fn shapes_that_are_mixtures_of_others_or_nothing_are_named() {
    let mut basis = MuscleBasis::sixteen().clone();
    let mixture: Vec<Vector3<f64>> = basis.elements[8]
        .vectors
        .iter()
        .zip(&basis.elements[9].vectors)
        .map(|(a, b)| a * 0.5 + b * 0.5)
        .collect();
    let mut smile = basis.elements[8].clone();
    smile.name = "smile_both".into();
    smile.vectors = mixture;
    basis.elements.push(smile);
    let Err(MuscleError::Dependent { muscle, of, .. }) = basis.check() else { unreachable!("dependent") };
    let named = format!("{muscle} {of}");
    assert!(named.contains("smile_both") && named.contains("zygomatic_major"), "{named}");

    let mut idle = MuscleBasis::sixteen().clone();
    idle.elements[3].vectors.fill(Vector3::zeros());
    assert!(matches!(idle.check(), Err(MuscleError::Idle { muscle, .. }) if muscle == idle.elements[3].name));
}

#[test]
fn expressions_are_sums_of_shapes_but_for_the_jaws_arc() {
    let basis = MuscleBasis::arkit();
    let face = FaceBasis::own(basis);
    let mut contractions = vec![0.0; basis.elements.len()];
    let mut out = Vec::new();
    face.synthesize(&contractions, &mut out);
    assert!(out.iter().all(|v| *v == Vector3::zeros()));
    let [smile, brow, jaw] = ["mouthSmileLeft", "browInnerUp", "jawOpen"].map(|n| basis.index(n).unwrap());
    (contractions[smile], contractions[brow]) = (0.7, 0.4);
    face.synthesize(&contractions, &mut out);
    for (i, sum) in out.iter().enumerate() {
        let own = basis.elements[smile].vectors[i] * 0.7 + basis.elements[brow].vectors[i] * 0.4;
        assert!((sum - own).norm() < 1e-12);
    }
    contractions.fill(0.0);
    contractions[jaw] = 1.0;
    face.synthesize(&contractions, &mut out);
    assert!((out[index::CHIN] - basis.elements[jaw].vectors[index::CHIN]).norm() < 1e-9);
    contractions[jaw] = 0.5;
    face.synthesize(&contractions, &mut out);
    // Half way the chin is farther out than the straight line: before the line from the condyles.
    let bow = out[index::CHIN] - basis.elements[jaw].vectors[index::CHIN] * 0.5;
    assert!(bow.norm() > 0.5 && bow.z > 0.0, "{bow}");
}
