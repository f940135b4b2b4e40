use std::time::Instant;
use understudy::{assets::Assets, pipeline::*, tracking::TrackerOptions, view::Gpu, anatomy::*, rig::*};
fn main() {
    let t0 = Instant::now();
    let lap = |what: &str, t: &mut Instant| { eprintln!("{what}: {:.0} ms", t.elapsed().as_secs_f64()*1e3); *t = Instant::now(); };
    let mut t = t0;
    let assets = Assets::locate().unwrap();
    let gpu = Gpu::headless().unwrap(); lap("gpu", &mut t);
    let mut n = Networks::load(&assets, TrackerOptions::default()).unwrap(); lap("networks", &mut t);
    let mut target = Target::load(std::path::Path::new(&std::env::args().nth(1).unwrap()), &TargetOptions::default(), &gpu, &mut n.tracker).unwrap(); lap("load", &mut t);
    target.prepare(&gpu).unwrap(); lap("prepare", &mut t);
    let a = Anatomy::prepare(&target.scan.mesh, &target.surface, &target.landmarks, None); lap("anatomy without view", &mut t);
    let face = TargetFace::new(target.landmarks.clone(), nalgebra::Rotation3::identity()).unwrap();
    let p = Puppet::new(&face, &target.anatomy, &target.surface, &|_| None, TransferRule::Spline).unwrap(); lap("puppet", &mut t);
    eprintln!("{} scan, {} skin, {} soft, {} all; {} columns {}", a.scan_vertices, a.skin_vertices(), a.soft_vertices(), a.mesh.positions.len(), p.warp().controls(), p.controls().rest.len());
    let bare = Anatomy::as_scanned(&target.scan.mesh); let q = Puppet::new(&face, &bare, &target.surface, &|_| None, TransferRule::Spline).unwrap();
    for (n, p) in [("opened", &p), ("bare", &q), ("opened", &p), ("bare", &q)] { let mut f = p.new_frame(); let t = Instant::now(); for i in 0..200 { p.act(&JawPose { opening: i as f64 * 1e-3, ..JawPose::default() }, &understudy::lift::Eyes::default(), &mut f).unwrap(); } eprintln!("{n}: {:.3} ms a pose, {} rows {} columns", t.elapsed().as_secs_f64() * 5.0, p.warp().vertices(), p.warp().controls()); }
    t = Instant::now();
    write_avatar_glb(std::path::Path::new("/tmp/o/x.glb"), &target).unwrap(); lap("glb incl. puppet", &mut t);
}
