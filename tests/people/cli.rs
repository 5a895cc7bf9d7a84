//! `count` as it is run.
#![expect(clippy::unwrap_used, reason = "a test that cannot make its input has failed")]

use crate::blob;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn count(path: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_mhp-inspector")).arg("count").arg(path).args(args).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn json(path: &Path, args: &[&str]) -> Value {
    let output = count(path, &[&["--json"], args].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn data_set(frames: usize) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), frames);
    folder
}

#[test]
fn every_frame_has_a_line_with_its_number_and_places() {
    let folder = data_set(6);
    let document = json(folder.path(), &[]);
    let frames = document["frames"].as_array().unwrap();
    assert_eq!(frames.len(), 6);
    for row in frames {
        let p: Vec<f64> = row["probabilities"].as_array().unwrap().iter().map(|p| p.as_f64().unwrap()).collect();
        assert!((p.iter().sum::<f64>() - 1.0).abs() < 1e-6);
        let people = row["people"].as_u64().unwrap() as usize;
        assert!(p.iter().all(|&other| other <= p[people]));
        assert_eq!(row["probability"].as_f64().unwrap(), p[people]);
        assert_eq!(row["persons"].as_array().unwrap().len(), people);
    }
    let output = count(folder.path(), &[]);
    let table = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0));
    assert!(table.starts_with("frame") && table.contains("people") && table.contains("frames/000"), "{table}");
}

#[test]
fn a_part_gives_the_same_rows_as_the_whole() {
    let folder = data_set(14);
    let (whole, part) = (json(folder.path(), &[]), json(folder.path(), &["--frames", "9..12"]));
    let (whole, part) = (whole["frames"].as_array().unwrap(), part["frames"].as_array().unwrap());
    assert_eq!(part.len(), 3);
    for (a, b) in whole[9..12].iter().zip(part) {
        assert_eq!((&a["frame"], &a["probabilities"]), (&b["frame"], &b["probabilities"]));
    }
}

/// Furniture stands still in both directions of time: the first frame of a sequence is counted with those after it, and a
/// frame that is all there is says that it is.
#[test]
fn furniture_is_nobody_in_the_first_frame_of_a_sequence_either() {
    let recorded = tempfile::tempdir().unwrap();
    let simulate = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"))
        .args([
            "simulate",
            recorded.path().to_str().unwrap(),
            "--preset",
            "hard",
            "--frames",
            "24",
            "--sequence-length",
            "4",
        ])
        .args(["--people", "1", "--seed", "991"])
        .output()
        .unwrap();
    assert!(simulate.status.success(), "{}", text(&simulate.stderr));
    let frames = json(recorded.path(), &[]);
    let frames = frames["frames"].as_array().unwrap();
    for first in frames.iter().step_by(4) {
        assert_eq!((first["people"].as_u64(), first["uncertain"].as_bool()), (Some(1), Some(false)), "{first}");
    }
}

#[test]
fn a_lone_frame_says_whether_it_is_uncertain() {
    let folder = data_set(1);
    let document = json(folder.path(), &[]);
    let row = &document["frames"][0];
    let uncertain = row["probability"].as_f64().unwrap() < 0.9;
    assert_eq!(row["uncertain"].as_bool(), Some(uncertain));
    let table = text(&count(folder.path(), &[]).stdout);
    assert_eq!(table.contains("counted from one frame alone"), uncertain, "{table}");
    let document = json(data_set(3).path(), &[]);
    assert!(document["frames"].as_array().unwrap().iter().all(|row| row["uncertain"] == false));
}

#[test]
fn the_table_of_frames_is_written() {
    let folder = data_set(3);
    let out = tempfile::tempdir().unwrap();
    let file = out.path().join("counts.csv");
    assert!(count(folder.path(), &["--csv", file.to_str().unwrap()]).status.success());
    let mut csv = csv::Reader::from_path(&file).unwrap();
    let head: Vec<String> = csv.headers().unwrap().iter().map(str::to_owned).collect();
    assert_eq!(head[..3], ["frame", "people", "probability"]);
    let rows: Vec<csv::StringRecord> = csv.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 3);
    assert!(rows.iter().all(|row| row[1].parse::<usize>().is_ok()));
}

#[test]
fn a_frame_that_cannot_be_read_does_not_stop_the_others() {
    let folder = data_set(4);
    std::fs::write(folder.path().join("frames/001.npz"), b"no archive").unwrap();
    let output = count(folder.path(), &["--json"]);
    assert_eq!(output.status.code(), Some(1));
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(document["frames"][1]["people"].is_null());
    assert!(document["frames"][1]["error"].as_str().unwrap().contains("001.npz"));
    assert!(document["frames"][2]["people"].is_number());
    assert!(text(&output.stderr).contains("1 of 4 frames could not be counted"));
}

#[test]
fn bad_input_is_one_line_and_exit_code_2() {
    let folder = data_set(1);
    let manifest = std::fs::read_to_string(folder.path().join("dataset.toml")).unwrap();
    let blind = manifest.replace("\"y\"", "\"doppler\"").replace("\"z\"", "\"doppler\"");
    let other = folder.path().join("blind.toml");
    std::fs::write(&other, blind).unwrap();
    let cases: [(&[&str], &str); 3] = [
        (&["--frames", "5..9"], "frames 5..9 were asked for"),
        (&["--manifest", other.to_str().unwrap()], "no view has both a distance"),
        (&["--csv", "/nowhere/at/all.csv"], "/nowhere/at/all.csv"),
    ];
    for (args, expected) in cases {
        let output = count(folder.path(), args);
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(expected), "{told}");
        assert_eq!(told.trim().lines().count(), 1, "{told}");
    }
    assert!(text(&count(Path::new("/no/such/place"), &[]).stderr).contains("/no/such/place"));
}

#[cfg(unix)]
#[test]
fn a_table_that_cannot_be_written_leaves_the_older_one_and_no_input_is_replaced() {
    let (folder, out) = (data_set(2), tempfile::tempdir().unwrap());
    let table = out.path().join("counts.csv");
    std::fs::write(&table, "older").unwrap();
    let mut command = Command::new("bash");
    command.args(["-c", "ulimit -f 0; exec \"$@\"", "bash", env!("CARGO_BIN_EXE_mhp-inspector"), "count"]);
    let output = command.arg(folder.path()).arg("--csv").arg(&table).output().unwrap();
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{told}");
    assert!(told.contains("counts.csv: cannot be written: File too large"), "{told}");
    assert_eq!(std::fs::read(&table).unwrap(), b"older");
    assert_eq!(std::fs::read_dir(out.path()).unwrap().count(), 1, "nothing else is left");

    let input = folder.path().join("frames/000.npz");
    let (before, link) = (std::fs::read(&input).unwrap(), out.path().join("link.csv"));
    std::fs::hard_link(&input, &link).unwrap();
    for (file, expected) in [
        (&link, "is an input, which is never replaced"),
        (&input, "lies in the data set"),
        (&folder.path().join("new.csv"), "lies in the data set"),
    ] {
        let output = count(folder.path(), &["--csv", file.to_str().unwrap()]);
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(expected), "{told}");
    }
    let flagged = count(folder.path(), &["--into-data", "--csv", input.to_str().unwrap()]);
    assert!(text(&flagged.stderr).contains("is an input"), "{}", text(&flagged.stderr));
    assert_eq!(std::fs::read(&input).unwrap(), before);
    // Devices are written to, not replaced; this one says that it is full.
    let full = count(folder.path(), &["--csv", "/dev/full"]);
    assert!(text(&full.stderr).contains("/dev/full: cannot be written: No space left"), "{}", text(&full.stderr));
    assert!(!std::fs::metadata("/dev/full").unwrap().is_file());
}

/// Two people through a sequence: in the files of the parameters each keeps its place, one body nearest to its own of the
/// frame before.
#[test]
fn persons_keep_their_places_in_the_parameter_files() {
    let (data, out) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let run = |args: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_mhp-inspector")).args(args).output().unwrap();
        assert!(output.status.success(), "{args:?}: {}", text(&output.stderr));
    };
    let (data, out) = (data.path().join("two"), out.path().join("fits"));
    let (folder, results) = (data.to_str().unwrap(), out.to_str().unwrap());
    let two = ["--people", "2", "--frames", "16", "--sequence-length", "8", "--seed", "5", "--preset", "easy"];
    run(&[&["simulate", folder], &two[..]].concat());
    run(&["fit", folder, "--people", "2", "--preset", "baseline", "--iterations", "4", "--out", results]);
    let mut files: Vec<_> = std::fs::read_dir(out.join("pppr")).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert_eq!(files.len(), 16);
    let places: Vec<[[f64; 2]; 2]> = files
        .iter()
        .map(|file| {
            let params = mhp_inspector::dataset::read_pppr(file, None).unwrap();
            [0, 1].map(|person| {
                let joints = params.person(person);
                [0, 1].map(|axis| joints.iter().map(|p| p[axis]).sum::<f64>() / joints.len() as f64)
            })
        })
        .collect();
    let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    for sequence in places.chunks(8) {
        for pair in sequence.windows(2) {
            let (before, now) = (pair[0], pair[1]);
            let kept = apart(before[0], now[0]) + apart(before[1], now[1]);
            let swapped = apart(before[0], now[1]) + apart(before[1], now[0]);
            assert!(kept <= swapped + 1e-9, "{before:?} then {now:?}");
        }
    }
}
