//! Bosphorus' `.bnt`: a range image of rows × columns points with texture coordinates.
//!
//! Little-endian: u16 rows, u16 columns, f64 background depth, u16 length and bytes of the texture's file name, u32
//! 5 · rows · columns, then five f64 arrays of rows · columns numbers each: x, y, z and the texture coordinates a, b in
//! 0..=1. Points at the background depth are no points. Neighbouring points become triangles, not across jumps.

use std::path::Path;

use nalgebra::{Point3, Vector3};

use super::error::Fault;
use super::mesh::{Material, Mesh, Texture};
use super::texture::folder_of;
use super::validate::{MAX_COORDINATE, MAX_TRIANGLES, MAX_VERTICES, check_count};

/// Bytes before the texture's name.
const HEADER: usize = 14;
/// An edge longer than this many median ones spans a jump from one surface to another.
const JUMP: f64 = 12.0;

/// Reads a range image; its vertices are the points that are not background, in the file's order.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<Mesh, Fault> {
    let image = RangeImage::parse(bytes)?;
    let mut mesh = image.mesh()?;
    if let Some(texture) = image.texture(path) {
        mesh.materials = vec![Material::textured(texture)];
    }
    Ok(mesh)
}

struct RangeImage<'a> {
    rows: usize,
    columns: usize,
    background: f64,
    image_name: String,
    /// 5 × rows · columns numbers.
    data: &'a [u8],
}

impl<'a> RangeImage<'a> {
    fn parse(bytes: &'a [u8]) -> Result<Self, Fault> {
        let cut = || Fault::corrupt(format!("{} bytes are too few for its header", bytes.len()));
        let u16_at = |at: usize| Some(usize::from(u16::from_le_bytes(*bytes.get(at..)?.first_chunk()?)));
        let f64_at = |at: usize| Some(f64::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
        let (rows, columns) = u16_at(0).zip(u16_at(2)).ok_or_else(cut)?;
        let (background, length) = f64_at(4).zip(u16_at(12)).ok_or_else(cut)?;
        let name = bytes.get(HEADER..HEADER + length).ok_or_else(cut)?;
        let rest = bytes.get(HEADER + length..).unwrap_or_default();
        let announced: [u8; 4] = *rest.first_chunk().ok_or_else(cut)?;
        let (announced, points) = (u32::from_le_bytes(announced) as usize, rows * columns);
        if announced != 5 * points {
            return Err(Fault::corrupt(format!(
                "{rows} x {columns} points need {} numbers, but it announces {announced}",
                5 * points
            )));
        }
        let data = &rest[4..];
        if data.len() < 8 * announced {
            return Err(Fault::corrupt(format!(
                "it announces {announced} numbers but has room for {}",
                data.len() / 8
            )));
        }
        check_count("points", points, MAX_VERTICES.min(MAX_TRIANGLES / 2))?;
        let end = name.iter().position(|byte| *byte == 0).unwrap_or(name.len());
        let image_name = String::from_utf8_lossy(&name[..end]).trim().to_owned();
        Ok(Self { rows, columns, background, image_name, data })
    }

    /// The number of a point in one of the five arrays.
    fn value(&self, array: usize, point: usize) -> f64 {
        let at = 8 * (array * self.rows * self.columns + point);
        self.data.get(at..).and_then(|rest| rest.first_chunk()).map_or(f64::NAN, |b| f64::from_le_bytes(*b))
    }

    /// The point's place, unless it is background.
    fn place(&self, point: usize) -> Option<Point3<f64>> {
        let [x, y, z] = [0, 1, 2].map(|array| self.value(array, point));
        let seen = [x, y, z].iter().all(|c| c.abs() < MAX_COORDINATE && !self.is_background(*c));
        seen.then(|| Point3::new(x, y, z))
    }

    fn is_background(&self, value: f64) -> bool {
        (value - self.background).abs() <= 1e-9 * self.background.abs()
    }

    fn mesh(&self) -> Result<Mesh, Fault> {
        let mut mesh = Mesh::default();
        let mut numbers = vec![None; self.rows * self.columns];
        for (point, number) in numbers.iter_mut().enumerate() {
            if let Some(place) = self.place(point) {
                *number = Some(mesh.positions.len() as u32);
                mesh.positions.push(place);
                let [a, b] = [3, 4].map(|array| self.value(array, point));
                let [a, b] = [a, b].map(|c| if (-10.0..=10.0).contains(&c) { c as f32 } else { 0.0 });
                mesh.uvs.push([a, b]);
            }
        }
        if mesh.positions.is_empty() {
            return Err(Fault::new("all its points are background", "Choose another scan"));
        }
        let candidates = self.triangles(&numbers, &mesh.positions);
        let longest = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            (a - b).norm().max((b - c).norm()).max((c - a).norm())
        };
        let mut lengths: Vec<f64> = candidates.iter().map(longest).collect();
        lengths.sort_unstable_by(f64::total_cmp);
        let limit = lengths.get(lengths.len() / 2).map_or(0.0, |median| JUMP * median);
        mesh.triangles = candidates.into_iter().filter(|t| longest(t) <= limit).collect();
        face_the_viewer(&mut mesh);
        upright(&mut mesh);
        mesh.uv_triangles.clone_from(&mesh.triangles);
        Ok(mesh)
    }

    /// Two triangles for every four neighbours, cut along the shorter diagonal; one for every three.
    fn triangles(&self, numbers: &[Option<u32>], places: &[Point3<f64>]) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        for row in 1..self.rows {
            for column in 1..self.columns {
                let at = |r: usize, c: usize| numbers[(row - r) * self.columns + column - c];
                let corners = [at(1, 1), at(1, 0), at(0, 0), at(0, 1)];
                if let [Some(a), Some(b), Some(c), Some(d)] = corners {
                    let length = |p: u32, q: u32| (places[p as usize] - places[q as usize]).norm_squared();
                    if length(a, c) <= length(b, d) {
                        triangles.extend([[a, b, c], [a, c, d]]);
                    } else {
                        triangles.extend([[a, b, d], [b, c, d]]);
                    }
                } else if let [a, b, c] = corners.into_iter().flatten().collect::<Vec<_>>()[..] {
                    triangles.push([a, b, c]);
                }
            }
        }
        triangles
    }

    /// The image that the file names, or one with the file's own stem.
    fn texture(&self, path: &Path) -> Option<std::sync::Arc<Texture>> {
        let folder = folder_of(path);
        let named = super::texture::locate(&folder, &self.image_name).is_some();
        named.then(|| Texture::load(&folder, &self.image_name)).flatten().or_else(|| Texture::beside(path))
    }
}

/// Turns the triangles over if most of them look along −z: depth grows towards the viewer, whatever the rows' order.
fn face_the_viewer(mesh: &mut Mesh) {
    let normal = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        (b - a).cross(&(c - a))
    };
    if mesh.triangles.iter().map(normal).sum::<Vector3<f64>>().z < 0.0 {
        for triangle in &mut mesh.triangles {
            triangle.swap(1, 2);
        }
    }
}

/// Lets v grow upwards with y, since files differ in where they count b from.
fn upright(mesh: &mut Mesh) {
    let count = mesh.positions.len().max(1) as f64;
    let mean_y = mesh.positions.iter().map(|p| p.y).sum::<f64>() / count;
    let mean_v = mesh.uvs.iter().map(|uv| f64::from(uv[1])).sum::<f64>() / count;
    let both = mesh.positions.iter().zip(&mesh.uvs);
    if both.map(|(p, uv)| (p.y - mean_y) * (f64::from(uv[1]) - mean_v)).sum::<f64>() < 0.0 {
        for uv in &mut mesh.uvs {
            uv[1] = 1.0 - uv[1];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slope of rows × columns points, 1 apart; `hole` is background, `down` counts b from the top.
    fn file(rows: u16, columns: u16, hole: Option<usize>, down: bool) -> Vec<u8> {
        let (zmin, points) = (-1e9_f64, usize::from(rows) * usize::from(columns));
        let mut out = [rows.to_le_bytes(), columns.to_le_bytes()].concat();
        out.extend(zmin.to_le_bytes());
        out.extend(4_u16.to_le_bytes());
        out.extend(b"none");
        out.extend(((5 * points) as u32).to_le_bytes());
        for array in 0..5 {
            for point in 0..points {
                let (row, column) = (point / usize::from(columns), point % usize::from(columns));
                let (x, y) = (column as f64, row as f64);
                let b = y / f64::from(rows);
                let value = [x, y, 0.1 * x, x / f64::from(columns), if down { 1.0 - b } else { b }][array];
                out.extend(if hole == Some(point) { zmin } else { value }.to_le_bytes());
            }
        }
        out
    }

    #[test]
    fn a_range_image_becomes_a_surface_that_faces_the_viewer() {
        let mesh = read(&file(3, 4, None, false), Path::new("/nonexistent/a.bnt")).unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (12, 12));
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            assert!((b - a).cross(&(c - a)).z > 0.0);
        }
        assert_eq!(read(&file(3, 4, None, true), Path::new("/nonexistent/a.bnt")).unwrap().uvs.len(), 12);
        let holed = read(&file(3, 4, Some(0), true), Path::new("/nonexistent/a.bnt")).unwrap();
        assert_eq!((holed.positions.len(), holed.triangles.len()), (11, 11));
        assert!(holed.uvs.last().unwrap()[1] > holed.uvs[0][1], "v does not grow with y");
    }

    #[test]
    fn a_jump_is_no_surface() {
        let mut bytes = file(4, 8, None, false);
        let z = bytes.len() - 8 * 32 * 3;
        for point in (0..32).filter(|point| point % 8 >= 4) {
            bytes[z + 8 * point..z + 8 * point + 8].copy_from_slice(&(-60.0_f64).to_le_bytes());
        }
        let mesh = read(&bytes, Path::new("/nonexistent/a.bnt")).unwrap();
        assert_eq!(mesh.triangles.len(), 2 * 3 * 6);
    }

    #[test]
    fn says_what_is_wrong() {
        let whole = file(3, 4, None, false);
        let reason = |bytes: &[u8]| read(bytes, Path::new("/nonexistent/a.bnt")).unwrap_err().reason;
        assert!(reason(&whole[..9]).contains("too few for its header"));
        assert!(reason(&whole[..20]).contains("too few for its header"));
        assert!(reason(&whole[..whole.len() - 8]).contains("room for 59"));
        let mut counts = whole.clone();
        counts[..4].fill(0xff);
        assert!(reason(&counts).contains("65535 x 65535"));
        let mut nothing = whole.clone();
        let data = nothing.len() - 8 * 60;
        for number in nothing[data..].chunks_exact_mut(8) {
            number.copy_from_slice(&f64::NAN.to_le_bytes());
        }
        assert!(reason(&nothing).contains("all its points are background"));
    }
}
