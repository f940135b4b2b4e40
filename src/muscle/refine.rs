//! Refinement of a basis by takes (001 §4.2): contractions by the shapes, shapes by the contractions, until it settles.
//!
//! (x, d) has a free scale: a muscle that the takes contract far is gauged so that its largest contraction is 1. A part of
//! the frames is kept from it all, and tells when the shapes begin to learn these takes and not this face.

use std::fmt;

use nalgebra::Vector3;

use super::{
    Analyser, FaceBasis, MarkerBasis, MarkerSeat, MuscleBasis, MuscleError, Part, Training,
    completion::Completion,
    refit::{Frame, Hold, Lesson},
};

/// A muscle that the takes use for less than this many frames of full contraction, Σx², or never contract farther than
/// [`IDLE_REACH`], is idle: it keeps its draft.
pub const IDLE_FRAMES: f64 = 1.0;
/// See [`IDLE_FRAMES`].
pub const IDLE_REACH: f64 = 0.1;
/// Only a muscle that the takes contract this far was exercised, and is gauged: less is no full contraction.
pub const EXERCISED: f64 = 0.5;
/// Frames to learn from, for each muscle.
const FRAMES_A_MUSCLE: usize = 2;
/// The total error has settled when a round changes it by less than this share.
const SETTLED: f64 = 1e-3;
/// The held-out error rises when it is above the least so far by this share, for so many rounds.
const RISE: f64 = 1e-3;
const PATIENCE: usize = 2;
/// The squared error of frames held out must fall by so much of the share by which that of those learned from falls, or it
/// is not this face that is learned.
const SHARED: f64 = 0.25;
/// Seconds that are held out at a time: neighbouring frames are alike.
const BLOCK: f64 = 1.0;

/// What may be chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefineOptions {
    /// Contractions may exceed 1.
    pub exaggerate: bool,
    /// Upper and lower face are solved apart, as 001 does.
    pub divided: bool,
    /// Share of the frames that is held out, 0.05..=0.5.
    pub hold_out: f64,
    /// Rounds at most.
    pub rounds: usize,
}

impl Default for RefineOptions {
    fn default() -> Self {
        Self { exaggerate: false, divided: true, hold_out: 0.2, rounds: 20 }
    }
}

/// Errors over many frames, millimetres.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TakeError {
    /// Root mean square of |d̂ⱼ − dⱼ| over frames and markers seen: the total analysis error of 001 §4.2.
    pub rms: f64,
    /// Mean of |d̂ⱼ − dⱼ| over markers, of the upper and the lower face (001 fig. 5).
    pub upper: f64,
    /// See `upper`.
    pub lower: f64,
}

/// One round; the first is the draft.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Round {
    /// Of the frames that shapes are learned from.
    pub learned: TakeError,
    /// Of those held out.
    pub held_out: TakeError,
}

/// Why there were no more rounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The total error changes no more.
    Settled,
    /// The frames held out are explained worse than before, or hardly better while those learned from are; the round before
    /// that is kept.
    Overfits,
    /// As many rounds as were allowed.
    Rounds,
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Settled => "the total error has settled",
            Self::Overfits => "more would overfit: the held-out error does not follow",
            Self::Rounds => "as many rounds as were allowed",
        })
    }
}

/// What came of it.
#[derive(Debug, Clone)]
pub struct Refinement {
    /// The draft with the shapes that the takes show.
    pub basis: MuscleBasis,
    /// The draft's errors, then those after each round.
    pub rounds: Vec<Round>,
    /// Which round `basis` is; 0 is the draft itself.
    pub best: usize,
    /// Why it ended.
    pub stop: Stop,
    /// M largest contractions of the frames learned from, by the draft: above 1 only with exaggeration.
    pub reach: Vec<f64>,
    /// Muscles that the takes did not use, whose shapes are the draft's.
    pub idle: Vec<String>,
    /// Muscles that they did not contract far enough to tell what full contraction is; refined, but not gauged.
    pub slight: Vec<String>,
    /// Frames learned from, and held out.
    pub frames: [usize; 2],
}

#[derive(Clone)]
struct State {
    shapes: MarkerBasis,
    gauges: Vec<f64>,
    contractions: Vec<Vec<f64>>,
}

/// Refines `basis` by takes whose J markers sit at `seats` on its face. `each` hears of each round as it ends.
///
/// Refuses fewer frames than twice the muscles.
pub fn refine(
    basis: &MuscleBasis,
    seats: &[Option<MarkerSeat>],
    takes: &[Training],
    options: &RefineOptions,
    mut each: impl FnMut(&Round),
) -> Result<Refinement, MuscleError> {
    let (learned, held) = split(takes, options.hold_out);
    let needed = FRAMES_A_MUSCLE * basis.elements.len();
    if learned.len() < needed {
        return Err(MuscleError::Training {
            reason: format!(
                "{} frames to learn from beside {} held out are too few for {} muscles, which need {needed}",
                learned.len(),
                held.len(),
                basis.elements.len()
            ),
            remedy: "Give longer takes, or a basis of fewer muscles",
        });
    }
    let face = FaceBasis::own(basis);
    let mut draft = MarkerBasis::new(&face, seats);
    if !options.divided {
        draft = draft.undivided();
    }
    let completion = Completion::new(&basis.face, seats)?;
    let count = basis.elements.len();
    let analyse = |shapes: &MarkerBasis| {
        let mut analyser = Analyser::new(shapes.clone(), options.exaggerate);
        let (contractions, of_learned) = analyse(&mut analyser, &learned);
        let (_, of_held) = self::analyse(&mut analyser, &held);
        (contractions, Round { learned: of_learned, held_out: of_held })
    };
    let (contractions, first) = analyse(&draft);
    each(&first);
    let used = Used::by(&contractions, count);
    let bent = |state: &mut State| -> Result<(), MuscleError> {
        if let Some(jaw) = draft.jaw() {
            let vectors = completed(basis, &draft, state, &completion, jaw)?;
            state.shapes.bend_by(&face, &vectors, seats);
        }
        Ok(())
    };
    let mut state = State { shapes: draft.clone(), gauges: vec![1.0; count], contractions };
    let mut rounds = vec![first];
    let mut best: (usize, Option<State>) = (0, None);
    let mut stop = Stop::Rounds;
    for round in 1..=options.rounds {
        gauge(&mut state, &used.exercised);
        bent(&mut state)?;
        let hold = Hold { draft: &draft, gauges: &state.gauges, idle: &used.idle };
        let lesson = Lesson { frames: &learned, contractions: &state.contractions };
        for part in [Part::Upper, Part::Lower] {
            lesson.refit(&mut state.shapes, &hold, part, part)?;
        }
        bent(&mut state)?;
        let (contractions, errors) = analyse(&state.shapes);
        state.contractions = contractions;
        each(&errors);
        let before = rounds[round - 1].learned.rms;
        rounds.push(errors);
        if rounds[round].held_out.rms < rounds[best.0].held_out.rms && !overfits(&rounds, best.0) {
            best = (round, Some(state.clone()));
        }
        if overfits(&rounds, best.0) {
            stop = Stop::Overfits;
            break;
        }
        if before - errors.learned.rms < SETTLED * before {
            stop = Stop::Settled;
            break;
        }
    }
    let mut refined = basis.clone();
    if let Some(mut state) = best.1 {
        gauge(&mut state, &used.exercised);
        let hold = Hold { draft: &draft, gauges: &state.gauges, idle: &used.idle };
        let lesson = Lesson { frames: &learned, contractions: &state.contractions };
        // What muscles do to the other part of the face does not count in the analysis, but is seen.
        lesson.refit(&mut state.shapes, &hold, Part::Upper, Part::Lower)?;
        lesson.refit(&mut state.shapes, &hold, Part::Lower, Part::Upper)?;
        for muscle in (0..count).filter(|muscle| !used.idle[*muscle]) {
            refined.elements[muscle].vectors = completed(basis, &draft, &state, &completion, muscle)?;
        }
    }
    let named = |which: Vec<bool>| {
        let kept = basis.elements.iter().zip(which).filter(|(_, which)| *which);
        kept.map(|(element, _)| element.name.clone()).collect()
    };
    let slight = used.idle.iter().zip(&used.exercised).map(|(idle, exercised)| !idle && !exercised);
    Ok(Refinement {
        basis: refined,
        rounds,
        best: best.0,
        stop,
        slight: named(slight.collect()),
        reach: used.reach,
        idle: named(used.idle),
        frames: [learned.len(), held.len()],
    })
}

/// How far the takes use each muscle, by the draft; M each.
struct Used {
    reach: Vec<f64>,
    idle: Vec<bool>,
    exercised: Vec<bool>,
}

impl Used {
    fn by(contractions: &[Vec<f64>], count: usize) -> Self {
        let reach = |muscle: usize| contractions.iter().map(|x| x[muscle]).fold(0.0, f64::max);
        let reach: Vec<f64> = (0..count).map(reach).collect();
        let idle = |muscle: usize| {
            reach[muscle] < IDLE_REACH
                || contractions.iter().map(|x| x[muscle].powi(2)).sum::<f64>() < IDLE_FRAMES
        };
        let idle: Vec<bool> = (0..count).map(idle).collect();
        let exercised = reach.iter().zip(&idle).map(|(reach, idle)| !idle && *reach >= EXERCISED).collect();
        Self { reach, idle, exercised }
    }
}

/// Whether the last round learned the takes and not the face.
fn overfits(rounds: &[Round], best: usize) -> bool {
    let (first, last) = (&rounds[0], &rounds[rounds.len() - 1]);
    let gain =
        |of: fn(&Round) -> TakeError| 1.0 - (of(last).rms / of(first).rms.max(f64::MIN_POSITIVE)).powi(2);
    let rises = last.held_out.rms > rounds[best].held_out.rms * (1.0 + RISE);
    gain(|round| round.held_out) < SHARED * gain(|round| round.learned)
        || rises && rounds.len() - 1 - best >= PATIENCE
}

/// One muscle's shape at every handle: the draft's times its gauge, and what the markers differ by from that.
fn completed(
    basis: &MuscleBasis,
    draft: &MarkerBasis,
    state: &State,
    completion: &Completion,
    muscle: usize,
) -> Result<Vec<Vector3<f64>>, MuscleError> {
    let gauge = state.gauges[muscle];
    let mut vectors: Vec<_> = basis.elements[muscle].vectors.iter().map(|v| v * gauge).collect();
    let pairs = state.shapes.vectors[muscle].iter().zip(&draft.vectors[muscle]);
    let differences: Vec<_> = pairs.map(|(own, draft)| own - draft * gauge).collect();
    completion.add(&differences, &mut vectors)?;
    Ok(vectors)
}

/// Scales each exercised muscle so that its largest contraction is 1: its contractions by one factor, its shape by the
/// inverse; what they make together stays.
fn gauge(state: &mut State, exercised: &[bool]) {
    for muscle in (0..exercised.len()).filter(|muscle| exercised[*muscle]) {
        let most = state.contractions.iter().map(|x| x[muscle]).fold(0.0, f64::max);
        if most < EXERCISED {
            continue;
        }
        state.contractions.iter_mut().for_each(|x| x[muscle] /= most);
        state.shapes.vectors[muscle].iter_mut().for_each(|v| *v *= most);
        state.gauges[muscle] *= most;
    }
}

/// T × M contractions, and the errors.
fn analyse(analyser: &mut Analyser, frames: &[&Frame]) -> (Vec<Vec<f64>>, TakeError) {
    let (mut squared, mut seen, mut sums, mut counts) = (0.0, 0, [0.0; 2], [0; 2]);
    let contractions = frames
        .iter()
        .map(|frame| {
            let fit = analyser.solve(frame);
            for (k, part) in [fit.upper, fit.lower].into_iter().enumerate() {
                squared += part.squared;
                seen += part.seen;
                sums[k] += part.error * part.seen as f64;
                counts[k] += part.seen;
            }
            analyser.contractions().to_vec()
        })
        .collect();
    let mean = |sum: f64, count: usize| sum / count.max(1) as f64;
    let rms = mean(squared, seen).sqrt();
    (contractions, TakeError { rms, upper: mean(sums[0], counts[0]), lower: mean(sums[1], counts[1]) })
}

/// Frames that show anything: to learn from, and every k-th block of a second to hold out.
fn split(takes: &[Training], share: f64) -> (Vec<&Frame>, Vec<&Frame>) {
    let every = (1.0 / share.clamp(0.05, 0.5)).round() as usize;
    let (mut learned, mut held) = (Vec::new(), Vec::new());
    for take in takes {
        let shown: Vec<&Frame> = take.frames.iter().filter(|f| f.iter().any(Option::is_some)).collect();
        // A short take holds one out as well.
        let block = ((BLOCK * take.rate).round() as usize).min(shown.len() / every).max(1);
        for (t, frame) in shown.into_iter().enumerate() {
            if (t / block) % every == every / 2 { held.push(frame) } else { learned.push(frame) }
        }
    }
    (learned, held)
}
