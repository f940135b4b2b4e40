//! Marks drawn over a finished picture, smooth-edged, on the CPU.
//!
//! Places are pixels as [`ViewCamera::project`](super::ViewCamera::project) gives them: (0, 0) is the upper left
//! corner of the picture. What lies outside the picture is cut off; marks at places that are not finite are not
//! drawn. Colours are sRGB with straight alpha.

use image::{Rgba, RgbaImage};
use nalgebra::{Point2, Vector2};

/// A filled disc of the given radius in pixels.
pub fn dot(picture: &mut RgbaImage, centre: Point2<f64>, radius: f64, colour: [u8; 4]) {
    paint(picture, [centre, centre], radius, colour, |p| (p - centre).norm() - radius);
}

/// A line between two points, `width` pixels wide, with round ends.
pub fn line(picture: &mut RgbaImage, from: Point2<f64>, to: Point2<f64>, width: f64, colour: [u8; 4]) {
    paint(picture, [from, to], width / 2.0, colour, |p| distance_to_segment(p, from, to) - width / 2.0);
}

/// An upright cross whose arms reach `radius` pixels from the centre.
pub fn cross(picture: &mut RgbaImage, centre: Point2<f64>, radius: f64, width: f64, colour: [u8; 4]) {
    let (x, y) = (Vector2::new(radius, 0.0), Vector2::new(0.0, radius));
    // One shape, not two lines: where they meet a see-through colour must not count twice.
    paint(picture, [centre - x - y, centre + x + y], width / 2.0, colour, |p| {
        let lying = distance_to_segment(p, centre - x, centre + x);
        let standing = distance_to_segment(p, centre - y, centre + y);
        lying.min(standing) - width / 2.0
    });
}

/// Lays `colour` over one pixel with the given share of its alpha, 0..=1.
pub(super) fn blend(pixel: &mut Rgba<u8>, colour: [u8; 4], share: f64) {
    let over = f64::from(colour[3]) / 255.0 * share;
    let under = f64::from(pixel[3]) / 255.0 * (1.0 - over);
    let alpha = over + under;
    if alpha <= 0.0 {
        return;
    }
    for (below, above) in pixel.0.iter_mut().zip(colour).take(3) {
        *below = ((f64::from(above) * over + f64::from(*below) * under) / alpha).round() as u8;
    }
    pixel[3] = (alpha * 255.0).round() as u8;
}

/// Fills where `distance` (pixels, negative inside) says, within `margin` of the box around two points.
fn paint(
    picture: &mut RgbaImage,
    corners: [Point2<f64>; 2],
    margin: f64,
    colour: [u8; 4],
    distance: impl Fn(Point2<f64>) -> f64,
) {
    let [a, b] = corners;
    if ![a.x, a.y, b.x, b.y, margin].iter().all(|v| v.is_finite()) {
        return;
    }
    let margin = margin + 1.0;
    // Casts saturate: what lies left of or above the picture begins at 0.
    let (left, top) = ((a.x.min(b.x) - margin) as u32, (a.y.min(b.y) - margin) as u32);
    let right = ((a.x.max(b.x) + margin).ceil() as u32).min(picture.width());
    let bottom = ((a.y.max(b.y) + margin).ceil() as u32).min(picture.height());
    for y in top..bottom {
        for x in left..right {
            let centre = Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let share = (0.5 - distance(centre)).clamp(0.0, 1.0);
            if share > 0.0 {
                blend(picture.get_pixel_mut(x, y), colour, share);
            }
        }
    }
}

fn distance_to_segment(p: Point2<f64>, from: Point2<f64>, to: Point2<f64>) -> f64 {
    let along = to - from;
    let length = along.norm_squared();
    let t = if length > 0.0 { ((p - from).dot(&along) / length).clamp(0.0, 1.0) } else { 0.0 };
    (p - (from + along * t)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: [u8; 4] = [255; 4];

    fn black() -> RgbaImage {
        RgbaImage::from_pixel(64, 48, Rgba([0, 0, 0, 255]))
    }

    fn painted(picture: &RgbaImage) -> f64 {
        picture.pixels().map(|p| f64::from(p[0]) / 255.0).sum()
    }

    #[test]
    fn shapes_cover_the_area_they_should() {
        let mut picture = black();
        dot(&mut picture, Point2::new(30.3, 20.8), 7.5, WHITE);
        assert!((painted(&picture) - std::f64::consts::PI * 7.5 * 7.5).abs() < 1.5);

        let mut picture = black();
        line(&mut picture, Point2::new(10.0, 10.0), Point2::new(50.0, 35.0), 3.0, WHITE);
        let length = (40.0_f64 * 40.0 + 25.0 * 25.0).sqrt();
        assert!((painted(&picture) - (3.0 * length + std::f64::consts::PI * 1.5 * 1.5)).abs() < 2.0);
    }

    #[test]
    fn a_cross_marks_its_centre() {
        let mut picture = black();
        cross(&mut picture, Point2::new(20.5, 20.5), 6.0, 1.0, WHITE);
        assert_eq!(picture.get_pixel(20, 20).0, WHITE);
        assert_eq!(picture.get_pixel(25, 20).0, WHITE);
        assert_eq!(picture.get_pixel(20, 15).0, WHITE);
        assert_eq!(picture.get_pixel(25, 25).0, [0, 0, 0, 255]);
    }

    #[test]
    fn what_lies_outside_is_cut_off() {
        let mut picture = black();
        for place in [[-50.0, 10.0], [1e9, 1e9], [f64::NAN, 3.0], [10.0, f64::INFINITY]] {
            dot(&mut picture, Point2::from(place), 4.0, WHITE);
            line(&mut picture, Point2::from(place), Point2::from(place), 4.0, WHITE);
        }
        assert!(painted(&picture) < 1e-9);
        dot(&mut picture, Point2::origin(), 10.0, WHITE);
        assert!((painted(&picture) - std::f64::consts::PI * 25.0).abs() < 1.5);
    }

    #[test]
    fn colours_lie_over_what_is_there() {
        let mut clear = Rgba([0, 0, 0, 0]);
        blend(&mut clear, [200, 100, 50, 255], 0.5);
        assert_eq!(clear.0, [200, 100, 50, 128]);
        let mut solid = Rgba([100, 100, 100, 255]);
        blend(&mut solid, [200, 0, 100, 128], 1.0);
        assert_eq!(solid.0, [150, 50, 100, 255]);
    }
}
