//! The regions of the face whose look changes without its landmarks saying so.

use serde::{Deserialize, Serialize};

/// Number of regions.
pub const REGION_COUNT: usize = 11;

/// A texture region Tⁱ of 002 §III. Left and right are the subject's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Region {
    /// Horizontal lines of raised brows.
    Forehead,
    /// Vertical lines between lowered brows.
    Glabella,
    /// Lines beside the right eye.
    CrowsFeetRight,
    /// Lines beside the left eye.
    CrowsFeetLeft,
    /// The fold from the nose to the right corner of the mouth.
    NasolabialRight,
    /// The fold from the nose to the left corner of the mouth.
    NasolabialLeft,
    /// Lids of the right eye.
    EyeRight,
    /// Lids of the left eye.
    EyeLeft,
    /// Folds beside the right corner of the mouth.
    MouthCornerRight,
    /// Folds beside the left corner of the mouth.
    MouthCornerLeft,
    /// Dimples of a pushed-up chin.
    Chin,
}

/// What of a region changes, which decides how wide the face must be in the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Detail {
    /// Lids, which are large.
    Lids,
    /// Folds: shading a tenth of the face wide.
    Folds,
    /// Lines: a few hundredths of the face wide.
    Lines,
}

impl Detail {
    /// The narrowest face, in pixels from cheek to cheek, on which it is told apart; measured in `design/skin.md` for
    /// folds and lines.
    pub fn narrowest_face(self) -> f64 {
        match self {
            Self::Lids => 60.0,
            Self::Folds => 150.0,
            Self::Lines => 200.0,
        }
    }
}

impl Region {
    /// All regions, in the order of [`AppearanceStates`](super::AppearanceStates).
    pub const ALL: [Self; REGION_COUNT] = [
        Self::Forehead,
        Self::Glabella,
        Self::CrowsFeetRight,
        Self::CrowsFeetLeft,
        Self::NasolabialRight,
        Self::NasolabialLeft,
        Self::EyeRight,
        Self::EyeLeft,
        Self::MouthCornerRight,
        Self::MouthCornerLeft,
        Self::Chin,
    ];

    /// The region's place in [`Region::ALL`].
    pub fn index(self) -> usize {
        self as usize
    }

    /// As files and command lines call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Forehead => "forehead",
            Self::Glabella => "glabella",
            Self::CrowsFeetRight => "crows_feet_right",
            Self::CrowsFeetLeft => "crows_feet_left",
            Self::NasolabialRight => "nasolabial_right",
            Self::NasolabialLeft => "nasolabial_left",
            Self::EyeRight => "eye_right",
            Self::EyeLeft => "eye_left",
            Self::MouthCornerRight => "mouth_corner_right",
            Self::MouthCornerLeft => "mouth_corner_left",
            Self::Chin => "chin",
        }
    }

    /// The region of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|region| region.name() == name)
    }

    /// The name of its curve: `wrinkle_forehead`, `lid_left`.
    pub fn curve(self) -> String {
        match self {
            Self::EyeRight => "lid_right".to_owned(),
            Self::EyeLeft => "lid_left".to_owned(),
            region => format!("wrinkle_{}", region.name()),
        }
    }

    /// What of it changes.
    pub fn detail(self) -> Detail {
        match self {
            Self::EyeRight | Self::EyeLeft => Detail::Lids,
            Self::NasolabialRight
            | Self::NasolabialLeft
            | Self::MouthCornerRight
            | Self::MouthCornerLeft
            | Self::Chin => Detail::Folds,
            Self::Forehead | Self::Glabella | Self::CrowsFeetRight | Self::CrowsFeetLeft => Detail::Lines,
        }
    }

    /// Whether it is on the subject's left.
    pub fn is_left(self) -> bool {
        matches!(self, Self::CrowsFeetLeft | Self::NasolabialLeft | Self::EyeLeft | Self::MouthCornerLeft)
    }

    /// Whether it is an eye, whose lids the landmarks follow.
    pub fn is_eye(self) -> bool {
        self.detail() == Detail::Lids
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_places_lead_back() {
        for (place, region) in Region::ALL.into_iter().enumerate() {
            assert_eq!(region.index(), place);
            assert_eq!(Region::named(region.name()), Some(region));
        }
        assert_eq!(Region::named("nose"), None);
    }
}
