//! One picture of a performing avatar against a stored one.

mod common;

use std::path::PathBuf;

use common::{animate, asset, finish, folder, james, made};

/// A wide open mouth, 1.6 s after a calm start.
const FRAME: u32 = 40;

/// The picture goes through two video encoders and a driver, and may round differently; it may not look different:
/// lips that stay fused are 1.95 levels away, and 0.7 %.
/// `UPDATE_SNAPSHOTS=1 cargo test --release --test e2e_snapshot` stores it anew.
#[test]
fn the_avatar_looks_as_it_did() {
    let folder = folder();
    let part = "-ss 14.6 -t 1.9 -c:v libx264 -preset veryfast -crf 12 -an";
    let clip = made(folder.path(), "clip.mp4", &[&asset("cap13")], part);
    let film = folder.path().join("film.mp4");
    finish(&mut animate(&clip, &james(), &[&film], &["--size", "256x256"])).succeeded();
    let frame = format!("-vf select=eq(n\\,{FRAME}) -frames:v 1 -update 1");
    let picture = image::open(made(folder.path(), "frame.png", &[&film], &frame)).unwrap().into_rgb8();

    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/snapshots/e2e_james.png");
    if std::env::var_os("UPDATE_SNAPSHOTS").is_some() {
        picture.save(&path).unwrap();
    }
    let stored = image::open(&path).expect("UPDATE_SNAPSHOTS=1 stores the picture").into_rgb8();
    assert_eq!(stored.dimensions(), picture.dimensions());
    let differences: Vec<u8> = stored.iter().zip(picture.iter()).map(|(a, b)| a.abs_diff(*b)).collect();
    let mean = differences.iter().map(|&d| f64::from(d)).sum::<f64>() / differences.len() as f64;
    let far = differences.iter().filter(|&&d| d > 40).count() as f64 / differences.len() as f64;
    println!("mean difference {mean:.2} levels, {:.2} % above 40", 100.0 * far);
    assert!(mean < 1.0 && far < 0.005, "mean difference {mean:.2} levels, {:.2} % above 40", 100.0 * far);
}
