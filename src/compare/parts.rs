//! Which part of the face a vertex belongs to.

use nalgebra::Point3;

use crate::tracking::{Region, SKIN_LANDMARK_COUNT, landmark_table};

/// How far from the nearest landmark the face ends, millimetres: the widest gaps between the network's landmarks, in cheek
/// and forehead, are bridged, and skull, ears and neck are left out.
pub const REACH: f64 = 25.0;

/// A part of the face, in the order in which it is reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FacePart {
    /// Forehead and temples.
    Forehead,
    /// Brows.
    Brows,
    /// Upper and lower lids with the fold, and what lies between them.
    Lids,
    /// Nose and bridge.
    Nose,
    /// Cheeks.
    Cheeks,
    /// Upper and lower lip, and what lies behind them.
    Lips,
    /// Chin and jaw.
    Jaw,
    /// Where the face ends.
    Outline,
}

impl FacePart {
    /// All parts, in order.
    pub const ALL: [Self; 8] = [
        Self::Forehead,
        Self::Brows,
        Self::Lids,
        Self::Nose,
        Self::Cheeks,
        Self::Lips,
        Self::Jaw,
        Self::Outline,
    ];

    /// What reports call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Forehead => "forehead",
            Self::Brows => "brows",
            Self::Lids => "lids",
            Self::Nose => "nose",
            Self::Cheeks => "cheeks",
            Self::Lips => "lips",
            Self::Jaw => "jaw",
            Self::Outline => "outline",
        }
    }

    fn of(region: Region) -> Self {
        match region {
            Region::Other => Self::Forehead,
            Region::Brows => Self::Brows,
            Region::Lids | Region::Iris => Self::Lids,
            Region::Nose => Self::Nose,
            Region::Cheeks => Self::Cheeks,
            Region::Lips => Self::Lips,
            Region::Jaw => Self::Jaw,
            Region::Oval => Self::Outline,
        }
    }
}

/// For each of the V positions the part of the landmark nearest to it, `None` beyond [`REACH`].
///
/// Positions and the 478 landmarks (by the network's index; absent ones and irises do not count) are in one frame,
/// millimetres.
pub fn face_parts(positions: &[Point3<f64>], landmarks: &[Option<Point3<f64>>]) -> Vec<Option<FacePart>> {
    let known: Vec<(Point3<f64>, FacePart)> = landmarks
        .iter()
        .take(SKIN_LANDMARK_COUNT)
        .zip(landmark_table())
        .filter_map(|(place, facts)| Some(((*place)?, FacePart::of(facts.region))))
        .collect();
    let part = |p: &Point3<f64>| {
        let squared = |q: &Point3<f64>| (p - q).norm_squared();
        let nearest = known.iter().min_by(|(a, _), (b, _)| squared(a).total_cmp(&squared(b)));
        nearest.filter(|(place, _)| squared(place) <= REACH * REACH).map(|(_, part)| *part)
    };
    positions.iter().map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracking::{LANDMARK_COUNT, index};

    #[test]
    fn a_vertex_belongs_to_its_nearest_landmark_within_reach() {
        let mut landmarks = vec![None; LANDMARK_COUNT];
        landmarks[index::RIGHT_EYE_OUTER] = Some(Point3::new(-45.0, 0.0, 0.0));
        landmarks[index::CHIN] = Some(Point3::new(0.0, -100.0, 0.0));
        // An iris is no skin.
        landmarks[SKIN_LANDMARK_COUNT] = Some(Point3::new(30.0, 0.0, 0.0));
        let positions = [[-45.0, REACH, 0.0], [-45.0, REACH + 0.1, 0.0], [0.0, -90.0, 5.0], [30.0, 0.0, 0.0]]
            .map(Point3::from);
        let parts = face_parts(&positions, &landmarks);
        assert_eq!(parts, [Some(FacePart::Lids), None, Some(FacePart::Jaw), None]);
        assert_eq!(face_parts(&positions, &[]), [None; 4]);
    }
}
