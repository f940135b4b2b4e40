//! Texture files: found beside the mesh, kept as their bytes, never decoded.

use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use super::mesh::{Texture, TextureFormat};

/// Texture files larger than this many bytes are left out.
const MAX_TEXTURE_BYTES: u64 = 256 << 20;

impl TextureFormat {
    /// The encoding that the first bytes of an image file announce; `None` for anything but PNG and JPEG.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
            Some(Self::Png)
        } else if bytes.starts_with(&[0xff, 0xd8, 0xff]) {
            Some(Self::Jpeg)
        } else {
            None
        }
    }

    /// The media type, as glTF wants it.
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Png => "image/png",
            Self::Jpeg => "image/jpeg",
        }
    }
}

impl Texture {
    /// Keeps encoded image bytes; `None`, with a warning that names `name`, when they are neither PNG nor JPEG.
    pub(super) fn from_bytes(name: &str, bytes: Vec<u8>) -> Option<Arc<Self>> {
        let Some(format) = TextureFormat::of(&bytes) else {
            tracing::warn!(
                texture = name,
                "texture left out: neither PNG nor JPEG. Convert it to one of them"
            );
            return None;
        };
        Some(Arc::new(Self { name: name.to_owned(), format, bytes }))
    }

    /// Reads the texture that a mesh file in `folder` calls `name`; `None`, with a warning, when it cannot be used.
    ///
    /// Absolute and Windows paths come from the exporter's machine: then the bare file name is tried in `folder`.
    pub(super) fn load(folder: &Path, name: &str) -> Option<Arc<Self>> {
        let Some(path) = locate(folder, name) else {
            let folder = folder.display();
            tracing::warn!(texture = name, %folder, "texture not found. Put it beside the mesh file");
            return None;
        };
        let bytes = match std::fs::metadata(&path).and_then(|meta| {
            if meta.len() > MAX_TEXTURE_BYTES {
                return Err(std::io::Error::other("larger than 256 MiB; scale the image down"));
            }
            std::fs::read(&path)
        }) {
            Ok(bytes) => bytes,
            Err(error) => {
                tracing::warn!(texture = %path.display(), %error, "texture left out");
                return None;
            }
        };
        Self::from_bytes(&path.file_name()?.to_string_lossy(), bytes)
    }

    /// An image beside `mesh_path` with the same stem, as scanners write them.
    pub(super) fn beside(mesh_path: &Path) -> Option<Arc<Self>> {
        let folder = folder_of(mesh_path);
        let stem = mesh_path.file_stem()?.to_string_lossy();
        ["jpg", "png", "jpeg", "JPG", "PNG"].iter().find_map(|extension| {
            let name = format!("{stem}.{extension}");
            folder.join(&name).is_file().then(|| Self::load(&folder, &name)).flatten()
        })
    }
}

/// The folder a file lies in; "." for a bare name.
pub(super) fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// Where the file that a mesh in `folder` calls `name` lies, if anywhere.
pub(super) fn locate(folder: &Path, name: &str) -> Option<PathBuf> {
    let name = name.trim().trim_matches('"');
    if name.is_empty() || name.contains('\0') {
        return None;
    }
    let relative = PathBuf::from(name.replace('\\', "/"));
    let local = relative.components().all(|c| !matches!(c, Component::RootDir | Component::Prefix(_)));
    let as_written = local.then(|| folder.join(&relative)).filter(|p| p.is_file());
    as_written.or_else(|| relative.file_name().map(|n| folder.join(n)).filter(|p| p.is_file()))
}
