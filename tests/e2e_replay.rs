//! The same clip gives the same bytes: run after run, with one thread or several.

mod common;

use std::fs;

use common::{animate, finish, folder, james, short_clip};

#[test]
fn runs_and_thread_counts_give_the_same_bytes() {
    let folder = folder();
    let clip = short_clip(folder.path(), 1.0);
    let scan = james();
    let kinds = ["pc2", "csv", "glb", "png", "mp4"];
    let run = |name: &str, threads: &str| {
        let outputs = kinds.map(|kind| folder.path().join(format!("{name}.{kind}")));
        let paths: Vec<_> = outputs.iter().map(AsRef::as_ref).collect();
        finish(&mut animate(&clip, &scan, &paths, &["--threads", threads, "--size", "128x96"])).succeeded();
        outputs.map(|path| fs::read(path).unwrap())
    };
    let first = run("first", "1");
    for (name, threads) in [("again", "1"), ("threads", "2")] {
        for ((kind, one), other) in kinds.iter().zip(&first).zip(run(name, threads)) {
            assert!(*one == other, "the .{kind} of the run `{name}` differs");
        }
    }
}
