//! Volume morphing (002 §IV): a few tracked points, thirteen phantom points that stay, and between them Hardy's
//! multiquadrics, or a Gaussian, through all of the space that the face takes up.
//!
//! Displacements are interpolated and not places, so that no motion gives exactly the neutral. As everywhere in this
//! program the system is solved for all frames at once: a frame is one product with a vertex × control matrix.

use nalgebra::{Point3, center};

use super::TargetFace;
use crate::{
    spline::{Kernel, Options, Polynomial, Regularisation},
    tracking::{IBUG_68, SKIN_LANDMARK_COUNT, index},
};

/// The points that 002 tracks, as the network's landmarks. The first nine tell only how the head lies and hardly move;
/// the other nine show the expression.
pub const TRACKED_18: [usize; 18] = [
    33, 133, 362, 263, // corners of the eyes
    168, 4, 2, 129, 358, // bridge, tip and base of the nose, nostrils' wings
    105, 107, 336, 334, // outer and inner brows
    61, 291, 13, 14,  // corners and middles of the lips
    152, // chin
];
/// Landmarks of the outline, evenly around it from the forehead to the subject's left, from which phantom points go out.
const PHANTOMS: [usize; 13] = [10, 332, 251, 454, 288, 379, 377, 148, 150, 58, 234, 21, 103];
/// How far the phantom points lie beyond the outline: times its distance from the face's middle.
const OUTWARDS: f64 = 1.3;
/// Up to this many outer canthal distances from the nearest landmark everything goes with the morph, from the second on
/// nothing does: beyond the phantom points no data say what a multiquadric may do.
const WITH: f64 = 0.3;
const WITHOUT: f64 = 0.9;

/// Which landmarks are centres of the morph.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum VolumePoints {
    /// 002's 18, [`TRACKED_18`].
    #[default]
    Tracked,
    /// The landmarks nearest to iBUG's 68.
    Ibug,
    /// All 468 of the skin.
    All,
}

impl VolumePoints {
    /// Whether a landmark is one of them.
    pub fn contains(self, landmark: usize) -> bool {
        match self {
            Self::Tracked => TRACKED_18.contains(&landmark),
            Self::Ibug => IBUG_68.contains(&landmark),
            Self::All => landmark < SKIN_LANDMARK_COUNT,
        }
    }
}

/// What a volume morph is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VolumeMorph {
    /// Its centres beside the phantom points.
    pub points: VolumePoints,
    /// [`Kernel::Hardy`] (002 eq. 2), or another.
    pub kernel: Kernel,
    /// λ of 002 eq. 5 in the unit box of the centres.
    pub lambda: f64,
    /// Factor on the stiffnesses of 002 eq. 3.
    pub stiffness: f64,
}

impl Default for VolumeMorph {
    /// As published: 18 points, Hardy, λ = 0.01, stiffnesses as eq. 3 has them.
    fn default() -> Self {
        Self { points: VolumePoints::default(), kernel: Kernel::Hardy, lambda: 0.01, stiffness: 1.0 }
    }
}

impl VolumeMorph {
    /// The spline's options. There is no polynomial part: phantom points are to hold the edge, and an affine part would
    /// carry what lies beyond it along.
    pub fn options(&self) -> Options {
        Options {
            regularisation: Regularisation::UnitBox(self.lambda),
            polynomial: Polynomial::None,
            stiffness: self.stiffness,
        }
    }
}

/// The phantom points of a face, around it: scan frame, millimetres. `place` says where a landmark lies.
pub(super) fn phantoms(place: impl Fn(usize) -> Option<Point3<f64>>) -> Vec<Point3<f64>> {
    let corners = place(index::RIGHT_EYE_OUTER).zip(place(index::LEFT_EYE_OUTER));
    let mouth = place(index::MOUTH_RIGHT).zip(place(index::MOUTH_LEFT));
    let Some((eyes, mouth)) = corners.zip(mouth) else { return Vec::new() };
    let middle = center(&center(&eyes.0, &eyes.1), &center(&mouth.0, &mouth.1));
    PHANTOMS.into_iter().filter_map(place).map(|outline| middle + (outline - middle) * OUTWARDS).collect()
}

/// How far each place goes with the morph, 1 on the face and 0 far from it.
pub(super) fn reach(target: &TargetFace, places: &[Point3<f64>]) -> Vec<f32> {
    let landmarks: Vec<_> = target.landmarks[..SKIN_LANDMARK_COUNT].iter().flatten().collect();
    let eyes = target.outer_canthal_distance().max(f64::MIN_POSITIVE);
    let share = |place: &Point3<f64>| {
        let far = landmarks.iter().map(|p| (place - **p).norm_squared()).fold(f64::INFINITY, f64::min).sqrt();
        let t = ((WITHOUT - far / eyes) / (WITHOUT - WITH)).clamp(0.0, 1.0);
        (t * t * (3.0 - 2.0 * t)) as f32
    };
    places.iter().map(share).collect()
}
