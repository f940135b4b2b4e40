//! Which muscles make a region change its look, and what to ask of a performer whose region has not changed.

use super::Region;

/// The muscles whose contraction wrinkles a region, by the names of the ARKit basis and then of the sixteen of 001. The strongest
/// counts. Eyes follow their lids instead.
pub fn muscles(region: Region) -> &'static [&'static str] {
    match region {
        Region::Forehead => {
            &["browInnerUp", "browOuterUpLeft", "browOuterUpRight", "frontalis_left", "frontalis_right"]
        }
        Region::Glabella => &["browDownLeft", "browDownRight", "corrugator_left", "corrugator_right"],
        Region::CrowsFeetRight => &[
            "cheekSquintRight",
            "eyeSquintRight",
            "mouthSmileRight",
            "orbicularis_oculi_right",
            "zygomatic_major_right",
        ],
        Region::CrowsFeetLeft => &[
            "cheekSquintLeft",
            "eyeSquintLeft",
            "mouthSmileLeft",
            "orbicularis_oculi_left",
            "zygomatic_major_left",
        ],
        Region::NasolabialRight => &[
            "mouthSmileRight",
            "noseSneerRight",
            "mouthUpperUpRight",
            "zygomatic_major_right",
            "levator_labii_superioris_right",
        ],
        Region::NasolabialLeft => &[
            "mouthSmileLeft",
            "noseSneerLeft",
            "mouthUpperUpLeft",
            "zygomatic_major_left",
            "levator_labii_superioris_left",
        ],
        Region::MouthCornerRight => &[
            "mouthSmileRight",
            "mouthDimpleRight",
            "mouthStretchRight",
            "zygomatic_major_right",
            "risorius_right",
        ],
        Region::MouthCornerLeft => &[
            "mouthSmileLeft",
            "mouthDimpleLeft",
            "mouthStretchLeft",
            "zygomatic_major_left",
            "risorius_left",
        ],
        Region::Chin => &["mouthShrugLower"],
        Region::EyeRight | Region::EyeLeft => &[],
    }
}

/// What makes the region change its look.
pub fn request(region: Region) -> &'static str {
    match region {
        Region::Forehead => "raise your brows as high as they go",
        Region::Glabella => "frown: draw your brows together and down",
        Region::CrowsFeetRight | Region::CrowsFeetLeft => "smile broadly and squint",
        Region::NasolabialRight | Region::NasolabialLeft => "smile broadly, and wrinkle your nose",
        Region::MouthCornerRight | Region::MouthCornerLeft => "draw the corners of your mouth back and out",
        Region::Chin => "push your lower lip up, so that the chin dimples",
        Region::EyeRight | Region::EyeLeft => "close your eyes slowly for a moment",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::muscle::{MuscleBasis, other_side};

    #[test]
    fn every_wrinkle_has_a_muscle_in_both_bases_and_sides_mirror() {
        for region in Region::ALL.into_iter().filter(|region| !region.is_eye()) {
            for basis in [MuscleBasis::arkit(), MuscleBasis::sixteen()] {
                let known = muscles(region).iter().filter(|name| basis.index(name).is_some()).count();
                // 001 has no muscle that pushes the chin up.
                let lacking = region == Region::Chin && basis.index("mouthShrugLower").is_none();
                assert!(known > 0 || lacking, "{} in {}", region.name(), basis.name);
            }
        }
        let mirrored = |name: &&str| other_side(name).unwrap();
        assert!(
            muscles(Region::NasolabialLeft)
                .iter()
                .map(mirrored)
                .eq(muscles(Region::NasolabialRight).iter().map(|name| (*name).to_owned()))
        );
    }
}
