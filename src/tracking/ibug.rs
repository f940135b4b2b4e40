//! The 68 points of iBUG's annotation and the network's landmarks that lie nearest to them.

/// For each of the 68 points, in their order, the landmark of the network. The outline (0–16) is only alike: iBUG's
/// follows the jaw's edge as a picture shows it, the network's the face's.
pub const IBUG_68: [usize; 68] = [
    162, 234, 93, 58, 172, 136, 149, 148, 152, 377, 378, 365, 397, 288, 323, 454,
    389, // outline, right to left
    70, 63, 105, 66, 107, 336, 296, 334, 293, 300, // brows
    168, 197, 5, 4, 75, 97, 2, 326, 305, // nose
    33, 160, 158, 133, 153, 144, 362, 385, 387, 263, 373, 380, // eyes
    61, 39, 37, 0, 267, 269, 291, 405, 314, 17, 84, 181, // outer lips
    78, 82, 13, 312, 308, 317, 14, 87, // inner lips
];

/// The parts of the 68 points, for reports.
pub const IBUG_REGIONS: [(&str, std::ops::Range<usize>); 5] =
    [("outline", 0..17), ("brows", 17..27), ("nose", 27..36), ("eyes", 36..48), ("mouth", 48..68)];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracking::{Region, landmark_table};

    #[test]
    fn points_lie_on_the_parts_they_are_named_for() {
        let region = |i: usize| landmark_table()[IBUG_68[i]].region;
        assert!((36..48).all(|i| region(i) == Region::Lids));
        assert!((48..68).all(|i| region(i) == Region::Lips));
        assert_eq!(IBUG_REGIONS.iter().map(|(_, range)| range.len()).sum::<usize>(), 68);
    }
}
