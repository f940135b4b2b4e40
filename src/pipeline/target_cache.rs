//! What was made of a scan, kept for the next run.
//!
//! Finding landmarks and opening a scan gives the same result every time, so it is kept below the user's cache folder,
//! under a name that says what it was made from: the program itself, the drawing device, the scan, its textures, and how
//! it was read. Whatever differs is another entry; an entry that is damaged is made anew. `UNDERSTUDY_CACHE` names
//! another folder, or `off`.

use std::{
    env, fs,
    io::Write as _,
    path::{Path, PathBuf},
    time::UNIX_EPOCH,
};

use nalgebra::{Point3, Rotation3};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::TargetOptions;
use crate::{anatomy::Anatomy, scan::Mesh, view::Lighting};

const CHECKSUM_BYTES: usize = 32;

/// What a scan's pictures told the networks.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct FoundFace {
    /// 478 points in the mesh's own frame and unit.
    pub landmarks: Vec<Option<Point3<f64>>>,
    /// 478 values 0..=1.
    pub confidences: Vec<f64>,
    /// Turns the mesh's own axes upright.
    pub facing: Rotation3<f64>,
    /// The light in which the scan is known as a face.
    pub lighting: Lighting,
}

/// One scan's place in the cache; without a folder nothing is kept.
#[derive(Debug, Clone)]
pub(super) struct TargetCache {
    stem: Option<PathBuf>,
}

impl TargetCache {
    /// For a mesh as its file has it, drawn by `adapter`.
    pub fn of(own: &Mesh, options: &TargetOptions, adapter: &str) -> Self {
        Self { stem: folder().and_then(|folder| Some(folder.join(key(own, options, adapter)?))) }
    }

    /// Nothing is looked up and nothing kept.
    #[cfg(test)]
    pub fn off() -> Self {
        Self { stem: None }
    }

    /// The face found before, if any.
    pub fn face(&self) -> Option<FoundFace> {
        self.read("face")
    }

    /// Keeps a face.
    pub fn keep_face(&self, face: &FoundFace) {
        self.write("face", face);
    }

    /// The anatomy made before, if any; `scan` gives it its textures back.
    pub fn anatomy(&self, scan: &Mesh) -> Option<Anatomy> {
        let mut anatomy: Anatomy = self.read("anatomy")?;
        for (kept, own) in anatomy.mesh.materials.iter_mut().zip(&scan.materials) {
            kept.texture.clone_from(&own.texture);
        }
        Some(anatomy)
    }

    /// Keeps an anatomy, without the textures that `scan` has anyway.
    pub fn keep_anatomy(&self, anatomy: &Anatomy, scan: &Mesh) {
        if self.stem.is_none() {
            return;
        }
        let mut kept = anatomy.clone();
        for material in kept.mesh.materials.iter_mut().take(scan.materials.len()) {
            material.texture = None;
        }
        self.write("anatomy", &kept);
    }

    fn read<T: for<'a> Deserialize<'a>>(&self, what: &str) -> Option<T> {
        let path = self.stem.as_ref()?.with_extension(what);
        let bytes = fs::read(&path).ok()?;
        let (checksum, payload) = bytes.split_at_checked(CHECKSUM_BYTES)?;
        let found = (Sha256::digest(payload).as_slice() == checksum)
            .then(|| postcard::from_bytes(payload).ok())
            .flatten();
        if found.is_some() {
            tracing::info!("{what} taken from {}", path.display());
        } else {
            tracing::warn!("{} is damaged, and is made anew", path.display());
        }
        found
    }

    /// Failing to keep something is no reason to fail: it is made again the next time.
    fn write<T: Serialize>(&self, what: &str, value: &T) {
        let Some(stem) = &self.stem else { return };
        let path = stem.with_extension(what);
        if let Err(error) = write_whole(&path, value) {
            tracing::info!("{} was not kept: {error}", path.display());
        }
    }
}

fn write_whole<T: Serialize>(path: &Path, value: &T) -> std::io::Result<()> {
    let payload = postcard::to_stdvec(value).map_err(std::io::Error::other)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    let mut draft = tempfile::NamedTempFile::new_in(folder)?;
    draft.write_all(&Sha256::digest(&payload))?;
    draft.write_all(&payload)?;
    draft.persist(path)?;
    Ok(())
}

fn folder() -> Option<PathBuf> {
    match env::var_os("UNDERSTUDY_CACHE") {
        Some(name) if name == "off" => None,
        Some(folder) if !folder.is_empty() => Some(folder.into()),
        _ => {
            let home = || Some(PathBuf::from(env::var_os("HOME")?).join(".cache"));
            let base =
                env::var_os("XDG_CACHE_HOME").filter(|v| !v.is_empty()).map(PathBuf::from).or_else(home)?;
            Some(base.join("understudy").join("targets"))
        }
    }
}

/// A name made of everything that the result depends on.
fn key(own: &Mesh, options: &TargetOptions, adapter: &str) -> Option<String> {
    let mut hash = Sha256::new();
    // The program itself, so that one built anew never finds what an older one made.
    let program = fs::metadata(env::current_exe().ok()?).ok()?;
    let built = program.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
    hash.update(built.as_nanos().to_le_bytes());
    hash.update(program.len().to_le_bytes());
    hash.update(adapter.as_bytes());
    hash.update(format!("{:?}", options.unit).as_bytes());
    if let Some(path) = &options.landmarks {
        hash.update(fs::read(path).ok()?);
    }
    let mut mesh = own.clone();
    for texture in mesh.materials.iter_mut().filter_map(|material| material.texture.take()) {
        hash.update(&texture.bytes);
    }
    hash.update(postcard::to_stdvec(&mesh).ok()?);
    let digest = hash.finalize();
    let (name, _) = digest.split_first_chunk::<16>()?;
    Some(format!("{:032x}", u128::from_be_bytes(*name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn face() -> FoundFace {
        FoundFace {
            landmarks: vec![Some(Point3::new(0.1, 1.0 / 3.0, -7.0)), None],
            confidences: vec![0.5, 0.0],
            facing: Rotation3::from_euler_angles(0.1, 0.2, 0.3),
            lighting: Lighting::Clay,
        }
    }

    #[test]
    fn what_is_kept_comes_back_to_the_bit_and_damage_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let cache = TargetCache { stem: Some(folder.path().join("deeper").join("key")) };
        assert!(cache.face().is_none());
        cache.keep_face(&face());
        let back = cache.face().unwrap();
        assert_eq!(back.landmarks, face().landmarks);
        assert_eq!(back.facing, face().facing);
        let path = folder.path().join("deeper").join("key.face");
        let mut bytes = fs::read(&path).unwrap();
        for damage in [0, CHECKSUM_BYTES + 3, bytes.len() - 1] {
            bytes[damage] ^= 1;
            fs::write(&path, &bytes).unwrap();
            assert!(cache.face().is_none());
            bytes[damage] ^= 1;
        }
        fs::write(&path, &bytes[..7]).unwrap();
        assert!(cache.face().is_none());
    }

    #[test]
    fn without_a_folder_nothing_is_kept() {
        TargetCache::off().keep_face(&face());
        assert!(TargetCache::off().face().is_none());
    }

    #[test]
    fn the_name_depends_on_the_mesh_its_reading_and_the_device() {
        let mesh = Mesh { positions: vec![Point3::new(1.0, 2.0, 3.0)], ..Mesh::default() };
        let moved = Mesh { positions: vec![Point3::new(1.0, 2.0, 3.5)], ..Mesh::default() };
        let plain = TargetOptions::default();
        let metres = TargetOptions { unit: Some(crate::scan::LengthUnit::Metre), ..TargetOptions::default() };
        let names = [
            key(&mesh, &plain, "a"),
            key(&moved, &plain, "a"),
            key(&mesh, &metres, "a"),
            key(&mesh, &plain, "b"),
        ];
        assert!(names.iter().all(Option::is_some));
        for (i, name) in names.iter().enumerate() {
            assert!(!names[..i].contains(name));
        }
        assert_eq!(key(&mesh, &plain, "a"), names[0]);
    }
}
