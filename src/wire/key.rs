//! The secret that sender and receiver share.

use std::{fmt, fs, path::Path};

use super::WireError;
use crate::export::{Draft, ExportError};

/// A key file is one short line.
const MOST_BYTES: u64 = 1024;

/// 256 secret bits.
#[derive(Clone, PartialEq, Eq)]
pub struct SecretKey([u8; 32]);

impl fmt::Debug for SecretKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SecretKey")
    }
}

impl SecretKey {
    /// Of bytes that nobody can guess.
    pub fn new(bytes: [u8; 32]) -> Self {
        Self(bytes)
    }

    pub(super) fn bytes(&self) -> &[u8; 32] {
        &self.0
    }

    /// Made of the system's random numbers.
    pub fn random() -> Result<Self, WireError> {
        random().map(Self)
    }

    /// From a line of 64 hexadecimal digits.
    pub fn read(path: &Path) -> Result<Self, WireError> {
        let fail = |source| WireError::Read { path: path.into(), source };
        let no_key = || WireError::NoKey { path: path.into() };
        if fs::metadata(path).map_err(fail)?.len() > MOST_BYTES {
            return Err(no_key());
        }
        let text = fs::read(path).map_err(fail)?;
        let text = std::str::from_utf8(&text).map_err(|_| no_key())?;
        Self::parse(text.trim()).ok_or_else(no_key)
    }

    fn parse(text: &str) -> Option<Self> {
        let mut bytes = [0; 32];
        if text.len() != 2 * bytes.len() {
            return None;
        }
        let digits: Option<Vec<u32>> = text.chars().map(|digit| digit.to_digit(16)).collect();
        for (byte, pair) in bytes.iter_mut().zip(digits?.chunks(2)) {
            *byte = (pair[0] << 4 | pair[1]) as u8;
        }
        Some(Self(bytes))
    }

    /// Writes it so that its owner alone can read it. Never over another file: what that key locks would be lost.
    pub fn write(&self, path: &Path) -> Result<(), WireError> {
        if fs::symlink_metadata(path).is_ok() {
            return Err(ExportError::Refused {
                path: path.into(),
                reason: "it exists, and what its key locks could not be read any more".into(),
                remedy: "Name a new file, or remove it yourself",
            }
            .into());
        }
        let mut draft = Draft::create(path)?;
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            let owners_alone = fs::set_permissions(draft.path(), fs::Permissions::from_mode(0o600));
            owners_alone.map_err(|source| ExportError::Write {
                path: path.into(),
                source,
                remedy: "Name a place that can keep a file to its owner",
            })?;
        }
        for byte in &self.0 {
            draft.append(format!("{byte:02x}").as_bytes())?;
        }
        draft.append(b"\n")?;
        Ok(draft.commit()?)
    }
}

/// Bytes that nobody can guess.
pub fn random<const N: usize>() -> Result<[u8; N], WireError> {
    let mut bytes = [0; N];
    getrandom::fill(&mut bytes).map_err(|source| WireError::NoRandomness { source })?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_written_once_and_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("my.key");
        let key = SecretKey::random().unwrap();
        assert_ne!(key, SecretKey::random().unwrap());
        key.write(&path).unwrap();
        assert_eq!(SecretKey::read(&path).unwrap(), key);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        }
        let said = key.write(&path).unwrap_err().to_string();
        assert!(said.contains("my.key") && said.contains("exists"), "{said}");
        assert_eq!(format!("{key:?}"), "SecretKey");
    }

    #[test]
    fn what_is_no_key_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.key");
        for text in ["", "abc", &"g".repeat(64), &"1".repeat(65), &"é".repeat(32), &"a".repeat(5000)] {
            fs::write(&path, text).unwrap();
            let said = SecretKey::read(&path).unwrap_err().to_string();
            assert!(said.contains("x.key") && said.contains("64 hexadecimal digits"), "{said}");
        }
        assert!(SecretKey::read(&folder.path().join("none")).unwrap_err().to_string().contains("none"));
    }
}
