//! Motion of a tracked face as curves over time, and how well one curve follows another.

use std::fmt::Write as _;

use understudy::{export::MotionRecord, tracking::index};

type Point = [f64; 2];

/// Lower edge of the lower lip, in its middle.
const LOWER_LIP: usize = 17;

/// A named measure of one face, in outer canthal distances.
pub struct Measure {
    pub name: &'static str,
    of: fn(&Face) -> f64,
}

/// One frame's landmarks in the picture.
struct Face<'a>(&'a MotionRecord);

/// What the tests look at.
pub const MEASURES: [Measure; 10] = [
    Measure { name: "mouth gap", of: |f| f.distance(index::UPPER_LIP_INNER, index::LOWER_LIP_INNER) },
    Measure { name: "mouth width", of: |f| f.distance(index::MOUTH_RIGHT, index::MOUTH_LEFT) },
    Measure { name: "lower lip", of: |f| f.below_the_eyes(LOWER_LIP) },
    Measure { name: "chin", of: |f| f.below_the_eyes(index::CHIN) },
    Measure {
        name: "brows",
        of: |f| -f64::midpoint(f.below_the_eyes(index::RIGHT_BROW), f.below_the_eyes(index::LEFT_BROW)),
    },
    Measure { name: "right brow", of: |f| -f.below_the_eyes(index::RIGHT_BROW) },
    Measure { name: "left brow", of: |f| -f.below_the_eyes(index::LEFT_BROW) },
    Measure { name: "lids", of: |f| f64::midpoint(f.right_eye(), f.left_eye()) },
    Measure { name: "right lids", of: |f| f.right_eye() },
    Measure { name: "left lids", of: |f| f.left_eye() },
];

impl Face<'_> {
    fn at(&self, landmark: usize) -> Point {
        let [x, y, _] = self.0.landmarks[landmark];
        [x, y]
    }

    fn eyes(&self) -> f64 {
        length(sub(self.at(index::LEFT_EYE_OUTER), self.at(index::RIGHT_EYE_OUTER)))
    }

    fn distance(&self, a: usize, b: usize) -> f64 {
        length(sub(self.at(a), self.at(b))) / self.eyes()
    }

    fn right_eye(&self) -> f64 {
        self.distance(index::RIGHT_LID_UPPER, index::RIGHT_LID_LOWER)
    }

    fn left_eye(&self) -> f64 {
        self.distance(index::LEFT_LID_UPPER, index::LEFT_LID_LOWER)
    }

    /// How far a landmark lies below the line through the outer eye corners.
    fn below_the_eyes(&self, landmark: usize) -> f64 {
        let (right, left) = (self.at(index::RIGHT_EYE_OUTER), self.at(index::LEFT_EYE_OUTER));
        let (along, to) = (sub(left, right), sub(self.at(landmark), right));
        (along[0] * to[1] - along[1] * to[0]) / self.eyes().powi(2)
    }
}

fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn length(v: Point) -> f64 {
    v[0].hypot(v[1])
}

impl Measure {
    /// The measure in every frame; NaN where there are no landmarks.
    pub fn curve(&self, records: &[MotionRecord]) -> Vec<f64> {
        records.iter().map(|record| (self.of)(&Face(record))).collect()
    }
}

/// How one curve follows another.
#[derive(Debug, Clone, Copy)]
pub struct Following {
    /// Pearson's.
    pub correlation: f64,
    /// Slope of the regression of the follower on the leader.
    pub gain: f64,
}

/// Compares over the frames in which both curves have a value.
pub fn following(leader: &[f64], follower: &[f64]) -> Following {
    assert_eq!(leader.len(), follower.len(), "one value a frame each");
    let pairs: Vec<_> = leader.iter().zip(follower).filter(|(a, b)| a.is_finite() && b.is_finite()).collect();
    assert!(pairs.len() > 10, "only {} frames have both values", pairs.len());
    let count = pairs.len() as f64;
    let mean_a = pairs.iter().map(|(a, _)| **a).sum::<f64>() / count;
    let mean_b = pairs.iter().map(|(_, b)| **b).sum::<f64>() / count;
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (a, b) in pairs {
        let (a, b) = (a - mean_a, b - mean_b);
        aa += a * a;
        bb += b * b;
        ab += a * b;
    }
    Following { correlation: ab / (aa * bb).sqrt(), gain: ab / aa }
}

/// The table that tests print.
pub fn table(rows: &[(&str, Following)]) -> String {
    let mut text = "| measure | correlation | gain |\n|---|---:|---:|\n".to_owned();
    for (name, following) in rows {
        let _ = writeln!(text, "| {name} | {:.3} | {:.2} |", following.correlation, following.gain);
    }
    text
}
