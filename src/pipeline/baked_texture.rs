//! The colours of a scan as one picture over its grid.

use std::sync::Arc;

use image::{ImageFormat, Rgba, RgbaImage};
use nalgebra::{Matrix4, Point3, Vector3};

use super::PipelineError;
use crate::{
    grid::{Cleaned, Raster},
    scan::{Mesh, NormalSolver, Texture, TextureFormat},
    view::{Background, Gpu, Look, Model, Projection, Renderer, Smoothing, ViewCamera, ViewError},
};

/// Pixels by which colours are carried beyond the face's edge, so that filtering finds skin there.
const BLEED: usize = 8;
/// What no colour reaches.
const BARE: [u8; 3] = [128; 3];

/// The scan's texture as seen from the front over the rectangle of the grid, `side` pixels along its longer side: the
/// picture's corners are the grid's, so that column / (columns − 1) and row / (rows − 1) are its texture coordinates.
/// `None` where the scan has no texture.
pub(super) fn bake(
    gpu: &Gpu,
    mesh: &Mesh,
    cleaned: &Cleaned,
    raster: &Raster,
    side: u32,
) -> Result<Option<Arc<Texture>>, PipelineError> {
    if mesh.uv_triangles.is_empty() || mesh.materials.iter().all(|m| m.texture.is_none()) {
        return Ok(None);
    }
    let extent = raster.high() - raster.low();
    let longer = extent.x.max(extent.y);
    let [width, height] =
        [extent.x, extent.y].map(|length| ((f64::from(side) * length / longer).round() as u32).max(2));
    // Millimetres become pixels, each way by itself: the sides in pixels are rounded.
    let centre = nalgebra::center(&raster.low(), &raster.high());
    let scale =
        Vector3::new(f64::from(width) / extent.x, f64::from(height) / extent.y, f64::from(side) / longer);
    let world = Matrix4::new_nonuniform_scaling(&scale)
        * Matrix4::new_translation(&Vector3::new(-centre.x, -centre.y, 0.0));

    let seen = face_only(mesh, cleaned);
    let depths = seen.triangles.iter().flatten().map(|v| seen.positions[*v as usize].z * scale.z);
    let (low, high) = depths.fold((f64::MAX, f64::MIN), |(low, high), z| (low.min(z), high.max(z)));
    if low > high {
        return Ok(None);
    }
    let camera = ViewCamera {
        eye: Point3::new(0.0, 0.0, high + 10.0),
        target: Point3::new(0.0, 0.0, high),
        up: Vector3::y(),
        projection: Projection::Orthographic { height: f64::from(height) },
        near: 1.0,
        far: high - low + 20.0,
        viewport: [width, height],
    };
    let positions = seen.positions_f32();
    let normals = NormalSolver::once(&seen.triangles, &positions);
    let model = Model::upload(gpu, &seen)?;
    let mut renderer = Renderer::new(gpu, width, height, Smoothing::Off)?;
    let look = Look::UNLIT.before(Background::Transparent);
    renderer.draw(&model, &positions, &normals, &world, &camera, &look)?;
    let picture = renderer.read_picture()?;
    Ok(Some(Arc::new(texture_of(bled(picture))?)))
}

/// A picture as a texture without alpha.
pub(super) fn texture_of(picture: RgbaImage) -> Result<Texture, ViewError> {
    let (width, height) = picture.dimensions();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::DynamicImage::from(picture)
        .into_rgb8()
        .write_to(&mut bytes, ImageFormat::Png)
        .map_err(|error| ViewError::Size { width, height, reason: error.to_string() })?;
    Ok(Texture { name: "face.png".into(), format: TextureFormat::Png, bytes: bytes.into_inner() })
}

/// The mesh without what is not the face.
fn face_only(mesh: &Mesh, cleaned: &Cleaned) -> Mesh {
    let kept = |numbers: &[[u32; 3]]| {
        numbers.iter().zip(&cleaned.kept).filter(|(_, kept)| **kept).map(|(t, _)| *t).collect::<Vec<_>>()
    };
    let materials = mesh.triangle_materials.iter().zip(&cleaned.kept);
    Mesh {
        positions: cleaned.positions.clone(),
        triangles: kept(&mesh.triangles),
        uv_triangles: kept(&mesh.uv_triangles),
        triangle_materials: materials.filter(|(_, kept)| **kept).map(|(m, _)| *m).collect(),
        ..mesh.clone()
    }
}

/// Carries colours over the edge of what is covered, pixel by pixel; the rest becomes grey.
pub(super) fn bled(mut picture: RgbaImage) -> RgbaImage {
    let (width, height) = picture.dimensions();
    for _ in 0..BLEED {
        let before = picture.clone();
        for (x, y, pixel) in picture.enumerate_pixels_mut().filter(|(_, _, pixel)| pixel[3] < 255) {
            let (mut sum, mut count) = ([0_u32; 3], 0);
            for (i, j) in (0..9).map(|k| (x + k % 3, y + k / 3)) {
                if (1..=width).contains(&i) && (1..=height).contains(&j) {
                    let neighbour = before.get_pixel(i - 1, j - 1);
                    if neighbour[3] == 255 {
                        (0..3).for_each(|k| sum[k] += u32::from(neighbour[k]));
                        count += 1;
                    }
                }
            }
            if count > 0 {
                let [r, g, b] = sum.map(|channel| (channel / count) as u8);
                *pixel = Rgba([r, g, b, 255]);
            }
        }
    }
    let [r, g, b] = BARE;
    for pixel in picture.pixels_mut().filter(|pixel| pixel[3] < 255) {
        *pixel = Rgba([r, g, b, 255]);
    }
    picture
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_cross_the_edge_by_a_few_pixels() {
        let edge =
            RgbaImage::from_fn(30, 4, |x, _| if x < 5 { Rgba([200, 40, 0, 255]) } else { Rgba([0; 4]) });
        let whole = bled(edge);
        assert_eq!(whole.get_pixel(12, 2).0, [200, 40, 0, 255]);
        assert_eq!(whole.get_pixel(14, 2).0, [128, 128, 128, 255]);
    }
}
