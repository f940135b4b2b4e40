//! A performer's skin from takes: looks gathered, exemplars chosen, texture volumes built.

use std::{collections::BTreeMap, fmt};

use nalgebra::Vector2;

use super::{
    Motion, PipelineError,
    appearance_observer::{observe, speeds},
};
use crate::{
    appearance::{
        Absence, AppearanceError, Exemplar, FEWEST_LAYERS, FaceFrame, FaceImage, LEARNT_NARROWER, Lesson,
        Look, MOST_LAYERS, REGION_COUNT, RatioFilter, RatioOptions, Region, RegionSkin, Skin, Stage,
        Unlearnt, learn, learn_from, muscles, request,
    },
    capture::{CaptureError, Frame, FrameSource},
    lift::{Displacements, Expression, Performer, Side},
};

/// Farthest turn from the neutral pose in which a look is learnt, radians.
const TURNED: f64 = 0.44;
/// Face widths that the head may move in a frame before the picture counts as blurred.
const BLURRED: f64 = 0.02;
/// The tip of the nose.
const NOSE: usize = 1;

/// Frames that a person names for a region: place of the take, number of the frame. Neutral first; none leaves the region out.
pub type Choice = Vec<(u16, u64)>;

/// The looks of one take.
pub struct TakeLooks {
    name: String,
    motion: Motion,
    looks: [Vec<Look>; REGION_COUNT],
    /// Frames in which each region is seen at all.
    seen: [usize; REGION_COUNT],
    /// Pixels from cheek to cheek, in most frames.
    width: f64,
}

/// Why a region is not in a skin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Missing {
    /// Which.
    pub region: Region,
    /// Why.
    pub reason: MissingReason,
}

/// Why a region cannot be learnt from takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MissingReason {
    /// The face is this many pixels wide at most.
    Narrow(f64),
    /// The looks do not tell.
    Looks(Unlearnt),
    /// It was left out by hand.
    LeftOut,
}

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (region, wanted) = (self.region.name(), request(self.region));
        match self.reason {
            MissingReason::Narrow(width) => write!(
                f,
                "{region}: the face is {width:.0} px wide in the picture, and {:.0} are needed; come closer to the camera",
                self.region.detail().narrowest_face()
            ),
            MissingReason::Looks(Unlearnt::Unseen(frames)) => {
                write!(f, "{region}: it is seen well in {frames} frames only; face the camera and hold still")
            }
            MissingReason::Looks(Unlearnt::NotPerformed(rise)) => {
                write!(f, "{region}: its muscles rose by {rise:.2} only; {wanted}")
            }
            MissingReason::Looks(Unlearnt::NoChange) => {
                write!(f, "{region}: its look did not change with its muscles; {wanted}")
            }
            MissingReason::LeftOut => write!(f, "{region}: left out by hand"),
        }
    }
}

impl TakeLooks {
    /// Looks at every frame of a solved take once more; `take` is its place among the takes.
    pub fn gather(
        take: u16,
        source: Box<dyn FrameSource>,
        motion: Motion,
        frame: &FaceFrame,
        mut progress: impl FnMut(u64),
    ) -> Result<Self, PipelineError> {
        let speed = speeds(&motion, NOSE);
        let cues = Cues::of(&motion);
        let mut looks: [Vec<Look>; REGION_COUNT] = Default::default();
        let mut seen = [0; REGION_COUNT];
        let mut done = 0;
        let mut widths = Vec::new();
        observe(source, &motion, frame, false, |observed| {
            done += 1;
            progress(done);
            let expression = &observed.motion.expression;
            if !matches!(observed.samples[0], Err(Absence::NoFace)) {
                widths.push(observed.width);
            }
            let turned = expression.pose.rotation.angle_to(&motion.performer.rest().rotation) > TURNED;
            let blurred = speed.get(done as usize - 1).is_none_or(|&speed| speed > BLURRED);
            let time = observed.motion.timestamp;
            let neutral = time >= motion.neutral.0 && time <= motion.neutral.1;
            for region in Region::ALL {
                let wide = observed.width >= region.detail().narrowest_face() * LEARNT_NARROWER;
                let Ok(sample) = &observed.samples[region.index()] else { continue };
                seen[region.index()] += 1;
                if wide && !turned && !blurred {
                    let cue = cues.of_region(region, expression);
                    let look = Look::new(take, observed.motion.index, cue, neutral, sample);
                    looks[region.index()].push(look);
                }
            }
        })?;
        widths.sort_by(f64::total_cmp);
        let width = widths.get(widths.len() / 2).copied().unwrap_or(0.0);
        Ok(Self { name: motion.info.name.clone(), motion, looks, seen, width })
    }
}

/// Where each region's muscles are in the contractions.
struct Cues([Vec<usize>; REGION_COUNT]);

impl Cues {
    fn of(motion: &Motion) -> Self {
        let basis = motion.basis.as_ref();
        let place = |name: &&str| basis?.index(name);
        Self(Region::ALL.map(|region| muscles(region).iter().filter_map(place).collect()))
    }

    fn of_region(&self, region: Region, expression: &Expression) -> f32 {
        let side = if region.is_left() { Side::Left } else { Side::Right };
        let value = if region.is_eye() {
            expression.eyes.of(side).closure
        } else {
            let contraction = |&at: &usize| expression.contractions.get(at).copied().unwrap_or(0.0);
            self.0[region.index()].iter().map(contraction).fold(0.0, f64::max)
        };
        value.clamp(0.0, 1.0) as f32
    }
}

/// What was learnt, and what was not.
pub struct Learnt {
    /// The skin.
    pub skin: Skin,
    /// Regions that are not in it.
    pub missing: Vec<Missing>,
}

/// Learns a skin from takes. `open` opens the take of a place once more; `choices` are exemplars that a person has named.
pub fn learn_skin(
    performer: String,
    takes: &[TakeLooks],
    frame: &FaceFrame,
    choices: &BTreeMap<Region, Choice>,
    open: impl Fn(usize) -> Result<Box<dyn FrameSource>, CaptureError>,
    mut progress: impl FnMut(u64),
) -> Result<Learnt, PipelineError> {
    let filter = RatioFilter::new(frame, RatioOptions::default());
    let (mut regions, mut missing) = (Vec::new(), Vec::new());
    for (done, region) in (0..).zip(Region::ALL) {
        progress(done);
        let looks: Vec<Look> = takes.iter().flat_map(|take| &take.looks[region.index()]).cloned().collect();
        match lesson(region, takes, &looks, choices.get(&region))? {
            Ok(lesson) => regions.push(build(region, &lesson, &looks, takes, frame, &filter, &open)?),
            Err(reason) => missing.push(Missing { region, reason }),
        }
    }
    if regions.is_empty() {
        let reasons: Vec<String> = missing.iter().map(|missing| format!("  {missing}")).collect();
        return Err(AppearanceError::NothingLearnt { reasons: reasons.join("\n") }.into());
    }
    let names = takes.iter().map(|take| take.name.clone()).collect();
    let skin = Skin::new(performer, names, regions)
        .map_err(|reason| AppearanceError::NothingLearnt { reasons: format!("  {reason}") })?;
    Ok(Learnt { skin, missing })
}

fn lesson(
    region: Region,
    takes: &[TakeLooks],
    looks: &[Look],
    choice: Option<&Choice>,
) -> Result<Result<Lesson, MissingReason>, AppearanceError> {
    let Some(choice) = choice else {
        let width = takes.iter().map(|take| take.width).fold(0.0, f64::max);
        let seen: usize = takes.iter().map(|take| take.seen[region.index()]).sum();
        if looks.is_empty() && seen > 0 && width < region.detail().narrowest_face() * LEARNT_NARROWER {
            return Ok(Err(MissingReason::Narrow(width)));
        }
        return Ok(learn(region, looks).map_err(MissingReason::Looks));
    };
    if choice.is_empty() {
        return Ok(Err(MissingReason::LeftOut));
    }
    let wrong = |reason: String| AppearanceError::Exemplars { region: region.name(), reason };
    if !(FEWEST_LAYERS..=MOST_LAYERS).contains(&choice.len()) {
        let count = choice.len();
        return Err(wrong(format!(
            "{count} are named; {FEWEST_LAYERS} to {MOST_LAYERS} are wanted, neutral first"
        )));
    }
    let place = |&(take, number): &(u16, u64)| {
        looks.iter().position(|look| look.take == take && look.frame == number).ok_or_else(|| {
            let of_take = looks.iter().filter(|look| look.take == take).map(|look| look.frame);
            let nearest = of_take.min_by_key(|frame| frame.abs_diff(number));
            let instead = nearest.map_or(String::new(), |frame| format!(", in frame {frame} it is"));
            wrong(format!("it is not seen well in frame {number} of take {}{instead}", u32::from(take) + 1))
        })
    };
    let chosen = choice.iter().map(place).collect::<Result<Vec<_>, _>>()?;
    learn_from(&chosen, looks).map(Ok).ok_or_else(|| wrong("two neighbours look the same".into()))
}

/// The texture volume of a lesson: the pictures of each stage, averaged in the shared frame.
fn build(
    region: Region,
    lesson: &Lesson,
    looks: &[Look],
    takes: &[TakeLooks],
    frame: &FaceFrame,
    filter: &RatioFilter,
    open: &impl Fn(usize) -> Result<Box<dyn FrameSource>, CaptureError>,
) -> Result<RegionSkin, PipelineError> {
    let mut pictures: BTreeMap<(u16, u64), FaceImage> = BTreeMap::new();
    for (place, take) in (0..).zip(takes) {
        let of_take = |&at: &usize| (looks[at].take == place).then_some(looks[at].frame);
        let wanted: Vec<u64> =
            lesson.stages.iter().flat_map(|stage| stage.looks.iter().filter_map(of_take)).collect();
        let Some(&last) = wanted.iter().max() else { continue };
        let mut source = open(usize::from(place))?;
        let mut picture = Frame::default();
        while source.read(&mut picture)? && picture.index <= last {
            if !wanted.contains(&picture.index) {
                continue;
            }
            let Some(shown) = take.motion.frames.get(picture.index as usize) else { continue };
            let landmarks = places(region, &take.motion.performer, &shown.expression);
            if let Some(face) = FaceImage::of_image(&picture.image, &landmarks, frame) {
                pictures.insert((place, picture.index), face);
            }
        }
    }
    let changed = || AppearanceError::Exemplars {
        region: region.name(),
        reason: "the clip shows other frames than when it was tracked".into(),
    };
    let mean = |stage: &Stage| {
        let key = |&at: &usize| (looks[at].take, looks[at].frame);
        let faces: Vec<&FaceImage> = stage.looks.iter().filter_map(|at| pictures.get(&key(at))).collect();
        FaceImage::mean(&faces)
    };
    let stages: Vec<Option<FaceImage>> = lesson.stages.iter().map(mean).collect();
    // A blend of its neighbours where a stage has no pictures of its own.
    let filled = |at: usize| -> Option<FaceImage> {
        if let Some(face) = &stages[at] {
            return Some(face.clone());
        }
        let before = stages[..at].iter().rev().find_map(Option::as_ref)?;
        let after = stages[at + 1..].iter().find_map(Option::as_ref)?;
        FaceImage::mean(&[before, after])
    };
    let neutral = filled(0).ok_or_else(changed)?;
    let others: Vec<FaceImage> = (1..stages.len()).map(filled).collect::<Option<_>>().ok_or_else(changed)?;
    let volume = filter.volume(region, frame, &neutral, &others).ok_or_else(changed)?;
    let exemplar = |stage: &Stage| Exemplar {
        take: stage.looks.first().map_or(0, |&at| looks[at].take),
        frames: stage.looks.iter().map(|&at| looks[at].frame).collect(),
    };
    let exemplars = lesson.stages.iter().map(exemplar).collect();
    Ok(RegionSkin { classifier: lesson.classifier.clone(), volume, exemplars })
}

/// Pixels of the landmarks by which a region is found: the pose alone for eyes, whose mesh follows the lids.
fn places(region: Region, performer: &Performer, expression: &Expression) -> Vec<Vector2<f64>> {
    let rigid = Displacements::neutral();
    let displacements = if region.is_eye() { &rigid } else { &expression.displacements };
    performer.pixels(displacements, &expression.pose)
}
