//! Where each region lies in the shared frame.

use nalgebra::{Point2, Vector2};

use super::{FaceFrame, Region};

/// A turned rectangle in the shared frame, pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    /// Its middle.
    pub centre: Point2<f64>,
    /// From the middle to the right edge; its length is half of the width.
    pub across: Vector2<f64>,
    /// From the middle to the lower edge, square to `across`.
    pub down: Vector2<f64>,
}

impl Area {
    /// The area of a region's texture: large enough for its folds, apart from eyes, lips and brows.
    pub fn of(region: Region, frame: &FaceFrame) -> Self {
        // (landmarks whose mean is the middle, half width, half height, turn in degrees, all of the subject's right side,
        // for which the picture's left is outward)
        let (middle, half, degrees): (&[usize], [f64; 2], f64) = match region {
            Region::Forehead => (&[151, 151, 9], [118.0, 46.0], 0.0),
            Region::Glabella => (&[9, 9, 8], [30.0, 34.0], 0.0),
            Region::CrowsFeetRight | Region::CrowsFeetLeft => (&[143, 35], [30.0, 40.0], 0.0),
            Region::NasolabialRight | Region::NasolabialLeft => (&[203, 206, 216], [40.0, 66.0], 28.0),
            Region::EyeRight | Region::EyeLeft => (&[33, 133, 159, 145], [50.0, 30.0], 0.0),
            Region::MouthCornerRight | Region::MouthCornerLeft => (&[57, 212], [24.0, 44.0], 18.0),
            Region::Chin => (&[199, 200], [58.0, 34.0], 0.0),
        };
        let mut centre = Vector2::zeros();
        for &landmark in middle {
            centre += frame.points()[landmark].coords / middle.len() as f64;
        }
        let angle = degrees.to_radians();
        let mut area = Self {
            centre: centre.into(),
            across: Vector2::new(angle.cos(), angle.sin()) * half[0],
            down: Vector2::new(-angle.sin(), angle.cos()) * half[1],
        };
        if region.is_left() {
            area = area.mirrored();
        }
        area
    }

    /// Where a place of the frame lies: (−1, −1) is the upper left corner, (1, 1) the lower right.
    pub fn inside(&self, place: &Point2<f64>) -> Vector2<f64> {
        let from = place - self.centre;
        Vector2::new(
            from.dot(&self.across) / self.across.norm_squared(),
            from.dot(&self.down) / self.down.norm_squared(),
        )
    }

    /// The place of the frame at `inside`.
    pub fn place(&self, inside: &Vector2<f64>) -> Point2<f64> {
        self.centre + self.across * inside.x + self.down * inside.y
    }

    /// How much of a region's own look shows at a place: 1 in the middle, 0 beyond the edge, rising along `ramp` pixels from
    /// the edge inwards (002 §V.iii: "a ten-pixel linear alpha mask").
    pub fn alpha(&self, place: &Point2<f64>, ramp: f64) -> f64 {
        let inside = self.inside(place);
        let depth = |at: f64, half: f64| (1.0 - at.abs()) * half;
        let nearest = depth(inside.x, self.across.norm()).min(depth(inside.y, self.down.norm()));
        (nearest / ramp).clamp(0.0, 1.0)
    }

    /// The same on the other side of the face.
    fn mirrored(self) -> Self {
        let middle = super::FRAME_SIZE[0] as f64 / 2.0;
        Self {
            centre: Point2::new(2.0 * middle - self.centre.x, self.centre.y),
            across: Vector2::new(self.across.x, -self.across.y),
            down: Vector2::new(-self.down.x, self.down.y),
        }
    }
}
