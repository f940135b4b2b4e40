//! STL through `stl_io`.
//!
//! An STL has no vertices of its own, only corners. Corners with the same bits are one vertex, numbered by first
//! appearance: that is `stl_io`'s rule, and as stable as the file.

use std::io::Cursor;

use nalgebra::Point3;

use super::error::Fault;
use super::mesh::Mesh;
use super::validate::{MAX_TRIANGLES, MAX_VERTICES, check_count};

/// Bytes before the triangles of a binary STL, and for each of them.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Reads an ascii or binary STL.
pub(super) fn read(bytes: &[u8]) -> Result<Mesh, Fault> {
    let announced =
        bytes.get(HEADER - 4..HEADER).and_then(|b| b.try_into().ok()).map(|b| u32::from_le_bytes(b) as usize);
    let binary_size = announced.and_then(|count| count.checked_mul(TRIANGLE)?.checked_add(HEADER));
    let solid = bytes.trim_ascii_start().starts_with(b"solid");
    let exact = binary_size == Some(bytes.len());
    let indexed = if solid && !exact {
        let facets =
            bytes.split(|b| *b == b'\n').filter(|l| l.trim_ascii_start().starts_with(b"facet")).count();
        check_count("triangles", facets, MAX_TRIANGLES)?;
        // `stl_io` knows an ascii file by "solid " on its first line; not every exporter writes that space.
        let text = bytes.trim_ascii_start();
        let body = text.get(5..).unwrap_or_default();
        if body.first() == Some(&b' ') && text.len() == bytes.len() {
            stl_io::read_stl(&mut Cursor::new(bytes))
        } else {
            stl_io::read_stl(&mut Cursor::new([b"solid ", body].concat()))
        }
    } else {
        let count = announced
            .ok_or_else(|| Fault::corrupt(format!("{} bytes are too few for any STL", bytes.len())))?;
        check_count("triangles", count, MAX_TRIANGLES)?;
        if binary_size.is_none_or(|size| size > bytes.len()) {
            let room = (bytes.len() - HEADER) / TRIANGLE;
            return Err(Fault::corrupt(format!("it announces {count} triangles but has room for {room}")));
        }
        if solid {
            // A binary file whose comment begins with "solid" would pass for ascii.
            stl_io::read_stl(&mut Cursor::new([b"binary", &bytes[6..]].concat()))
        } else {
            stl_io::read_stl(&mut Cursor::new(bytes))
        }
    };
    let indexed = indexed.map_err(|error| Fault::corrupt(error.to_string()))?;
    check_count("vertices", indexed.vertices.len(), MAX_VERTICES)?;
    check_count("triangles", indexed.faces.len(), MAX_TRIANGLES)?;
    Ok(Mesh {
        positions: indexed
            .vertices
            .iter()
            .map(|v| Point3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2])))
            .collect(),
        // In range: the vertices were just counted.
        triangles: indexed.faces.iter().map(|f| f.vertices.map(|i| i as u32)).collect(),
        ..Mesh::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn binary(comment: &[u8], count: u32, triangles: &[[f32; 9]]) -> Vec<u8> {
        let mut out = comment.to_vec();
        out.resize(80, 0);
        out.extend(count.to_le_bytes());
        for t in triangles {
            out.extend([0.0_f32, 0.0, 1.0].iter().chain(t).flat_map(|c| c.to_le_bytes()));
            out.extend([0, 0]);
        }
        out
    }

    const TWO: [[f32; 9]; 2] =
        [[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]];

    #[test]
    fn equal_corners_become_one_vertex() {
        for comment in [&b"made by hand"[..], b"solid but binary"] {
            let mesh = read(&binary(comment, 2, &TWO)).unwrap();
            assert_eq!(mesh.positions.len(), 4);
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        }
    }

    #[test]
    fn announced_counts_are_checked_against_the_length() {
        let fault = read(&binary(b"", u32::MAX, &TWO)).unwrap_err();
        assert!(fault.reason.contains("at most 16000000"), "{fault:?}");
        let fault = read(&binary(b"", 3, &TWO)).unwrap_err();
        assert!(fault.reason.contains("announces 3 triangles but has room for 2"), "{fault:?}");
    }

    #[test]
    fn ascii_without_a_name() {
        let facet =
            "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
        for head in ["solid\n", "solid x\n", "solid\r\n", " solid y\n"] {
            let mesh = read(format!("{head}{facet}endsolid\n").as_bytes()).unwrap();
            assert_eq!(mesh.triangles, [[0, 1, 2]], "{head:?}");
        }
    }
}
