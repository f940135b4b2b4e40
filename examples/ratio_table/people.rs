//! Photographs of people, neutral and smiling, in the shared frame.

use std::{error::Error, path::Path};

use nalgebra::Vector2;
use understudy::{
    appearance::{FaceFrame, FaceImage},
    capture::{Frame, FrameRate, FrameSource, Image, PictureSequence},
    pipeline::Networks,
    tracking::{Landmarks, index},
};

/// A photograph with the face in it.
pub struct Photo {
    pub image: Image,
    pub landmarks: Landmarks,
    pub face: FaceImage,
}

impl Photo {
    fn read(path: &Path, networks: &mut Networks, frame: &FaceFrame) -> Result<Self, Box<dyn Error>> {
        let mut seen = Frame::default();
        PictureSequence::open(path, FrameRate::nearest(25.0))?.read(&mut seen)?;
        networks.tracker.reset();
        let none = || format!("{}: no face is found", path.display());
        let landmarks = networks.tracker.track(&seen.image)?.ok_or_else(none)?;
        let face = FaceImage::of_image(&seen.image, &pixels(&landmarks), frame).ok_or_else(none)?;
        Ok(Self { image: seen.image, landmarks, face })
    }
}

/// A person in two photographs.
pub struct Person {
    pub name: String,
    pub neutral: Photo,
    pub smiling: Photo,
}

impl Person {
    /// How strongly the person smiles: how far the mouth's corners go apart and up, over the distance of the eyes.
    pub fn smile(&self) -> f64 {
        let at = |photo: &Photo| {
            let face = &photo.landmarks;
            let corners = [index::MOUTH_RIGHT, index::MOUTH_LEFT].map(|corner| face.pixel(corner));
            let apart = (corners[0] - corners[1]).norm();
            let up = face.pixel(index::NOSE_BRIDGE).y - f64::midpoint(corners[0].y, corners[1].y);
            Vector2::new(apart, up) / face.outer_canthal_distance()
        };
        (at(&self.smiling) - at(&self.neutral)).norm()
    }
}

/// Everyone of whom the folder has both photographs, by name.
pub fn read(
    folder: &Path,
    networks: &mut Networks,
    frame: &FaceFrame,
) -> Result<Vec<Person>, Box<dyn Error>> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))? {
        let file = entry?.file_name().to_string_lossy().into_owned();
        let name = file.strip_suffix("_neutral.jpg");
        names.extend(
            name.filter(|name| folder.join(format!("{name}_smiling.jpg")).exists()).map(str::to_owned),
        );
    }
    names.sort();
    let mut person = |name: String| {
        let mut photo =
            |state: &str| Photo::read(&folder.join(format!("{name}_{state}.jpg")), networks, frame);
        Ok(Person { neutral: photo("neutral")?, smiling: photo("smiling")?, name })
    };
    names.into_iter().map(&mut person).collect()
}

/// Landmarks as pixels.
pub fn pixels(landmarks: &Landmarks) -> Vec<Vector2<f64>> {
    (0..landmarks.points.len()).map(|landmark| landmarks.pixel(landmark)).collect()
}
