//! The 478 landmarks of a scan: the clip's own networks look at pictures of it, and what they find is cast back.
//!
//! A frontal picture finds the face and its size; pictures from both sides then see the cheeks and the nose less
//! steeply. Each landmark is the mean of what all pictures say, weighted by how squarely each sees it.

use std::path::Path;

use nalgebra::{Point3, Rotation3, Vector3};

use super::{
    PipelineError,
    photographer::{Photographer, Portrait, SIZE},
};
use crate::{
    scan::{Mesh, Surface, SurfacePoint},
    tracking::{LANDMARK_COUNT, Region, Tracker, index, is_outline, landmark_table},
    view::Lighting,
};

/// Degrees of yaw of the pictures after the frontal one.
const YAWS: [f64; 4] = [20.0, -20.0, 40.0, -40.0];
/// Radius of the framed ball over the outer canthal distance.
pub(super) const FRAMING: f64 = 1.55;
/// A point seen more steeply than this cosine says nothing.
const GRAZING: f64 = 0.15;
/// Two pictures that disagree by more than this many outer canthal distances do not show the same point.
const DISAGREEMENT: f64 = 0.12;
/// A head turned in the picture plane by more than this is another orientation, radians.
const UPRIGHT: f64 = 0.7;
/// Steps by which a point of the outline is drawn towards the face until it lies on skin.
const OUTLINE_STEPS: usize = 10;
/// Each of them over the way to the tip of the nose.
const OUTLINE_STEP: f64 = 0.01;
/// Steps further in at which the outline is compared with the face's inside.
const LOOK_INWARDS: usize = 5;
/// A point farther behind that inside than this many outer canthal distances lies on what is behind the face.
const JUMP: f64 = 0.3;

/// A face found on a scan.
#[derive(Debug, Clone)]
pub struct ScanFace {
    /// 478 points on the surface, in the mesh's own frame and unit; `None` where no picture shows one.
    pub landmarks: Vec<Option<SurfacePoint>>,
    /// 478 values 0..=1: how squarely the pictures saw each landmark.
    pub confidences: Vec<f64>,
    /// From the mesh's own axes to upright ones that look at the camera: one of the 24 axis-aligned rotations.
    pub facing: Rotation3<f64>,
    /// The light in which the networks know the scan as a face.
    pub lighting: Lighting,
}

impl ScanFace {
    /// Looks for a face on a mesh in its own frame and unit. `path` is for messages.
    pub fn find(
        path: &Path,
        mesh: &Mesh,
        surface: &Surface,
        photographer: &mut Photographer,
        tracker: &mut Tracker,
    ) -> Result<Self, PipelineError> {
        let (centre, radius) = mesh.bounding_ball();
        let mut first = None;
        let attempts =
            orientations().into_iter().flat_map(|facing| lightings(mesh).iter().map(move |l| (facing, *l)));
        for (facing, lighting) in attempts {
            let camera = Photographer::camera(centre, radius, &facing, SIZE);
            if let Some(portrait) = photographer.portrait(camera, lighting, tracker)?
                && roll(&portrait).abs() < UPRIGHT
                && let Some(measure) = Measure::of(&portrait, surface)
            {
                first = Some((facing, lighting, measure));
                break;
            }
        }
        let (facing, lighting, measure) =
            first.ok_or_else(|| PipelineError::NoFaceOnScan { scan: path.into() })?;

        let camera = Photographer::camera(measure.centre, FRAMING * measure.eyes, &facing, SIZE);
        let mut portraits = Vec::new();
        for yaw in std::iter::once(0.0).chain(YAWS) {
            let side = camera.orbit(f64::to_radians(yaw), 0.0);
            let portrait = photographer.portrait(side, lighting, tracker)?;
            tracing::info!(
                "from {yaw}° in {lighting:?} light a face is {}",
                if portrait.is_some() { "seen" } else { "not seen" }
            );
            portraits.extend(portrait);
        }
        if portraits.is_empty() {
            return Err(PipelineError::NoFaceOnScan { scan: path.into() });
        }
        let (landmarks, confidences) = combine(&portraits, surface, measure.eyes).into_iter().unzip();
        Ok(Self { landmarks, confidences, facing, lighting })
    }

    /// Positions of the landmarks.
    pub fn positions(&self) -> Vec<Option<Point3<f64>>> {
        self.landmarks.iter().map(|point| point.as_ref().map(|p| p.position)).collect()
    }
}

/// How a scan may be lit for the networks. One with colours has the light of its recording, but its colours may be
/// labels and no skin; a bare one needs light to show its shape.
pub(super) fn lightings(mesh: &Mesh) -> &'static [Lighting] {
    let coloured = !mesh.colours.is_empty() || mesh.materials.iter().any(|m| m.texture.is_some());
    if coloured { &[Lighting::Unlit, Lighting::Clay] } else { &[Lighting::Clay] }
}

/// Where the face is and how large.
struct Measure {
    centre: Point3<f64>,
    eyes: f64,
}

impl Measure {
    fn of(portrait: &Portrait, surface: &Surface) -> Option<Self> {
        let at = |landmark: usize| Some(portrait.cast(portrait.landmarks.pixel(landmark), surface)?.position);
        let (right, left) = (at(index::RIGHT_EYE_OUTER)?, at(index::LEFT_EYE_OUTER)?);
        let mouth = nalgebra::center(&at(index::MOUTH_RIGHT)?, &at(index::MOUTH_LEFT)?);
        let eyes = (right - left).norm();
        let centre = nalgebra::center(&nalgebra::center(&right, &left), &mouth);
        (eyes > 0.0).then_some(Self { centre, eyes })
    }
}

/// For each landmark the weighted mean over the portraits, put back onto the surface.
fn combine(portraits: &[Portrait], surface: &Surface, eyes: f64) -> Vec<(Option<SurfacePoint>, f64)> {
    (0..LANDMARK_COUNT)
        .map(|landmark| {
            let region = landmark_table()[landmark].region;
            let outline = is_outline(landmark);
            // Each picture has its own silhouette, and its own idea of where a rim lies that rolls out of sight: the
            // outline, the lids and the lips are taken from the frontal one.
            let views = if outline || matches!(region, Region::Lids | Region::Lips) {
                &portraits[..1]
            } else {
                portraits
            };
            let sightings: Vec<_> =
                views.iter().filter_map(|view| sight(view, landmark, outline, surface, eyes)).collect();
            // What hides a landmark from one picture may face that picture squarely: the word of several counts more.
            let agree =
                |a: &SurfacePoint, b: &SurfacePoint| (a.position - b.position).norm() <= DISAGREEMENT * eyes;
            let support = |own: &SurfacePoint| -> f64 {
                sightings.iter().filter(|s| agree(own, &s.0)).map(|s| s.1.powi(2)).sum()
            };
            let supported = sightings.iter().map(|s| (s.0, support(&s.0), s.1));
            let best_supported = supported.max_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2)));
            let Some(reference) = best_supported.map(|s| s.0) else {
                return (None, 0.0);
            };
            let (mut sum, mut total, mut best) = (Vector3::zeros(), 0.0, 0.0_f64);
            for (point, facing) in &sightings {
                if agree(point, &reference) {
                    sum += point.position.coords * facing.powi(2);
                    total += facing.powi(2);
                    best = best.max(*facing);
                }
            }
            (surface.nearest(Point3::from(sum / total)), best)
        })
        .collect()
}

/// One picture's word on one landmark, and how squarely it sees it.
///
/// The network's outline may fall beside the face, on skin that is seen edge-on, or past the jaw onto the neck: it is
/// drawn towards the nose until it lies on the face.
fn sight(
    portrait: &Portrait,
    landmark: usize,
    outline: bool,
    surface: &Surface,
    eyes: f64,
) -> Option<(SurfacePoint, f64)> {
    let pixel = portrait.landmarks.pixel(landmark);
    let middle = portrait.landmarks.pixel(index::NOSE_TIP);
    let at = |step: usize| portrait.cast(pixel + (middle - pixel) * (OUTLINE_STEP * step as f64), surface);
    let away = |point: &SurfacePoint| (portrait.camera.eye - point.position).norm();
    let steps = if outline { OUTLINE_STEPS } else { 1 };
    (0..steps).find_map(|step| {
        let point = at(step)?;
        let facing = portrait.facing(&point);
        let behind =
            outline && at(step + LOOK_INWARDS).is_some_and(|inner| away(&point) - away(&inner) > JUMP * eyes);
        (facing > GRAZING && !behind).then_some((point, facing))
    })
}

/// Radians by which the eyes are off level in the picture.
fn roll(portrait: &Portrait) -> f64 {
    let eyes =
        portrait.landmarks.pixel(index::LEFT_EYE_OUTER) - portrait.landmarks.pixel(index::RIGHT_EYE_OUTER);
    eyes.y.atan2(eyes.x)
}

/// All 24 ways to set the mesh's axes upright, the file's own first.
fn orientations() -> Vec<Rotation3<f64>> {
    let quarter = std::f64::consts::FRAC_PI_2;
    let turns = [
        Rotation3::identity(),
        Rotation3::from_axis_angle(&Vector3::x_axis(), -quarter), // z up, looks along -y
        Rotation3::from_axis_angle(&Vector3::y_axis(), quarter),
        Rotation3::from_axis_angle(&Vector3::y_axis(), -quarter),
        Rotation3::from_axis_angle(&Vector3::y_axis(), 2.0 * quarter),
        Rotation3::from_axis_angle(&Vector3::x_axis(), quarter),
    ];
    let rolls = [0.0, 2.0, 1.0, 3.0].map(|k| Rotation3::from_axis_angle(&Vector3::z_axis(), k * quarter));
    rolls.iter().flat_map(|roll| turns.iter().map(move |turn| roll * turn)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_orientations_are_24_different_rotations_and_the_files_own_comes_first() {
        let all = orientations();
        assert_eq!(all.len(), 24);
        assert!(all[0].angle() < 1e-12);
        for (i, a) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|b| a.angle_to(b) > 1.0));
        }
    }
}
