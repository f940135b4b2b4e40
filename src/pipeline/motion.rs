//! From a tracked clip to the motion of a face: neutral, pose, lifting, repair, smoothing, presence.

use std::sync::Arc;

use nalgebra::Point3;

use super::{Performance, PipelineError, TrackedFrame};
use crate::{
    capture::{ClipInfo, Timestamp},
    head::{Camera, HeadPose},
    lift::{
        Candidate, CausalEyes, CausalSteadier, Expression, EyeRun, Eyes, FaceState, LiftError, NeutralEyes,
        NeutralSearch, NeutralStretch, NotNeutral, Performer, Presence, Repair, Smoothing, eyes_of_recording,
        measure_eyes, steady_recording,
    },
    muscle::{MuscleBasis, MuscleLift},
    tracking::{BlendshapeNetwork, Landmarks, TrackingError},
};

/// How a recording is solved.
#[derive(Debug, Clone, PartialEq)]
pub struct SolveOptions {
    /// Degrees along the picture's longer side.
    pub field_of_view: f64,
    /// Seconds between which the performer is neutral; found automatically where `None`.
    pub neutral: Option<(f64, f64)>,
    /// Take a stretch that the gate refuses.
    pub accept_neutral: bool,
    /// How to steady.
    pub smoothing: Smoothing,
    /// Where depth comes from.
    pub lift: LiftMode,
}

/// How landmarks in the picture become motion in space.
#[derive(Debug, Clone, PartialEq)]
pub enum LiftMode {
    /// Pose and the muscles of a basis are solved together; depth follows from the muscles.
    Muscles(Arc<MuscleBasis>),
    /// Pose from the rigid points, then the plane parallel to the picture, with the network's depth as a hint.
    Plane,
}

impl Default for LiftMode {
    fn default() -> Self {
        Self::Muscles(Arc::new(MuscleBasis::arkit().clone()))
    }
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self {
            field_of_view: Camera::DEFAULT_FIELD_OF_VIEW,
            neutral: None,
            accept_neutral: false,
            smoothing: Smoothing::default(),
            lift: LiftMode::default(),
        }
    }
}

/// One frame of the motion.
#[derive(Debug, Clone)]
pub struct MotionFrame {
    /// From 0.
    pub index: u64,
    /// When.
    pub timestamp: Timestamp,
    /// Head and face.
    pub expression: Expression,
    /// Where they come from.
    pub state: FaceState,
    /// The network's presence; 0 where no face is seen.
    pub confidence: f64,
    /// Mean distance of the landmarks from where the contractions put them, upper and lower face, millimetres, before
    /// anything is steadied; none where no face is seen or no muscles were solved for.
    pub marker_error: Option<[f64; 2]>,
}

/// A whole take.
#[derive(Debug, Clone)]
pub struct Motion {
    /// The clip.
    pub info: ClipInfo,
    /// The performer's camera and neutral scan.
    pub performer: Performer,
    /// The muscles by which it was lifted, in the order of `Expression::contractions`; `None` where it was not.
    pub basis: Option<MuscleBasis>,
    /// All frames.
    pub frames: Vec<MotionFrame>,
    /// First and last moment of the neutral stretch.
    pub neutral: (Timestamp, Timestamp),
    /// What speaks against that stretch, where it was taken all the same.
    pub objections: Vec<NotNeutral>,
}

impl Motion {
    /// Solves a recording. `average_face` has 468 points in millimetres.
    pub fn solve(
        performance: &Performance,
        average_face: &[Point3<f64>],
        blendshapes: &mut BlendshapeNetwork,
        options: &SolveOptions,
    ) -> Result<Self, PipelineError> {
        let info = performance.info.clone();
        let camera = Camera::with_field_of_view(info.width, info.height, options.field_of_view)
            .map_err(LiftError::from)?;
        let seen: Vec<(Timestamp, &Landmarks)> =
            performance.frames.iter().filter_map(|f| Some((f.timestamp, f.landmarks.as_ref()?))).collect();
        if seen.is_empty() {
            return Err(LiftError::NoFace { frames: performance.frames.len() }.into());
        }
        // Any one frame's neutral is good enough to tell how the head is turned in all.
        let draft = Performer::from_average_face(camera, average_face, &[seen[0].1])?;
        let mut candidates: Vec<Candidate> = Vec::with_capacity(seen.len());
        for (time, landmarks) in seen {
            let pose = draft.pose(landmarks, candidates.last().map(|c| &c.pose))?;
            candidates.push(Candidate { time, landmarks, pose });
        }
        let stretch = choose_neutral(&candidates, blendshapes, options)?;
        let chosen = &candidates[stretch.first..stretch.end];
        let neutral_frames: Vec<&Landmarks> = chosen.iter().map(|c| c.landmarks).collect();
        let performer = Performer::from_average_face(camera, average_face, &neutral_frames)?;
        let neutral = (chosen[0].time, chosen[chosen.len() - 1].time);
        let eyes = neutral_eyes(&performer, &neutral_frames)?;
        let basis = match &options.lift {
            LiftMode::Muscles(basis) => Some(MuscleLift::lifting(basis)),
            LiftMode::Plane => None,
        };
        let mut lift = basis.as_ref().map(|basis| MuscleLift::new(&performer, basis)).transpose()?;
        let frames = solve_frames(&performance.frames, &performer, &mut lift, &eyes, options.smoothing)?;
        Ok(Self { info, performer, basis, frames, neutral, objections: stretch.objections })
    }
}

fn choose_neutral(
    candidates: &[Candidate],
    blendshapes: &mut BlendshapeNetwork,
    options: &SolveOptions,
) -> Result<NeutralStretch, PipelineError> {
    let search = NeutralSearch::new(candidates);
    let smile =
        |landmarks: &Landmarks| -> Result<f64, TrackingError> { Ok(blendshapes.run(landmarks)?.smile()) };
    let Some((start, end)) = options.neutral else {
        let chosen = search.choose(smile)?;
        return Ok(chosen.unwrap_or(NeutralStretch {
            first: 0,
            end: candidates.len(),
            objections: Vec::new(),
        }));
    };
    let stretch = search.between(start, end, smile)??;
    if stretch.objections.is_empty() || options.accept_neutral {
        return Ok(stretch);
    }
    let reasons = stretch.objections.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ");
    Err(LiftError::NotNeutral { start, end, reasons }.into())
}

fn neutral_eyes(performer: &Performer, frames: &[&Landmarks]) -> Result<NeutralEyes, LiftError> {
    let measures: Result<Vec<_>, LiftError> = frames
        .iter()
        .map(|frame| Ok(measure_eyes(performer, frame, &performer.pose(frame, Some(performer.rest()))?)))
        .collect();
    Ok(NeutralEyes::new(&measures?))
}

/// Every unbroken run of tracked frames is solved and steadied by itself; presence then joins the runs.
fn solve_frames(
    frames: &[TrackedFrame],
    performer: &Performer,
    lift: &mut Option<MuscleLift>,
    neutral_eyes: &NeutralEyes,
    smoothing: Smoothing,
) -> Result<Vec<MotionFrame>, PipelineError> {
    let mut repair = Repair::new(performer);
    let mut expressions = Vec::with_capacity(frames.len());
    let (mut errors, mut eye_runs) = (Vec::new(), Vec::new());
    for run in frames.chunk_by(|a, b| a.landmarks.is_some() == b.landmarks.is_some()) {
        let solved = solve_run(run, performer, lift, &mut repair, smoothing)?;
        expressions.extend(solved.expressions);
        errors.extend(solved.errors);
        eye_runs.push(solved.eyes);
    }
    // The lids' range is that of all runs.
    for (expression, eyes) in expressions.iter_mut().zip(solve_eyes(neutral_eyes, &eye_runs, smoothing)) {
        expression.eyes = eyes;
    }
    let mut presence = Presence::new(*performer.rest());
    let mut seen = expressions.into_iter().zip(errors);
    let shown = frames.iter().map(|frame| {
        let (expression, error) = frame.landmarks.as_ref().and_then(|_| seen.next()).unzip();
        let (expression, state) = presence.show(frame.timestamp, expression);
        MotionFrame {
            index: frame.index,
            timestamp: frame.timestamp,
            expression,
            state,
            confidence: frame.landmarks.as_ref().map_or(0.0, |landmarks| landmarks.presence),
            marker_error: error.flatten(),
        }
    });
    Ok(shown.collect())
}

/// What an unbroken run of frames shows, an entry for each; none where they have no face.
#[derive(Default)]
struct SolvedRun {
    expressions: Vec<Expression>,
    errors: Vec<Option<[f64; 2]>>,
    eyes: EyeRun,
}

/// One run. The eyes are only measured.
fn solve_run(
    run: &[TrackedFrame],
    performer: &Performer,
    lift: &mut Option<MuscleLift>,
    repair: &mut Repair,
    smoothing: Smoothing,
) -> Result<SolvedRun, PipelineError> {
    let reference = performer.rest().rotation;
    let quick = lift.as_ref().map_or_else(Vec::new, MuscleLift::quick);
    let mut steadier = CausalSteadier::new(&quick);
    let mut previous: Option<HeadPose> = None;
    let SolvedRun { mut expressions, mut errors, mut eyes } = SolvedRun::default();
    repair.reset();
    if let Some(lift) = lift {
        lift.reset();
    }
    for frame in run {
        let Some(landmarks) = &frame.landmarks else { continue };
        let rigid = performer.pose(landmarks, previous.as_ref())?;
        previous = Some(rigid);
        eyes.times.push(frame.timestamp);
        let mut expression = Expression::neutral(rigid);
        let mut error = None;
        match lift {
            Some(lift) => {
                let mut visible = landmarks.clone();
                repair.hide(&rigid, &mut visible.states);
                let lifted = lift.lift(performer, &visible, &rigid);
                expression.pose = lifted.pose;
                expression.displacements = lifted.displacements;
                expression.contractions = lifted.contractions;
                error = lifted.marker_error;
            }
            None => expression.displacements = performer.lift(landmarks, &rigid),
        }
        eyes.measures.push(measure_eyes(performer, landmarks, &expression.pose));
        repair.apply(frame.timestamp, &expression.pose, &mut expression.displacements);
        if let Some(lift) = lift {
            // Contractions and what they leave unexplained are steadied apart.
            lift.add(&expression.contractions, -1.0, &mut expression.displacements);
        }
        if smoothing == Smoothing::Causal {
            steadier.apply(frame.timestamp, &reference, &mut expression);
        }
        expressions.push(expression);
        errors.push(error);
    }
    if smoothing == Smoothing::ZeroPhase && !expressions.is_empty() {
        steady_recording(&eyes.times, &reference, &quick, &mut expressions);
    }
    if let Some(lift) = lift {
        for expression in &mut expressions {
            lift.add(&expression.contractions, 1.0, &mut expression.displacements);
        }
    }
    Ok(SolvedRun { expressions, errors, eyes })
}

/// The eyes of all tracked frames.
fn solve_eyes(neutral: &NeutralEyes, runs: &[EyeRun], smoothing: Smoothing) -> Vec<Eyes> {
    if smoothing != Smoothing::Causal {
        return eyes_of_recording(neutral, runs, smoothing == Smoothing::ZeroPhase).concat();
    }
    let mut causal = CausalEyes::new(*neutral);
    let mut eyes = Vec::new();
    for run in runs {
        causal.reset();
        eyes.extend(
            run.times.iter().zip(&run.measures).map(|(&time, measures)| causal.apply(time, measures)),
        );
    }
    eyes
}
