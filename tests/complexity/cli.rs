//! `complexity` as it is run.

use super::sets::{Set, file, open};
use mhp_inspector::study::complexity::{Complexity, ComplexityOptions, compute};
use mhp_inspector::task::Progress;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

const COLUMNS: [&str; 6] = ["frame", "peak_density", "static_dominance", "human_saliency", "hardness", "stratum"];

fn complexity(path: &Path, home: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    command.arg("complexity").arg(path).args(args).env("MHP_INSPECTOR_HOME", home).env("RUST_LOG", "warn");
    command.output().unwrap()
}

fn out(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn err(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn library(path: &Path, options: &ComplexityOptions) -> Complexity {
    compute(&open(path), options, None, &Progress::new()).unwrap()
}

/// The values of frame `i`, in the order of the columns after the first two.
fn numbers(complexity: &Complexity, i: usize) -> [Option<f64>; 4] {
    let frame = complexity.frame(i).copied().unwrap_or_default();
    let s = frame.statistics;
    [s.peak_density, s.static_dominance, s.human_saliency, frame.hardness]
}

#[test]
fn json_is_an_array_in_the_order_of_the_data_set() {
    let (folder, home) = (Set::mixed(&[6, 5], 2).folder(), tempfile::tempdir().unwrap());
    let output = complexity(folder.path(), home.path(), &["--json", "--kappa", "20", "--window", "3", "--tau", "30"]);
    assert_eq!(output.status.code(), Some(0), "{}", err(&output));
    let options = ComplexityOptions { kappa_pct: 20.0, window: 3, tau_pct: 30.0 };
    let wanted = library(folder.path(), &options);
    let rows: Vec<Value> = serde_json::from_str(&out(&output)).unwrap();
    assert_eq!(rows.len(), 11);
    for (i, row) in rows.iter().enumerate() {
        let keys: Vec<&String> = row.as_object().unwrap().keys().collect();
        assert_eq!(keys.len(), COLUMNS.len());
        assert_eq!(row["frame"], open(folder.path()).frame_name(i));
        for (k, wanted) in (1..).zip(numbers(&wanted, i)) {
            let got = row[COLUMNS[k]].as_f64();
            // The reader used here may miss the last bit of a number.
            let close = got.zip(wanted).map_or(got == wanted, |(a, b)| (a - b).abs() <= 1e-15);
            assert!(close, "frame {i}, {}: {got:?}, expected {wanted:?}", COLUMNS[k]);
        }
        assert_eq!(row["stratum"], wanted.frame(i).unwrap().stratum.unwrap().word());
    }
    assert!(rows[0]["static_dominance"].is_null() && rows[2]["static_dominance"].is_number());
}

#[test]
fn csv_has_the_same_columns_and_the_summary_is_printed() {
    let (folder, home) = (Set::mixed(&[6, 5], 2).folder(), tempfile::tempdir().unwrap());
    let table = home.path().join("table.csv");
    let output = complexity(folder.path(), home.path(), &["--csv", table.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(0), "{}", err(&output));
    let wanted = library(folder.path(), &ComplexityOptions::default());
    let mut reader = csv::Reader::from_path(&table).unwrap();
    assert_eq!(reader.headers().unwrap().iter().collect::<Vec<_>>(), COLUMNS);
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 11);
    for (i, row) in rows.iter().enumerate() {
        let got = [1, 2, 3, 4].map(|k| row[k].parse::<f64>().ok());
        assert_eq!(got, numbers(&wanted, i));
    }
    assert_eq!(&rows[0][2], "", "undefined is empty");
    let text = out(&output);
    for part in ["11 frames in 2 sequences", "easy", "medium", "hard", "peak_density", "the hardest", "1/00"] {
        assert!(text.contains(part), "{part} in {text}");
    }
    assert!(!text.contains("unreadable"));
}

#[test]
fn a_frame_that_cannot_be_read_is_null_told_and_in_the_exit_code() {
    let (folder, home) = (Set::mixed(&[7], 2).folder(), tempfile::tempdir().unwrap());
    std::fs::write(file(folder.path(), 0, 2), "text").unwrap();
    for args in [&["--json"][..], &["--json"], &["--json", "--no-cache"]] {
        let output = complexity(folder.path(), home.path(), args);
        assert_eq!(output.status.code(), Some(1));
        let rows: Vec<Value> = serde_json::from_str(&out(&output)).unwrap();
        assert_eq!((rows.len(), &rows[2]["frame"]), (7, &Value::from("0/002")));
        assert!(COLUMNS[1..].iter().all(|&key| rows[2][key].is_null()));
        let told = err(&output);
        assert!(told.contains("002.npz: is neither npz nor npy"), "{told}");
        assert!(told.contains("1 of 7 frames could not be read"), "{told}");
    }
    for frame in 0..7 {
        std::fs::write(file(folder.path(), 0, frame), "text").unwrap();
    }
    let output = complexity(folder.path(), home.path(), &[]);
    assert_eq!((output.status.code(), out(&output).as_str()), (Some(2), ""));
    assert!(err(&output).contains("error: none of 7 frames could be read"));
}

#[test]
fn the_cache_lies_in_the_users_folder_unless_it_is_not_wanted() {
    let (folder, home) = (Set::mixed(&[7], 2).folder(), tempfile::tempdir().unwrap());
    let cache = home.path().join("cache/complexity");
    let first = complexity(folder.path(), home.path(), &["--json", "--no-cache"]);
    assert!(!cache.exists());
    let second = complexity(folder.path(), home.path(), &["--json"]);
    assert_eq!(std::fs::read_dir(&cache).unwrap().count(), 1);
    let third = complexity(folder.path(), home.path(), &["--json"]);
    assert_eq!((out(&first), out(&second)), (out(&second), out(&third)));
}

#[test]
fn bad_options_are_named() {
    let (folder, home) = (Set::mixed(&[2], 2).folder(), tempfile::tempdir().unwrap());
    let cases = [
        (&["--kappa", "0"][..], "--kappa is 0; expected a percentage"),
        (&["--tau", "NaN"], "--tau is NaN; expected a percentage"),
        (&["--window", "0"], "--window is 0; expected a number of frames"),
        (&["--csv", "/no/such/folder/t.csv"], "/no/such/folder/t.csv: cannot be written: no folder"),
    ];
    for (args, wanted) in cases {
        let output = complexity(folder.path(), home.path(), args);
        assert_eq!(output.status.code(), Some(2));
        assert!(err(&output).contains(wanted), "{}", err(&output));
    }
    let output = complexity(&folder.path().join("none"), home.path(), &[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(err(&output).contains("none: no such file or folder"));
}
