//! What is known of each landmark beforehand: region, mirror image, how far expressions move it.

use std::{str::FromStr, sync::LazyLock};

use super::landmarks::LANDMARK_COUNT;

/// The part of the face a landmark lies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Region {
    /// Upper and lower lip.
    Lips,
    /// Upper and lower lids with the fold.
    Lids,
    /// Brows.
    Brows,
    /// Nose and bridge.
    Nose,
    /// Cheeks.
    Cheeks,
    /// Chin and jaw.
    Jaw,
    /// The outline of the face, which the network guesses at the silhouette.
    Oval,
    /// Forehead and temples.
    Other,
    /// Irises.
    Iris,
}

impl FromStr for Region {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        Ok(match text {
            "lips" => Self::Lips,
            "lids" => Self::Lids,
            "brows" => Self::Brows,
            "nose" => Self::Nose,
            "cheeks" => Self::Cheeks,
            "jaw" => Self::Jaw,
            "oval" => Self::Oval,
            "other" => Self::Other,
            "iris" => Self::Iris,
            _ => return Err(()),
        })
    }
}

/// One row of the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LandmarkFacts {
    /// Where it lies.
    pub region: Region,
    /// The landmark on the other side of the face; itself on the midline.
    pub mirror: usize,
    /// The farthest that any one expression moves it on an average face, millimetres.
    pub max_motion: f64,
    /// How much head pose may rely on it, 0..=1: 1 / (0.8² + max_motion²), a quarter of that on the oval, scaled.
    pub pose_weight: f64,
}

static TABLE: LazyLock<Vec<LandmarkFacts>> = LazyLock::new(|| {
    include_str!("landmark_table.csv")
        .lines()
        .skip(1)
        .filter_map(|line| {
            let mut cells = line.split(',').skip(1);
            Some(LandmarkFacts {
                region: cells.next()?.parse().ok()?,
                mirror: cells.next()?.parse().ok()?,
                max_motion: cells.next()?.parse().ok()?,
                pose_weight: cells.next()?.parse().ok()?,
            })
        })
        .collect()
});

/// 478 rows, by landmark index.
pub fn landmark_table() -> &'static [LandmarkFacts] {
    debug_assert_eq!(TABLE.len(), LANDMARK_COUNT);
    &TABLE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_landmark_has_a_row_and_mirrors_are_mutual() {
        let table = landmark_table();
        assert_eq!(table.len(), LANDMARK_COUNT);
        for (index, facts) in table.iter().enumerate() {
            assert_eq!(table[facts.mirror].mirror, index);
            assert!((0.0..=1.0).contains(&facts.pose_weight));
            assert!(facts.max_motion > 0.0);
        }
        assert_eq!(table[33].mirror, 263);
        assert_eq!(table[4].mirror, 4);
    }
}
