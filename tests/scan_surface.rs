//! Nearest points and ray casts against closed forms and against looking at every triangle.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]
#![allow(clippy::float_cmp, reason = "values pass through unchanged")]

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use understudy::scan::{Anchor, Mesh, Surface, vertex_normals};

type P = Point3<f64>;

/// The nearest point of one triangle, by cases over its corners, edges and inside (Ericson, Real-Time Collision
/// Detection, 5.1.5), written apart from the code under test.
fn nearest_on_triangle(p: P, [a, b, c]: [P; 3]) -> P {
    let on_segment = |a: P, b: P| {
        let d = b - a;
        let t = if d.norm_squared() > 0.0 { (p - a).dot(&d) / d.norm_squared() } else { 0.0 };
        a + d * t.clamp(0.0, 1.0)
    };
    let mut candidates = vec![on_segment(a, b), on_segment(b, c), on_segment(c, a)];
    let n = (b - a).cross(&(c - a));
    if n.norm_squared() > 0.0 {
        let q = p - n * ((p - a).dot(&n) / n.norm_squared());
        let inside = [(a, b), (b, c), (c, a)].iter().all(|(s, e)| (e - s).cross(&(q - s)).dot(&n) >= 0.0);
        if inside {
            candidates.push(q);
        }
    }
    candidates.into_iter().min_by(|q, r| (q - p).norm().total_cmp(&(r - p).norm())).unwrap()
}

/// The first distance at which a ray along a unit vector meets a triangle (Möller and Trumbore).
fn ray_on_triangle(o: P, d: Vector3<f64>, [a, b, c]: [P; 3]) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let h = d.cross(&ac);
    let det = ab.dot(&h);
    if det.abs() < 1e-12 {
        return None;
    }
    let s = o - a;
    let u = s.dot(&h) / det;
    let q = s.cross(&ab);
    let v = d.dot(&q) / det;
    let t = ac.dot(&q) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
}

/// A wavy sheet of `n` × `n` quads over ±1.
fn sheet(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..=n {
        for j in 0..=n {
            let (x, y) = (f64::from(j) * 2.0 / f64::from(n) - 1.0, f64::from(i) * 2.0 / f64::from(n) - 1.0);
            mesh.positions.push(P::new(x, y, 0.3 * (3.0 * x).sin() * (2.0 * y).cos()));
        }
    }
    for i in 0..n {
        for j in 0..n {
            let a = i * (n + 1) + j;
            mesh.triangles.extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
        }
    }
    mesh
}

fn corners(mesh: &Mesh, t: u32) -> [P; 3] {
    mesh.triangles[t as usize].map(|i| mesh.positions[i as usize])
}

fn any_point(reach: f64) -> impl Strategy<Value = P> {
    [-reach..reach, -reach..reach, -reach..reach].prop_map(P::from)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn nearest_is_the_nearest_of_all_triangles(p in any_point(1.5)) {
        let mesh = sheet(12);
        let surface = Surface::new(&mesh).unwrap();
        let found = surface.nearest(p).unwrap();
        let wanted = (0..mesh.triangles.len() as u32)
            .map(|t| (nearest_on_triangle(p, corners(&mesh, t)) - p).norm())
            .fold(f64::INFINITY, f64::min);
        prop_assert!(((found.position - p).norm() - wanted).abs() < 1e-12);
        prop_assert!((found.barycentric.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        prop_assert!(found.barycentric.iter().all(|w| (0.0..=1.0).contains(w)));
        let again = surface.at(&found.anchor(), &mesh.positions).unwrap();
        prop_assert!((again - found.position).norm() < 1e-15);
        prop_assert!((found.normal.norm() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_ray_meets_the_first_of_all_triangles(o in any_point(2.0), d in any_point(1.0)) {
        prop_assume!(d.coords.norm() > 1e-3);
        let mesh = sheet(12);
        let surface = Surface::new(&mesh).unwrap();
        let unit = d.coords.normalize();
        let wanted = (0..mesh.triangles.len() as u32)
            .filter_map(|t| ray_on_triangle(o, unit, corners(&mesh, t)))
            .fold(f64::INFINITY, f64::min);
        match surface.cast(o, d.coords * 7.0) {
            Some(hit) => {
                let distance = (hit.position - o).norm();
                // A ray along an edge may be missed by one and met by the other.
                prop_assert!((distance - wanted).abs() < 1e-9, "{distance} against {wanted}");
                prop_assert!((hit.position - (o + unit * distance)).norm() < 1e-9);
            }
            None => prop_assert!(wanted.is_infinite(), "missed at {wanted}"),
        }
    }

    /// Whatever the triangles look like: no panic, weights that are weights, a place that they give.
    #[test]
    fn slivers_and_points_do_not_panic(
        coordinates in proptest::collection::vec(prop_oneof![Just(0.0), Just(1.0), Just(1e-13), -2.0..2.0_f64], 12),
        indices in proptest::collection::vec(0..4_u32, 12),
        p in any_point(3.0),
        d in any_point(1.0),
    ) {
        let mesh = Mesh {
            positions: coordinates.chunks(3).map(|c| P::new(c[0], c[1], c[2])).collect(),
            triangles: indices.chunks(3).map(|t| [t[0], t[1], t[2]]).collect(),
            ..Mesh::default()
        };
        let Ok(surface) = Surface::new(&mesh) else { return Ok(()) };
        let found = surface.nearest(p).unwrap();
        let wanted = (0..mesh.triangles.len() as u32)
            .map(|t| (nearest_on_triangle(p, corners(&mesh, t)) - p).norm())
            .fold(f64::INFINITY, f64::min);
        prop_assert!(((found.position - p).norm() - wanted).abs() < 1e-6, "{found:?} against {wanted}");
        for hit in [Some(found), surface.cast(p, d.coords)].into_iter().flatten() {
            prop_assert!(hit.barycentric.iter().all(|w| (0.0..=1.0).contains(w)));
            prop_assert!(hit.position.iter().chain(hit.normal.iter()).all(|c| c.is_finite()));
        }
        prop_assert!(vertex_normals(&mesh).iter().all(|n| (n.norm() - 1.0).abs() < 1e-9));
    }
}

#[test]
fn both_sides_of_a_quad() {
    let mesh = Mesh {
        positions: vec![
            P::new(0.0, 0.0, 0.0),
            P::new(2.0, 0.0, 0.0),
            P::new(2.0, 2.0, 0.0),
            P::new(0.0, 2.0, 0.0),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let surface = Surface::new(&mesh).unwrap();
    for z in [5.0, -5.0] {
        let hit = surface.cast(P::new(1.5, 0.5, z), Vector3::new(0.0, 0.0, -z)).unwrap();
        assert_eq!(hit.triangle, 0);
        assert!((hit.position - P::new(1.5, 0.5, 0.0)).norm() < 1e-15);
        assert_eq!(hit.normal, Vector3::z());
        assert_eq!(surface.nearest(P::new(1.5, 0.5, z)).unwrap().position, hit.position);
        assert!(surface.cast(P::new(1.5, 0.5, z), Vector3::new(0.0, 0.0, z)).is_none());
    }
    // An anchor follows the mesh.
    let anchor = surface.nearest(P::new(1.0, 0.5, 1.0)).unwrap().anchor();
    let moved: Vec<P> = mesh.positions.iter().map(|p| P::from(p.coords * 3.0)).collect();
    assert!((surface.at(&anchor, &moved).unwrap() - P::new(3.0, 1.5, 0.0)).norm() < 1e-15);
    assert_eq!(surface.at(&Anchor { triangle: 9, ..anchor }, &moved), None);
    assert_eq!(surface.at(&anchor, &moved[..1]), None);
    assert_eq!(surface.nearest_vertex(P::new(1.9, 1.8, 0.0)).unwrap().0, 2);
    assert_eq!(surface.nearest_vertex(P::new(1.0, 1.0, 0.0)).unwrap(), (0, 2.0_f64.sqrt()));
}

#[test]
fn what_is_not_finite_finds_nothing() {
    let surface = Surface::new(&sheet(2)).unwrap();
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        assert_eq!(surface.nearest(P::new(bad, 0.0, 0.0)), None);
        assert_eq!(surface.nearest_vertex(P::new(0.0, bad, 0.0)), None);
        assert_eq!(surface.cast(P::new(0.0, 0.0, bad), Vector3::z()), None);
    }
    assert_eq!(surface.cast(P::origin(), Vector3::zeros()), None);
    assert_eq!(surface.cast(P::origin(), Vector3::new(f64::NAN, 0.0, 1.0)), None);
    assert!(Surface::new(&Mesh::default()).is_err());
}
