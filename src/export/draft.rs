//! An output under a temporary name, so that nothing half-written ever replaces a good file.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::ExportError;

/// Many leftovers of killed runs may stand in the folder; beyond this something else is wrong.
const NAME_ATTEMPTS: u32 = 10_000;

/// A file being written beside its destination as `.{name}.{process}-{n}.partial`.
///
/// [`Draft::commit`] puts it in place in one step (same folder, so that renaming is atomic). Dropped without a
/// commit it is removed, and what stood at the destination stays as it was.
#[derive(Debug)]
pub struct Draft {
    destination: PathBuf,
    partial: PathBuf,
    writer: BufWriter<File>,
    committed: bool,
}

impl Draft {
    /// Opens a draft for `destination`.
    ///
    /// Fails at once when the folder is missing or not writable, and when the destination exists but is no regular
    /// file: renaming would replace a folder's or a device's entry. A symbolic link is followed, so that the file it
    /// leads to is replaced and the link kept.
    pub fn create(destination: &Path) -> Result<Self, ExportError> {
        let fail = |source| ExportError::create(destination, source);
        let place = match fs::metadata(destination) {
            Ok(found) if found.is_dir() => return Err(fail(io::ErrorKind::IsADirectory.into())),
            Ok(found) if !found.is_file() => {
                return Err(ExportError::refused(
                    destination,
                    "it exists and is not a regular file",
                    "Name a regular file",
                ));
            }
            Ok(_) => fs::canonicalize(destination).map_err(fail)?,
            Err(error) if error.kind() == io::ErrorKind::NotFound => destination.to_path_buf(),
            Err(error) => return Err(fail(error)),
        };
        let Some(name) = place.file_name() else {
            return Err(fail(io::ErrorKind::IsADirectory.into()));
        };
        let mut attempt = 0;
        let (partial, file) = loop {
            let mut hidden = std::ffi::OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".{}-{attempt}.partial", std::process::id()));
            let partial = place.with_file_name(hidden);
            match OpenOptions::new().read(true).write(true).create_new(true).open(&partial) {
                Ok(file) => break (partial, file),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists && attempt < NAME_ATTEMPTS => {
                    attempt += 1;
                }
                Err(error) => return Err(fail(error)),
            }
        };
        let writer = BufWriter::with_capacity(1 << 18, file);
        Ok(Self { destination: place, partial, writer, committed: false })
    }

    /// Where [`Draft::commit`] will put the file.
    pub fn destination(&self) -> &Path {
        &self.destination
    }

    /// Where the file stands until then; for programs that write it themselves. They may truncate it, not replace it.
    pub fn path(&self) -> &Path {
        &self.partial
    }

    /// The buffered writer, for serialisers that want one; [`Draft::append`] gives errors that name the file.
    pub fn writer(&mut self) -> &mut BufWriter<File> {
        &mut self.writer
    }

    /// Appends `bytes`.
    pub fn append(&mut self, bytes: &[u8]) -> Result<(), ExportError> {
        self.writer.write_all(bytes).map_err(|source| ExportError::write(&self.destination, source))
    }

    /// Writes `bytes` over what stands `offset` bytes from the start, then returns to the end.
    pub fn overwrite(&mut self, offset: u64, bytes: &[u8]) -> Result<(), ExportError> {
        self.writer
            .seek(SeekFrom::Start(offset))
            .and_then(|_| self.writer.write_all(bytes))
            .and_then(|()| self.writer.seek(SeekFrom::End(0)))
            .map(|_| ())
            .map_err(|source| ExportError::write(&self.destination, source))
    }

    /// Flushes, waits for the disk, and puts the file in place.
    pub fn commit(mut self) -> Result<(), ExportError> {
        let done = self
            .writer
            .flush()
            .and_then(|()| self.writer.get_ref().sync_all())
            .and_then(|()| fs::rename(&self.partial, &self.destination));
        done.map_err(|source| ExportError::write(&self.destination, source))?;
        self.committed = true;
        Ok(())
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if !self.committed {
            // Nobody is left to tell; the name itself says that the file is partial.
            let _ = fs::remove_file(&self.partial);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn commit_puts_the_file_in_place_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.bin");
        fs::write(&path, b"old").unwrap();
        let mut draft = Draft::create(&path).unwrap();
        draft.append(b"neXt").unwrap();
        draft.overwrite(2, b"w").unwrap();
        draft.append(b"!").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()).len(), 2);
        draft.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"newt!");
        assert_eq!(names(folder.path()), ["out.bin"]);
    }

    #[test]
    fn a_dropped_draft_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.bin");
        fs::write(&path, b"old").unwrap();
        let mut draft = Draft::create(&path).unwrap();
        draft.append(&vec![1; 1_000_000]).unwrap();
        drop(draft);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["out.bin"]);
    }

    #[test]
    fn two_drafts_of_one_destination_do_not_meet() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.bin");
        let mut first = Draft::create(&path).unwrap();
        let mut second = Draft::create(&path).unwrap();
        assert_ne!(first.path(), second.path());
        first.append(b"first").unwrap();
        second.append(b"second").unwrap();
        second.commit().unwrap();
        first.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"first");
    }

    #[test]
    fn a_missing_folder_a_folder_and_a_device_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let missing = Draft::create(&folder.path().join("none/out.bin")).unwrap_err().to_string();
        assert!(missing.contains("none/out.bin") && missing.contains("Create the folder"), "{missing}");
        let itself = Draft::create(folder.path()).unwrap_err().to_string();
        assert!(itself.contains("Name a file"), "{itself}");
        let device = Draft::create(Path::new("/dev/null")).unwrap_err().to_string();
        assert!(device.contains("not a regular file"), "{device}");
        assert!(Path::new("/dev/null").exists());
    }

    #[cfg(unix)]
    #[test]
    fn a_symbolic_link_is_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real"), folder.path().join("link"));
        fs::write(&real, b"old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        let mut draft = Draft::create(&link).unwrap();
        draft.append(b"new").unwrap();
        draft.commit().unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&real).unwrap(), b"new");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_named_with_its_remedy_and_keeps_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.bin");
        fs::write(&path, b"old").unwrap();
        let mut draft = Draft::create(&path).unwrap();
        let full = OpenOptions::new().write(true).open("/dev/full").unwrap();
        draft.writer = BufWriter::new(full);
        draft.append(b"small enough for the buffer").unwrap();
        let error = draft.commit().unwrap_err().to_string();
        assert!(error.contains("out.bin") && error.contains("free some space"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["out.bin"]);
    }
}
