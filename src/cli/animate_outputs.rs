//! What `animate` writes: the performer's own files once, the avatar's for every target.

use std::{
    error::Error,
    path::{Path, PathBuf},
};

use understudy::export::Draft;

use super::{curve_files::CurveFile, inputs};

/// A file that shows a target.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum AvatarFile {
    Mp4,
    Glb,
    Pc2,
    Png,
}

/// A file of the performer.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum PerformerFile {
    Motion,
    Curves(CurveFile),
}

/// What goes where.
pub struct Outputs {
    pub performer: Vec<(PerformerFile, PathBuf)>,
    /// An entry for each target.
    pub avatars: Vec<Vec<(AvatarFile, PathBuf)>>,
}

enum Kind {
    Avatar(AvatarFile),
    Performer(PerformerFile),
}

impl Kind {
    fn of(path: &Path) -> Result<Self, String> {
        if let Some(curves) = CurveFile::of(path) {
            return Ok(Self::Performer(PerformerFile::Curves(curves)));
        }
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("mp4") => Ok(Self::Avatar(AvatarFile::Mp4)),
            Some("glb") => Ok(Self::Avatar(AvatarFile::Glb)),
            Some("pc2") => Ok(Self::Avatar(AvatarFile::Pc2)),
            Some("png") => Ok(Self::Avatar(AvatarFile::Png)),
            Some("csv") => Ok(Self::Performer(PerformerFile::Motion)),
            _ => Err(format!("cannot write {}: name it .mp4, .glb, .pc2, .csv or .png", path.display())),
        }
    }
}

impl Outputs {
    /// Places that cannot be written to are refused, and two targets whose files would have one name.
    pub fn plan(paths: &[PathBuf], targets: &[PathBuf], read: &[&Path]) -> Result<Self, Box<dyn Error>> {
        let stems: Vec<String> = targets
            .iter()
            .map(|target| target.file_stem().unwrap_or_default().to_string_lossy().into_owned())
            .collect();
        for (k, stem) in stems.iter().enumerate() {
            if let Some(first) = stems[..k].iter().position(|other| other.eq_ignore_ascii_case(stem)) {
                return Err(format!(
                    "{} and {} have one name, by which their outputs would be told apart. Rename one of them",
                    targets[first].display(),
                    targets[k].display()
                )
                .into());
            }
        }
        let mut outputs = Self { performer: Vec::new(), avatars: vec![Vec::new(); targets.len()] };
        for path in paths {
            match Kind::of(path)? {
                Kind::Performer(kind) => outputs.performer.push((kind, path.clone())),
                Kind::Avatar(kind) => {
                    for (files, stem) in outputs.avatars.iter_mut().zip(&stems) {
                        files.push((kind, if stems.len() > 1 { inserted(path, stem) } else { path.clone() }));
                    }
                }
            }
        }
        let performer = outputs.performer.iter().map(|(_, path)| path);
        for path in performer.chain(outputs.avatars.iter().flatten().map(|(_, path)| path)) {
            inputs::spare(path, read)?;
            drop(Draft::create(path)?);
        }
        Ok(outputs)
    }

    /// The files of contractions.
    pub fn curve_files(&self) -> Vec<CurveFile> {
        let curves = |kind: &PerformerFile| match kind {
            PerformerFile::Curves(file) => Some(*file),
            PerformerFile::Motion => None,
        };
        self.performer.iter().filter_map(|(kind, _)| curves(kind)).collect()
    }
}

/// `avatar.james.mp4` of `avatar.mp4`.
fn inserted(path: &Path, stem: &str) -> PathBuf {
    let part = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    path.with_file_name(format!("{}.{stem}.{}", part(path.file_stem()), part(path.extension())))
}
