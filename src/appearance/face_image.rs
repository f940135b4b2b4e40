//! A face's colours, laid into the shared frame.

use image::{Rgb, RgbImage};
use nalgebra::{Matrix2, Vector2};

use super::{FRAME_SIZE, FaceFrame, srgb};
use crate::{capture::Image, tracking::SKIN_LANDMARK_COUNT};

/// Most samples of the picture for a pixel of the frame, in each direction: enough for a face 2,700 pixels wide.
const MOST_SAMPLES: usize = 6;
/// Added to a value before its logarithm is taken, so that black stays finite; linear light, 1 is white.
pub const DARKEST: f32 = 0.01;

/// What a face looks like in the shared frame: linear red, green and blue at every pixel that is known.
///
/// Lengths are pixels of the frame, rows of [`FRAME_SIZE`] one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceImage {
    colours: Vec<[f32; 3]>,
    valid: Vec<bool>,
}

impl FaceImage {
    /// Warps a picture into the frame triangle by triangle (002 §V.i). `landmarks` are its pixels, x right, y down,
    /// centres at integers, 468 or more. `None` if there are fewer or the picture is empty.
    pub fn of_image(image: &Image, landmarks: &[Vector2<f64>], frame: &FaceFrame) -> Option<Self> {
        let (width, bytes) = (image.width() as usize, image.bytes().ok()?);
        let pixel = |x: usize, y: usize| {
            let at = (y * width + x) * 3;
            [bytes[at + 2], bytes[at + 1], bytes[at]]
        };
        Self::warp([width, image.height() as usize], pixel, landmarks, frame)
    }

    /// The same of a picture in red, green and blue.
    pub fn of_rgb(image: &RgbImage, landmarks: &[Vector2<f64>], frame: &FaceFrame) -> Option<Self> {
        let size = [image.width() as usize, image.height() as usize];
        Self::warp(size, |x, y| image.get_pixel(x as u32, y as u32).0, landmarks, frame)
    }

    /// The same of anything that has pixels, sRGB. A pixel of the frame is unknown beside the face, beyond the picture,
    /// and where a triangle is seen from behind or has a corner that is no number. A face that is wider in the picture than
    /// in the frame is averaged over the pixels that a pixel of the frame covers.
    pub fn warp(
        size: [usize; 2],
        pixel: impl Fn(usize, usize) -> [u8; 3],
        landmarks: &[Vector2<f64>],
        frame: &FaceFrame,
    ) -> Option<Self> {
        if landmarks.len() < SKIN_LANDMARK_COUNT || size.contains(&0) {
            return None;
        }
        let table = srgb::table();
        let linear = |x: usize, y: usize| pixel(x, y).map(|value| table[usize::from(value)]);
        let last = [(size[0] - 1) as f64, (size[1] - 1) as f64];
        let sample = |place: Vector2<f64>| {
            let (x, y) = (place.x.clamp(0.0, last[0]), place.y.clamp(0.0, last[1]));
            let (left, top) = (x as usize, y as usize);
            let (right, bottom) = ((left + 1).min(size[0] - 1), (top + 1).min(size[1] - 1));
            let (u, v) = ((x - left as f64) as f32, (y - top as f64) as f32);
            let row = |y: usize| mix(linear(left, y), linear(right, y), u);
            mix(row(top), row(bottom), v)
        };
        let mut face = Self::unknown();
        for (at, anchor) in frame.anchors().iter().enumerate() {
            let Some(anchor) = anchor else { continue };
            let Some(stretch) = stretch(anchor.corners, landmarks, frame) else { continue };
            let centre = anchor.in_plane(landmarks);
            if !(0..2).all(|axis| (-0.5..=last[axis] + 0.5).contains(&centre[axis])) {
                continue;
            }
            let widest = stretch.column(0).norm().max(stretch.column(1).norm());
            let samples = (widest.ceil() as usize).clamp(1, MOST_SAMPLES);
            let offset = |step: usize| (step as f64 + 0.5) / samples as f64 - 0.5;
            let share = 1.0 / (samples * samples) as f32;
            let mut colour = [0.0; 3];
            for step in 0..samples * samples {
                let within = Vector2::new(offset(step % samples), offset(step / samples));
                let seen = sample(centre + stretch * within);
                (0..3).for_each(|channel| colour[channel] += seen[channel] * share);
            }
            face.set(at, colour);
        }
        Some(face)
    }

    /// Nothing known anywhere.
    pub fn unknown() -> Self {
        let pixels = FRAME_SIZE[0] * FRAME_SIZE[1];
        Self { colours: vec![[0.0; 3]; pixels], valid: vec![false; pixels] }
    }

    /// The mean of several pictures of one face in one state, of the logarithm of each channel, so that a lamp that
    /// flickers weighs no more than its share; at a pixel, of those that know it. `None` of nothing.
    pub fn mean(faces: &[&Self]) -> Option<Self> {
        if faces.is_empty() {
            return None;
        }
        let mut mean = Self::unknown();
        for at in 0..mean.valid.len() {
            let (mut sum, mut count) = ([0.0_f32; 3], 0.0_f32);
            for colour in faces.iter().filter_map(|face| face.colour(at)) {
                (0..3).for_each(|channel| sum[channel] += (colour[channel].max(0.0) + DARKEST).ln());
                count += 1.0;
            }
            if count > 0.0 {
                mean.set(at, sum.map(|logarithm| (logarithm / count).exp() - DARKEST));
            }
        }
        Some(mean)
    }

    /// Linear red, green and blue at a pixel, 1 is white.
    pub fn colour(&self, pixel: usize) -> Option<[f32; 3]> {
        self.valid[pixel].then(|| self.colours[pixel])
    }

    /// Linear luminance at a pixel (Rec. 709), 1 is white.
    pub fn luminance(&self, pixel: usize) -> Option<f32> {
        self.colour(pixel).map(srgb::luminance)
    }

    /// The colour at a pixel as pictures store it; black where it is unknown.
    pub fn srgb(&self, pixel: usize) -> [u8; 3] {
        self.colour(pixel).map_or([0; 3], |colour| colour.map(srgb::from_linear))
    }

    /// Makes a colour known; one that is no number makes the pixel unknown.
    pub fn set(&mut self, pixel: usize, colour: [f32; 3]) {
        self.valid[pixel] = colour.iter().all(|value| value.is_finite());
        self.colours[pixel] = if self.valid[pixel] { colour } else { [0.0; 3] };
    }

    /// Number of pixels, known or not.
    pub fn pixels(&self) -> usize {
        self.valid.len()
    }

    /// The frame as a picture, black where nothing is known.
    pub fn picture(&self) -> RgbImage {
        let width = FRAME_SIZE[0] as u32;
        RgbImage::from_fn(width, FRAME_SIZE[1] as u32, |x, y| Rgb(self.srgb((y * width + x) as usize)))
    }
}

/// How far a step of a pixel in the frame goes in the picture within a triangle; `None` if the triangle is seen from behind,
/// from its edge, or has no place.
fn stretch(corners: [u16; 3], landmarks: &[Vector2<f64>], frame: &FaceFrame) -> Option<Matrix2<f64>> {
    let [a, b, c] = corners.map(|corner| frame.points()[corner as usize].coords);
    let [p, q, r] = corners.map(|corner| landmarks[corner as usize]);
    let here = Matrix2::from_columns(&[b - a, c - a]).try_inverse()?;
    let stretch = Matrix2::from_columns(&[q - p, r - p]) * here;
    (stretch.determinant() > 1e-6).then_some(stretch)
}

fn mix(a: [f32; 3], b: [f32; 3], share: f32) -> [f32; 3] {
    std::array::from_fn(|channel| a[channel] + (b[channel] - a[channel]) * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::appearance::face_frame::sheet_frame;

    /// The landmarks of the frame itself, enlarged and moved.
    fn enlarged(frame: &FaceFrame, scale: f64, by: f64) -> Vec<Vector2<f64>> {
        frame.points().iter().map(|p| p.coords * scale + Vector2::repeat(by)).collect()
    }

    fn ramp() -> RgbImage {
        RgbImage::from_fn(600, 700, |x, y| Rgb([(x / 4) as u8, (y / 4) as u8, 77]))
    }

    #[test]
    fn a_pixel_has_the_colour_of_its_place() {
        let frame = sheet_frame();
        let face = FaceImage::of_rgb(&ramp(), &enlarged(&frame, 1.0, 8.0), &frame).unwrap();
        let at = 288 * FRAME_SIZE[0] + 300;
        assert_eq!(face.srgb(at), [77, 74, 77]);
        assert_eq!(face.picture().get_pixel(300, 288).0, [77, 74, 77]);
        assert!(face.colour(0).is_none());
    }

    #[test]
    fn fine_stripes_of_a_large_face_average_out() {
        let frame = sheet_frame();
        let stripes = RgbImage::from_fn(2100, 2400, |x, _| Rgb([if x % 2 == 0 { 0 } else { 255 }; 3]));
        let face = FaceImage::of_rgb(&stripes, &enlarged(&frame, 4.0, 0.0), &frame).unwrap();
        let seen: Vec<f32> = (0..face.pixels()).filter_map(|pixel| face.luminance(pixel)).collect();
        assert!(seen.iter().all(|value| (value - 0.5).abs() < 0.05));
    }

    #[test]
    fn what_cannot_be_seen_is_unknown() {
        let frame = sheet_frame();
        let known =
            |face: &FaceImage| (0..face.pixels()).filter(|&pixel| face.colour(pixel).is_some()).count();
        let whole = known(&FaceImage::of_rgb(&ramp(), &enlarged(&frame, 1.0, 8.0), &frame).unwrap());
        let beyond = FaceImage::of_rgb(&ramp(), &enlarged(&frame, 1.0, 300.0), &frame).unwrap();
        assert!(known(&beyond) > whole / 8 && known(&beyond) < whole);
        let turned: Vec<_> = frame.points().iter().map(|p| Vector2::new(590.0 - p.x, p.y)).collect();
        assert_eq!(known(&FaceImage::of_rgb(&ramp(), &turned, &frame).unwrap()), 0);
        let mut broken = enlarged(&frame, 1.0, 8.0);
        broken[200].x = f64::NAN;
        let broken = known(&FaceImage::of_rgb(&ramp(), &broken, &frame).unwrap());
        assert!(broken < whole && broken > whole * 9 / 10, "{broken} of {whole}");
        assert!(FaceImage::of_rgb(&ramp(), &[Vector2::zeros(); 467], &frame).is_none());
        assert!(FaceImage::of_rgb(&RgbImage::new(0, 0), &enlarged(&frame, 1.0, 0.0), &frame).is_none());
    }

    #[test]
    fn means_are_of_logarithms() {
        let (mut a, mut b) = (FaceImage::unknown(), FaceImage::unknown());
        a.set(5, [0.19, 0.2, 0.0]);
        b.set(5, [0.79, 0.2, 0.0]);
        b.set(6, [0.5; 3]);
        let mean = FaceImage::mean(&[&a, &b]).unwrap();
        assert!((mean.colour(5).unwrap()[0] - 0.39).abs() < 1e-6);
        assert!((mean.colour(5).unwrap()[1] - 0.2).abs() < 1e-6);
        assert!((mean.luminance(6).unwrap() - 0.5).abs() < 1e-6);
        assert!(mean.colour(7).is_none() && FaceImage::mean(&[]).is_none());
    }
}
