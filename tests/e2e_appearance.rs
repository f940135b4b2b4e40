//! `understudy learn-appearance` and `track --skin` through the binary.
//!
//! Faces of the fetched clips are 90 pixels wide: lids can be told, folds and lines cannot, and that is said.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use std::{fs, path::Path, process::Command};

use understudy::{
    appearance::{CLOSED_LID, Region, Skin, read_appearance_csv},
    assets::Assets,
};

/// Exit status and what was said, both streams.
fn understudy(arguments: &[&str]) -> (bool, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_understudy")).args(arguments).output().unwrap();
    let said =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    (output.status.success(), said)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn lids_are_learnt_from_a_clip_and_its_blinks_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let clip = Assets::locate().unwrap().verified("cap13").unwrap();
    let (skin, sheet, table) = (at("me.skin"), at("me.png"), at("take.appearance.csv"));
    let (done, said) =
        understudy(&["learn-appearance", text(&clip), "-o", text(&skin), "--sheet", text(&sheet)]);
    assert!(done, "{said}");
    for wanted in ["learnt eye_right", "learnt eye_left", "not forehead: the face is 9", "200 are needed"] {
        assert!(said.contains(wanted), "{wanted}: {said}");
    }
    assert!(image::open(&sheet).unwrap().width() > 300);
    let learnt = Skin::read(&skin).unwrap();
    assert_eq!(learnt.performer(), "me");
    assert!(learnt.regions().iter().all(|region| region.volume.region().is_eye()));

    let (done, said) = understudy(&["track", text(&clip), "--skin", text(&skin), "-o", text(&table)]);
    assert!(done, "{said}");
    let frames = read_appearance_csv(&table).unwrap();
    assert_eq!(frames.len(), 765);
    let closed = |frame: usize| frames[frame].states.get(Region::EyeRight).unwrap() >= CLOSED_LID;
    // Looked at by hand: both lids are shut here and open there.
    assert!([99, 100, 101, 426].into_iter().all(closed));
    assert!(![30, 75, 150, 300, 600].into_iter().any(closed));
    for frame in &frames {
        assert!(frame.states.iter().all(|(region, state)| region.is_eye() || state.is_none()));
    }
    // The same again, on one thread.
    let again = at("again.appearance.csv");
    let (done, said) =
        understudy(&["track", text(&clip), "--skin", text(&skin), "-o", text(&again), "--threads", "1"]);
    assert!(done, "{said}");
    assert_eq!(fs::read(&table).unwrap(), fs::read(&again).unwrap());
}

#[test]
fn what_cannot_be_learnt_or_read_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let assets = Assets::locate().unwrap();
    let (clip, skin) = (assets.verified("cap13").unwrap(), at("x.skin"));
    let refused = |arguments: &[&str], wanted: &[&str]| {
        let (done, said) = understudy(arguments);
        assert!(!done && wanted.iter().all(|word| said.contains(word)), "{said}");
        assert!(!said.contains("panicked") && !skin.exists(), "{said}");
    };
    let learn = ["learn-appearance", text(&clip), "-o"];
    refused(&[&learn[..], &["x.png"]].concat(), &["name it .skin"]);
    refused(&[&learn[..], &[text(&skin), "--use", "nose=1,2,3"]].concat(), &["nose", "forehead=12,80,143"]);
    refused(&[&learn[..], &[text(&skin), "--use", "chin=1,2:4,3"]].concat(), &["chin", "take 2"]);
    let edit = at("edit.toml");
    fs::write(&edit, "chin = 7").unwrap();
    refused(&[&learn[..], &[text(&skin), "--edit", text(&edit)]].concat(), &["edit.toml", "no list"]);
    refused(&["learn-appearance", "nowhere.mp4", "-o", text(&skin)], &["nowhere.mp4"]);
    let table = at("take.appearance.csv");
    let track = ["track", text(&clip), "-o", text(&table)];
    refused(&track, &["--skin"]);
    let bad = at("bad.skin");
    fs::write(&bad, b"UNDRSKIN and more").unwrap();
    refused(&[&track[..], &["--skin", text(&bad)]].concat(), &["bad.skin", "learn-appearance"]);
    let motion = at("motion.csv");
    refused(&["track", text(&clip), "-o", text(&motion), "--skin", text(&bad)], &[".appearance.csv"]);
    assert!(!table.exists());
}

/// A performer without a scan: their own face out of the clip, and its skin sent over the wire.
#[test]
fn a_clip_gives_an_avatar_that_wears_its_own_skin_at_the_far_end() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let clip = Assets::locate().unwrap().verified("single_face").unwrap();
    let (skin, avatar, wire) = (at("me.skin"), at("face.obj"), at("take.uwire"));
    let learn = ["learn-appearance", text(&clip), "-o", text(&skin), "--avatar", text(&avatar)];
    let (refused, said) = understudy(&[&learn[..], &["--sheet", text(&at("face.png"))]].concat());
    assert!(!refused && said.contains("texture"), "{said}");
    let (done, said) = understudy(&learn);
    assert!(done && said.contains("learnt nasolabial_left"), "{said}");
    let mesh = understudy::scan::read_mesh(&avatar).unwrap();
    assert_eq!(mesh.triangles.len(), 898 * 16);
    assert!(mesh.materials[0].texture.is_some());

    let (done, said) = understudy(&["send", text(&clip), "--skin", text(&skin), "-o", text(&wire)]);
    assert!(done, "{said}");
    let picture = |name: &str, more: &[&str]| {
        let path = at(name);
        let shown = ["receive", text(&wire), "--target", text(&avatar), "-o", text(&path)];
        let (done, said) = understudy(&[&shown[..], more].concat());
        assert!(done, "{said}");
        image::open(&path).unwrap().to_rgb8()
    };
    let bare = picture("bare.png", &[]);
    let worn = picture("worn.png", &["--skin", text(&skin), "--skin-mode", "own"]);
    let apart = |(a, b): (&u8, &u8)| u64::from(a.abs_diff(*b));
    let changed: u64 = bare.as_raw().iter().zip(worn.as_raw()).map(apart).sum();
    assert!(changed > 100_000, "the skin changes the pictures by {changed}");
}
