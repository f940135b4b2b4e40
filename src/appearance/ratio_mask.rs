//! Where a ratio image is taken: on skin, apart from eyes, lips, brows, nostrils and the outline.

use nalgebra::Point2;

use super::{
    FRAME_SIZE, FaceFrame,
    plane::{blur, places},
};

/// Rings of landmarks that are no skin, and by how many pixels each is widened. Right first, then left.
const HOLES: [(&[usize], f64); 6] = [
    (&[33, 246, 161, 160, 159, 158, 157, 173, 133, 155, 154, 153, 145, 144, 163, 7], 9.0),
    (&[263, 466, 388, 387, 386, 385, 384, 398, 362, 382, 381, 380, 374, 373, 390, 249], 9.0),
    (&[61, 185, 40, 39, 37, 0, 267, 269, 270, 409, 291, 375, 321, 405, 314, 17, 84, 181, 91, 146], 7.0),
    (&[70, 63, 105, 66, 107, 55, 65, 52, 53, 46], 6.0),
    (&[300, 293, 334, 296, 336, 285, 295, 282, 283, 276], 6.0),
    (&[64, 98, 97, 2, 326, 327, 294, 278, 344, 440, 275, 4, 45, 220, 115, 48], 5.0),
];
/// The outline of the face.
const OUTLINE: [usize; 36] = [
    10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377, 152, 148, 176,
    149, 150, 136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67, 109,
];
/// Inside the outline the mask rises from 0 at the first distance to 1 at the second: where the cheek turns away …
const FADE: [f64; 2] = [22.0, 62.0];
/// … and on the forehead, which faces the viewer as far as its lines go.
const FOREHEAD_FADE: [f64; 2] = [10.0, 30.0];
/// From the brows up, the one becomes the other.
const FOREHEAD: f64 = 30.0;
/// Middle of a brow.
const BROW: usize = 105;
/// Nearer to the outline than this a picture may show the background.
const RIM: f64 = 8.0;
/// Blur of the edge of a hole.
const FEATHER: f32 = 4.0;

/// The mask, 0 to 1 for each pixel of the frame, and the skin as far as the outline, 0 or 1.
pub(super) fn of(frame: &FaceFrame) -> (Vec<f32>, Vec<f32>) {
    let ring = |landmarks: &[usize]| -> Vec<Point2<f64>> {
        landmarks.iter().map(|&landmark| frame.points()[landmark]).collect()
    };
    let holes: Vec<_> = HOLES.iter().map(|(landmarks, wider)| (ring(landmarks), *wider)).collect();
    let outline = ring(&OUTLINE);
    let open: Vec<f32> = places()
        .map(|place| {
            let covered = holes.iter().any(|(ring, wider)| depth(&place, ring) > -wider);
            if covered { 0.0 } else { 1.0 }
        })
        .collect();
    let inside: Vec<f64> = places().map(|place| depth(&place, &outline)).collect();
    let brow = frame.points()[BROW].y;
    let fade = |pixel: usize| {
        let y = (pixel / FRAME_SIZE[0]) as f64;
        let share = ((brow - y) / FOREHEAD).clamp(0.0, 1.0);
        let [low, high] = [0, 1].map(|end| FADE[end] + (FOREHEAD_FADE[end] - FADE[end]) * share);
        ((inside[pixel] - low) / (high - low)).clamp(0.0, 1.0) as f32
    };
    // Feathered away from the hole alone: nothing of it comes back.
    let feathered = blur(open.clone(), FEATHER);
    let soft = |pixel: usize| open[pixel] * (2.0 * feathered[pixel] - 1.0).clamp(0.0, 1.0);
    let mask = (0..open.len()).map(|pixel| soft(pixel) * fade(pixel)).collect();
    let skin = (0..open.len()).map(|pixel| if inside[pixel] > RIM { open[pixel] } else { 0.0 }).collect();
    (mask, skin)
}

/// Distance from a ring's edge, positive inside.
fn depth(place: &Point2<f64>, ring: &[Point2<f64>]) -> f64 {
    let (mut nearest, mut inside) = (f64::INFINITY, false);
    for (at, a) in ring.iter().enumerate() {
        let b = &ring[(at + 1) % ring.len()];
        let along = b - a;
        let share = ((place - a).dot(&along) / along.norm_squared().max(1e-12)).clamp(0.0, 1.0);
        nearest = nearest.min((place - (a + along * share)).norm());
        if (a.y > place.y) != (b.y > place.y) && place.x < a.x + along.x * (place.y - a.y) / along.y {
            inside = !inside;
        }
    }
    if inside { nearest } else { -nearest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::appearance::face_frame::sheet_frame;

    #[test]
    fn depth_is_signed_distance() {
        let square = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]].map(Point2::from);
        assert!((depth(&Point2::new(3.0, 5.0), &square) - 3.0).abs() < 1e-12);
        assert!((depth(&Point2::new(13.0, 14.0), &square) + 5.0).abs() < 1e-12);
        assert!(depth(&Point2::new(10.0, 5.0), &square).abs() < 1e-12);
        assert!(depth(&Point2::origin(), &[]) < -1e9);
    }

    #[test]
    fn masks_stay_in_range() {
        let (mask, skin) = of(&sheet_frame());
        assert!(mask.iter().all(|value| (0.0..=1.0).contains(value)));
        assert!(mask.iter().zip(&skin).all(|(&mask, &skin)| mask <= skin));
    }
}
