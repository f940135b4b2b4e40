//! Wavefront OBJ.
//!
//! Read here rather than through `tobj`, which gives every distinct v/vt/vn corner a vertex of its own: that
//! renumbers the vertices, and point caches written for this scan would no longer fit it.
//!
//! Kept: `v` (with colours as `x y z r g b`, or a fourth number, which is ignored), `vt`, `f` in every form with
//! negative indices, n-gons as triangle fans, `usemtl`, `mtllib`. Everything else is passed over.

use std::path::Path;

use nalgebra::Point3;

use super::error::Fault;
use super::mesh::Mesh;
use super::mtl;
use super::validate::{MAX_TRIANGLES, MAX_VERTICES, check_count};

/// Stands for a face corner without texture coordinate until the file is read.
const NO_UV: u32 = u32::MAX;

/// More `mtllib` names than this are refused.
const MAX_LIBRARIES: usize = 100;

const DECIMAL_POINT: &str = "Export the file again, with a point as the decimal mark";

/// Reads an OBJ; `path` leads to its material file and textures.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<Mesh, Fault> {
    let mut reader = Reader::default();
    let end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    let mut joined = Vec::new();
    for (number, raw) in bytes.split(|b| *b == end).enumerate() {
        let line = raw.trim_ascii();
        if joined.is_empty() && line.first().is_none_or(|b| *b == b'#') {
            continue;
        }
        if let Some(part) = line.strip_suffix(b"\\") {
            joined.extend_from_slice(part);
            joined.push(b' ');
        } else if joined.is_empty() {
            reader.line(line).map_err(|fault| at_line(&fault, number))?;
        } else {
            joined.extend_from_slice(line);
            reader.line(&joined).map_err(|fault| at_line(&fault, number))?;
            joined.clear();
        }
    }
    reader.line(&joined)?;
    Ok(reader.finish(path))
}

fn at_line(fault: &Fault, number: usize) -> Fault {
    Fault::new(format!("line {}: {}", number + 1, fault.reason), fault.remedy)
}

#[derive(Default)]
struct Reader {
    mesh: Mesh,
    libraries: Vec<String>,
    /// Material names in the order of their first use; `mesh.triangle_materials` counts in these until the end.
    materials: Vec<String>,
    /// The material in force, or none yet.
    current: Option<u32>,
    /// Triangles that came before the first `usemtl`.
    unnamed: usize,
    coloured: bool,
    short_faces: usize,
    corners: Vec<[u32; 2]>,
}

impl Reader {
    fn line(&mut self, line: &[u8]) -> Result<(), Fault> {
        let mut words =
            line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).take_while(|w| w[0] != b'#');
        let Some(keyword) = words.next() else { return Ok(()) };
        match keyword {
            b"v" => self.vertex(words),
            b"vt" => self.texture_coordinate(words),
            b"f" => self.face(words),
            b"usemtl" => self.use_material(rest(line, keyword)),
            b"mtllib" => self.use_library(rest(line, keyword)),
            _ => Ok(()),
        }
    }

    fn vertex<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>) -> Result<(), Fault> {
        check_count("vertices", self.mesh.positions.len() + 1, MAX_VERTICES)?;
        let mut values = [0.0; 6];
        let mut count = 0;
        for (value, word) in values.iter_mut().zip(words) {
            *value = number(word)?;
            count += 1;
        }
        if count < 3 {
            return Err(Fault::corrupt(format!("a vertex needs 3 coordinates, found {count}")));
        }
        let [x, y, z, r, g, b] = values;
        if count == 6 {
            if !self.coloured {
                self.coloured = true;
                self.mesh.colours.resize(self.mesh.positions.len(), [1.0; 3]);
            }
            self.mesh.colours.push([r as f32, g as f32, b as f32]);
        } else if self.coloured {
            self.mesh.colours.push([1.0; 3]);
        }
        self.mesh.positions.push(Point3::new(x, y, z));
        Ok(())
    }

    fn texture_coordinate<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>) -> Result<(), Fault> {
        check_count("texture coordinates", self.mesh.uvs.len() + 1, MAX_TRIANGLES)?;
        let mut uv = [0.0; 2];
        for (value, word) in uv.iter_mut().zip(words) {
            *value = number(word)? as f32;
        }
        self.mesh.uvs.push(uv);
        Ok(())
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>) -> Result<(), Fault> {
        self.corners.clear();
        for word in words {
            let mut parts = word.split(|b| *b == b'/');
            let v = index(parts.next().unwrap_or_default(), self.mesh.positions.len())?;
            let vt = match parts.next() {
                None | Some([]) => NO_UV,
                Some(part) => index(part, self.mesh.uvs.len())?,
            };
            self.corners.push([v, vt]);
        }
        if self.corners.len() < 3 {
            self.short_faces += 1;
            return Ok(());
        }
        check_count("triangles", self.mesh.triangles.len() + self.corners.len() - 2, MAX_TRIANGLES)?;
        let [a, at] = self.corners[0];
        for pair in self.corners[1..].windows(2) {
            let ([b, bt], [c, ct]) = (pair[0], pair[1]);
            self.mesh.triangles.push([a, b, c]);
            self.mesh.uv_triangles.push([at, bt, ct]);
            self.mesh.triangle_materials.push(self.current.unwrap_or(0));
            self.unnamed += usize::from(self.current.is_none());
        }
        Ok(())
    }

    fn use_material(&mut self, name: String) -> Result<(), Fault> {
        let place = self.materials.iter().rposition(|m| *m == name).unwrap_or(self.materials.len());
        if place == self.materials.len() {
            check_count("materials", place + 1, mtl::MAX_MATERIALS)?;
            self.materials.push(name);
        }
        self.current = Some(place as u32);
        Ok(())
    }

    fn use_library(&mut self, name: String) -> Result<(), Fault> {
        if !self.libraries.contains(&name) {
            check_count("material files", self.libraries.len() + 1, MAX_LIBRARIES)?;
            self.libraries.push(name);
        }
        Ok(())
    }

    fn finish(mut self, path: &Path) -> Mesh {
        let shown = path.display();
        if self.short_faces > 0 {
            tracing::warn!(path = %shown, count = self.short_faces, "passed over faces with fewer than 3 corners");
        }
        let mesh = &mut self.mesh;
        let textured = mesh.uv_triangles.iter().flatten().any(|i| *i != NO_UV);
        if textured {
            let missing = mesh.uvs.len() as u32;
            let mut used = false;
            for i in mesh.uv_triangles.iter_mut().flatten().filter(|i| **i == NO_UV) {
                *i = missing;
                used = true;
            }
            if used {
                mesh.uvs.push([0.0; 2]);
            }
        } else {
            mesh.uv_triangles.clear();
        }
        scale_byte_colours(&mut mesh.colours);
        let unnamed = self.unnamed.min(mesh.triangles.len());
        let found = mtl::resolve(path, &self.libraries, &self.materials, unnamed > 0, textured);
        if found.materials.len() > 1 {
            let (before, after) = mesh.triangle_materials.split_at_mut(unnamed);
            before.fill(found.unnamed);
            for m in after {
                *m = found.named.get(*m as usize).copied().unwrap_or(found.unnamed);
            }
        } else {
            mesh.triangle_materials.clear();
        }
        mesh.materials = found.materials;
        self.mesh
    }
}

/// Some exporters write colours as 0..=255.
pub(super) fn scale_byte_colours(colours: &mut [[f32; 3]]) {
    let bytes = colours.iter().flatten().any(|c| *c > 1.5);
    for c in colours.iter_mut().flatten() {
        *c = if bytes { *c / 255.0 } else { *c }.clamp(0.0, 1.0);
    }
}

/// What follows the keyword, which may hold spaces.
fn rest(line: &[u8], keyword: &[u8]) -> String {
    String::from_utf8_lossy(line.trim_ascii().get(keyword.len()..).unwrap_or_default()).trim().to_owned()
}

fn number(word: &[u8]) -> Result<f64, Fault> {
    let parsed = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
    parsed.ok_or_else(|| Fault::new(format!("{:?} is not a number", shown(word)), DECIMAL_POINT))
}

/// The zero-based index that `word` means after `count` entries; OBJ counts from 1, or backwards from −1.
///
/// Whether a forward reference is ever met is for [`Mesh::validate`] to say.
fn index(word: &[u8], count: usize) -> Result<u32, Fault> {
    let parsed: Option<i64> = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
    let absolute = match parsed {
        Some(i) if i > 0 => Some(i - 1),
        Some(i) if i < 0 => (count as i64).checked_add(i),
        _ => None,
    };
    absolute.and_then(|i| u32::try_from(i).ok()).filter(|i| *i != NO_UV).ok_or_else(|| {
        let word = shown(word);
        Fault::corrupt(format!(
            "{word:?} is no usable index; there are {count} entries so far, counted from 1"
        ))
    })
}

/// A word for a message, cut short.
fn shown(word: &[u8]) -> String {
    String::from_utf8_lossy(&word[..word.len().min(40)]).into_owned()
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values pass through unchanged")]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Mesh, Fault> {
        read(text.as_bytes(), Path::new("/nonexistent/x.obj"))
    }

    #[test]
    fn keeps_vertex_order_whatever_the_faces_say() {
        let mesh =
            parse("v 9 9 9\nv 0 0 0\nv 1e0 0 0\nv 1 1 0\nv 0 1 0\nf 5 4 3\nf 2/1/1 3/2 4//7\nvt 0 0\nvt 1 0")
                .unwrap();
        assert_eq!(mesh.positions.len(), 5);
        assert_eq!(mesh.positions[0].x, 9.0);
        assert_eq!(mesh.triangles, [[4, 3, 2], [1, 2, 3]]);
        // The corners without texture coordinate share one that is appended.
        assert_eq!(mesh.uv_triangles, [[2, 2, 2], [0, 1, 2]]);
        assert_eq!(mesh.uvs, [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]]);
    }

    #[test]
    fn negative_indices_ngons_continuations_and_carriage_returns() {
        let mesh = parse(
            "# c \\\r\nv 0 0 0\r\nv 1 0 0 # here\r\nv 1 1 0\r\nv 0 1 \\\r\n0\r\nf -4 -3 \\\r\n -2 -1\r\n",
        )
        .unwrap();
        assert_eq!(mesh.positions.len(), 4);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        let mac = parse("v 0 0 0\rv 1 0 0\rv 1 1 0\rf 1 2 3").unwrap();
        assert_eq!(mac.triangles.len(), 1);
    }

    #[test]
    fn colours_and_the_fourth_coordinate() {
        let mesh = parse("v 0 0 0 1.0\nv 1 0 0 255 0 0\nv 1 1 0\nf 1 2 3").unwrap();
        assert_eq!(mesh.colours.len(), 3);
        assert_eq!(mesh.colours[1], [1.0, 0.0, 0.0]);
        assert_eq!(parse("v 0 0 0 1\nv 1 0 0 1\nv 1 1 0 1\nf 1 2 3").unwrap().colours.len(), 0);
    }

    #[test]
    fn errors_name_the_line() {
        assert!(
            parse("v 0 0 0\nv 0 0,5 1").unwrap_err().reason.starts_with("line 2: \"0,5\" is not a number")
        );
        assert!(parse("v 0 0 0\nf 0 1 1").unwrap_err().reason.contains("line 2"));
        assert!(parse("v 0 0 0\nf -2 1 1").unwrap_err().reason.contains("no usable index"));
        assert!(parse("v 0 0\n").unwrap_err().reason.contains("3 coordinates, found 2"));
    }

    #[test]
    fn materials_before_the_first_name_are_grey() {
        let mesh = parse("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nusemtl my skin\nf 2 3 1\nusemtl b\nf 3 2 1\n")
            .unwrap();
        let names: Vec<&str> = mesh.materials.iter().map(|m| m.name.as_str()).collect();
        assert_eq!(names, ["my skin", "b", "default"]);
        assert_eq!(mesh.triangle_materials, [2, 0, 1]);
    }
}
