//! The window on 100,000 frames: what opening, scrolling, filtering, sorting and tagging cost, as a table of figures.
//!
//! `cargo test --release --test window large -- --ignored --nocapture` makes the tree and opens it twice, each time in a process
//! and with a home of its own, so that the peak of memory is that of the window alone: first without, then with what the
//! first left on disk. `MHP_LARGE_FRAMES` asks for another number of frames, `MHP_LARGE_BATCH_ONLY=1`
//! for nothing but the batch of all of them. Nothing is asserted about times: they are
//! this machine's.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

mod acts;
mod meter;

use crate::tree;
use mhp_inspector::folders::HOME_VARIABLE;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Says to a process that it is to open the window, on which tree.
const TREE: &str = "MHP_LARGE_TREE";
/// Says that a run before has left its results.
const WARM: &str = "MHP_LARGE_WARM";

fn frames() -> usize {
    std::env::var("MHP_LARGE_FRAMES").ok().and_then(|text| text.parse().ok()).unwrap_or(100_000)
}

/// A process of this very test that opens the window on `tree`.
fn window(tree: &Path, home: &Path, warm: bool) {
    let mut child = Command::new(std::env::current_exe().unwrap());
    child.args(["--ignored", "--exact", "--nocapture", "large::a_hundred_thousand_frames_cost_as_much_as_a_hundred"]);
    child.env(TREE, tree).env(HOME_VARIABLE, home);
    if warm {
        child.env(WARM, "1");
    }
    assert!(child.status().unwrap().success());
}

#[test]
#[ignore = "makes 100,000 files and takes minutes; prints figures, run it with --release"]
fn a_hundred_thousand_frames_cost_as_much_as_a_hundred() {
    if let Some(tree) = std::env::var_os(TREE).map(PathBuf::from) {
        return acts::measure(&tree, std::env::var_os(WARM).is_some());
    }
    let folder = tempfile::tempdir().unwrap();
    let (data, home) = (folder.path().join("tree"), folder.path().join("home"));
    std::fs::create_dir_all(&home).unwrap();
    tree::tree(&data, frames(), 100);
    println!("\n{} frames, {} cores", frames(), std::thread::available_parallelism().unwrap());
    println!("\n# first opening");
    window(&data, &home, false);
    println!("\n# opened again");
    window(&data, &home, true);
}
