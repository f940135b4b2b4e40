//! How a face was normalised, as a small JSON, so that results can return to the scan.

use nalgebra::{Matrix3, Matrix4, Point3, Vector3};
use serde::{Deserialize, Serialize};

use super::GridError;

const FORMAT: &str = "understudy transform 1";
/// A matrix times its inverse may be off the identity by this much in each entry, entries being in their own units.
const TOLERANCE: f64 = 1e-6;
const DIMENSIONS: usize = 4;

/// A map between two frames with its way back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TransformRecord {
    format: String,
    /// `none`, `affine` (eq. 5.1–5.4) or `similarity`.
    pub method: String,
    /// The frame that points come from.
    pub from: String,
    /// Millimetres to one unit of that frame.
    pub from_unit_mm: f64,
    /// The frame that points are brought to.
    pub to: String,
    /// Millimetres to one unit of that frame.
    pub to_unit_mm: f64,
    /// Rows of the 4 × 4 matrix; it acts on columns (x, y, z, 1).
    matrix: [[f64; DIMENSIONS]; DIMENSIONS],
    /// Rows of its inverse.
    inverse: [[f64; DIMENSIONS]; DIMENSIONS],
    /// Largest over smallest singular value of what was inverted to find the matrix; 1 where nothing was.
    pub condition_number: f64,
    /// Of the matrix's linear part, both frames in millimetres, descending: all alike unless it shears or stretches.
    pub singular_values: [f64; 3],
    /// Numbers of the landmarks that it rests on.
    pub landmarks: Vec<usize>,
}

impl TransformRecord {
    /// Of a matrix with the last row (0, 0, 0, 1). `None` where it has no inverse or is not finite.
    pub fn new(
        method: impl Into<String>,
        matrix: &Matrix4<f64>,
        (from, from_unit_mm): (impl Into<String>, f64),
        (to, to_unit_mm): (impl Into<String>, f64),
        condition_number: f64,
        landmarks: Vec<usize>,
    ) -> Option<Self> {
        // By parts, so that the last row stays exact.
        let back: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).try_inverse()?;
        let shift: Vector3<f64> = matrix.fixed_view::<3, 1>(0, 3).into();
        let inverse = back.to_homogeneous() * Matrix4::new_translation(&-shift);
        let linear: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0) * (to_unit_mm / from_unit_mm);
        let mut singular_values: [f64; 3] = linear.singular_values().into();
        singular_values.sort_by(|a, b| b.total_cmp(a));
        let rows =
            |m: &Matrix4<f64>| std::array::from_fn(|row| std::array::from_fn(|column| m[(row, column)]));
        let record = Self {
            format: FORMAT.into(),
            method: method.into(),
            from: from.into(),
            from_unit_mm,
            to: to.into(),
            to_unit_mm,
            matrix: rows(matrix),
            inverse: rows(&inverse),
            condition_number,
            singular_values,
            landmarks,
        };
        record.check().is_ok().then_some(record)
    }

    /// The matrix.
    pub fn matrix(&self) -> Matrix4<f64> {
        Matrix4::from_fn(|row, column| self.matrix[row][column])
    }

    /// Its inverse.
    pub fn inverse(&self) -> Matrix4<f64> {
        Matrix4::from_fn(|row, column| self.inverse[row][column])
    }

    /// A point of the frame `to`, in the frame `from`.
    pub fn undo(&self, point: &Point3<f64>) -> Point3<f64> {
        self.inverse().transform_point(point)
    }

    /// As JSON, ending in a line feed.
    pub fn to_json(&self) -> Result<String, GridError> {
        let text = serde_json::to_string_pretty(self);
        text.map(|text| text + "\n").map_err(|error| GridError::Record { reason: error.to_string() })
    }

    /// From the JSON that [`TransformRecord::to_json`] gives.
    pub fn parse(text: &str) -> Result<Self, GridError> {
        let record: Self =
            serde_json::from_str(text).map_err(|error| GridError::Record { reason: error.to_string() })?;
        record.check().map(|()| record)
    }

    fn check(&self) -> Result<(), GridError> {
        let wrong = |reason: &str| Err(GridError::Record { reason: reason.into() });
        if self.format != FORMAT {
            return wrong("its format is another one");
        }
        let (matrix, inverse) = (self.matrix(), self.inverse());
        let last = |m: &Matrix4<f64>| m.row(3).iter().copied().eq([0.0, 0.0, 0.0, 1.0]);
        if !last(&matrix) || !last(&inverse) {
            return wrong("the last row of its matrix is not 0 0 0 1");
        }
        if !matrix.iter().chain(inverse.iter()).all(|entry| entry.is_finite()) {
            return wrong("its matrix is not finite");
        }
        // Translations are as large as the scan's coordinates, so that their error is held against their size.
        let size = 1.0 + inverse.column(3).amax().max(matrix.column(3).amax());
        if (matrix * inverse - Matrix4::identity()).amax() > TOLERANCE * size {
            return wrong("its inverse does not undo its matrix");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> TransformRecord {
        let matrix = Matrix4::new_translation(&Vector3::new(1.0, -2000.0, 3.25))
            * Matrix4::new_nonuniform_scaling(&Vector3::new(10.0, 9.0, 11.0));
        let (own, average) = (("own frame of a.obj", 10.0), ("average face", 1.0));
        TransformRecord::new("affine", &matrix, own, average, 2.5, vec![4, 33]).unwrap()
    }

    #[test]
    fn there_and_back_through_json() {
        let kept = TransformRecord::parse(&record().to_json().unwrap()).unwrap();
        // JSON's numbers come back to the last bit or the one before it.
        assert!((kept.inverse() - record().inverse()).amax() < 1e-12 && kept.landmarks == record().landmarks);
        assert!(
            (kept.singular_values[0] - 1.1).abs() < 1e-12 && (kept.singular_values[2] - 0.9).abs() < 1e-12
        );
        let p = Point3::new(0.1, 160.0, -3.0);
        assert!((kept.undo(&kept.matrix().transform_point(&p)) - p).norm() < 1e-9);
    }

    #[test]
    fn what_is_no_record_is_refused() {
        let text = record().to_json().unwrap();
        let reason = |text: &str| TransformRecord::parse(text).unwrap_err().to_string();
        assert!(reason("{}").contains("missing field"));
        assert!(reason("").contains("no transform"));
        assert!(reason(&text.replace("transform 1", "transform 2")).contains("format"));
        assert!(reason(&text.replacen("10.0", "12.0", 2)).contains("does not undo"));
        let singular = Matrix4::new_nonuniform_scaling(&Vector3::new(1.0, 0.0, 1.0));
        assert!(TransformRecord::new("affine", &singular, ("a", 1.0), ("b", 1.0), 1.0, vec![]).is_none());
    }
}
