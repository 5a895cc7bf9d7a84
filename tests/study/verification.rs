//! The count-matched protocol: what is kept, what reviewers said, which annotations are no bodies.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use mhp_inspector::dataset::bundled_sample;
use mhp_inspector::dataset::npz::{NpzArchive, copy_with};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn program(home: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    command.args(arguments).env("MHP_INSPECTOR_HOME", home).output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// Ten frames of the bundled sample, of which one has a wrist where its elbow is.
fn data(folder: &Path) {
    let sample = bundled_sample().unwrap();
    std::fs::create_dir_all(folder.join("frames")).unwrap();
    std::fs::copy(sample.join("dataset.toml"), folder.join("dataset.toml")).unwrap();
    for frame in 0..10 {
        let name = format!("frames/{frame:06}.npz");
        let (from, to) = (sample.join(&name), folder.join(&name));
        if frame != 7 {
            std::fs::copy(from, to).unwrap();
            continue;
        }
        let mut archive = NpzArchive::open(&from).unwrap();
        let form = archive.form("joints").unwrap();
        let mut joints = archive.read("joints").unwrap().data;
        joints.copy_within(3 * 7..3 * 8, 3 * 9);
        copy_with(&from, &to, &[("joints".to_owned(), form.encode(&joints).unwrap())]).unwrap();
    }
}

#[test]
fn what_reviewers_object_to_is_left_out_and_told_as_in_the_paper() {
    let home = tempfile::tempdir().unwrap();
    let folder = home.path().join("data");
    data(&folder);
    let path = folder.to_str().unwrap();
    let judge = |who: &str, frame: usize, verdict: &str| {
        let name = format!("frames/{frame:06}");
        let done =
            program(home.path(), &["labels", "tag", path, "--annotator", who, "--frame", &name, "--verdict", verdict]);
        assert!(done.status.success(), "{}", said(&done));
    };
    // Both call 1 wrong; over 2 they differ; 3 is a passing variation.
    judge("anna", 1, "annotation-error");
    judge("bert", 1, "annotation-error");
    judge("anna", 2, "both-incorrect");
    judge("bert", 2, "true-negative");
    judge("anna", 3, "true-negative");
    let told = program(home.path(), &["labels", "verification", path, "--json"]);
    assert!(told.status.success(), "{}", said(&told));
    let object: Value = serde_json::from_slice(&told.stdout).unwrap();
    let found = &object["data"][0];
    let mismatched = found["mismatched"].as_u64().unwrap();
    assert_eq!((&found["frames"], &found["disputed"]), (&serde_json::json!([10, 0]), &1.into()));
    let reviewed: u64 = found["verdicts"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).sum();
    // The two frames that a verdict takes out, whether their numbers are equal or not.
    let lost = 10 - found["kept"][0].as_u64().unwrap();
    assert_eq!(found["overruled"].as_u64().unwrap() + mismatched, lost);
    assert!(lost >= 2 && reviewed <= 2);
    let odd = found["implausible"].as_array().unwrap();
    assert_eq!(odd.len(), 1, "{odd:?}");
    assert_eq!(odd[0]["frame"], "frames/000007");
    assert_eq!(odd[0]["bone"], serde_json::json!(["left_elbow", "left_wrist"]));
    assert!(odd[0]["length_m"].as_f64().unwrap() < 1e-6);
    let text = said(&program(home.path(), &["labels", "verification", path]));
    assert!(
        text.contains("annotation error") && text.contains("left_elbow to left_wrist 0 cm") && !text.contains("paper"),
        "{text}"
    );
    // A study of verified frames.
    let run = home.path().join("run");
    let words =
        ["study", "complexity", path, "--verified", "--iterations", "1", "--preset", "baseline", "--json", "--out"];
    let study = program(home.path(), &[&words[..], &[run.to_str().unwrap()]].concat());
    assert!(
        study.status.success() && said(&study).contains("2 of 10 frames are left out by a verdict: retention 80.0 %"),
        "{}",
        said(&study)
    );
    let table: Value = serde_json::from_slice(&study.stdout).unwrap();
    assert_eq!(table["data"]["frames"], 8);
}
