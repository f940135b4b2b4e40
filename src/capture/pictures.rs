//! A folder of numbered pictures, or a single one.

use std::path::{Path, PathBuf};

use opencv::{core::MatTraitConst, imgcodecs};

use super::{CaptureError, ClipInfo, Frame, FrameRate, FrameSource, Image, error::MIN_SIDE};

/// Pictures in the order of their names, at a constant rate.
pub struct PictureSequence {
    paths: Vec<PathBuf>,
    info: ClipInfo,
    next: usize,
}

impl PictureSequence {
    /// `path` is a folder of .png/.jpg/.jpeg pictures or one such picture.
    ///
    /// Names are ordered so that `2.png` comes before `10.png`.
    pub fn open(path: &Path, rate: FrameRate) -> Result<Self, CaptureError> {
        let read = |source| CaptureError::Read { path: path.into(), source };
        let mut paths = if path.is_dir() {
            std::fs::read_dir(path)
                .map_err(read)?
                .map(|entry| entry.map(|entry| entry.path()))
                .collect::<Result<Vec<_>, _>>()
                .map_err(read)?
        } else {
            std::fs::metadata(path).map_err(read)?;
            vec![path.to_path_buf()]
        };
        paths.retain(|candidate| is_picture(candidate));
        paths.sort_by_cached_key(|candidate| natural_key(candidate));
        let first = paths.first().ok_or_else(|| CaptureError::NoPictures { path: path.into() })?;
        let picture = decode(first)?;
        if picture.width() < MIN_SIDE || picture.height() < MIN_SIDE {
            return Err(CaptureError::TooSmall {
                path: first.clone(),
                width: picture.width(),
                height: picture.height(),
            });
        }
        let info = ClipInfo {
            name: path
                .file_name()
                .map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned()),
            width: picture.width(),
            height: picture.height(),
            rate,
            announced_frames: Some(paths.len() as u64),
        };
        Ok(Self { paths, info, next: 0 })
    }
}

impl FrameSource for PictureSequence {
    fn info(&self) -> &ClipInfo {
        &self.info
    }

    fn read(&mut self, frame: &mut Frame) -> Result<bool, CaptureError> {
        let Some(path) = self.paths.get(self.next) else { return Ok(false) };
        frame.image = decode(path)?;
        if (frame.image.width(), frame.image.height()) != (self.info.width, self.info.height) {
            return Err(CaptureError::SizeChanged {
                path: path.clone(),
                width: self.info.width,
                height: self.info.height,
                found_width: frame.image.width(),
                found_height: frame.image.height(),
            });
        }
        frame.index = self.next as u64;
        frame.timestamp = self.info.rate.tick(frame.index);
        self.next += 1;
        Ok(true)
    }
}

/// True for names that end like a picture this program reads.
pub fn is_picture(path: &Path) -> bool {
    path.extension().is_some_and(|extension| {
        ["png", "jpg", "jpeg"].iter().any(|known| extension.eq_ignore_ascii_case(known))
    })
}

fn decode(path: &Path) -> Result<Image, CaptureError> {
    let bytes = std::fs::read(path).map_err(|source| CaptureError::Read { path: path.into(), source })?;
    if bytes.is_empty() {
        return Err(CaptureError::Empty { path: path.into() });
    }
    let library = |source| CaptureError::Library { path: path.into(), source };
    let mat = imgcodecs::imdecode(&opencv::core::Vector::from_slice(&bytes), imgcodecs::IMREAD_COLOR)
        .map_err(library)?;
    if mat.empty() {
        return Err(CaptureError::NotAVideo { path: path.into() });
    }
    Ok(Image::from_bgr(mat))
}

/// Text runs and numbers in turn, so that numbers compare by value.
fn natural_key(path: &Path) -> Vec<(String, u64)> {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let mut key = Vec::new();
    let mut rest = name.as_str();
    while !rest.is_empty() {
        let text_end = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let (text, tail) = rest.split_at(text_end);
        let number_end = tail.find(|c: char| !c.is_ascii_digit()).unwrap_or(tail.len());
        let (number, tail) = tail.split_at(number_end);
        key.push((text.to_owned(), number.parse().unwrap_or(u64::MAX)));
        rest = tail;
    }
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_sort_by_value() {
        let mut names = ["f10.png", "f9.png", "f1.png", "e99.png"].map(PathBuf::from);
        names.sort_by_cached_key(|name| natural_key(name));
        assert_eq!(names, ["e99.png", "f1.png", "f9.png", "f10.png"].map(PathBuf::from));
    }
}
