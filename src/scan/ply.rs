//! PLY through `ply-rs-bw`, ascii and both binaries.
//!
//! The header's counts are held against the file's length first, since the parser takes them at their word.
//! Kept: positions, vertex colours, texture coordinates by vertex or by face corner (MeshLab's `texcoord` lists),
//! faces as triangle fans, and the first `comment TextureFile` or `comment texture file`.

use std::io::Cursor;
use std::path::Path;

use nalgebra::Point3;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};

use super::error::Fault;
use super::mesh::{Material, Mesh, Texture};
use super::obj::scale_byte_colours;
use super::texture::folder_of;
use super::validate::{MAX_TRIANGLES, MAX_VERTICES, check_count};

/// A header longer than this is none.
const MAX_HEADER: usize = 1 << 20;

/// Reads a PLY; `path` leads to its texture.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<Mesh, Fault> {
    if !bytes.starts_with(b"ply") {
        return Err(Fault::corrupt("it does not begin with \"ply\""));
    }
    let head = &bytes[..bytes.len().min(MAX_HEADER)];
    if !head.windows(10).any(|w| w == b"end_header") {
        return Err(Fault::corrupt("its header has no end"));
    }
    let mut reader = Reader::new(Cursor::new(bytes));
    let header = Parser::<Skipped>::new().read_header(&mut reader).map_err(|e| parse_fault(&e))?;
    let body = bytes.len().saturating_sub(reader.get_ref().position() as usize);
    check_sizes(&header, body)?;

    let mut mesh = Mesh::default();
    for (name, element) in &header.elements {
        match name.as_str() {
            "vertex" | "vertices" => read_vertices(&mut reader, element, &header, &mut mesh)?,
            "face" | "faces" => read_faces(&mut reader, element, &header, &mut mesh)?,
            _ => {
                let parser = Parser::<Skipped>::new();
                parser
                    .read_payload_for_element(&mut reader, element, &header)
                    .map_err(|e| parse_fault(&e))?;
            }
        }
    }
    if mesh.uv_triangles.is_empty() && !mesh.uvs.is_empty() {
        mesh.uv_triangles.clone_from(&mesh.triangles);
    }
    if let Some(texture) =
        texture_name(&header.comments).and_then(|name| Texture::load(&folder_of(path), name))
    {
        mesh.materials = vec![Material::textured(texture)];
    }
    Ok(mesh)
}

fn parse_fault(error: &ply_rs_bw::parser::ParseError) -> Fault {
    // The parser quotes whole lines; one line of message is enough.
    let text: String = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    Fault::corrupt(text.chars().take(300).collect::<String>())
}

fn texture_name(comments: &[String]) -> Option<&str> {
    comments.iter().find_map(|comment| {
        let comment = comment.trim();
        let lower = comment.to_ascii_lowercase();
        let keyword = ["texturefile", "texture file"].into_iter().find(|k| lower.starts_with(k))?;
        comment.get(keyword.len()..).map(str::trim).filter(|name| !name.is_empty())
    })
}

/// Refuses counts beyond the limits or beyond what `body` bytes can hold.
fn check_sizes(header: &Header, body: usize) -> Result<(), Fault> {
    let mut least = 0_usize;
    for (name, element) in &header.elements {
        match name.as_str() {
            "vertex" | "vertices" => check_count("vertices", element.count, MAX_VERTICES)?,
            "face" | "faces" => check_count("faces", element.count, MAX_TRIANGLES)?,
            _ => {}
        }
        let each: usize = match header.encoding {
            // A digit and a separator each.
            Encoding::Ascii => 2 * element.properties.len(),
            _ => element.properties.values().map(|p| least_bytes(&p.data_type)).sum(),
        };
        least = element
            .count
            .checked_mul(each.max(1))
            .and_then(|n| n.checked_add(least))
            .filter(|n| *n <= body.saturating_add(1))
            .ok_or_else(|| {
                let count = element.count;
                Fault::corrupt(format!(
                    "it announces {count} of {name:?}, more than its {body} bytes can hold"
                ))
            })?;
    }
    Ok(())
}

fn least_bytes(kind: &PropertyType) -> usize {
    match kind {
        PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => match scalar {
            ScalarType::Char | ScalarType::UChar => 1,
            ScalarType::Short | ScalarType::UShort => 2,
            ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
            ScalarType::Double => 8,
        },
    }
}

type Source<'a> = Reader<Cursor<&'a [u8]>>;

fn read_vertices(
    reader: &mut Source,
    element: &ElementDef,
    header: &Header,
    mesh: &mut Mesh,
) -> Result<(), Fault> {
    let has = |names: &[&str]| names.iter().any(|n| element.properties.contains_key(*n));
    if !(has(&["x"]) && has(&["y"]) && has(&["z"])) {
        return Err(Fault::corrupt("its vertices have no x, y and z"));
    }
    let parser = Parser::<Vertex>::new();
    let vertices = parser.read_payload_for_element(reader, element, header).map_err(|e| parse_fault(&e))?;
    mesh.positions = vertices.iter().map(|v| Point3::from(v.position)).collect();
    if has(RED) && has(GREEN) && has(BLUE) {
        mesh.colours = vertices.iter().map(|v| v.colour).collect();
        scale_byte_colours(&mut mesh.colours);
    }
    if has(U) && has(V) {
        mesh.uvs = vertices.iter().map(|v| v.uv).collect();
    }
    Ok(())
}

fn read_faces(
    reader: &mut Source,
    element: &ElementDef,
    header: &Header,
    mesh: &mut Mesh,
) -> Result<(), Fault> {
    let faces = Parser::<Face>::new()
        .read_payload_for_element(reader, element, header)
        .map_err(|e| parse_fault(&e))?;
    let by_corner = faces.iter().any(|f| f.uvs.len() >= 6);
    if by_corner {
        // What the corners say goes before what the vertices say.
        mesh.uvs.clear();
    }
    for (number, face) in faces.iter().enumerate() {
        let n = face.corners.len();
        if let Some(wrong) = face.corners.iter().find(|i| u32::try_from(**i).is_err()) {
            return Err(Fault::corrupt(format!("face {number} (counted from 0) refers to vertex {wrong}")));
        }
        if n < 3 {
            continue;
        }
        check_count("triangles", mesh.triangles.len() + n - 2, MAX_TRIANGLES)?;
        let first_uv = mesh.uvs.len() as u32;
        if by_corner {
            check_count("texture coordinates", mesh.uvs.len() + n, 3 * MAX_TRIANGLES)?;
            let at = |k: usize| face.uvs.get(k).copied().unwrap_or(0.0);
            mesh.uvs.extend((0..n).map(|k| [at(2 * k), at(2 * k + 1)]));
        }
        for k in 1..n - 1 {
            let corners = [0, k, k + 1];
            mesh.triangles.push(corners.map(|c| face.corners[c] as u32));
            if by_corner {
                mesh.uv_triangles.push(corners.map(|c| first_uv + c as u32));
            }
        }
    }
    Ok(())
}

const RED: &[&str] = &["red", "r", "diffuse_red"];
const GREEN: &[&str] = &["green", "g", "diffuse_green"];
const BLUE: &[&str] = &["blue", "b", "diffuse_blue"];
const U: &[&str] = &["s", "u", "texture_u", "texture_s"];
const V: &[&str] = &["t", "v", "texture_v", "texture_t"];

struct Vertex {
    position: [f64; 3],
    colour: [f32; 3],
    uv: [f32; 2],
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self { position: [0.0; 3], colour: [0.0; 3], uv: [0.0; 2] }
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        let Some(number) = scalar(&value) else { return PropertyAccessResult::Ignored };
        let places = [("x", 0), ("y", 1), ("z", 2)];
        if let Some((_, axis)) = places.into_iter().find(|(n, _)| *n == name) {
            self.position[axis] = number;
        } else if let Some(channel) = [RED, GREEN, BLUE].iter().position(|names| names.contains(&name)) {
            let whole = match value {
                Property::UChar(_) => 255.0,
                Property::UShort(_) => 65_535.0,
                _ => 1.0,
            };
            self.colour[channel] = (number / whole) as f32;
        } else if let Some(axis) = [U, V].iter().position(|names| names.contains(&name)) {
            self.uv[axis] = number as f32;
        }
        PropertyAccessResult::Set
    }
}

struct Face {
    corners: Vec<i64>,
    uvs: Vec<f32>,
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self { corners: Vec::new(), uvs: Vec::new() }
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        match name {
            "vertex_indices" | "vertex_index" => match indices(value) {
                Some(corners) => self.corners = corners,
                None => return PropertyAccessResult::UnsupportedType,
            },
            "texcoord" => match value {
                Property::ListFloat(list) => self.uvs = list,
                Property::ListDouble(list) => self.uvs = list.into_iter().map(|c| c as f32).collect(),
                _ => {}
            },
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

/// An element that is read past.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }

    fn set_property(&mut self, _: &str, _: Property) -> PropertyAccessResult {
        PropertyAccessResult::Ignored
    }
}

fn scalar(value: &Property) -> Option<f64> {
    Some(match *value {
        Property::Char(n) => f64::from(n),
        Property::UChar(n) => f64::from(n),
        Property::Short(n) => f64::from(n),
        Property::UShort(n) => f64::from(n),
        Property::Int(n) => f64::from(n),
        Property::UInt(n) => f64::from(n),
        Property::Float(n) => f64::from(n),
        Property::Double(n) => n,
        _ => return None,
    })
}

fn indices(value: Property) -> Option<Vec<i64>> {
    fn widen<T: Into<i64>>(list: Vec<T>) -> Vec<i64> {
        list.into_iter().map(Into::into).collect()
    }
    Some(match value {
        Property::ListChar(list) => widen(list),
        Property::ListUChar(list) => widen(list),
        Property::ListShort(list) => widen(list),
        Property::ListUShort(list) => widen(list),
        Property::ListInt(list) => widen(list),
        Property::ListUInt(list) => widen(list),
        _ => return None,
    })
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values pass through unchanged")]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Mesh, Fault> {
        read(text.as_bytes(), Path::new("/nonexistent/x.ply"))
    }

    const HEAD: &str = "ply\nformat ascii 1.0\ncomment TextureFile missing.png\nelement vertex 4\n\
        property double x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n\
        property uchar blue\nproperty float s\nproperty float t\nelement face 1\n";
    const VERTICES: &str = "0 0 0 255 0 0 0 0\n1 0 0 0 255 0 1 0\n1 1 0 0 0 255 1 1\n0 1 0 0 0 0 0 1\n";

    #[test]
    fn colours_texture_coordinates_and_fans() {
        let mesh = parse(&format!(
            "{HEAD}property list uchar short vertex_index\nend_header\n{VERTICES}4 0 1 2 3\n"
        ))
        .unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.uv_triangles, mesh.triangles);
        assert_eq!(mesh.colours[1], [0.0, 1.0, 0.0]);
        assert_eq!(mesh.uvs[2], [1.0, 1.0]);
    }

    #[test]
    fn corner_texture_coordinates_win() {
        let lists =
            "property list uchar uint vertex_indices\nproperty list uchar float texcoord\nend_header\n";
        let mesh = parse(&format!("{HEAD}{lists}{VERTICES}3 0 1 2 6 0 0 0.5 0 0.5 0.5\n")).unwrap();
        assert_eq!(mesh.uvs, [[0.0, 0.0], [0.5, 0.0], [0.5, 0.5]]);
        assert_eq!(mesh.uv_triangles, [[0, 1, 2]]);
    }

    #[test]
    fn huge_counts_are_refused_before_they_are_believed() {
        for count in ["3999999", "4000001", "18446744073709551615"] {
            let text = format!(
                "ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
            );
            assert!(parse(&text).is_err());
        }
        let text = "ply\nformat binary_little_endian 1.0\nelement nothing 99999999999\nend_header\n";
        assert!(parse(text).unwrap_err().reason.contains("more than its 0 bytes can hold"));
    }

    #[test]
    fn texture_comments() {
        assert_eq!(texture_name(&["VCGLIB".into(), "TextureFile my face.png".into()]), Some("my face.png"));
        assert_eq!(texture_name(&["texture file: nothing".into()]), Some(": nothing"));
        assert_eq!(texture_name(&["TextureFile ".into()]), None);
    }

    #[test]
    fn negative_corners_and_float_lists_are_errors() {
        let face = "property list uchar int vertex_indices\nend_header\n";
        assert!(
            parse(&format!("{HEAD}{face}{VERTICES}3 0 1 -2\n")).unwrap_err().reason.contains("vertex -2")
        );
        let face = "property list uchar float vertex_indices\nend_header\n";
        assert!(parse(&format!("{HEAD}{face}{VERTICES}3 0 1 2\n")).is_err());
    }
}
