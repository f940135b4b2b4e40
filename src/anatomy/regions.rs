//! Which of the network's landmarks bound the mouth and the eyes. Right and left are the subject's.

pub use crate::tracking::index::{LOWER_INNER, UPPER_INNER};

use crate::lift::Side;

/// Inner corners of the mouth, right and left.
pub const INNER_CORNERS: [usize; 2] = [78, 308];
/// Outer corners of the mouth, right and left.
pub const OUTER_CORNERS: [usize; 2] = [61, 291];

/// The upper lip but its inner rim: outer rim and the two rows between.
pub const UPPER_LIP: [usize; 27] = [
    185, 40, 39, 37, 0, 267, 269, 270, 409, 184, 74, 73, 72, 11, 302, 303, 304, 408, 183, 42, 41, 38, 12,
    268, 271, 272, 407,
];
/// The lower lip but its inner rim.
pub const LOWER_LIP: [usize; 27] = [
    146, 91, 181, 84, 17, 314, 405, 321, 375, 77, 90, 180, 85, 16, 315, 404, 320, 307, 96, 89, 179, 86, 15,
    316, 403, 319, 325,
];
/// Both corners, outer to inner.
pub const CORNERS: [usize; 8] = [61, 76, 62, 78, 291, 306, 292, 308];

/// The chin's skin, which lies on the jaw bone.
pub const CHIN: [usize; 12] = [152, 148, 377, 176, 400, 149, 378, 175, 199, 200, 171, 396];
/// Chin and front of the jaw: they move as the bone does.
pub const ON_JAW: [usize; 33] = [
    152, 148, 377, 176, 400, 149, 378, 150, 379, 199, 175, 200, 18, 83, 313, 182, 406, 201, 421, 194, 418,
    208, 428, 171, 396, 140, 369, 32, 262, 211, 431, 204, 424,
];
/// Cheeks and jaw line between what moves with the jaw and what does not.
pub const BETWEEN_JAW_AND_SKULL: [usize; 64] = [
    132, 58, 172, 136, 361, 288, 397, 365, 93, 323, 215, 435, 138, 367, 177, 401, 147, 376, 213, 433, 192,
    416, 214, 434, 207, 427, 187, 411, 212, 432, 202, 422, 57, 287, 186, 410, 43, 273, 106, 335, 210, 430,
    135, 364, 169, 394, 170, 395, 216, 436, 206, 426, 92, 322, 165, 391, 61, 291, 76, 306, 62, 292, 78, 308,
];

/// The landmarks of one eye.
#[derive(Debug, Clone, Copy)]
pub struct EyeLandmarks {
    /// Corner towards the temple.
    pub outer: usize,
    /// Corner towards the nose.
    pub inner: usize,
    /// Rim of the upper lid from the outer corner to the inner one, without them.
    pub upper: [usize; 7],
    /// Rim of the lower lid, each below its partner in `upper`.
    pub lower: [usize; 7],
    /// Centre of the iris.
    pub iris: usize,
    /// Four points on the iris's rim.
    pub iris_rim: [usize; 4],
    /// Lower edge of the brow, from the temple to the nose.
    pub brow: [usize; 5],
}

const RIGHT_EYE: EyeLandmarks = EyeLandmarks {
    outer: 33,
    inner: 133,
    upper: [246, 161, 160, 159, 158, 157, 173],
    lower: [7, 163, 144, 145, 153, 154, 155],
    iris: 468,
    iris_rim: [469, 470, 471, 472],
    brow: [46, 53, 52, 65, 55],
};
const LEFT_EYE: EyeLandmarks = EyeLandmarks {
    outer: 263,
    inner: 362,
    upper: [466, 388, 387, 386, 385, 384, 398],
    lower: [249, 390, 373, 374, 380, 381, 382],
    iris: 473,
    iris_rim: [474, 475, 476, 477],
    brow: [276, 283, 282, 295, 285],
};

/// The landmarks of the eye on one side.
pub const fn eye_landmarks(side: Side) -> &'static EyeLandmarks {
    match side {
        Side::Right => &RIGHT_EYE,
        Side::Left => &LEFT_EYE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracking::{Region, landmark_table};

    #[test]
    fn the_lists_lie_where_their_names_say_and_mirror_each_other() {
        let table = landmark_table();
        let is = |list: &[usize], region| list.iter().all(|&i| table[i].region == region);
        for list in [&UPPER_INNER[..], &LOWER_INNER, &UPPER_LIP, &LOWER_LIP, &CORNERS] {
            assert!(is(list, Region::Lips), "{list:?}");
            assert!(list.iter().all(|&i| list.contains(&table[i].mirror)), "{list:?}");
        }
        for list in [&ON_JAW[..], &CHIN, &BETWEEN_JAW_AND_SKULL] {
            assert!(list.iter().all(|&i| list.contains(&table[i].mirror)), "{list:?}");
        }
        let (right, left) = (eye_landmarks(Side::Right), eye_landmarks(Side::Left));
        let pairs = right.upper.iter().zip(&left.upper).chain(right.lower.iter().zip(&left.lower));
        assert!(pairs.chain(right.brow.iter().zip(&left.brow)).all(|(&r, &l)| table[r].mirror == l));
        assert!(
            is(&right.upper, Region::Lids)
                && is(&right.lower, Region::Lids)
                && is(&right.brow, Region::Brows)
        );
    }
}
