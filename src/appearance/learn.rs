//! Which frames show a region's looks, from neutral to most expressive.
//!
//! A muscle's cue says when a region may wrinkle, and its look has to agree: a hand before the mouth changes the look without
//! a muscle, and a muscle that a turned head pretends changes nothing. Lids follow how far the eye has closed.

use super::{
    Classifier, FEWEST_LAYERS, MOST_LAYERS, Region, Sample,
    haar::{self, COUNT, Grid},
    template::Template,
};

/// Frames that a layer is averaged of, at most and for a clear one.
pub const MOST_AVERAGED: usize = 8;
const AVERAGED: usize = 4;
/// Fewest looks from which anything is learnt.
const FEWEST_LOOKS: usize = 12;
/// Rise of the cue that counts as performed: contractions of muscles, closure of lids.
const RISE: f32 = 0.25;
const LID_RISE: f32 = 0.6;
/// Closure from which a lid is shut.
const SHUT: f32 = 0.9;
/// Fewest looks of an extreme.
const FEWEST_STRONG: usize = 3;
/// The expressive look differs from the neutral by at least this many times what neutral looks differ from their mean.
const CLEAR: f32 = 1.5;
/// Share of looks by which the scores of the performer's own skin are known, and how many times farther a look may be from all
/// templates before it counts as something else.
const OWN_SHARE: f32 = 0.75;
const REACH: f32 = 1.75;

/// The look of a region in one frame that can be learnt from: seen, facing the camera, not blurred.
#[derive(Debug, Clone)]
pub struct Look {
    /// Which take.
    pub take: u16,
    /// Which frame of it.
    pub frame: u64,
    /// How strongly the region should wrinkle (0..=1), or the lid be closed.
    pub cue: f32,
    /// Whether it belongs to the neutral stretch of its take.
    pub neutral: bool,
    /// Coefficients of its sample, lighting normalised.
    pub coefficients: Grid,
    /// How much contrast its details have, before lighting is normalised.
    pub relief: f32,
}

impl Look {
    /// From a sample.
    pub fn new(take: u16, frame: u64, cue: f32, neutral: bool, sample: &Sample) -> Self {
        let mut coefficients = sample.own();
        haar::decompose(&mut coefficients);
        Self { take, frame, cue, neutral, coefficients, relief: sample.relief() }
    }
}

/// One layer to be: the looks it is averaged of, by their places in the list; none for a blend of its neighbours.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Places in the list of looks.
    pub looks: Vec<usize>,
    /// Mean coefficients.
    pub coefficients: Grid,
}

/// What of a region can be learnt.
#[derive(Debug, Clone, PartialEq)]
pub struct Lesson {
    /// Neutral first.
    pub stages: Vec<Stage>,
    /// Tells the state of a look.
    pub classifier: Classifier,
}

/// Why a region cannot be learnt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unlearnt {
    /// It is seen in so many frames only.
    Unseen(usize),
    /// The muscles that wrinkle it never contracted; how far they did.
    NotPerformed(f32),
    /// They did, and its look stayed the same or changed in another way each time.
    NoChange,
}

/// Finds neutral, extreme and what lies between.
pub fn learn(region: Region, looks: &[Look]) -> Result<Lesson, Unlearnt> {
    if looks.len() < FEWEST_LOOKS {
        return Err(Unlearnt::Unseen(looks.len()));
    }
    let all: Vec<usize> = (0..looks.len()).collect();
    let neutral = neutral_looks(looks, &all);
    let rest = mean(looks, &closest(looks, &neutral, &median(looks, &neutral)));
    let low = quantile(neutral.iter().map(|&at| looks[at].cue).collect(), 0.5);
    let (strongest, high) = strongest(region, looks, &rest);
    if high - low < if region.is_eye() { LID_RISE } else { RISE } || strongest.len() < FEWEST_STRONG {
        return Err(Unlearnt::NotPerformed(high - low));
    }
    let strongest: Vec<usize> =
        strongest.into_iter().filter(|&at| looks[at].cue - low > 0.6 * (high - low)).collect();
    // What most of them share is the wrinkle; a hand is there in some, and elsewhere in each.
    let shared = median(looks, &strongest);
    let extreme = closest(looks, &strongest, &shared);
    let peak = mean(looks, &extreme);
    let spread = |of: &[usize], centre: &Grid| {
        let template = Template::new(centre);
        quantile(of.iter().map(|&at| template.score(&looks[at].coefficients)).collect(), 0.5)
    };
    let change = Template::new(&rest).score(&peak);
    let relief = |of: &[usize]| quantile(of.iter().map(|&at| looks[at].relief).collect(), 0.5);
    let flatter = !region.is_eye() && relief(&extreme) <= relief(&neutral);
    if change < CLEAR * spread(&neutral, &rest) || flatter {
        return Err(Unlearnt::NoChange);
    }
    let first = Stage { looks: closest(looks, &neutral, &rest), coefficients: rest };
    let last = Stage { looks: extreme, coefficients: peak };
    let stages = between(looks, first, last);
    finish(stages, looks).ok_or(Unlearnt::NoChange)
}

/// From frames that a person has chosen: neutral first, 3 to 6 of them. Each is averaged with like looks around it.
pub fn learn_from(chosen: &[usize], looks: &[Look]) -> Option<Lesson> {
    let stage = |&at: &usize| {
        let template = Template::new(&looks[at].coefficients);
        let near = |other: &usize| {
            looks[*other].take == looks[at].take && looks[*other].frame.abs_diff(looks[at].frame) <= 3
        };
        let mut around: Vec<usize> = (0..looks.len()).filter(near).collect();
        let score = |other: usize| template.score(&looks[other].coefficients);
        around.sort_by(|&a, &b| score(a).total_cmp(&score(b)).then(a.cmp(&b)));
        around.truncate(AVERAGED);
        around.sort_unstable();
        Stage { coefficients: mean(looks, &around), looks: around }
    };
    finish(chosen.iter().map(stage).collect(), looks)
}

/// Looks in which the cue is strongest, and how strong it is: a twentieth of all for wrinkles. Blinks are rarer and shorter: every
/// look in which the lid is shut, and of these the half that is farthest from the open eye, because the landmarks shut
/// early.
fn strongest(region: Region, looks: &[Look], rest: &Grid) -> (Vec<usize>, f32) {
    let mut order: Vec<usize> = (0..looks.len()).collect();
    order.sort_by(|&a, &b| looks[b].cue.total_cmp(&looks[a].cue).then(a.cmp(&b)));
    if region.is_eye() {
        let high = order.first().map_or(0.0, |&at| looks[at].cue);
        order.retain(|&at| looks[at].cue >= SHUT);
        let template = Template::new(rest);
        let far = |at: usize| template.score(&looks[at].coefficients);
        order.sort_by(|&a, &b| far(b).total_cmp(&far(a)).then(a.cmp(&b)));
        order.truncate(order.len().div_ceil(2).max(FEWEST_STRONG));
        return (order, high);
    }
    order.truncate((looks.len() / 20).max(AVERAGED).min(looks.len() / 3));
    let high = quantile(order.iter().map(|&at| looks[at].cue).collect(), 0.5);
    (order, high)
}

/// Looks of the neutral: those of the neutral stretch, or else those of the lowest cues.
fn neutral_looks(looks: &[Look], all: &[usize]) -> Vec<usize> {
    let named: Vec<usize> = all.iter().copied().filter(|&at| looks[at].neutral).collect();
    if named.len() >= AVERAGED {
        return named;
    }
    let mut calm = all.to_vec();
    calm.sort_by(|&a, &b| looks[a].cue.total_cmp(&looks[b].cue).then(a.cmp(&b)));
    calm.truncate((looks.len() / 4).max(AVERAGED));
    calm
}

/// Layers at even steps between the two ends, as many as the take shows; one blend where it shows none.
fn between(looks: &[Look], first: Stage, last: Stage) -> Vec<Stage> {
    let way: Grid = std::array::from_fn(|at| last.coefficients[at] - first.coefficients[at]);
    let length = dot(&way, &way);
    // How far along the way a look is, and how far beside it.
    let along: Vec<(f32, f32)> = looks
        .iter()
        .map(|look| {
            let from: Grid = std::array::from_fn(|at| look.coefficients[at] - first.coefficients[at]);
            let share = dot(&from, &way) / length;
            let beside: Grid = std::array::from_fn(|at| from[at] - share * way[at]);
            (share, dot(&beside, &beside).sqrt())
        })
        .collect();
    let (low, high) = (mean_cue(looks, &first.looks), mean_cue(looks, &last.looks));
    let usual = quantile(along.iter().map(|(_, beside)| *beside).collect(), 0.5);
    let found = |layers: usize| -> Option<Vec<Stage>> {
        (1..layers - 1)
            .map(|step| {
                let wanted = step as f32 / (layers - 1) as f32;
                let off = |at: usize| (along[at].0 - wanted).abs();
                let cue = |at: usize| (looks[at].cue - low) / (high - low);
                let fits = |at: &usize| {
                    off(*at) < 0.3 / layers as f32
                        && along[*at].1 <= usual
                        && (cue(*at) - wanted).abs() < 0.35
                };
                let mut near: Vec<usize> = (0..looks.len()).filter(fits).collect();
                near.sort_by(|&a, &b| off(a).total_cmp(&off(b)).then(a.cmp(&b)));
                near.truncate(MOST_AVERAGED);
                near.sort_unstable();
                (near.len() >= AVERAGED).then(|| Stage { coefficients: mean(looks, &near), looks: near })
            })
            .collect()
    };
    let middle = (FEWEST_LAYERS..MOST_LAYERS).rev().find_map(found);
    let middle = middle.unwrap_or_else(|| {
        let blend = std::array::from_fn(|at| f32::midpoint(first.coefficients[at], last.coefficients[at]));
        vec![Stage { looks: Vec::new(), coefficients: blend }]
    });
    std::iter::once(first).chain(middle).chain([last]).collect()
}

/// The classifier of the stages, which knows how far the performer's own looks are from them.
fn finish(stages: Vec<Stage>, looks: &[Look]) -> Option<Lesson> {
    let coefficients: Vec<Grid> = stages.iter().map(|stage| stage.coefficients).collect();
    let templates: Vec<Template> = coefficients.iter().map(Template::new).collect();
    let nearest = |look: &Look| {
        templates.iter().map(|template| template.score(&look.coefficients)).fold(f32::INFINITY, f32::min)
    };
    let reach = REACH * quantile(looks.iter().map(nearest).collect(), OWN_SHARE);
    Some(Lesson { classifier: Classifier::new(&coefficients, reach)?, stages })
}

/// Up to eight of some looks that are nearest to a centre, and no more than half of them.
fn closest(looks: &[Look], of: &[usize], centre: &Grid) -> Vec<usize> {
    let far = |at: usize| {
        let off: Grid = std::array::from_fn(|c| looks[at].coefficients[c] - centre[c]);
        dot(&off, &off)
    };
    let mut order = of.to_vec();
    order.sort_by(|&a, &b| far(a).total_cmp(&far(b)).then(a.cmp(&b)));
    order.truncate((of.len() / 2).clamp(AVERAGED, MOST_AVERAGED));
    order.sort_unstable();
    order
}

fn mean(looks: &[Look], of: &[usize]) -> Grid {
    let share = 1.0 / of.len().max(1) as f32;
    std::array::from_fn(|c| of.iter().map(|&at| looks[at].coefficients[c]).sum::<f32>() * share)
}

fn mean_cue(looks: &[Look], of: &[usize]) -> f32 {
    of.iter().map(|&at| looks[at].cue).sum::<f32>() / of.len().max(1) as f32
}

fn median(looks: &[Look], of: &[usize]) -> Grid {
    std::array::from_fn(|c| quantile(of.iter().map(|&at| looks[at].coefficients[c]).collect(), 0.5))
}

fn quantile(mut values: Vec<f32>, share: f32) -> f32 {
    values.sort_by(f32::total_cmp);
    let at = (values.len().saturating_sub(1) as f32 * share).round() as usize;
    values.get(at).copied().unwrap_or(0.0)
}

fn dot(a: &Grid, b: &Grid) -> f32 {
    (1..COUNT).map(|at| a[at] * b[at]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A look of which `state` of the wrinkle shows, beside what differs from frame to frame.
    fn look(frame: u64, cue: f32, state: f32, hand: bool) -> Look {
        let noise = |at: usize| 0.05 * ((frame as usize * 7919 + at * 104_729) as f32).sin();
        let mut coefficients: Grid = std::array::from_fn(|at| noise(at) + 2.0 / (1.0 + at as f32));
        for at in [2, 3, 18, 35] {
            coefficients[at] += 4.0 * state;
        }
        if hand {
            // Somewhere else in every frame.
            coefficients[[1, 16, 17, 2, 3, 18, 4, 5][frame as usize % 8]] += 40.0;
        }
        Look { take: 0, frame, cue, neutral: frame < 20, coefficients, relief: 0.02 + 0.05 * state }
    }

    /// Neutral, a rise and a fall; a hand passes while nothing contracts.
    fn take(cue: impl Fn(f32) -> f32, state: impl Fn(f32) -> f32) -> Vec<Look> {
        let strength = |frame: u64| (1.0 - (frame as f32 - 90.0).abs() / 50.0).clamp(0.0, 1.0);
        let frame = |at: u64| {
            let strength = strength(at);
            look(at, cue(strength), state(strength), (30..38).contains(&at))
        };
        (0..180).map(frame).collect()
    }

    #[test]
    fn neutral_extreme_and_between_are_found_and_the_hand_is_not() {
        let looks = take(|s| s, |s| s);
        let lesson = learn(Region::Forehead, &looks).unwrap();
        let layers = lesson.stages.len();
        assert!(layers >= 4, "{layers}");
        for (at, stage) in lesson.stages.iter().enumerate() {
            assert!(!stage.looks.is_empty());
            for &chosen in &stage.looks {
                let wanted = at as f32 / (layers - 1) as f32;
                assert!((looks[chosen].cue - wanted).abs() < 0.2, "{at}: {}", looks[chosen].cue);
                assert!(!(30..38).contains(&looks[chosen].frame));
            }
        }
        // Every look is within reach but the hand's.
        let nearest = |look: &Look| {
            lesson.classifier.templates().iter().map(|t| t.score(&look.coefficients)).fold(f32::MAX, f32::min)
        };
        let within = |look: &&Look| nearest(look) <= lesson.classifier.reach();
        assert!(looks.iter().filter(within).all(|look| !(30..38).contains(&look.frame)));
        assert!(looks.iter().filter(within).count() > 160);
    }

    #[test]
    fn what_was_not_performed_or_changes_nothing_is_said() {
        assert_eq!(learn(Region::Chin, &take(|s| s, |s| s)[..5]), Err(Unlearnt::Unseen(5)));
        assert!(matches!(
            learn(Region::Chin, &take(|s| 0.1 * s, |s| s)),
            Err(Unlearnt::NotPerformed(rise)) if rise < 0.11
        ));
        assert_eq!(learn(Region::Chin, &take(|s| s, |_| 0.0)), Err(Unlearnt::NoChange));
    }

    #[test]
    fn frames_that_a_person_names_are_layers_in_their_order() {
        let looks = take(|_| 0.0, |s| s);
        let lesson = learn_from(&[10, 65, 90], &looks).unwrap();
        assert_eq!(lesson.stages.len(), 3);
        assert!(lesson.stages[2].looks.contains(&90) && lesson.stages[2].looks.len() == 4);
        assert!(learn_from(&[10, 65], &looks).is_none());
    }
}
