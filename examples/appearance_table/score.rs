//! Labels made by hand, and scores against them.

use std::{collections::BTreeMap, error::Error, path::Path};

use understudy::appearance::Region;

/// What a person saw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Truth {
    /// The neutral look, an open eye.
    Rest,
    /// Between; no frame by which to judge.
    Between,
    /// The wrinkle, a closed eye.
    Shown,
    /// Hidden.
    Unseen,
}

pub type Labels = BTreeMap<(String, u64, Region), Truth>;

pub fn read(path: &Path) -> Result<Labels, Box<dyn Error>> {
    let mut labels = Labels::new();
    for line in std::fs::read_to_string(path)?.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let [clip, frame, region, state] = cells[..] else { continue };
        let truth = match state {
            "0" => Truth::Rest,
            "0.5" => Truth::Between,
            "1" => Truth::Shown,
            _ => Truth::Unseen,
        };
        let region = Region::named(region).ok_or(format!("{region} is no region"))?;
        labels.insert((clip.to_owned(), frame.parse()?, region), truth);
    }
    Ok(labels)
}

/// How often a decision was right.
#[derive(Debug, Clone, Copy, Default)]
pub struct Row {
    hits: usize,
    false_alarms: usize,
    misses: usize,
    rejections: usize,
}

impl Row {
    pub fn count(&mut self, told: bool, truth: bool) {
        *match (told, truth) {
            (true, true) => &mut self.hits,
            (true, false) => &mut self.false_alarms,
            (false, true) => &mut self.misses,
            (false, false) => &mut self.rejections,
        } += 1;
    }

    pub fn with(self, other: &Self) -> Self {
        Self {
            hits: self.hits + other.hits,
            false_alarms: self.false_alarms + other.false_alarms,
            misses: self.misses + other.misses,
            rejections: self.rejections + other.rejections,
        }
    }

    pub fn positives(&self) -> usize {
        self.hits + self.misses
    }

    pub fn told(&self) -> usize {
        self.hits + self.false_alarms
    }

    pub fn total(&self) -> usize {
        self.positives() + self.false_alarms + self.rejections
    }

    pub fn precision(&self) -> f64 {
        self.hits as f64 / self.told().max(1) as f64
    }

    pub fn recall(&self) -> f64 {
        self.hits as f64 / self.positives().max(1) as f64
    }

    pub fn f1(&self) -> f64 {
        2.0 * self.hits as f64 / (2 * self.hits + self.false_alarms + self.misses).max(1) as f64
    }
}
