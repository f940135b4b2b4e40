//! glTF's buffers, accessors and images, every range checked before it is read.

use std::path::Path;
use std::sync::Arc;

use gltf::accessor::{DataType, Dimensions};
use gltf::buffer::{Data, Source};

use super::error::Fault;
use super::mesh::Texture;
use super::read::MAX_FILE_BYTES;
use super::texture::{folder_of, locate};
use super::validate::{MAX_TRIANGLES, MAX_VERTICES, check_count};

/// The bytes a document refers to.
pub(super) struct Buffers {
    data: Vec<Vec<u8>>,
    folder: std::path::PathBuf,
    /// Images already taken, by their place in the file.
    images: Vec<(usize, Option<Arc<Texture>>)>,
}

impl Buffers {
    /// Takes the BIN chunk and reads `data:` buffers and files beside `path`.
    pub fn load(document: &gltf::Document, blob: Option<Vec<u8>>, path: &Path) -> Result<Self, Fault> {
        let folder = folder_of(path);
        let mut blob = blob;
        let mut data = Vec::new();
        for buffer in document.buffers() {
            data.push(match buffer.source() {
                Source::Bin => blob
                    .take()
                    .ok_or_else(|| Fault::corrupt("its buffer refers to a BIN chunk that is missing"))?,
                Source::Uri(uri) => resource(&folder, uri)?,
            });
        }
        Ok(Self { data, folder, images: Vec::new() })
    }

    /// Reads `N` floats an entry; integers must be normalised.
    pub fn floats<const N: usize>(&self, accessor: &gltf::Accessor) -> Result<Vec<[f32; N]>, Fault> {
        let wanted = if N == 2 { Dimensions::Vec2 } else { Dimensions::Vec3 };
        if accessor.dimensions() != wanted {
            let found = accessor.dimensions();
            return Err(Fault::corrupt(format!(
                "accessor {} is {found:?}, not {wanted:?}",
                accessor.index()
            )));
        }
        self.components::<N>(accessor)
    }

    /// Reads linear RGB from three- or four-part colours.
    pub fn colours(&self, accessor: &gltf::Accessor) -> Result<Vec<[f32; 3]>, Fault> {
        if accessor.dimensions() == Dimensions::Vec4 {
            Ok(self.components::<4>(accessor)?.into_iter().map(|[r, g, b, _]| [r, g, b]).collect())
        } else {
            self.floats::<3>(accessor)
        }
    }

    /// Reads unsigned indices of any width.
    pub fn indices(&self, accessor: &gltf::Accessor) -> Result<Vec<u32>, Fault> {
        check_count("face corners", accessor.count(), 3 * MAX_TRIANGLES)?;
        if accessor.dimensions() != Dimensions::Scalar {
            return Err(Fault::corrupt(format!("index accessor {} is no list of numbers", accessor.index())));
        }
        let entries = self.entries(accessor)?;
        match accessor.data_type() {
            DataType::U8 => Ok(entries.map(|e| u32::from(e[0])).collect()),
            DataType::U16 => Ok(entries.map(|e| u32::from(u16::from_le_bytes([e[0], e[1]]))).collect()),
            DataType::U32 => Ok(entries.map(|e| u32::from_le_bytes([e[0], e[1], e[2], e[3]])).collect()),
            found => Err(Fault::corrupt(format!("indices of type {found:?}, not unsigned integers"))),
        }
    }

    /// The image numbered `index`, as its bytes; `None`, with a warning, when it cannot be used.
    pub fn image(&mut self, document: &gltf::Document, index: usize) -> Option<Arc<Texture>> {
        if let Some((_, known)) = self.images.iter().find(|(i, _)| *i == index) {
            return known.clone();
        }
        // The crate's own view of an image panics when it has neither source.
        let image = document.as_json().images.get(index)?;
        let mut name = image.name.clone().unwrap_or_else(|| format!("image{index}"));
        let bytes = if let Some(view) = image.buffer_view {
            document.views().nth(view.value()).and_then(|view| self.view(&view)).map(<[u8]>::to_vec)
        } else if let Some(uri) = &image.uri {
            if !uri.starts_with("data:") {
                name.clone_from(&decode_percent(uri));
            }
            resource(&self.folder, uri)
                .map_err(|fault| tracing::warn!("texture left out: {}", fault.reason))
                .ok()
        } else {
            None
        };
        let texture = bytes.and_then(|bytes| Texture::from_bytes(&name, bytes));
        self.images.push((index, texture.clone()));
        texture
    }

    fn components<const N: usize>(&self, accessor: &gltf::Accessor) -> Result<Vec<[f32; N]>, Fault> {
        check_count("vertices", accessor.count(), MAX_VERTICES)?;
        let entries = self.entries(accessor)?;
        let normalised = accessor.normalized();
        Ok(match accessor.data_type() {
            DataType::F32 => entries
                .map(|e| {
                    std::array::from_fn(|k| {
                        f32::from_le_bytes([e[4 * k], e[4 * k + 1], e[4 * k + 2], e[4 * k + 3]])
                    })
                })
                .collect(),
            DataType::U8 if normalised => {
                entries.map(|e| std::array::from_fn(|k| f32::from(e[k]) / 255.0)).collect()
            }
            DataType::U16 if normalised => entries
                .map(|e| {
                    std::array::from_fn(|k| {
                        f32::from(u16::from_le_bytes([e[2 * k], e[2 * k + 1]])) / 65_535.0
                    })
                })
                .collect(),
            found => {
                let index = accessor.index();
                let reason = format!("accessor {index} holds {found:?}, not floats or normalised integers");
                return Err(Fault::new(reason, "Export it again without quantisation"));
            }
        })
    }

    /// One slice of the element's size for each entry.
    fn entries<'a>(
        &'a self,
        accessor: &gltf::Accessor,
    ) -> Result<impl Iterator<Item = &'a [u8]> + use<'a>, Fault> {
        let index = accessor.index();
        if accessor.sparse().is_some() {
            let reason = format!("accessor {index} is sparse, which is not read");
            return Err(Fault::new(reason, "Export it again, for instance from Blender, which writes none"));
        }
        let out_of_range = || Fault::corrupt(format!("accessor {index} reaches beyond its buffer"));
        let view = accessor.view().ok_or_else(|| Fault::corrupt(format!("accessor {index} has no data")))?;
        let bytes = self.view(&view).ok_or_else(out_of_range)?;
        let (count, size) = (accessor.count(), accessor.size());
        let stride = view.stride().unwrap_or(size).max(1);
        let bytes = bytes.get(accessor.offset()..).ok_or_else(out_of_range)?;
        let needed = count.checked_sub(1).map_or(Some(0), |n| n.checked_mul(stride)?.checked_add(size));
        if needed.is_none_or(|needed| needed > bytes.len()) {
            return Err(out_of_range());
        }
        Ok((0..count).map(move |k| &bytes[k * stride..k * stride + size]))
    }

    fn view(&self, view: &gltf::buffer::View) -> Option<&[u8]> {
        let end = view.offset().checked_add(view.length())?;
        self.data.get(view.buffer().index())?.get(view.offset()..end)
    }
}

/// The bytes behind a URI: `data:` or a file beside the glTF.
fn resource(folder: &Path, uri: &str) -> Result<Vec<u8>, Fault> {
    if uri.starts_with("data:") {
        let data = Data::from_source(Source::Uri(uri), None).map_err(|e| Fault::corrupt(e.to_string()))?;
        // The crate pads buffers with zeros; an image is to stay as it was.
        let text = uri.rsplit(',').next().unwrap_or_default().trim_end_matches('=');
        let mut bytes = data.0;
        bytes.truncate(text.len() * 6 / 8);
        return Ok(bytes);
    }
    let name = decode_percent(uri);
    let file = locate(folder, &name).ok_or_else(|| {
        Fault::new(format!("{name:?} is not beside it"), "Keep the files of a .gltf together")
    })?;
    let unreadable = |e: std::io::Error| Fault::new(format!("{name:?}: {e}"), "Check the file's permissions");
    let length = std::fs::metadata(&file).map_err(unreadable)?.len();
    if length > MAX_FILE_BYTES {
        return Err(Fault::new(format!("{name:?} has {length} bytes"), Fault::DECIMATE));
    }
    std::fs::read(&file).map_err(unreadable)
}

/// Undoes `%20` and its like; what is no such code stays as it is.
fn decode_percent(uri: &str) -> String {
    let bytes = uri.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let code = (bytes[at] == b'%')
            .then(|| bytes.get(at + 1..at + 3))
            .flatten()
            .and_then(|hex| std::str::from_utf8(hex).ok())
            .and_then(|hex| u8::from_str_radix(hex, 16).ok());
        out.push(code.unwrap_or(bytes[at]));
        at += if code.is_some() { 3 } else { 1 };
    }
    String::from_utf8_lossy(&out).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percent_codes() {
        assert_eq!(decode_percent("my%20face.bin"), "my face.bin");
        assert_eq!(decode_percent("100%.bin%2"), "100%.bin%2");
        assert_eq!(decode_percent("%C3%A9%FF"), "é\u{fffd}");
    }

    #[test]
    fn data_uris_keep_their_length() {
        let folder = Path::new(".");
        assert_eq!(
            resource(folder, "data:application/octet-stream;base64,AQIDBAU=").unwrap(),
            [1, 2, 3, 4, 5]
        );
        assert!(resource(folder, "data:x;base64,***").is_err());
        assert!(resource(folder, "missing-file.bin").unwrap_err().reason.contains("missing-file.bin"));
    }
}
