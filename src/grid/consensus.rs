//! The consensus of many faces' landmarks: generalised Procrustes analysis (000 section 5.3).

use nalgebra::{Point3, Similarity3};

use super::{
    GridError,
    similarity::{similarity_between, spread},
};

/// The consensus has settled when it moves by less than this of its size.
const SETTLED: f64 = 1e-10;
const ROUNDS: usize = 200;
/// Fewer points do not span space.
const FEWEST: usize = 4;

/// The shape that many faces have in common.
#[derive(Debug, Clone, PartialEq)]
pub struct Consensus {
    /// N points, centred at the origin, turned as the first face is. Their centroid size is the mean of the faces'.
    pub points: Vec<Point3<f64>>,
    /// For each face the similarity from its own frame to the consensus.
    pub fits: Vec<Similarity3<f64>>,
    /// Rounds until it settled.
    pub rounds: usize,
    /// For each face the root mean square distance of its fitted landmarks from the consensus, in the faces' unit.
    pub residuals: Vec<f64>,
}

impl Consensus {
    /// Of at least one face, each N like points in one unit and a frame of its own.
    ///
    /// Each round fits every face to the mean by a similarity (turn, scale, shift), takes the mean of what was fitted and
    /// gives it its size back (Gower 1975), until it no longer moves.
    pub fn of(faces: &[Vec<Point3<f64>>]) -> Result<Self, GridError> {
        let count = faces.first().map_or(0, Vec::len);
        if count < FEWEST || faces.iter().any(|face| face.len() != count) {
            return Err(GridError::TooFewCommon {
                found: faces.iter().map(Vec::len).min().unwrap_or(0),
                wanted: FEWEST,
                remedy: "leave out the scan that lacks them",
            });
        }
        let spreads: Vec<_> = faces
            .iter()
            .enumerate()
            .map(|(face, points)| spread(points).ok_or(GridError::NoExtent { face }))
            .collect::<Result<_, _>>()?;
        let size = spreads.iter().map(|(_, size)| size).sum::<f64>() / spreads.len() as f64;
        let mut points = resized(&faces[0], size).ok_or(GridError::NoExtent { face: 0 })?;
        let (mut rounds, mut change) = (0, f64::INFINITY);
        while change > SETTLED {
            if rounds == ROUNDS {
                return Err(GridError::NotSettled { rounds, change });
            }
            let fits = fitted(faces, &points)?;
            let mut mean = vec![Point3::origin(); count];
            for (fit, face) in fits.iter().zip(faces) {
                for (mean, point) in mean.iter_mut().zip(face) {
                    mean.coords += (fit * point).coords / faces.len() as f64;
                }
            }
            let next = resized(&mean, size).ok_or(GridError::NoExtent { face: 0 })?;
            change = next.iter().zip(&points).map(|(a, b)| (a - b).norm_squared()).sum::<f64>().sqrt() / size;
            points = next;
            rounds += 1;
        }
        let fits = fitted(faces, &points)?;
        let off = |(fit, face): (&Similarity3<f64>, &Vec<Point3<f64>>)| {
            let squares: f64 =
                face.iter().zip(&points).map(|(p, mean)| (fit * p - mean).norm_squared()).sum();
            (squares / count as f64).sqrt()
        };
        let residuals = fits.iter().zip(faces).map(off).collect();
        Ok(Self { points, fits, rounds, residuals })
    }

    /// Root mean square of [`Consensus::residuals`].
    pub fn residual(&self) -> f64 {
        let squares: f64 = self.residuals.iter().map(|off| off * off).sum();
        (squares / self.residuals.len().max(1) as f64).sqrt()
    }

    /// Faces that are off by more than twice as much as half of the faces are: their landmarks are hardly where they
    /// should be.
    pub fn outliers(&self) -> Vec<usize> {
        let mut sorted = self.residuals.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let limit = sorted.get(sorted.len() / 2).map_or(f64::INFINITY, |median| 2.0 * median + 1e-6);
        (0..self.residuals.len()).filter(|face| self.residuals[*face] > limit).collect()
    }
}

fn fitted(faces: &[Vec<Point3<f64>>], points: &[Point3<f64>]) -> Result<Vec<Similarity3<f64>>, GridError> {
    let fit =
        |(face, own): (usize, &Vec<_>)| similarity_between(own, points).ok_or(GridError::NoExtent { face });
    faces.iter().enumerate().map(fit).collect()
}

/// Centred at the origin, with another centroid size.
fn resized(points: &[Point3<f64>], size: f64) -> Option<Vec<Point3<f64>>> {
    let (centre, own) = spread(points)?;
    Some(points.iter().map(|p| Point3::from((p - centre) * (size / own))).collect())
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    use super::*;

    fn shape() -> Vec<Point3<f64>> {
        (0..20)
            .map(f64::from)
            .map(|t| Point3::new(45.0 * (1.3 * t).sin(), 60.0 * (0.7 * t).cos(), 20.0 * (2.1 * t).sin()))
            .collect()
    }

    fn placed(shape: &[Point3<f64>], k: f64) -> Vec<Point3<f64>> {
        let turn = UnitQuaternion::from_euler_angles(0.1 * k, -0.3 * k, 0.2 * k);
        let to = Similarity3::from_parts(Translation3::new(100.0 * k, -k, 9.0), turn, 0.8 + 0.1 * k);
        shape.iter().map(|p| to * p).collect()
    }

    #[test]
    fn scaled_and_turned_copies_align_exactly() {
        let faces: Vec<_> = (0..5).map(|k| placed(&shape(), f64::from(k))).collect();
        let consensus = Consensus::of(&faces).unwrap();
        assert!(consensus.residual() < 1e-9 && consensus.rounds <= 3, "{consensus:?}");
        let (_, size) = spread(&consensus.points).unwrap();
        let (_, own) = spread(&shape()).unwrap();
        // Scales 0.8 … 1.2, whose mean is 1.
        assert!((size / own - 1.0).abs() < 1e-12);
        assert!((consensus.fits[4].scaling() - 1.0 / 1.2).abs() < 1e-12);
        assert!(consensus.points.iter().map(|p| p.coords).sum::<Vector3<f64>>().norm() < 1e-9);
    }

    #[test]
    fn opposite_perturbations_cancel() {
        let base = shape();
        let mut faces = Vec::new();
        for (k, sign) in [1.0, -1.0, 1.0, -1.0].into_iter().enumerate() {
            let i = 3 + 5 * (k / 2);
            let mut face = base.clone();
            face[i] += Vector3::new(2.0, -1.0, 3.0) * sign;
            faces.push(placed(&face, k as f64));
        }
        let consensus = Consensus::of(&faces).unwrap();
        let back = similarity_between(&consensus.points, &base).unwrap();
        let worst =
            consensus.points.iter().zip(&base).map(|(p, b)| (back * p - b).norm()).fold(0.0, f64::max);
        assert!(worst < 0.05, "{worst}");
        assert!(consensus.residual() > 0.3 && consensus.outliers().is_empty());
        let mut odd = vec![base.clone(); 5];
        odd[3][7] += Vector3::new(0.0, 30.0, 0.0);
        assert_eq!(Consensus::of(&odd).unwrap().outliers(), [3]);
    }

    #[test]
    fn useless_faces_are_refused() {
        assert!(Consensus::of(&[]).is_err());
        assert!(Consensus::of(&[shape(), shape()[1..].to_vec()]).is_err());
        assert!(Consensus::of(&[shape()[..3].to_vec()]).is_err());
        let flat = vec![Point3::new(1.0, 2.0, 3.0); 20];
        assert_eq!(Consensus::of(&[shape(), flat]).unwrap_err(), GridError::NoExtent { face: 1 });
    }
}
