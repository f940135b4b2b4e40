//! From the frame of the performance to the frame of the model (001 §4.1.1).
//!
//! ᴹp = sR ᴾp + t, with s, R and t solved in turn until the error settles; then the virtual markers slide along the normals
//! to where the surface is nearest to the real ones, and all is done again. Both halves can only bring real and virtual
//! markers closer together.
//!
//! Different here: 001 aligns a performer with a model of himself, and adjusts "slightly". On another's face, virtual
//! markers would slide off the features that they stand for, so that there is a farthest they may.

use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use super::{MarkerMap, MuscleError, marker_guess::mean};
use crate::{
    head::rotation_between,
    scan::{Anchor, Surface, SurfacePoint},
};

/// Fewer markers would fit anything.
const FEWEST: usize = 4;
/// The error has settled when a round takes less than this share of it away.
const SETTLED: f64 = 1e-3;
/// Rounds; a take and a face of different shapes need some ten.
const MOST_ROUNDS: usize = 100;
/// Markers that spread less than this share of their length in every other direction lie in one line.
const FLAT: f64 = 1e-3;

/// How far virtual markers may slide on a face that is not the performer's own, millimetres: about as far as studios differ
/// about where a marker of one name sits.
pub const OTHER_FACE_REACH: f64 = 8.0;

/// How a performance lies on a model.
#[derive(Debug, Clone)]
pub struct Alignment {
    /// Millimetres of the model in one unit of the performance.
    pub scale: f64,
    /// From the performance's axes to the model's.
    pub rotation: Rotation3<f64>,
    /// Millimetres, model frame.
    pub translation: Vector3<f64>,
    /// M virtual markers, on the model's surface; `None` where a marker is off or not in the neutral.
    pub markers: Vec<Option<Anchor>>,
    /// M real markers of the neutral, model frame, millimetres; `None` as above.
    pub rest: Vec<Option<Point3<f64>>>,
    /// Root mean square distance between real and virtual markers, millimetres: with the virtual markers where they were
    /// put, then after each round of sliding. Never ascends.
    pub errors: Vec<f64>,
}

impl Alignment {
    /// A place of the performance in the model frame, millimetres.
    pub fn to_model(&self, place: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.rotation * place.coords * self.scale + self.translation)
    }

    /// Root mean square distance between real and virtual markers before these slide, millimetres.
    pub fn error_before(&self) -> f64 {
        self.errors.first().copied().unwrap_or_default()
    }

    /// The same at the end.
    pub fn error_after(&self) -> f64 {
        self.errors.last().copied().unwrap_or_default()
    }

    /// How often the virtual markers slid.
    pub fn rounds(&self) -> usize {
        self.errors.len().saturating_sub(1)
    }
}

/// Where `map` puts the markers `names` on a face with these `landmarks` (468 or 478, `None` where the face has none):
/// M places in the face's frame, not yet on its surface; `None` for markers that are off, or whose landmarks are missing.
pub fn virtual_markers(
    map: &MarkerMap,
    names: &[String],
    landmarks: &[Option<Point3<f64>>],
) -> Vec<Option<Point3<f64>>> {
    map.landmarks(names).map(|at| mean(at, |landmark| landmarks.get(landmark).copied().flatten())).collect()
}

/// Aligns the markers of a neutral face, M places in the frame and unit of the performance, with `start`, M places near
/// the model's `surface` (model frame, millimetres). Markers that either lacks do not count.
///
/// Virtual markers slide no farther than `reach` millimetres from `start`: [`OTHER_FACE_REACH`], or infinitely far on the
/// performer's own face, as 001 has it. `surface` is the skin of the neutral model: on an opened scan the mouth's inside
/// would be near to lips as well.
pub fn align(
    neutral: &[Option<Point3<f64>>],
    start: &[Option<Point3<f64>>],
    surface: &Surface,
    reach: f64,
) -> Result<Alignment, MuscleError> {
    let mut used = Vec::new();
    let mut real = Vec::new();
    let mut slid: Vec<SurfacePoint> = Vec::new();
    for (marker, pair) in neutral.iter().zip(start).enumerate() {
        let (Some(seen), Some(place)) = pair else { continue };
        let Some(on_surface) = surface.nearest(*place) else { continue };
        used.push(marker);
        real.push(*seen);
        slid.push(on_surface);
    }
    let fault = |reason: String| MuscleError::Alignment {
        reason,
        remedy: "Start the take with a neutral face that shows its markers, and say in the mapping where they sit",
    };
    if used.len() < FEWEST {
        return Err(fault(format!("{} of {} are in the neutral and on the face", used.len(), neutral.len())));
    }
    let centred = Centred::new(&real);
    if !centred.tells() {
        return Err(fault("they lie in one line or place".to_owned()));
    }
    let solve = |slid: &[SurfacePoint]| {
        let solved = centred.in_turn(&slid.iter().map(|p| p.position).collect::<Vec<_>>());
        solved.ok_or_else(|| fault("their size is lost".to_owned()))
    };
    let put: Vec<Point3<f64>> = slid.iter().map(|point| point.position).collect();
    let mut solved = solve(&slid)?;
    let mut errors = vec![solved.error];
    for _ in 0..MOST_ROUNDS {
        let mut next = slid.clone();
        for ((marker, put), point) in real.iter().zip(&put).zip(&mut next) {
            let marker = solved.place(marker);
            let apart = marker - put;
            let within = put + apart * (reach / apart.norm().max(f64::MIN_POSITIVE)).min(1.0);
            // The nearest point lies along the normal. On the far side of a thin part it would be another place.
            if let Some(found) = surface.nearest(within)
                && found.normal.dot(&point.normal) > 0.0
                && (found.position - marker).norm() < (point.position - marker).norm()
            {
                *point = found;
            }
        }
        let again = solve(&next)?;
        let last = solved.error;
        if again.error > last {
            break;
        }
        (slid, solved) = (next, again);
        errors.push(solved.error);
        if last - solved.error <= SETTLED * last {
            break;
        }
    }
    let mut markers = vec![None; neutral.len()];
    let mut rest = vec![None; neutral.len()];
    for ((marker, point), real) in used.into_iter().zip(&slid).zip(&real) {
        markers[marker] = Some(point.anchor());
        rest[marker] = Some(solved.place(real));
    }
    let Solved { scale, rotation, translation, .. } = solved;
    Ok(Alignment { scale, rotation, translation, markers, rest, errors })
}

#[derive(Debug, Clone, Copy)]
struct Solved {
    scale: f64,
    rotation: Rotation3<f64>,
    translation: Vector3<f64>,
    error: f64,
}

impl Solved {
    fn place(&self, real: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.rotation * real.coords * self.scale + self.translation)
    }
}

/// Real markers about their mean: from afar, scale and shift would hide each other and settle slowly.
struct Centred {
    mean: Vector3<f64>,
    vectors: Vec<Vector3<f64>>,
}

impl Centred {
    fn new(real: &[Point3<f64>]) -> Self {
        let mean = real.iter().map(|p| p.coords).sum::<Vector3<f64>>() / real.len().max(1) as f64;
        Self { mean, vectors: real.iter().map(|p| p.coords - mean).collect() }
    }

    /// Whether the markers spread in two directions at least, so that there is one rotation.
    fn tells(&self) -> bool {
        let spread: Matrix3<f64> = self.vectors.iter().map(|v| v * v.transpose()).sum();
        let mut along = spread.symmetric_eigenvalues();
        along.as_mut_slice().sort_by(f64::total_cmp);
        along[2].is_normal() && along[1] > FLAT * FLAT * along[2]
    }

    /// The least-squares t, R and s to the virtual markers, each with the others held, until the error settles; `None`
    /// where there is no scale.
    fn in_turn(&self, markers: &[Point3<f64>]) -> Option<Solved> {
        const MOST: usize = 50;
        let count = markers.len().max(1) as f64;
        let size: f64 = self.vectors.iter().map(Vector3::norm_squared).sum();
        let pairs = || self.vectors.iter().zip(markers);
        let (mut scale, mut rotation) = (1.0, Rotation3::identity());
        let mut best: Option<Solved> = None;
        for _ in 0..MOST {
            let shift = pairs().map(|(p, m)| m.coords - rotation * p * scale).sum::<Vector3<f64>>() / count;
            let shifted: Vec<Vector3<f64>> = markers.iter().map(|m| m.coords - shift).collect();
            rotation = rotation_between(&self.vectors, &shifted);
            scale = self.vectors.iter().zip(&shifted).map(|(p, m)| (rotation * p).dot(m)).sum::<f64>() / size;
            if !(scale.is_normal() && scale > 0.0) {
                return None;
            }
            let left: f64 =
                pairs().map(|(p, m)| (m.coords - rotation * p * scale - shift).norm_squared()).sum();
            let error = (left / count).sqrt();
            if best.is_some_and(|best| error >= best.error) {
                break;
            }
            let translation = shift - rotation * self.mean * scale;
            best = Some(Solved { scale, rotation, translation, error });
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Similarity3, UnitQuaternion};
    use proptest::prelude::*;

    use super::*;
    use crate::{grid::similarity_between, scan::Mesh};

    type P = Point3<f64>;

    /// A bumpy ball of 60 mm, denser than markers are.
    fn ball() -> (Mesh, Surface) {
        let (rows, columns) = (48_u32, 96_u32);
        let mut mesh = Mesh::default();
        for i in 0..=rows {
            for j in 0..columns {
                let (theta, phi) = (
                    std::f64::consts::PI * (f64::from(i) + 0.5) / (f64::from(rows) + 1.0),
                    std::f64::consts::TAU * f64::from(j) / f64::from(columns),
                );
                let radius = 60.0 + 6.0 * (3.0 * phi).sin() * theta.sin() + 4.0 * (2.0 * theta).cos();
                let d = Vector3::new(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos());
                mesh.positions.push(P::from(d * radius));
            }
        }
        for i in 0..rows {
            for j in 0..columns {
                let (a, b) = (i * columns + j, i * columns + (j + 1) % columns);
                mesh.triangles.extend([[a, a + columns, b + columns], [a, b + columns, b]]);
            }
        }
        let surface = Surface::new(&mesh).unwrap();
        (mesh, surface)
    }

    /// A performance in decimetres, turned and far off.
    fn performance() -> Similarity3<f64> {
        let turn = UnitQuaternion::from_euler_angles(0.7, -2.1, 0.4);
        Similarity3::from_parts(Vector3::new(130.0, -750.0, 20.0).into(), turn, 0.01)
    }

    fn on_front(mesh: &Mesh, every: usize) -> Vec<P> {
        mesh.positions.iter().copied().filter(|p| p.z > 10.0).step_by(every).collect()
    }

    fn some(points: &[P]) -> Vec<Option<P>> {
        points.iter().copied().map(Some).collect()
    }

    #[test]
    fn a_known_similarity_comes_back() {
        let (mesh, surface) = ball();
        let markers = on_front(&mesh, 31);
        let away = performance();
        let mut real: Vec<_> = markers.iter().map(|p| Some(away * p)).collect();
        real[3] = None;
        let mut start = some(&markers);
        start[5] = None;
        let found = align(&real, &start, &surface, f64::INFINITY).unwrap();
        let wanted = away.inverse();
        assert!((found.scale - wanted.scaling()).abs() < 1e-9);
        assert!(
            (found.rotation.matrix() - wanted.isometry.rotation.to_rotation_matrix().matrix()).norm() < 1e-9
        );
        for (j, marker) in markers.iter().enumerate() {
            assert!((found.to_model(&(away * marker)) - marker).norm() < 1e-8);
            assert_eq!(found.markers[j].is_some(), j != 3 && j != 5);
            if let Some(anchor) = &found.markers[j] {
                assert!((surface.at(anchor, &mesh.positions).unwrap() - marker).norm() < 1e-8);
                assert!((found.rest[j].unwrap() - marker).norm() < 1e-8);
            }
        }
        assert!(found.error_before() < 1e-8 && found.error_after() <= found.error_before());
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

        /// Whatever the unit, the axes and the origin of the performance.
        #[test]
        fn any_similarity_comes_back(
            angles in [-3.0..3.0_f64, -1.5..1.5_f64, -3.0..3.0_f64],
            magnitude in -3.0..3.0_f64,
            shift in [-10.0..10.0_f64, -10.0..10.0_f64, -10.0..10.0_f64],
        ) {
            let (mesh, _) = ball();
            let markers = on_front(&mesh, 61);
            let scale = 10.0_f64.powf(magnitude);
            let turn = UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]);
            let away = Similarity3::from_parts((Vector3::from(shift) * 100.0 * scale).into(), turn, scale);
            let real: Vec<P> = markers.iter().map(|p| away * p).collect();
            let solved = Centred::new(&real).in_turn(&markers).unwrap();
            prop_assert!((solved.scale * scale - 1.0).abs() < 1e-9);
            prop_assert!(real.iter().zip(&markers).all(|(p, m)| (solved.place(p) - m).norm() < 1e-8));
        }
    }

    #[test]
    fn solving_in_turn_ends_at_the_joint_optimum() {
        let (mesh, _) = ball();
        let markers = on_front(&mesh, 17);
        let away = performance();
        let astray =
            |k: usize| Vector3::new((k as f64).sin(), (3.0 * k as f64).cos(), (k as f64 * 0.7).sin()) * 4.0;
        let real: Vec<P> = markers.iter().enumerate().map(|(k, p)| away * (p + astray(k))).collect();
        let solved = Centred::new(&real).in_turn(&markers).unwrap();
        let joint = similarity_between(&real, &markers).unwrap();
        assert!((solved.scale / joint.scaling() - 1.0).abs() < 1e-9);
        assert!(real.iter().all(|p| (solved.place(p) - joint * p).norm() < 1e-7));
    }

    #[test]
    fn markers_put_amiss_slide_to_where_they_are() {
        let (mesh, surface) = ball();
        let normals = crate::scan::vertex_normals(&mesh);
        let chosen: Vec<usize> =
            (0..mesh.positions.len()).filter(|i| mesh.positions[*i].z > 10.0).step_by(29).collect();
        let away = performance();
        // Real markers stand off the skin by their radius; virtual ones were put up to 4 mm beside.
        let real: Vec<P> = chosen.iter().map(|&i| away * (mesh.positions[i] + normals[i] * 1.5)).collect();
        let amiss: Vec<P> = chosen
            .iter()
            .map(|&i| {
                let k = i as f64;
                mesh.positions[i] + Vector3::new(k.sin(), (1.7 * k).cos(), 0.3 * k.cos()) * 4.0
            })
            .collect();
        let found = align(&some(&real), &some(&amiss), &surface, f64::INFINITY).unwrap();
        assert!(found.errors.windows(2).all(|pair| pair[1] <= pair[0]), "{:?}", found.errors);
        assert!(found.error_before() > 2.0 && found.error_after() < 0.5, "{:?}", found.errors);
        assert!(found.rounds() < MOST_ROUNDS);
        assert!((found.scale / away.inverse().scaling() - 1.0).abs() < 0.04, "{}", found.scale);
        let off: f64 = chosen
            .iter()
            .zip(&found.markers)
            .map(|(&i, anchor)| {
                (surface.at(&anchor.unwrap(), &mesh.positions).unwrap() - mesh.positions[i]).norm()
            })
            .sum::<f64>()
            / chosen.len() as f64;
        assert!(off < 1.0, "{off}");

        // Held back, they end farther from the real ones, and no farther from where they were put than they may.
        let held = align(&some(&real), &some(&amiss), &surface, 2.0).unwrap();
        assert!(held.errors.windows(2).all(|pair| pair[1] <= pair[0]), "{:?}", held.errors);
        assert!(held.error_after() > found.error_after());
        for (put, anchor) in amiss.iter().zip(&held.markers) {
            let put = surface.nearest(*put).unwrap().position;
            let at = surface.at(&anchor.unwrap(), &mesh.positions).unwrap();
            assert!((at - put).norm() < 2.0 * 2.0, "{at} {put}");
        }
    }

    #[test]
    fn what_cannot_be_aligned_is_refused() {
        let (mesh, surface) = ball();
        let markers = on_front(&mesh, 200);
        let reason =
            |real: &[Option<P>]| align(real, &some(&markers), &surface, 8.0).unwrap_err().to_string();
        assert!(reason(&[]).contains("0 of 0"));
        let mut three = vec![None; markers.len()];
        three[..3].copy_from_slice(&some(&markers[..3]));
        assert!(reason(&three).contains(&format!("3 of {}", markers.len())));
        assert!(reason(&vec![Some(P::new(4.0, 5.0, 6.0)); markers.len()]).contains("one line or place"));
        let line: Vec<_> = (0..markers.len()).map(|k| Some(P::new(k as f64, 2.0 * k as f64, 7.0))).collect();
        assert!(reason(&line).contains("one line or place"));
    }
}
