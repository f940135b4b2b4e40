//! Pictures to files.

use std::io::Write;
use std::path::{Path, PathBuf};

use image::{ImageFormat, RgbaImage};

use super::ViewError;

/// Writes a PNG beside its destination and renames it, so that no one ever reads half a picture.
pub fn save_png(path: &Path, picture: &RgbaImage) -> Result<(), ViewError> {
    let failed = |reason: String| ViewError::Save { path: path.to_path_buf(), reason };
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder.to_path_buf(),
        _ => PathBuf::from("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".picture");
    // A temporary file is its owner's alone; a picture is as open as the user's umask lets files be.
    #[cfg(unix)]
    let builder = builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder).map_err(|error| failed(error.to_string()))?;
    let mut writer = std::io::BufWriter::new(&mut file);
    picture.write_to(&mut writer, ImageFormat::Png).map_err(|error| failed(error.to_string()))?;
    writer.flush().map_err(|error| failed(error.to_string()))?;
    drop(writer);
    file.persist(path).map_err(|error| failed(error.error.to_string()))?;
    Ok(())
}
