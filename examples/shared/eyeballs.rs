//! Balls for faces that have none: an iris looks along +z.

use nalgebra::{Point3, Vector3};
use understudy::scan::Mesh;

/// Adds a ball with pupil and iris to a mesh whose vertices have colours.
pub fn add_eyeball(mesh: &mut Mesh, centre: Point3<f64>, radius: f64) {
    const STEPS: usize = 24;
    let first = mesh.positions.len();
    for i in 0..=STEPS {
        // From the pupil backwards.
        let polar = std::f64::consts::PI * i as f64 / STEPS as f64;
        let colour = match polar {
            p if p < 0.2 => [0.02, 0.02, 0.02],
            p if p < 0.5 => [0.25, 0.17, 0.1],
            _ => [0.85, 0.85, 0.85],
        };
        for j in 0..STEPS {
            let around = std::f64::consts::TAU * j as f64 / STEPS as f64;
            let way = Vector3::new(polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos());
            mesh.positions.push(centre + way * radius);
            mesh.colours.push(colour);
        }
    }
    let at = |i: usize, j: usize| (first + i * STEPS + j % STEPS) as u32;
    for i in 0..STEPS {
        for j in 0..STEPS {
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
}
