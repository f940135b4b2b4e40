//! From a region's sample to its state (002 §V.ii): the best of templates × offsets, then between neighbours.

use serde::{Deserialize, Serialize};

use super::{
    FEWEST_LAYERS, MOST_LAYERS, OFFSETS,
    haar::{self, Grid},
    template::Template,
};

/// A look halfway between two templates is half of their gap away from both, and noise comes on top.
const BETWEEN: f32 = 0.75;

/// The templates of one region, neutral first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Classifier {
    templates: Vec<Template>,
    /// φ between each template and the next one.
    gaps: Vec<f32>,
    /// φ up to which a sample may be the performer's skin; farther ones are something else.
    reach: f32,
}

/// What a sample is most like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// γ, the best template.
    pub template: usize,
    /// Which of the five offset samples it was.
    pub offset: usize,
    /// φ of the two.
    pub score: f32,
    /// Q / (p − 1): 0 the neutral template, 1 the last.
    pub state: f32,
}

impl Classifier {
    /// `coefficients` of 3 to 6 looks, neutral first; `reach` is the score up to which samples are believed, at
    /// least three quarters of the widest gap between neighbours. `None` where two
    /// neighbours are the same look, or their number is another.
    pub fn new(coefficients: &[Grid], reach: f32) -> Option<Self> {
        let templates: Vec<Template> = coefficients.iter().map(Template::new).collect();
        let gap = |at: usize| {
            let (a, b) = (&templates[at], &templates[at + 1]);
            f32::midpoint(a.score(&coefficients[at + 1]), b.score(&coefficients[at]))
        };
        let gaps: Vec<f32> = (1..templates.len()).map(|at| gap(at - 1)).collect();
        let reach = gaps.iter().fold(reach, |reach, gap| reach.max(BETWEEN * gap));
        let made = Self { templates, gaps, reach };
        made.is_sound().then_some(made)
    }

    /// Whether it could have been made by [`Classifier::new`].
    pub(super) fn is_sound(&self) -> bool {
        let positive = |value: &f32| value.is_finite() && *value > 0.0;
        (FEWEST_LAYERS..=MOST_LAYERS).contains(&self.templates.len())
            && self.templates.iter().all(Template::is_sound)
            && self.gaps.len() + 1 == self.templates.len()
            && self.gaps.iter().all(positive)
            && positive(&self.reach)
    }

    /// Templates p.
    pub fn templates(&self) -> &[Template] {
        &self.templates
    }

    /// φ up to which a sample is believed to be the performer's skin.
    pub fn reach(&self) -> f32 {
        self.reach
    }

    /// The state of a region by its five offset samples.
    pub fn classify(&self, samples: &[Grid; OFFSETS]) -> Match {
        let mut best = (f32::INFINITY, 0, 0);
        let mut coefficients = *samples;
        for (offset, grid) in coefficients.iter_mut().enumerate() {
            haar::decompose(grid);
            for (at, template) in self.templates.iter().enumerate() {
                let score = template.score(grid);
                if score < best.0 {
                    best = (score, at, offset);
                }
            }
        }
        let (score, template, offset) = best;
        // "This winning sample is kept and the others are discarded."
        let place = self.between(template, score, &coefficients[offset]);
        Match { template, offset, score, state: place / (self.templates.len() - 1) as f32 }
    }

    /// Q in 0..=p−1. A look between two templates, t of the way, differs from both by t and 1 − t of their own difference;
    /// what noise adds to both scores falls out of their difference. The nearer neighbour decides the side.
    fn between(&self, template: usize, score: f32, sample: &Grid) -> f32 {
        let way = |neighbour: usize, gap: f32| {
            let other = self.templates[neighbour].score(sample);
            (0.5 - (other - score) / (2.0 * gap)).clamp(0.0, 0.5)
        };
        let up = (template + 1 < self.templates.len()).then(|| way(template + 1, self.gaps[template]));
        let down = template.checked_sub(1).map(|lower| way(lower, self.gaps[lower]));
        // Both are 0 on the template itself, and what leads away from it on one side leads towards it on the other.
        template as f32 + up.unwrap_or(0.0) - down.unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A look whose coefficients are all kept by all: a few coarse ones, in proportion to `value`.
    fn look(value: f32) -> Grid {
        let mut grid = [0.0; haar::COUNT];
        for (at, place) in [1, 2, 16, 17, 18, 33, 34, 5].into_iter().enumerate() {
            grid[place] = value * (1.0 + at as f32 / 7.0) + 3.0;
        }
        grid
    }

    fn samples(coefficients: &Grid) -> [Grid; OFFSETS] {
        let mut grid = *coefficients;
        haar::recompose(&mut grid);
        [grid; OFFSETS]
    }

    fn classifier() -> Classifier {
        Classifier::new(&[look(0.0), look(1.0), look(2.5), look(4.0)], 50.0).unwrap()
    }

    #[test]
    fn templates_are_themselves_and_blends_lie_between() {
        let classifier = classifier();
        for (value, state) in
            [(0.0, 0.0), (1.0, 1.0), (2.5, 2.0), (4.0, 3.0), (0.25, 0.25), (3.7, 2.8), (9.0, 3.0)]
        {
            let found = classifier.classify(&samples(&look(value))).state * 3.0;
            assert!((found - state).abs() < 0.02, "{value}: {found}, not {state}");
        }
    }

    #[test]
    fn the_best_offset_wins() {
        let classifier = classifier();
        let mut five = samples(&look(-60.0));
        five[3] = samples(&look(2.5))[0];
        let found = classifier.classify(&five);
        assert_eq!((found.offset, found.template), (3, 2));
        assert!(found.score < 1e-3);
    }

    #[test]
    fn too_few_or_equal_looks_are_refused() {
        assert!(Classifier::new(&[look(0.0), look(1.0)], 1.0).is_none());
        assert!(Classifier::new(&[look(0.0), look(0.0), look(1.0)], 1.0).is_none());
        assert!(Classifier::new(&[look(0.0), look(1.0), look(2.0)], f32::INFINITY).is_none());
    }

    proptest! {
        #[test]
        fn states_rise_without_jumps(at in 0.0..4.0_f32) {
            let classifier = classifier();
            let state = |value: f32| classifier.classify(&samples(&look(value))).state;
            let (here, there) = (state(at), state(at + 0.01));
            prop_assert!(there >= here - 1e-3 && there - here < 0.02, "{here} {there}");
        }

        #[test]
        fn any_sample_has_a_state(values in prop::collection::vec(-9.0..9.0_f32, haar::COUNT)) {
            let grid: Grid = values.try_into().unwrap();
            let found = classifier().classify(&[grid; OFFSETS]);
            prop_assert!((0.0..=1.0).contains(&found.state) && found.score >= 0.0);
        }
    }
}
