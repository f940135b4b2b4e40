//! A sheet: whose smile, on whom, and how that person really smiles.

use std::{error::Error, path::Path};

use image::{DynamicImage, RgbImage, RgbaImage, codecs::jpeg::JpegEncoder, imageops};
use nalgebra::Point3;
use understudy::{
    appearance::{FRAME_SIZE, FaceFrame, FaceImage, RatioFilter, RatioImage},
    tracking::SKIN_LANDMARK_COUNT,
    view::contact_sheet,
};

use super::people::{Person, Photo, pixels};

/// Pixels across of each face.
const WIDTH: u32 = 224;
const QUALITY: u8 = 85;
/// As strong as the donor's: what is wanted is the look and not the least error.
const GAIN: f32 = 1.0;

/// Writes the sheet. `pairs` are `donor:receiver`.
pub fn write(
    path: &Path,
    pairs: &[String],
    people: &[Person],
    frame: &FaceFrame,
    filter: &RatioFilter,
) -> Result<(), Box<dyn Error>> {
    let mut pictures: Vec<(RgbaImage, &str)> = Vec::new();
    for pair in pairs {
        let (donor, receiver) =
            pair.split_once(':').ok_or_else(|| format!("{pair}: not `donor:receiver`"))?;
        let named = |name: &str| people.iter().find(|person| person.name == name);
        let (Some(donor), Some(receiver)) = (named(donor), named(receiver)) else {
            return Err(format!("{pair}: no such people among the photographs").into());
        };
        let ratio = filter.ratio(&donor.neutral.face, &donor.smiling.face);
        let own = |photo: &Photo| Ok::<_, Box<dyn Error>>(shown(&seen(photo, &shape(photo, frame)?)?));
        let smile = shape(&receiver.smiling, frame)?;
        let stretched = seen(&receiver.neutral, &smile)?;
        let folded = carried(&ratio, &smile, frame).applied(&stretched, GAIN);
        pictures.extend([
            (own(&donor.neutral)?, "donor, neutral"),
            (own(&donor.smiling)?, "donor, smiling"),
            (own(&receiver.neutral)?, "receiver, neutral"),
            (shown(&stretched), "geometry alone"),
            (shown(&folded), "and the donor's ratio"),
            (own(&receiver.smiling)?, "receiver, truly"),
        ]);
    }
    let cells: Vec<_> = pictures.iter().map(|(picture, words)| (picture, *words)).collect();
    let sheet = DynamicImage::from(contact_sheet(&cells, 6)).into_rgb8();
    let mut bytes = Vec::new();
    sheet.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, QUALITY))?;
    std::fs::write(path, bytes).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(())
}

/// A frame in which the face has its own shape, as the photograph sees it.
fn shape(photo: &Photo, frame: &FaceFrame) -> Result<FaceFrame, Box<dyn Error>> {
    let upright = photo.landmarks.points.iter().map(|p| Point3::new(p.x, -p.y, -p.z));
    let points: Vec<_> = upright.take(SKIN_LANDMARK_COUNT).collect();
    let triangles: Vec<_> = frame.triangles().iter().map(|corners| corners.map(u32::from)).collect();
    FaceFrame::new(&points, &triangles).ok_or_else(|| "a face without width".into())
}

fn seen(photo: &Photo, shape: &FaceFrame) -> Result<FaceImage, Box<dyn Error>> {
    FaceImage::of_image(&photo.image, &pixels(&photo.landmarks), shape)
        .ok_or_else(|| "a photograph without a face".into())
}

/// A ratio of the shared frame in another shape.
fn carried(ratio: &RatioImage, shape: &FaceFrame, frame: &FaceFrame) -> RatioImage {
    let places: Vec<_> = frame.points().iter().map(|point| point.coords).collect();
    RatioImage::from_fn(|place| {
        shape.anchor(place).map_or(0.0, |anchor| ratio.at_place(&anchor.in_plane(&places).into()))
    })
}

fn shown(face: &FaceImage) -> RgbaImage {
    let picture: RgbImage = face.picture();
    let height = WIDTH * FRAME_SIZE[1] as u32 / FRAME_SIZE[0] as u32;
    let small = imageops::resize(&picture, WIDTH, height, imageops::FilterType::Triangle);
    DynamicImage::from(small).into_rgba8()
}
