//! Wrinkle maps: living skin in a target's own texture space, for engines that blend textures by curves.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use image::{Rgba, RgbaImage, imageops};
use nalgebra::{Point2, Vector2};

use super::{PipelineError, SharedFace, Target};
use crate::{
    anatomy::PartKind,
    appearance::{ALPHA_RAMP, AppearanceStates, Area, Composition, FaceChart, TextureVolume},
    scan::{Mesh, Texture},
    view::{SkinMode, decode_texture, save_png},
};

/// Larger textures are reduced: a face of 448 pixels in the shared frame has no more to say.
const WIDEST: u32 = 2048;
/// Pixels by which a triangle's map goes over its edges, so that filtering finds skin beyond a seam.
const BLEED: f64 = 2.0;

/// A texel on the face: where in the shared frame, and how far it is of the face.
#[derive(Clone, Copy)]
struct Texel {
    place: Point2<f64>,
    cover: f32,
    /// Inside of its triangle, not in the bleed around it.
    inside: bool,
}

/// Writes, for every texture of the target's skin, `neutral.png`, and for every volume `wrinkle_NAME.png`, the texture with the
/// region's last layer on it, and `mask_NAME.png`, white where the region shows. Several textures are numbered from the second
/// on. An engine shows neutral + (wrinkle − neutral) · state. Returns what was written.
pub fn bake_skin(
    folder: &Path,
    target: &Target,
    face: &SharedFace,
    volumes: &[TextureVolume],
    mode: SkinMode,
    gain: f32,
) -> Result<Vec<PathBuf>, PipelineError> {
    let mesh = &target.anatomy.mesh;
    let chart = face.chart(target)?;
    let textures = skin_textures(target, &chart);
    if textures.is_empty() {
        return Err(PipelineError::NoSkinTexture { scan: target.scan.name.clone() });
    }
    std::fs::create_dir_all(folder)
        .map_err(|source| PipelineError::Folder { path: folder.into(), source })?;
    let mut written = Vec::new();
    for (number, (texture, triangles)) in textures.iter().enumerate() {
        let neutral = reduced(decode_texture(texture)?);
        let texels = lay_out(mesh, &chart, triangles, neutral.dimensions());
        let suffix = if number == 0 { String::new() } else { format!("_{}", number + 1) };
        let mut write = |name: &str, picture: &RgbaImage| -> Result<(), PipelineError> {
            let path = folder.join(format!("{name}{suffix}.png"));
            save_png(&path, picture)?;
            written.push(path);
            Ok(())
        };
        write("neutral", &neutral)?;
        for volume in volumes {
            let region = volume.region();
            let composed = Composition::new(face.frame(), std::slice::from_ref(volume));
            let area = Area::of(region, face.frame());
            let mut states = AppearanceStates::default();
            states.set(region, Some(1.0));
            let (mut picture, mut mask) =
                (neutral.clone(), RgbaImage::from_pixel(neutral.width(), neutral.height(), BLACK));
            let pixels = picture.pixels_mut().zip(mask.pixels_mut());
            for ((pixel, masked), texel) in pixels.zip(&texels) {
                let Some(texel) = texel else { continue };
                let alpha = area.alpha(&texel.place, ALPHA_RAMP) as f32 * texel.cover;
                if alpha > 0.0 {
                    change(pixel, &composed, texel, &states, mode, gain);
                    let value = (alpha * 255.0).round() as u8;
                    *masked = Rgba([value, value, value, 255]);
                }
            }
            write(&region.curve(), &picture)?;
            write(&format!("mask_{}", region.name()), &mask)?;
        }
    }
    Ok(written)
}

const BLACK: Rgba<u8> = Rgba([0, 0, 0, 255]);

/// A texel's colour with living skin on it; sRGB is taken for a power of 2.2, as the renderer takes it.
fn change(
    pixel: &mut Rgba<u8>,
    composed: &Composition,
    texel: &Texel,
    states: &AppearanceStates,
    mode: SkinMode,
    gain: f32,
) {
    let factor = (gain * texel.cover * composed.log_ratio(&texel.place, states)).exp();
    let (own, share) = composed.own(&texel.place, states);
    for (channel, own) in pixel.0.iter_mut().zip(own.iter()) {
        let light = (f32::from(*channel) / 255.0).powf(2.2);
        let share = share * texel.cover;
        let shown = match mode {
            SkinMode::Ratio => light * factor,
            SkinMode::Own => light * (1.0 - share) + own * share,
        };
        *channel = (shown.powf(1.0 / 2.2).min(1.0) * 255.0).round() as u8;
    }
}

/// The textures of the skin, each with its triangles, as far as the face goes.
fn skin_textures(target: &Target, chart: &FaceChart) -> Vec<(Arc<Texture>, Vec<usize>)> {
    let mesh = &target.anatomy.mesh;
    let mut textures: Vec<(Arc<Texture>, Vec<usize>)> = Vec::new();
    let skin = target.anatomy.parts.iter().filter(|part| part.kind == PartKind::Skin);
    for triangle in skin.flat_map(|part| part.triangles.clone()) {
        let covered = mesh.triangles[triangle].iter().any(|&corner| chart.covers()[corner as usize] > 0.0);
        let material = mesh.triangle_materials.get(triangle).copied().unwrap_or(0);
        let texture = mesh.materials.get(material as usize).and_then(|material| material.texture.as_ref());
        let (Some(texture), true) = (texture, covered && !mesh.uv_triangles.is_empty()) else { continue };
        match textures.iter_mut().find(|(known, _)| Arc::ptr_eq(known, texture)) {
            Some((_, triangles)) => triangles.push(triangle),
            None => textures.push((Arc::clone(texture), vec![triangle])),
        }
    }
    textures
}

fn reduced(image: RgbaImage) -> RgbaImage {
    let (width, height) = image.dimensions();
    let longer = width.max(height);
    if longer <= WIDEST {
        return image;
    }
    let side = |side: u32| (u64::from(side) * u64::from(WIDEST) / u64::from(longer)).max(1) as u32;
    imageops::resize(&image, side(width), side(height), imageops::FilterType::Triangle)
}

/// Where each texel lies in the shared frame, row by row. Textures repeat.
fn lay_out(
    mesh: &Mesh,
    chart: &FaceChart,
    triangles: &[usize],
    (width, height): (u32, u32),
) -> Vec<Option<Texel>> {
    let mut texels: Vec<Option<Texel>> = vec![None; width as usize * height as usize];
    for &triangle in triangles {
        let corners = mesh.triangles[triangle].map(|corner| corner as usize);
        let [a, b, c] = mesh.uv_triangles[triangle].map(|uv| {
            let [u, v] = mesh.uvs[uv as usize].map(f64::from);
            Vector2::new(u * f64::from(width) - 0.5, (1.0 - v) * f64::from(height) - 0.5)
        });
        let area = (b - a).perp(&(c - a));
        let (low, high) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
        // A seam that was drawn across the whole picture is no place.
        if area.abs() < 1e-9 || (high - low).amax() > f64::from(width.max(height)) {
            continue;
        }
        // Barycentric weights go by so much in a pixel.
        let slack = [(c - b).norm(), (a - c).norm(), (b - a).norm()].map(|side| BLEED * side / area.abs());
        let span = |axis: usize| (low[axis] - BLEED).floor() as i64..=(high[axis] + BLEED).ceil() as i64;
        for (x, y) in span(1).flat_map(|y| span(0).map(move |x| (x, y))) {
            let at = Vector2::new(x as f64, y as f64);
            let weights = [(b - at).perp(&(c - at)), (c - at).perp(&(a - at)), (a - at).perp(&(b - at))]
                .map(|part| part / area);
            if weights.iter().zip(slack).any(|(weight, slack)| *weight < -slack) {
                continue;
            }
            let inside = weights.iter().all(|weight| *weight >= 0.0);
            let column = x.rem_euclid(i64::from(width)) as usize;
            let row = y.rem_euclid(i64::from(height)) as usize;
            let texel = &mut texels[row * width as usize + column];
            if texel.is_none_or(|known| inside && !known.inside) {
                *texel = Some(laid(chart, corners, weights, inside));
            }
        }
    }
    texels
}

fn laid(chart: &FaceChart, corners: [usize; 3], weights: [f64; 3], inside: bool) -> Texel {
    let (mut place, mut cover) = (Point2::origin(), 0.0);
    for (corner, weight) in corners.into_iter().zip(weights) {
        let [x, y] = chart.places()[corner].map(f64::from);
        place += Vector2::new(x, y) * weight;
        cover += f64::from(chart.covers()[corner]) * weight;
    }
    Texel { place, cover: cover.clamp(0.0, 1.0) as f32, inside }
}
