//! Between two rigs that were made independently: ICT-FaceKit's and MakeHuman's, which share ARKit's names and nothing
//! else. Their authors' ideas of an expression differ, so there is no truth here, only likeness.

use std::path::Path;

use nalgebra::{Point3, Vector3};
use understudy::{
    actions::ActionLibrary,
    pipeline::{Target, TargetOptions},
    rig::{Method, TransferRule, WarpKind},
    scan::{Mesh, Surface},
};

use crate::{
    product::{Finder, Landmarks, carried, known, library},
    protocol::{Face, Outcome, Protocol},
};

const METHODS: [(&str, Method); 4] = [
    ("landmark spline, surface (default)", Method { rule: TransferRule::Spline, warp: WarpKind::Surface }),
    ("landmark spline, space", Method { rule: TransferRule::Spline, warp: WarpKind::Spline }),
    ("copy, surface", Method { rule: TransferRule::Copy, warp: WarpKind::Surface }),
    ("thesis", Method::THESIS),
];
/// Vertices within so many millimetres of a landmark are the face.
const REACH: f64 = 15.0;
/// Expressions that move a face by less on average are not compared, millimetres.
const STILL: f64 = 0.2;

/// Prints a table.
pub fn print(folder: &Path, protocol: &Protocol, finder: &mut Finder<'_>) -> Outcome<()> {
    let folder = folder.join("cross");
    let ict = Face::read(&folder, "ict.obj", "ict.pc2")?;
    let makehuman = Face::read(&folder, "makehuman.obj", "makehuman.pc2")?;
    let on_ict = known(protocol, &ict.mesh);
    let path = folder.join("makehuman.obj");
    let target = Target::load(&path, &TargetOptions::default(), finder.gpu, &mut finder.networks.tracker)?;
    let surface = Surface::new(&makehuman.mesh)?;
    let own = |p: &Point3<f64>| Some(surface.nearest(target.scan.placement.to_own(*p))?.position);
    let on_makehuman: Landmarks = target.landmarks.iter().map(|p| own(p.as_ref()?)).collect();

    println!("\n| from, to | method | cosine | size | error |\n|---|---|---:|---:|---:|");
    let directions = [
        ("ICT → MakeHuman", &ict, &on_ict, &makehuman, &on_makehuman),
        ("MakeHuman → ICT", &makehuman, &on_makehuman, &ict, &on_ict),
    ];
    for (direction, source, on_source, target, on_target) in directions {
        let library = library(source, on_source, ActionLibrary::built_in())?;
        let face = face_of(&target.mesh, on_target);
        for (name, method) in METHODS {
            let found = carried(&library, &target.mesh, on_target, method)?;
            let mut sums = [0.0; 3];
            let mut count = 0.0;
            for (found, own) in found.iter().zip(&target.motions) {
                let square = |of: &[Vector3<f64>]| face.iter().map(|&v| of[v].norm_squared()).sum::<f64>();
                let (a, b) = (square(found), square(own));
                if (b / face.len() as f64).sqrt() < STILL {
                    continue;
                }
                let both: f64 = face.iter().map(|&v| found[v].dot(&own[v])).sum();
                let wrong: f64 = face.iter().map(|&v| (found[v] - own[v]).norm_squared()).sum();
                sums[0] += both / (a * b).sqrt().max(f64::MIN_POSITIVE);
                sums[1] += (a / b).sqrt();
                sums[2] += (wrong / b).sqrt();
                count += 1.0;
            }
            let [cosine, size, error] = sums.map(|sum| sum / count);
            println!("| {direction}, {count} expressions | {name} | {cosine:.3} | {size:.2} | {error:.3} |");
        }
    }
    Ok(())
}

fn face_of(mesh: &Mesh, landmarks: &Landmarks) -> Vec<usize> {
    let near = |p: &Point3<f64>| landmarks.iter().flatten().any(|q| (p - q).norm() < REACH);
    (0..mesh.positions.len()).filter(|&v| near(&mesh.positions[v])).collect()
}
