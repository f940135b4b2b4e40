//! Khronos' validator, run on what the tests have written.

use std::{
    env,
    path::{Path, PathBuf},
    process::Command,
};

/// The folder where the validator is installed; `make test` installs it and names the folder in `GLTF_VALIDATOR_DIR`.
pub fn validator() -> Option<PathBuf> {
    let folder = env::var_os("GLTF_VALIDATOR_DIR").map(PathBuf::from);
    if folder.is_none() {
        eprintln!("skipped: GLTF_VALIDATOR_DIR is not set; `make test` sets it");
    }
    folder
}

/// The validator has nothing to say of the files: no error, warning, information or hint.
#[track_caller]
pub fn validate(validator: &Path, files: &[PathBuf]) {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/gltf_validate.mjs");
    let output = Command::new("node").arg(script).args(files).current_dir(validator).output().unwrap();
    let said =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert!(output.status.success(), "{said}");
}
