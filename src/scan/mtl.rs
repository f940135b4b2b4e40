//! The materials of an OBJ: its MTL files through `tobj`, and the textures they name.

use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use super::mesh::{Material, Texture};
use super::texture::{folder_of, locate};

/// A material file larger than this many bytes is left out.
const MAX_MTL_BYTES: u64 = 16 << 20;

/// An OBJ that names more materials than this is refused, and a material file's later ones are passed over.
pub(super) const MAX_MATERIALS: usize = 10_000;

/// An OBJ's materials and where its names lead.
pub(super) struct Resolved {
    /// In the order of the MTL, then the names that no MTL defines, then the default.
    pub materials: Vec<Material>,
    /// For each `usemtl` name, in the order asked for, its material.
    pub named: Vec<u32>,
    /// The material of triangles before the first `usemtl`.
    pub unnamed: u32,
}

/// Finds the materials of the OBJ at `path`.
///
/// `names` are its `usemtl` names, `any_unnamed` says whether triangles precede the first, `textured` whether it has
/// texture coordinates. When no material file gives a texture, an image beside the OBJ with the same stem is it.
pub(super) fn resolve(
    path: &Path,
    libraries: &[String],
    names: &[String],
    any_unnamed: bool,
    textured: bool,
) -> Resolved {
    let folder = folder_of(path);
    let mut materials = Vec::new();
    for library in libraries {
        read_library(&folder, library, &mut materials);
    }
    if names.is_empty() && materials.len() > 1 {
        let first = materials[0].name.clone();
        tracing::warn!(path = %path.display(), first, "the OBJ names none of its materials; the first is used");
        materials.truncate(1);
    }
    let mut named = Vec::with_capacity(names.len());
    for name in names {
        let place = materials.iter().position(|m| m.name == *name).unwrap_or_else(|| {
            materials.push(grey(name));
            materials.len() - 1
        });
        named.push(place as u32);
    }
    let mut unnamed = 0;
    if any_unnamed && !names.is_empty() {
        unnamed = materials.len() as u32;
        materials.push(grey("default"));
    }
    if textured
        && materials.len() <= 1
        && materials.iter().all(|m| m.texture.is_none())
        && let Some(texture) = Texture::beside(path)
    {
        let name = materials.pop().map_or_else(|| "scan".to_owned(), |m| m.name);
        tracing::info!(path = %path.display(), texture = texture.name, "the image beside the OBJ is its texture");
        materials.push(Material { name, base_colour: [1.0; 4], texture: Some(texture), gloss: 0.0 });
    }
    Resolved { materials, named, unnamed }
}

fn grey(name: &str) -> Material {
    Material { name: name.to_owned(), base_colour: [0.5, 0.5, 0.5, 1.0], texture: None, gloss: 0.0 }
}

/// `mtllib` may name one file with spaces in it or several files.
fn read_library(folder: &Path, names: &str, materials: &mut Vec<Material>) {
    let files = match locate(folder, names) {
        Some(path) => vec![path],
        None => names.split_whitespace().filter_map(|name| locate(folder, name)).collect(),
    };
    if files.is_empty() {
        let folder = folder.display();
        tracing::warn!(mtl = names, %folder, "material file not found. Put it beside the OBJ");
    }
    for file in files {
        let text = std::fs::metadata(&file).and_then(|meta| {
            if meta.len() > MAX_MTL_BYTES {
                return Err(std::io::Error::other("larger than 16 MiB"));
            }
            std::fs::read(&file)
        });
        match text {
            Ok(bytes) => parse_library(&bytes, &file, materials),
            Err(error) => tracing::warn!(mtl = %file.display(), %error, "material file left out"),
        }
    }
}

fn parse_library(bytes: &[u8], file: &Path, materials: &mut Vec<Material>) {
    let wanted = wanted_lines(&String::from_utf8_lossy(bytes));
    let loaded = match tobj::load_mtl_buf(&mut Cursor::new(wanted)) {
        Ok((loaded, _)) => loaded,
        Err(error) => {
            tracing::warn!(mtl = %file.display(), %error, "material file left out");
            return;
        }
    };
    let folder = folder_of(file);
    let mut textures: Vec<(String, Option<Arc<Texture>>)> = Vec::new();
    let room = MAX_MATERIALS.saturating_sub(materials.len());
    if loaded.len() > room {
        tracing::warn!(mtl = %file.display(), found = loaded.len(), "passed over all but {room} materials");
    }
    for material in loaded.into_iter().take(room) {
        let texture = material.diffuse_texture.as_deref().and_then(|value| {
            let name = texture_name(value);
            if let Some((_, known)) = textures.iter().find(|(n, _)| *n == name) {
                return known.clone();
            }
            let texture = Texture::load(&folder, &name);
            textures.push((name, texture.clone()));
            texture
        });
        // Exporters write a grey or black Kd beside a texture without meaning to darken it.
        let [r, g, b] = match (material.diffuse, &texture) {
            (_, Some(_)) => [1.0; 3],
            (Some(kd), None) => kd.map(|c| if c.is_finite() { c.clamp(0.0, 1.0) } else { 0.5 }),
            (None, None) => [0.5; 3],
        };
        materials.push(Material { name: material.name, base_colour: [r, g, b, 1.0], texture, gloss: 0.0 });
    }
}

/// The lines that matter here, in `tobj`'s spelling: it gives up on a whole file for one odd line elsewhere.
fn wanted_lines(text: &str) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let line = line.trim();
        let (keyword, value) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let keyword = match keyword.to_ascii_lowercase().as_str() {
            "newmtl" => "newmtl",
            "kd" if value.split_whitespace().filter(|w| w.parse::<f32>().is_ok()).count() >= 3 => "Kd",
            "map_kd" => "map_Kd",
            _ => continue,
        };
        if !value.trim().is_empty() {
            out.extend([keyword, " ", value.trim(), "\n"]);
        }
    }
    out
}

/// The file name in a `map_Kd` value, which may begin with options and hold spaces.
fn texture_name(value: &str) -> String {
    let mut rest = value.trim();
    while rest.starts_with('-') {
        let (option, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        let (most, numeric) = match option {
            "-o" | "-s" | "-t" => (3, true),
            "-mm" => (2, true),
            "-bm" | "-boost" | "-texres" => (1, true),
            "-blendu" | "-blendv" | "-cc" | "-clamp" | "-imfchan" | "-type" => (1, false),
            _ => break,
        };
        rest = after.trim_start();
        for _ in 0..most {
            let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
            if numeric && word.parse::<f32>().is_err() {
                break;
            }
            rest = after.trim_start();
        }
    }
    rest.trim().to_owned()
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values pass through unchanged")]
mod tests {
    use super::*;

    #[test]
    fn texture_names_with_options_and_spaces() {
        assert_eq!(texture_name("face.jpg"), "face.jpg");
        assert_eq!(texture_name("my face.jpg"), "my face.jpg");
        assert_eq!(texture_name("-s 1 1 1 -o 0.5 0 my face.jpg"), "my face.jpg");
        assert_eq!(texture_name("-blendu on -mm 0 1 -clamp off  a b.png"), "a b.png");
        assert_eq!(texture_name("-odd name.png"), "-odd name.png");
    }

    #[test]
    fn odd_lines_do_not_spoil_the_rest() {
        let mut materials = Vec::new();
        let text =
            b"\xff# cp1252\nnewmtl my skin\nKd 1 0.5 0\nd\nmap_Ka\nTr x\nnewmtl b\nKd spectral x.rfl\n";
        parse_library(text, Path::new("/nonexistent/x.mtl"), &mut materials);
        assert_eq!(materials.len(), 2);
        assert_eq!(materials[0].name, "my skin");
        assert_eq!(materials[0].base_colour, [1.0, 0.5, 0.0, 1.0]);
    }
}
