//! The files that `make setup` brings: where they are, and that they are the right ones.
//!
//! `models/manifest.toml` and `recordings/manifest.toml` are compiled in. Nothing is loaded, and no library is
//! opened, before its size and SHA-256 agree with them.
//!
//! ```no_run
//! let assets = understudy::assets::Assets::locate()?;
//! let detector = assets.verified("face_detector")?;
//! # Ok::<(), understudy::assets::AssetError>(())
//! ```

use std::{
    collections::BTreeSet,
    ffi::OsString,
    fmt::{self, Write as _},
    fs::{self, File},
    io::{self, Read},
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
    time::SystemTime,
};

use serde::Deserialize;
use sha2::{Digest, Sha256};

/// The manifests of this version of the program.
const MANIFESTS: [&str; 2] =
    [include_str!("../models/manifest.toml"), include_str!("../recordings/manifest.toml")];

/// What was verified in this process: a file is hashed once, however often it is asked for, and again when its size
/// or time of change is another one.
static VERIFIED: Mutex<BTreeSet<Verified>> = Mutex::new(BTreeSet::new());

#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Verified {
    path: PathBuf,
    sha256: String,
    bytes: u64,
    changed: Option<SystemTime>,
}

/// What can go wrong between a name and a file that may be loaded.
#[derive(Debug, thiserror::Error)]
pub enum AssetError {
    /// No environment variable says where the assets are.
    #[error(
        "wanted the asset folder, but none of UNDERSTUDY_ASSETS, XDG_DATA_HOME and HOME is set; set \
         UNDERSTUDY_ASSETS to the folder that `make setup` filled"
    )]
    NoFolder,
    /// The manifest cannot be read.
    #[error("an asset manifest cannot be read: {0}")]
    Manifest(#[from] toml::de::Error),
    /// An asset names a package that its manifests do not describe.
    #[error("asset `{asset}` comes from `{package}`, which no manifest describes; add a [[package]] for it")]
    UnknownPackage {
        /// The asset's name.
        asset: String,
        /// The package that is not described.
        package: String,
    },
    /// There is no asset of this name.
    #[error("wanted asset `{name}`, which no manifest names; the known ones are {known}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// All names, separated by commas.
        known: String,
    },
    /// The file is not there.
    #[error("wanted asset `{name}` at {path}, found no file there; run `make setup`")]
    Missing {
        /// The asset's name.
        name: String,
        /// Where it should be.
        path: PathBuf,
    },
    /// The file is there but cannot be read.
    #[error("asset `{name}` at {path} cannot be read: {source}; see to its permissions or run `make setup`")]
    Unreadable {
        /// The asset's name.
        name: String,
        /// Where it is.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file is another one than the manifest names.
    #[error(
        "asset `{name}` at {path} is not the file wanted: wanted {wanted_bytes} bytes with SHA-256 {wanted}, found \
         {found_bytes} bytes with SHA-256 {found}; remove the file and run `make setup` again"
    )]
    Corrupt {
        /// The asset's name.
        name: String,
        /// Where it is.
        path: PathBuf,
        /// The SHA-256 in the manifest.
        wanted: String,
        /// The SHA-256 of the file.
        found: String,
        /// The size in the manifest.
        wanted_bytes: u64,
        /// The size of the file.
        found_bytes: u64,
    },
}

/// One file that the manifests name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Asset {
    /// The name it is asked for by.
    pub name: String,
    /// Its path relative to the asset folder.
    pub path: PathBuf,
    /// The package it comes from, with its version and registry, such as `menpo3d 0.8.6 (PyPI)`.
    pub package: String,
    /// The file inside the package.
    pub member: String,
    /// SHA-256 of the finished file, 64 hexadecimal digits in lower case.
    pub sha256: String,
    /// Size of the finished file in bytes.
    pub bytes: u64,
    /// Its licence as an SPDX expression.
    pub licence: String,
    /// What the program uses it for.
    pub purpose: String,
}

/// How an asset's file stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Condition {
    /// There, of the right size, not hashed.
    Present,
    /// There, with the right SHA-256.
    Verified,
    /// Not there.
    Missing,
    /// There, but another file than the manifest names, or not readable.
    Corrupt,
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Present => "present",
            Self::Verified => "verified",
            Self::Missing => "missing",
            Self::Corrupt => "corrupt",
        })
    }
}

/// The asset folder together with the manifests.
#[derive(Debug, Clone)]
pub struct Assets {
    root: PathBuf,
    assets: Vec<Asset>,
}

impl Assets {
    /// The folder of this user: `$UNDERSTUDY_ASSETS`, or `understudy` in `$XDG_DATA_HOME`, or
    /// `~/.local/share/understudy`. It need not exist yet.
    pub fn locate() -> Result<Self, AssetError> {
        Self::at(folder(|name| std::env::var_os(name)).ok_or(AssetError::NoFolder)?)
    }

    /// The assets in a folder of one's own choice.
    pub fn at(root: impl Into<PathBuf>) -> Result<Self, AssetError> {
        Self::with_manifests(root, &MANIFESTS)
    }

    /// The assets in a folder, as other manifests describe them.
    pub fn with_manifests(root: impl Into<PathBuf>, manifests: &[&str]) -> Result<Self, AssetError> {
        let (mut packages, mut entries) = (Vec::new(), Vec::new());
        for text in manifests {
            let manifest: Manifest = toml::from_str(text)?;
            packages.extend(manifest.package);
            entries.extend(manifest.asset);
        }
        let assets = entries.into_iter().map(|entry| entry.resolve(&packages)).collect::<Result<_, _>>()?;
        Ok(Self { root: root.into(), assets })
    }

    /// The asset folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The path of an asset whose file is there with the right size and SHA-256. The hash is taken once a process.
    pub fn verified(&self, name: &str) -> Result<PathBuf, AssetError> {
        let asset = self.assets.iter().find(|asset| asset.name == name).ok_or_else(|| {
            let known: Vec<&str> = self.assets.iter().map(|asset| asset.name.as_str()).collect();
            AssetError::Unknown { name: name.to_owned(), known: known.join(", ") }
        })?;
        self.verify(asset)
    }

    /// Every asset in the order of the manifests with the state of its file, judged by size alone.
    pub fn list(&self) -> Vec<(&Asset, Condition)> {
        let quick = |asset: &Asset| match fs::metadata(self.root.join(&asset.path)) {
            Ok(found) if found.is_file() && found.len() == asset.bytes => Condition::Present,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Condition::Missing,
            _ => Condition::Corrupt,
        };
        self.assets.iter().map(|asset| (asset, quick(asset))).collect()
    }

    /// Every asset in the order of the manifests with the state of its file, hashed.
    pub fn check(&self) -> Vec<(&Asset, Condition)> {
        let full = |asset: &Asset| match self.verify(asset) {
            Ok(_) => Condition::Verified,
            Err(AssetError::Missing { .. }) => Condition::Missing,
            Err(_) => Condition::Corrupt,
        };
        self.assets.iter().map(|asset| (asset, full(asset))).collect()
    }

    fn verify(&self, asset: &Asset) -> Result<PathBuf, AssetError> {
        let path = self.root.join(&asset.path);
        let unreadable = |source: io::Error| {
            let (name, path) = (asset.name.clone(), path.clone());
            if source.kind() == io::ErrorKind::NotFound {
                AssetError::Missing { name, path }
            } else {
                AssetError::Unreadable { name, path, source }
            }
        };
        let metadata = fs::metadata(&path).map_err(unreadable)?;
        let seen = Verified {
            path: path.clone(),
            sha256: asset.sha256.clone(),
            bytes: metadata.len(),
            changed: metadata.modified().ok(),
        };
        if VERIFIED.lock().unwrap_or_else(PoisonError::into_inner).contains(&seen) {
            return Ok(path);
        }
        let (found, found_bytes) = sha256(&path).map_err(unreadable)?;
        if found != asset.sha256 || found_bytes != asset.bytes {
            return Err(AssetError::Corrupt {
                name: asset.name.clone(),
                path,
                wanted: asset.sha256.clone(),
                found,
                wanted_bytes: asset.bytes,
                found_bytes,
            });
        }
        VERIFIED.lock().unwrap_or_else(PoisonError::into_inner).insert(seen);
        Ok(path)
    }
}

/// The asset folder, from the environment that `get` gives; an empty variable counts as none.
fn folder(get: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let get = |name| get(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    get("UNDERSTUDY_ASSETS")
        .or_else(|| get("XDG_DATA_HOME").map(|data| data.join("understudy")))
        .or_else(|| get("HOME").map(|home| home.join(".local/share/understudy")))
}

/// SHA-256 in lower-case hexadecimal, and the number of bytes it was taken over.
fn sha256(path: &Path) -> io::Result<(String, u64)> {
    let (mut file, mut hash, mut bytes) = (File::open(path)?, Sha256::new(), 0);
    let mut buffer = vec![0; 1 << 18];
    loop {
        let read = file.read(&mut buffer)?;
        if read == 0 {
            break;
        }
        bytes += read as u64;
        hash.update(&buffer[..read]);
    }
    let mut text = String::with_capacity(64);
    for byte in hash.finalize() {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
    }
    Ok((text, bytes))
}

#[derive(Deserialize)]
struct Manifest {
    package: Vec<Package>,
    asset: Vec<Entry>,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    version: String,
    registry: String,
}

#[derive(Deserialize)]
struct Entry {
    name: String,
    path: PathBuf,
    package: String,
    member: String,
    sha256: String,
    bytes: u64,
    licence: String,
    purpose: String,
}

impl Entry {
    fn resolve(self, packages: &[Package]) -> Result<Asset, AssetError> {
        let Some(package) = packages.iter().find(|package| package.name == self.package) else {
            return Err(AssetError::UnknownPackage { asset: self.name, package: self.package });
        };
        Ok(Asset {
            package: format!("{} {} ({})", package.name, package.version, package.registry),
            name: self.name,
            path: self.path,
            member: self.member,
            sha256: self.sha256,
            bytes: self.bytes,
            licence: self.licence,
            purpose: self.purpose,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_folder_follows_the_environment_in_order() {
        let find = |set: &[(&str, &str)]| {
            folder(|name| set.iter().find(|(key, _)| *key == name).map(|(_, value)| OsString::from(value)))
        };
        let all = [("UNDERSTUDY_ASSETS", "/a"), ("XDG_DATA_HOME", "/x"), ("HOME", "/h")];
        assert_eq!(find(&all), Some("/a".into()));
        assert_eq!(find(&all[1..]), Some("/x/understudy".into()));
        assert_eq!(find(&all[2..]), Some("/h/.local/share/understudy".into()));
        assert_eq!(
            find(&[("UNDERSTUDY_ASSETS", ""), ("HOME", "/h")]),
            Some("/h/.local/share/understudy".into())
        );
        assert_eq!(find(&[]), None);
    }
}
