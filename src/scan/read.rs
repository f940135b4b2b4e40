//! One door for every mesh format.

use std::path::Path;

use super::error::{Fault, ScanError};
use super::glb::Morph;
use super::mesh::Mesh;
use super::{bnt, glb, obj, ply, stl};

/// Files larger than this many bytes are refused unread.
pub const MAX_FILE_BYTES: u64 = 2 << 30;

/// The mesh formats that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshFormat {
    /// Wavefront OBJ with its MTL and textures.
    Obj,
    /// PLY, ascii or binary of either byte order.
    Ply,
    /// STL, ascii or binary.
    Stl,
    /// glTF 2.0, as `.glb` or `.gltf`.
    Gltf,
    /// Bosphorus' range images, `.bnt`.
    Bnt,
}

impl MeshFormat {
    /// The extensions that are read, for messages.
    pub const EXTENSIONS: &'static str = ".obj, .ply, .stl, .glb, .gltf, .bnt";

    /// The format that the extension of `path` stands for, in either case.
    pub fn from_path(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            "stl" => Some(Self::Stl),
            "glb" | "gltf" => Some(Self::Gltf),
            "bnt" => Some(Self::Bnt),
            _ => None,
        }
    }

    /// The format's name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Stl => "STL",
            Self::Gltf => "glTF",
            Self::Bnt => "BNT",
        }
    }
}

/// Reads a mesh in the file's own frame and unit (metres for glTF), vertices in the file's own order.
///
/// Triangles that name a vertex twice are dropped; unreferenced vertices stay. What the mesh then fulfils is listed
/// at [`Mesh::validate`]. Missing textures and material files are warned of, not errors.
pub fn read_mesh(path: &Path) -> Result<Mesh, ScanError> {
    let Some(format) = MeshFormat::from_path(path) else {
        return Err(ScanError::unsupported(path, MeshFormat::EXTENSIONS));
    };
    let bytes = read_limited(path, format.name(), MAX_FILE_BYTES)?;
    read_mesh_bytes(&bytes, format, path)
}

/// A glTF mesh as [`read_mesh`] reads it, with its morph targets.
pub fn read_morphs(path: &Path) -> Result<(Mesh, Vec<Morph>), ScanError> {
    if MeshFormat::from_path(path) != Some(MeshFormat::Gltf) {
        return Err(ScanError::unsupported(path, ".glb, .gltf"));
    }
    let bytes = read_limited(path, MeshFormat::Gltf.name(), MAX_FILE_BYTES)?;
    let read = || {
        let (mesh, morphs) = glb::read_with_morphs(&bytes, path)?;
        mesh.validate()?;
        Ok((mesh, morphs))
    };
    read().map_err(|fault: Fault| fault.at(path, MeshFormat::Gltf.name()))
}

/// Like [`read_mesh`], from bytes that are already in memory.
///
/// `path` serves messages, and its folder is where textures, material files and glTF buffers are looked for.
pub fn read_mesh_bytes(bytes: &[u8], format: MeshFormat, path: &Path) -> Result<Mesh, ScanError> {
    read_checked(bytes, format, path).map_err(|fault| fault.at(path, format.name()))
}

fn read_checked(bytes: &[u8], format: MeshFormat, path: &Path) -> Result<Mesh, Fault> {
    if bytes.is_empty() {
        return Err(Fault::corrupt("it is empty"));
    }
    let mut mesh = match format {
        MeshFormat::Obj => obj::read(bytes, path),
        MeshFormat::Ply => ply::read(bytes, path),
        MeshFormat::Stl => stl::read(bytes),
        MeshFormat::Gltf => glb::read(bytes, path),
        MeshFormat::Bnt => bnt::read(bytes, path),
    }?;
    mesh.validate()?;
    let dropped = mesh.drop_degenerate_triangles();
    if dropped > 0 {
        tracing::warn!(path = %path.display(), dropped, "dropped triangles that name a vertex twice");
        mesh.validate()?;
    }
    Ok(mesh)
}

/// Reads a whole file of at most `limit` bytes.
pub(super) fn read_limited(path: &Path, format: &'static str, limit: u64) -> Result<Vec<u8>, ScanError> {
    let failed = |source| ScanError::Read { path: path.to_owned(), source };
    let meta = std::fs::metadata(path).map_err(failed)?;
    if !meta.is_file() {
        return Err(failed(std::io::Error::other("it is not a regular file")));
    }
    if meta.len() > limit {
        let reason = format!("it has {} bytes, and at most {limit} are read", meta.len());
        return Err(Fault::new(reason, Fault::DECIMATE).at(path, format));
    }
    std::fs::read(path).map_err(failed)
}
