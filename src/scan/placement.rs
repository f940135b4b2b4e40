//! Where a file's own frame lies in the scan frame.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Similarity3, Translation3, UnitQuaternion, Vector3};

use super::unit::LengthUnit;

/// The shortest axis and the smallest scale that are taken for one.
const TINY: f64 = 1e-12;

/// A similarity (turn, shift, uniform scale, no mirroring) from a file's own frame and unit to the **scan frame**:
/// right-handed, +Y up, +Z out of the face, +X to the subject's left, millimetres.
///
/// Going there and back moves a point by no more than rounding does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    own_to_scan: Similarity3<f64>,
}

/// Why a [`Placement`] could not be made.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PlacementError {
    /// The scale is not a positive finite number of usable size.
    #[error(
        "a placement's scale must be between 1e-12 and 1e12 millimetres per unit, found {found}. State the unit"
    )]
    Scale {
        /// The scale asked for.
        found: f64,
    },
    /// The rotation or translation is not finite.
    #[error("a placement's rotation and translation must be finite. Check the landmarks they come from")]
    NotFinite,
    /// Two axes are zero or parallel.
    #[error(
        "the up and forward axes must differ in direction, found {up:?} and {forward:?}. State two different axes"
    )]
    Axes {
        /// The up axis asked for.
        up: [f64; 3],
        /// The forward axis asked for.
        forward: [f64; 3],
    },
}

impl Default for Placement {
    fn default() -> Self {
        Self::identity()
    }
}

impl Placement {
    /// For files that already are in the scan frame and in millimetres.
    pub fn identity() -> Self {
        Self { own_to_scan: Similarity3::identity() }
    }

    /// For files whose axes already are the scan frame's: the unit alone.
    pub fn from_unit(unit: LengthUnit) -> Result<Self, PlacementError> {
        Self::new(Rotation3::identity(), Vector3::zeros(), unit.millimetres_per_unit())
    }

    /// `scan = scale · rotation · own + translation`, `translation` in millimetres and `scale` in millimetres per
    /// own unit.
    pub fn new(
        rotation: Rotation3<f64>,
        translation: Vector3<f64>,
        scale: f64,
    ) -> Result<Self, PlacementError> {
        if !(TINY..=1.0 / TINY).contains(&scale) {
            return Err(PlacementError::Scale { found: scale });
        }
        if !rotation.matrix().iter().chain(translation.iter()).all(|c| c.is_finite()) {
            return Err(PlacementError::NotFinite);
        }
        let turn = UnitQuaternion::from_rotation_matrix(&rotation);
        let isometry = Isometry3::from_parts(Translation3::from(translation), turn);
        Ok(Self { own_to_scan: Similarity3::from_isometry(isometry, scale) })
    }

    /// For files in other axes: `up` and `forward` (out of the face) are directions in the file's own frame. `up` is
    /// followed exactly, `forward` as far as it is square to it; the frame is taken to be right-handed. The origin
    /// stays.
    pub fn from_axes(
        up: Vector3<f64>,
        forward: Vector3<f64>,
        unit: LengthUnit,
    ) -> Result<Self, PlacementError> {
        let wrong = PlacementError::Axes { up: up.into(), forward: forward.into() };
        let y = up.try_normalize(TINY).ok_or(wrong)?;
        let toward = forward.try_normalize(TINY).ok_or(wrong)?;
        let x = y.cross(&toward).try_normalize(1e-6).ok_or(wrong)?;
        let z = x.cross(&y);
        let rows = Matrix3::from_rows(&[x.transpose(), y.transpose(), z.transpose()]);
        Self::new(Rotation3::from_matrix_unchecked(rows), Vector3::zeros(), unit.millimetres_per_unit())
    }

    /// Millimetres per own unit.
    pub fn scale(&self) -> f64 {
        self.own_to_scan.scaling()
    }

    /// The turn from the own frame's axes to the scan frame's.
    pub fn rotation(&self) -> Rotation3<f64> {
        self.own_to_scan.isometry.rotation.to_rotation_matrix()
    }

    /// Where the own frame's origin lies in the scan frame, in millimetres.
    pub fn translation(&self) -> Vector3<f64> {
        self.own_to_scan.isometry.translation.vector
    }

    /// A place of the own frame, in the scan frame.
    pub fn to_scan(&self, own: Point3<f64>) -> Point3<f64> {
        self.own_to_scan.transform_point(&own)
    }

    /// A place of the scan frame, in the own frame.
    pub fn to_own(&self, scan: Point3<f64>) -> Point3<f64> {
        self.own_to_scan.inverse_transform_point(&scan)
    }

    /// A displacement of the own frame, in the scan frame: turned and scaled, not shifted.
    pub fn vector_to_scan(&self, own: Vector3<f64>) -> Vector3<f64> {
        self.own_to_scan.transform_vector(&own)
    }

    /// A displacement of the scan frame, in the own frame.
    pub fn vector_to_own(&self, scan: Vector3<f64>) -> Vector3<f64> {
        self.own_to_scan.inverse_transform_vector(&scan)
    }

    /// A direction of the own frame, in the scan frame: turned, its length kept.
    pub fn direction_to_scan(&self, own: Vector3<f64>) -> Vector3<f64> {
        self.own_to_scan.isometry.rotation * own
    }

    /// A direction of the scan frame, in the own frame: turned, its length kept.
    pub fn direction_to_own(&self, scan: Vector3<f64>) -> Vector3<f64> {
        self.own_to_scan.isometry.rotation.inverse_transform_vector(&scan)
    }

    /// `before` first, then this one.
    #[must_use]
    pub fn compose(&self, before: &Self) -> Self {
        Self { own_to_scan: self.own_to_scan * before.own_to_scan }
    }

    /// The way back as a placement of its own.
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self { own_to_scan: self.own_to_scan.inverse() }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_placement() -> impl Strategy<Value = Placement> {
        let part = -300.0..300.0_f64;
        ([-3.0..3.0_f64, -3.0..3.0, -3.0..3.0], [part.clone(), part.clone(), part], -3.0..3.0_f64).prop_map(
            |(turn, shift, power)| {
                Placement::new(Rotation3::new(Vector3::from(turn)), Vector3::from(shift), 10_f64.powf(power))
                    .unwrap()
            },
        )
    }

    proptest! {
        /// Within 1e-9 mm for any place on a head in any unit, both ways round.
        #[test]
        fn there_and_back(placement in any_placement(), p in [-400.0..400.0_f64, -400.0..400.0, -400.0..400.0]) {
            let p = Point3::from(p);
            prop_assert!((placement.to_scan(placement.to_own(p)) - p).norm() <= 1e-9);
            let own = placement.to_own(p);
            let back = placement.to_own(placement.to_scan(own));
            prop_assert!((back - own).norm() * placement.scale() <= 1e-9);
            let v = p.coords;
            prop_assert!((placement.vector_to_scan(placement.vector_to_own(v)) - v).norm() <= 1e-9);
            prop_assert!((placement.direction_to_own(placement.direction_to_scan(v)) - v).norm() <= 1e-9);
            prop_assert!((placement.inverse().to_scan(p) - own).norm() * placement.scale() <= 1e-9);
        }

        #[test]
        fn composing_is_one_after_the_other(
            a in any_placement(),
            b in any_placement(),
            p in [-1.0..1.0_f64, -1.0..1.0, -1.0..1.0],
        ) {
            let p = Point3::from(p);
            let (one, two) = (b.compose(&a).to_scan(p), b.to_scan(a.to_scan(p)));
            prop_assert!((one - two).norm() <= 1e-9 * (1.0 + two.coords.norm()));
        }
    }

    #[test]
    fn z_up_files_stand_up() {
        // Blender: Z up, the face looks along −Y.
        let placement = Placement::from_axes(Vector3::z(), -Vector3::y(), LengthUnit::Metre).unwrap();
        let nose = placement.to_scan(Point3::new(0.02, -0.1, 1.6));
        assert!((nose - Point3::new(20.0, 1600.0, 100.0)).norm() < 1e-9, "{nose}");
    }

    #[test]
    fn refuses_what_is_no_similarity() {
        for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Placement::from_unit(LengthUnit::Custom(scale)).is_err());
        }
        assert!(Placement::new(Rotation3::identity(), Vector3::new(f64::NAN, 0.0, 0.0), 1.0).is_err());
        assert!(Placement::from_axes(Vector3::y(), Vector3::y() * -2.0, LengthUnit::Metre).is_err());
        assert!(Placement::from_axes(Vector3::zeros(), Vector3::y(), LengthUnit::Metre).is_err());
    }
}
