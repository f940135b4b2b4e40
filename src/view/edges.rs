//! Smooths the stairs of a finished picture's edges, on the CPU.
//!
//! After T. Lottes, "FXAA" (NVIDIA 2009, version 3.11 quality): where neighbours differ strongly in brightness, the
//! ends of the stair's step are looked for along the edge, and the pixel takes a share of its neighbour across the
//! edge according to how near an end it lies. Left out is the blur of single bright pixels: a scan's texture is
//! smooth already. On the CPU because one pixel in fifty lies on an edge, and lavapipe would pay for all of them.

/// Neighbours must differ by this many of 255 steps of brightness, and by an eighth of the brighter one.
const LEAST_CONTRAST: u8 = 12;
/// How far the end of a step is looked for, pixels. Flatter edges are smoothed in part.
const REACH: usize = 16;

/// Smooths pictures, reusing its memory.
#[derive(Debug, Default)]
pub(super) struct EdgeSmoother {
    brightness: Vec<u8>,
    strong: Vec<bool>,
    changed: Vec<(usize, [u8; 4])>,
}

impl EdgeSmoother {
    /// Smooths H × W × 4 bytes of premultiplied RGBA in place. The outermost pixels stay as they are.
    pub(super) fn smooth(&mut self, rgba: &mut [u8], width: usize) {
        let height = rgba.len() / 4 / width.max(1);
        if width < 3 || height < 3 {
            return;
        }
        self.brightness.clear();
        self.brightness.extend(rgba.chunks_exact(4).map(|p| {
            // Alpha counts a quarter, so that a dark model stands out from a transparent background.
            ((58 * u32::from(p[0]) + 112 * u32::from(p[1]) + 22 * u32::from(p[2]) + 64 * u32::from(p[3]))
                >> 8) as u8
        }));
        self.strong.resize(width - 2, false);
        self.changed.clear();
        for y in 1..height - 1 {
            self.find_strong(y, width);
            let mut x = 1;
            for chunk in self.strong.chunks(32) {
                // Nearly all chunks hold nothing.
                if chunk.iter().fold(false, |any, &strong| any | strong) {
                    for (k, _) in chunk.iter().enumerate().filter(|(_, strong)| **strong) {
                        if let Some((across, share)) = blend(&self.brightness, [width, height], x + k, y) {
                            let here = y * width + x + k;
                            self.changed.push((here, mix(rgba, here, across, share)));
                        }
                    }
                }
                x += chunk.len();
            }
        }
        for &(pixel, colour) in &self.changed {
            rgba[4 * pixel..4 * pixel + 4].copy_from_slice(&colour);
        }
    }

    /// Marks the pixels of row `y`, without its first and last, that differ strongly from a neighbour.
    fn find_strong(&mut self, y: usize, width: usize) {
        let row = |y: usize| &self.brightness[y * width..(y + 1) * width];
        let (above, here, below) = (row(y - 1), row(y), row(y + 1));
        let inner = above[1..].iter().zip(&here[1..]).zip(&below[1..]).zip(here).zip(&here[2..]);
        for (strong, ((((&n, &m), &s), &w), &e)) in self.strong.iter_mut().zip(inner) {
            let low = n.min(m).min(s).min(w).min(e);
            let high = n.max(m).max(s).max(w).max(e);
            *strong = high - low >= LEAST_CONTRAST.max(high >> 3);
        }
    }
}

/// The neighbour to blend with, and its share in 0..0.5; `None` where the pixel keeps its colour.
fn blend(brightness: &[u8], [width, height]: [usize; 2], x: usize, y: usize) -> Option<(usize, f32)> {
    let here = y * width + x;
    let b = |at: usize| i32::from(brightness[at]);
    let m = b(here);
    let (n, s, w, e) = (b(here - width), b(here + width), b(here - 1), b(here + 1));
    let (nw, ne) = (b(here - width - 1), b(here - width + 1));
    let (sw, se) = (b(here + width - 1), b(here + width + 1));
    let lying = (nw + sw - 2 * w).abs() + 2 * (n + s - 2 * m).abs() + (ne + se - 2 * e).abs();
    let standing = (nw + ne - 2 * n).abs() + 2 * (w + e - 2 * m).abs() + (sw + se - 2 * s).abs();

    // `across` steps over the edge, `along` follows it; `room` is how far along the picture goes on.
    let (sides, across, along, room) = if lying >= standing {
        ([n, s], width, 1, [x, width - 1 - x])
    } else {
        ([w, e], 1, width, [y, height - 1 - y])
    };
    let first = (sides[0] - m).abs() >= (sides[1] - m).abs();
    let (other, neighbour) = if first { (sides[0], here - across) } else { (sides[1], here + across) };
    // Twice the mean brightness on the edge, and how far it may stray before the step ends.
    let edge = other + m;
    let stray = (other - m).abs() / 2;

    let end = |room: usize, step: &dyn Fn(usize, usize) -> usize| {
        let reach = room.min(REACH);
        let difference = |i| b(step(here, i * along)) + b(step(neighbour, i * along)) - edge;
        let found = (1..=reach).find(|&i| difference(i).abs() >= stray.max(1));
        let at = found.unwrap_or(reach);
        (at, if at == 0 { 0 } else { difference(at) })
    };
    let (back, back_difference) = end(room[0], &|from, by| from - by);
    let (ahead, ahead_difference) = end(room[1], &|from, by| from + by);
    let (near, difference) = if back < ahead { (back, back_difference) } else { (ahead, ahead_difference) };
    // Only the side of the edge that the step's end cuts into gives way.
    if difference == 0 || (difference < 0) == (2 * m < edge) {
        return None;
    }
    let share = 0.5 - near as f32 / (back + ahead) as f32;
    (share > 0.0).then_some((neighbour, share))
}

fn mix(rgba: &[u8], here: usize, across: usize, share: f32) -> [u8; 4] {
    std::array::from_fn(|channel| {
        let (a, b) = (f32::from(rgba[4 * here + channel]), f32::from(rgba[4 * across + channel]));
        (a + (b - a) * share).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// White below a line of the given slope, hard-edged.
    fn half_plane(size: usize, slope: f64) -> Vec<u8> {
        (0..size * size)
            .flat_map(|i| {
                let (x, y) = ((i % size) as f64 + 0.5, (i / size) as f64 + 0.5);
                let white = y - size as f64 / 2.0 > slope * (x - size as f64 / 2.0);
                [[0, 0, 0, 255], [255; 4]][usize::from(white)]
            })
            .collect()
    }

    /// Mean absolute difference from the coverage that the line truly has, in its inner pixels.
    fn error(rgba: &[u8], size: usize, slope: f64) -> f64 {
        let mut sum = 0.0;
        for y in 20..size - 20 {
            for x in 20..size - 20 {
                let middle = size as f64 / 2.0;
                let covered = (0..64).filter(|k| {
                    let (u, v) = (f64::from(k % 8) / 8.0 + 0.0625, f64::from(k / 8) / 8.0 + 0.0625);
                    (y as f64 + v) - middle > slope * ((x as f64 + u) - middle)
                });
                let truth = covered.count() as f64 / 64.0 * 255.0;
                sum += (f64::from(rgba[4 * (y * size + x)]) - truth).abs();
            }
        }
        sum
    }

    #[test]
    fn slanting_edges_come_nearer_to_their_true_coverage() {
        let size = 120;
        // Near the diagonal every step is one pixel long, and there is less to gain.
        for (slope, left) in [(0.13, 0.55), (0.3, 0.55), (-0.45, 0.55), (0.8, 0.8), (2.6, 0.55), (-5.2, 0.55)]
        {
            let hard = half_plane(size, slope);
            let mut soft = hard.clone();
            EdgeSmoother::default().smooth(&mut soft, size);
            let (before, after) = (error(&hard, size, slope), error(&soft, size, slope));
            assert!(after < left * before, "slope {slope}: {before} -> {after}");
        }
    }

    #[test]
    fn level_edges_and_faint_texture_stay_byte_for_byte() {
        let level = half_plane(40, 0.0);
        let faint: Vec<u8> = (0..40 * 40_u32).flat_map(|i| [(100 + i * 7 % 11) as u8; 4]).collect();
        for picture in [level, faint, vec![9; 2 * 2 * 4], Vec::new()] {
            let width = if picture.len() > 100 { 40 } else { 2 };
            let mut smoothed = picture.clone();
            EdgeSmoother::default().smooth(&mut smoothed, width);
            assert_eq!(smoothed, picture);
        }
    }
}
