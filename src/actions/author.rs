//! Measuring an action: control points carried from a neutral scan to an expressive one (000 §5.5.3).
//!
//! The landmark spline of neutral → expressive carries the control points, which are then moved to the nearest point of
//! the expressive surface, and v = P′ − P (eq. 5.5, 5.6). Where both scans share one mesh, the mesh itself says where a
//! point went, without spline and snapping. The vectors are then carried to the average face by the f-rule.

use nalgebra::{Point3, Rotation3, Vector3};

use super::{ActionError, ActionLibrary, Catalogue};
use crate::{
    anatomy::{Lip, SidedSkin, SkinPlace, alike_pairs, eye_landmarks, face_spline},
    head::rotation_between,
    lift::{Side, WIDEST_CLOSURE},
    scan::{Mesh, Surface},
    spline::{Kernel, Options, Regularisation, Spline},
    tracking::{SKIN_LANDMARK_COUNT, is_still},
};

/// Common landmarks that two faces need at least: the thesis has 22.
const FEWEST: usize = 12;
/// λ of neutral → expressive in the unit box: only so much that coinciding landmarks do no harm.
const CARRY: f64 = 1e-6;

/// An expressive scan of a face whose neutral is known.
pub struct Expressive<'a> {
    /// V′ vertices, scan frame, millimetres.
    pub mesh: &'a Mesh,
    /// Its surface.
    pub surface: &'a Surface,
    /// Its landmarks.
    pub landmarks: &'a [Option<Point3<f64>>],
}

/// What one pair of scans shows, on the neutral scan's own face.
#[derive(Debug, Clone)]
pub struct Measured {
    /// Where the handles lie on the neutral, scan frame, millimetres.
    pub places: Vec<Option<Point3<f64>>>,
    /// How far each went.
    pub vectors: Vec<Option<Vector3<f64>>>,
    /// How far the right and the left eye closed: 1 is shut, below 0 is wider.
    pub closure: [f64; 2],
    /// Whether the mesh carried the points, and not the landmark spline.
    pub by_mesh: bool,
    /// Landmarks that only one of the two has.
    pub missing: Vec<usize>,
}

/// Measures a pair. Both in their scan frames and millimetres; they need not lie in the same place.
pub fn measure(
    neutral: (&Mesh, &Surface, &[Option<Point3<f64>>]),
    expressive: &Expressive<'_>,
) -> Result<Measured, ActionError> {
    let (mesh, surface, landmarks) = neutral;
    if mesh.triangles == expressive.mesh.triangles && mesh.positions.len() == expressive.mesh.positions.len()
    {
        let moved = held_together(&mesh.positions, &expressive.mesh.positions);
        let skin = SidedSkin::of_scan(mesh, surface, landmarks).ok_or(ActionError::TooFewLandmarks {
            found: 0,
            wanted: FEWEST,
            what: "scans, which have no triangles".to_owned(),
        })?;
        return Ok(measure_moved(surface, &skin, landmarks, &moved));
    }
    let missing: Vec<usize> = (0..SKIN_LANDMARK_COUNT)
        .filter(|&i| landmarks[i].is_some() != expressive.landmarks[i].is_some())
        .collect();
    let common: Vec<usize> = (0..SKIN_LANDMARK_COUNT)
        .filter(|&i| landmarks[i].is_some() && expressive.landmarks[i].is_some())
        .collect();
    let what = || "the neutral and the expressive scan".to_owned();
    if common.len() < FEWEST {
        return Err(ActionError::TooFewLandmarks { found: common.len(), wanted: FEWEST, what: what() });
    }
    // The pair is brought together by what hardly moves.
    let at = |list: &[Option<Point3<f64>>], i: usize| list[i].unwrap_or_else(Point3::origin);
    let still: Vec<usize> = common.iter().copied().filter(|&i| is_still(i)).collect();
    let basis = if still.len() >= FEWEST { &still } else { &common };
    let from: Vec<_> = basis.iter().map(|&i| at(expressive.landmarks, i).coords).collect();
    let to: Vec<_> = basis.iter().map(|&i| at(landmarks, i).coords).collect();
    let back = Rigid::between(&from, &to);

    let centres: Vec<_> = common.iter().map(|&i| at(landmarks, i)).collect();
    let values: Vec<_> = common.iter().map(|&i| at(expressive.landmarks, i).coords).collect();
    let options = Options { regularisation: Regularisation::UnitBox(CARRY), ..Options::default() };
    let carry = Spline::fit(Kernel::ThinPlate, &centres, &values, options)
        .map_err(|source| ActionError::Spline { what: what(), source })?;
    let places = Catalogue::get().place(landmarks, surface);
    let arrived = |handle: usize, place: &Point3<f64>| -> Option<Point3<f64>> {
        if handle < SKIN_LANDMARK_COUNT {
            return expressive.landmarks[handle];
        }
        Some(expressive.surface.nearest(carry.evaluate(place).into())?.position)
    };
    let vectors: Vec<_> = places
        .iter()
        .enumerate()
        .map(|(handle, place)| Some(back.apply(&arrived(handle, place.as_ref()?)?) - (*place)?))
        .collect();
    let closure = closures(&places, &vectors);
    Ok(Measured { places, vectors, closure, by_mesh: false, missing })
}

/// Measures a pair that shares one mesh: `moved` are the expressive scan's vertices, held together with the neutral's.
/// Landmarks of a lip are looked for on that lip, as far as `skin` knows the lips' sides.
pub fn measure_moved(
    surface: &Surface,
    skin: &SidedSkin,
    landmarks: &[Option<Point3<f64>>],
    moved: &[Point3<f64>],
) -> Measured {
    let found: Vec<Option<SkinPlace>> = Catalogue::get()
        .place(landmarks, surface)
        .into_iter()
        .enumerate()
        .map(|(handle, place)| skin.nearest(Lip::of(handle), place?))
        .collect();
    let places: Vec<_> = found.iter().map(|place| place.map(|place| place.position)).collect();
    let vectors: Vec<_> = found
        .iter()
        .map(|place| {
            let place = (*place)?;
            Some(place.on(moved)? - place.position)
        })
        .collect();
    let closure = closures(&places, &vectors);
    Measured { places, vectors, closure, by_mesh: true, missing: Vec::new() }
}

impl Measured {
    /// The vectors on the library's face: v′ = J·v with J the Jacobian of the regularised landmark spline there.
    pub fn on_average(&self, library: &ActionLibrary) -> Result<Vec<Option<Vector3<f64>>>, ActionError> {
        let pairs = alike_pairs(|i| self.places[i], |i| Some(library.face[i]));
        let what = || "the neutral scan and the average face".to_owned();
        if pairs.len() < FEWEST {
            return Err(ActionError::TooFewLandmarks { found: pairs.len(), wanted: FEWEST, what: what() });
        }
        let eyes = match (self.places[33], self.places[263]) {
            (Some(right), Some(left)) => (right - left).norm(),
            _ => 90.0,
        };
        let bend =
            face_spline(&pairs, eyes).map_err(|source| ActionError::Spline { what: what(), source })?;
        Ok(self.places.iter().zip(&self.vectors).map(|(p, v)| Some(bend.jacobian(&(*p)?) * (*v)?)).collect())
    }

    /// How far an action of one side, or of both, closes the right and the left eye. What is too little to be told from
    /// the landmarks' own noise is 0.
    pub fn closure_of(&self, side: Option<Side>) -> [f64; 2] {
        /// Share of the open eye.
        const NOISE: f64 = 0.03;
        let own = |eye: usize| {
            let closure = self.closure[eye];
            let other = side.is_some_and(|side| Side::BOTH[eye] != side);
            if other || closure.abs() < NOISE { 0.0 } else { closure.clamp(WIDEST_CLOSURE, 1.0) }
        };
        [own(0), own(1)]
    }

    /// The vectors that belong to one side: all of that half, none of the other, and half and half on the midline.
    /// `places` are the library's.
    pub fn half(
        vectors: &[Option<Vector3<f64>>],
        places: &[Point3<f64>],
        side: Side,
    ) -> Vec<Option<Vector3<f64>>> {
        /// Millimetres from the midline over which one side fades into the other.
        const FADE: f64 = 8.0;
        vectors
            .iter()
            .zip(places)
            .map(|(vector, place)| {
                let left = f64::midpoint(place.x / FADE, 1.0).clamp(0.0, 1.0);
                let share = if side == Side::Left { left } else { 1.0 - left };
                vector.map(|vector| vector * (share * share * (3.0 - 2.0 * share)))
            })
            .collect()
    }
}

/// A turn and a shift.
struct Rigid {
    turn: Rotation3<f64>,
    from: Vector3<f64>,
    to: Vector3<f64>,
}

impl Rigid {
    fn between(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Self {
        let mean = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        Self { turn: rotation_between(from, to), from: mean(from), to: mean(to) }
    }

    fn apply(&self, point: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.turn * (point.coords - self.from) + self.to)
    }
}

/// The expressive vertices brought to the neutral's by the half of the vertices that moved least.
fn held_together(neutral: &[Point3<f64>], expressive: &[Point3<f64>]) -> Vec<Point3<f64>> {
    const ROUNDS: usize = 4;
    let mut moved = expressive.to_vec();
    for _ in 0..ROUNDS {
        let mut order: Vec<usize> = (0..neutral.len()).collect();
        let distance = |i: &usize| (moved[*i] - neutral[*i]).norm_squared();
        order.sort_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)));
        order.truncate((neutral.len() / 2).max(3));
        let from: Vec<_> = order.iter().map(|&i| moved[i].coords).collect();
        let to: Vec<_> = order.iter().map(|&i| neutral[i].coords).collect();
        if distance(&order[order.len() - 1]) < 1e-18 {
            break;
        }
        let rigid = Rigid::between(&from, &to);
        for point in &mut moved {
            *point = rigid.apply(point);
        }
    }
    moved
}

/// How far the lids came together, right and left; 0 where their rims are not known or were shut before.
fn closures(places: &[Option<Point3<f64>>], vectors: &[Option<Vector3<f64>>]) -> [f64; 2] {
    /// Eyes less open than this share of their width have no closure.
    const OPEN: f64 = 0.08;
    Side::BOTH.map(|side| {
        let eye = eye_landmarks(side);
        let gap = |moved: bool| -> Option<f64> {
            let at = |i: usize| {
                let place = places[i]?;
                Some(if moved { place + vectors[i]? } else { place })
            };
            let gaps: Option<Vec<f64>> = eye.upper[2..5]
                .iter()
                .zip(&eye.lower[2..5])
                .map(|(&u, &l)| Some(at(u)?.y - at(l)?.y))
                .collect();
            Some(gaps?.iter().sum::<f64>() / 3.0)
        };
        let width = places[eye.outer].zip(places[eye.inner]).map(|(a, b)| (a - b).norm());
        match (gap(false), gap(true), width) {
            (Some(rest), Some(now), Some(width)) if rest > OPEN * width => 1.0 - now.max(0.0) / rest,
            _ => 0.0,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How far a vector may be from what moved the surface, millimetres: what a mesh of 4 mm rounds off, and what the
    /// spline guesses between landmarks besides.
    const BY_MESH: f64 = 0.15;
    const BY_SPLINE: f64 = 0.5;

    /// A face-sized dome with the average face's landmarks on it.
    fn dome(step: f64, moved: impl Fn(Point3<f64>) -> Point3<f64>) -> (Mesh, Surface) {
        let count = (240.0 / step) as u32;
        let at = |i: u32, j: u32| {
            let (x, y) = (f64::from(i) * step - 120.0, f64::from(j) * step - 120.0);
            moved(Point3::new(x, y, -(x * x + 0.6 * y * y) / 150.0))
        };
        let positions = (0..=count).flat_map(|j| (0..=count).map(move |i| (i, j))).map(|(i, j)| at(i, j));
        let corner = |i: u32, j: u32| j * (count + 1) + i;
        let triangles = (0..count).flat_map(|j| (0..count).map(move |i| (i, j))).flat_map(|(i, j)| {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[a, b, c], [a, c, d]]
        });
        let mesh = Mesh { positions: positions.collect(), triangles: triangles.collect(), ..Mesh::default() };
        let surface = Surface::new(&mesh).unwrap();
        (mesh, surface)
    }

    /// A smile of up to 7 mm about the corners of the average face's mouth.
    fn smile(p: Point3<f64>) -> Vector3<f64> {
        let face = &ActionLibrary::built_in().face;
        let pull = |corner: usize, way: Vector3<f64>| {
            let to = p - face[corner];
            way * (-(to.x * to.x + to.y * to.y) / 450.0).exp()
        };
        pull(61, Vector3::new(-5.0, 4.0, 1.0)) + pull(291, Vector3::new(5.0, 4.0, 1.0))
    }

    /// Farthest that a vector is from the smile at its place, millimetres.
    fn worst(measured: &Measured) -> f64 {
        let off =
            |(p, v): (&Option<Point3<f64>>, &Option<Vector3<f64>>)| (v.unwrap() - smile(p.unwrap())).norm();
        measured.places.iter().zip(&measured.vectors).map(off).fold(0.0, f64::max)
    }

    #[test]
    fn one_mesh_carries_every_point_and_another_does_so_by_the_spline() {
        let (neutral, surface) = dome(4.0, |p| p);
        let face = &ActionLibrary::built_in().face[..SKIN_LANDMARK_COUNT];
        let mut landmarks: Vec<_> = face
            .iter()
            .map(|p| surface.cast(Point3::new(p.x, p.y, 200.0), -Vector3::z()).map(|hit| hit.position))
            .collect();
        let turn = Rotation3::from_euler_angles(0.04, -0.06, 0.02);
        let posed = |p: Point3<f64>| turn * (p + smile(p)) + Vector3::new(2.0, -3.0, 5.0);

        let (mesh, other) = dome(4.0, posed);
        let at_rest = (&neutral, &surface, landmarks.as_slice());
        let expressive = Expressive { mesh: &mesh, surface: &other, landmarks: &[] };
        let measured = measure(at_rest, &expressive).unwrap();
        assert!(measured.by_mesh && measured.missing.is_empty());
        assert!(worst(&measured) < BY_MESH, "{}", worst(&measured));

        let (mesh, other) = dome(3.1, posed);
        let mut moved: Vec<_> = landmarks.iter().map(|p| p.map(posed)).collect();
        let expressive = Expressive { mesh: &mesh, surface: &other, landmarks: &moved };
        let measured = measure(at_rest, &expressive).unwrap();
        assert!(!measured.by_mesh && measured.missing.is_empty());
        assert!(worst(&measured) < BY_SPLINE, "{}", worst(&measured));

        (landmarks[10], moved[152], moved[0]) = (None, None, None);
        let expressive = Expressive { mesh: &mesh, surface: &other, landmarks: &moved };
        let measured = measure((&neutral, &surface, &landmarks), &expressive).unwrap();
        assert_eq!(measured.missing, [0, 10, 152]);
        assert!([0, 10, 152].iter().all(|&i| measured.vectors[i].is_none()));

        moved.fill(None);
        let expressive = Expressive { mesh: &mesh, surface: &other, landmarks: &moved };
        let few = measure((&neutral, &surface, &landmarks), &expressive).unwrap_err();
        assert!(matches!(few, ActionError::TooFewLandmarks { found: 0, .. }));
    }

    #[test]
    fn closures_go_to_the_side_that_acts() {
        let close = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12;
        let measured = Measured {
            places: Vec::new(),
            vectors: Vec::new(),
            closure: [0.9, -0.02],
            by_mesh: true,
            missing: Vec::new(),
        };
        assert!(close(measured.closure_of(None), [0.9, 0.0]));
        assert!(close(measured.closure_of(Some(Side::Right)), [0.9, 0.0]));
        assert!(close(measured.closure_of(Some(Side::Left)), [0.0, 0.0]));
    }

    #[test]
    fn halves_add_up_to_the_whole() {
        let places: Vec<_> = (-10..=10).map(|x| Point3::new(f64::from(x) * 2.0, 0.0, 0.0)).collect();
        let vectors = vec![Some(Vector3::new(1.0, -2.0, 3.0)); places.len()];
        let right = Measured::half(&vectors, &places, Side::Right);
        let left = Measured::half(&vectors, &places, Side::Left);
        for ((right, left), whole) in right.iter().zip(&left).zip(&vectors) {
            assert!((right.unwrap() + left.unwrap() - whole.unwrap()).norm() < 1e-12);
        }
        assert!(right[20].unwrap().norm() < 1e-12 && left[0].unwrap().norm() < 1e-12);
    }

    #[test]
    fn a_pair_that_was_turned_and_shifted_comes_together() {
        let neutral: Vec<_> = (0..60)
            .map(|i| {
                let t = f64::from(i);
                Point3::new(60.0 * t.sin(), 80.0 * (1.7 * t).cos(), 30.0 * (0.9 * t).sin())
            })
            .collect();
        let turn = Rotation3::from_euler_angles(0.05, -0.03, 0.02);
        let expressive: Vec<_> = neutral
            .iter()
            .enumerate()
            .map(|(i, p)| turn * (p + if i % 5 == 0 { Vector3::y() * 6.0 } else { Vector3::zeros() }))
            .map(|p| p + Vector3::new(3.0, -2.0, 1.0))
            .collect();
        let moved = held_together(&neutral, &expressive);
        for (i, (moved, neutral)) in moved.iter().zip(&neutral).enumerate() {
            let wanted = if i % 5 == 0 { Vector3::y() * 6.0 } else { Vector3::zeros() };
            assert!((moved - neutral - wanted).norm() < 0.05, "{i}: {}", moved - neutral);
        }
    }
}
