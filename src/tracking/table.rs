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

/// The face's outline in the network's picture, from the forehead to the subject's left and round. The chin's part of it
/// counts as [`Region::Jaw`] for its motion, but all of it is silhouette: another view has another outline.
const OUTLINE: [usize; 36] = [
    10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377, 152, 148, 176,
    149, 150, 136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67, 109,
];

/// Whether a landmark lies on the face's outline.
pub fn is_outline(landmark: usize) -> bool {
    OUTLINE.contains(&landmark)
}

/// Whether a landmark hardly moves in any expression, so that it tells how a face lies.
pub fn is_still(landmark: usize) -> bool {
    /// Millimetres.
    const LEAST: f64 = 4.0;
    landmark_table()[landmark].max_motion < LEAST
}

/// 478 rows, by landmark index.
pub fn landmark_table() -> &'static [LandmarkFacts] {
    debug_assert_eq!(TABLE.len(), LANDMARK_COUNT);
    &TABLE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outline_holds_the_oval_and_the_chin_and_mirrors_itself() {
        let table = landmark_table();
        for (index, facts) in table.iter().enumerate() {
            assert!(facts.region != Region::Oval || is_outline(index));
            assert_eq!(is_outline(index), is_outline(facts.mirror));
        }
    }

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
