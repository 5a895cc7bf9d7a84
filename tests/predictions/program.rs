//! `predictions` and `fit --init` as they are run.

use crate::{shifted_truth, walk};
use mhp_inspector::dataset::{bundled_sample, read_pppr};
use mhp_inspector::predictions::{WriteFormat, write_predictions};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Output};

pub(crate) fn program(home: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    command.args(arguments).env("MHP_INSPECTOR_HOME", home).env("RAYON_NUM_THREADS", "1").output().unwrap()
}

pub(crate) fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

#[test]
fn two_sources_stand_beside_a_fit_and_begin_another() {
    let (dataset, home) = (walk(), tempfile::tempdir().unwrap());
    let data = bundled_sample().unwrap();
    let data = data.to_str().unwrap();
    let at = |name: &str| home.path().join(name).to_str().unwrap().to_owned();
    let names = &dataset.info().skeleton.joints;
    for (name, aside_m) in [("near.npz", 0.03), ("far.csv", 0.2)] {
        let path = home.path().join(name);
        write_predictions(&path, WriteFormat::of(&path).unwrap(), names, &shifted_truth(&dataset, aside_m)).unwrap();
    }
    // A fit that takes one step stays near where it begins.
    let (near, results) = (at("near.npz"), at("results"));
    let fit = program(
        home.path(),
        &[
            "fit",
            data,
            "--frames",
            "0..3",
            "--preset",
            "baseline",
            "--iterations",
            "1",
            "--init",
            &near,
            "--out",
            &results,
        ],
    );
    assert!(fit.status.success(), "{}", text(&fit));
    let file =
        home.path().join("results/pppr").join(format!("{}.npz", dataset.file_names().of(1, dataset.frame_name(1))));
    let params = read_pppr(&file, None).unwrap();
    let truth = dataset.load(1).unwrap().truth.unwrap();
    let apart = params.positions().iter().zip(&truth.joints).map(|(p, t)| p[1] - t[1] - 0.03);
    assert!(apart.map(f64::abs).fold(0.0, f64::max) < 5e-3);
    assert!(std::fs::read_to_string(home.path().join("results/fit.toml")).unwrap().contains("every frame from"));

    let (far, table) = (at("far.csv"), at("errors.csv"));
    let arguments = [
        "predictions",
        data,
        "--frames",
        "0..3",
        "--pred",
        &near,
        "--pred",
        &format!("wide={far}"),
        "--fit",
        &results,
        "--joints",
        "--sort",
        "disagreement",
        "--csv",
        &table,
    ];
    let shown = program(home.path(), &arguments);
    assert!(shown.status.success(), "{}", text(&shown));
    let shown = text(&shown);
    let line =
        |name: &str| shown.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name} in {shown}"));
    let cells = |name: &str| line(name).split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let number = |name: &str, at: usize| cells(name)[at].parse::<f64>().unwrap();
    assert!((number("fit", 5) - 30.0).abs() < 3.0 && number("near", 8) < 3.0, "{shown}");
    assert_eq!(
        [cells("near")[5].as_str(), cells("wide")[5].as_str(), cells("wide")[6].as_str()],
        ["30.0", "200.0", "0.0"]
    );
    assert!((number("wide", 8) - 170.0).abs() < 3.0, "{shown}");
    assert_eq!(cells("left_wrist")[3], "200.0");
    let csv = std::fs::read_to_string(&table).unwrap();
    assert_eq!(csv.lines().count(), 1 + 3 * 2);
    assert!(csv.starts_with("frame,source,people,annotated,joints,majpe_mm,pa_majpe_mm,ospa_mm,fit_majpe_mm"));

    let json = program(home.path(), &["predictions", data, "--frames", "0..2", "--pred", &near, "--json"]);
    let json: Value = serde_json::from_slice(&json.stdout).unwrap();
    let mean = json["sources"]["near"]["truth"]["majpe_mm"].as_f64().unwrap();
    assert!((mean - 30.0).abs() < 1e-6);
    assert_eq!(json["frames"].as_array().unwrap().len(), 2);
}

#[test]
fn what_is_told_once_is_remembered_and_formats_are_changed() {
    let (dataset, home) = (walk(), tempfile::tempdir().unwrap());
    let data = bundled_sample().unwrap();
    let data = data.to_str().unwrap();
    let plain = home.path().join("plain.csv");
    let mut text_of = String::from("frame");
    for joint in &dataset.info().skeleton.joints {
        write!(text_of, ",{joint}_x,{joint}_y,{joint}_z").unwrap();
    }
    for (name, persons) in shifted_truth(&dataset, 0.01) {
        write!(text_of, "\n{name}").unwrap();
        for x in persons[0].as_flattened() {
            write!(text_of, ",{}", 100.0 * x).unwrap();
        }
    }
    std::fs::write(&plain, text_of).unwrap();
    let plain = plain.to_str().unwrap();
    let asked = program(home.path(), &["predictions", data, "--pred", plain]);
    assert_eq!(asked.status.code(), Some(2));
    assert!(text(&asked).contains("nothing in it says the unit, which way the axes point"), "{}", text(&asked));
    assert!(
        program(home.path(), &["predictions", data, "--pred", plain, "--unit", "cm", "--axes", "radar"])
            .status
            .success()
    );
    let parquet = home.path().join("same.parquet");
    let again = program(home.path(), &["predictions", data, "--pred", plain, "--write", parquet.to_str().unwrap()]);
    assert!(again.status.success(), "{}", text(&again));
    let read = program(home.path(), &["predictions", data, "--pred", parquet.to_str().unwrap()]);
    let (again, read) = (text(&again).replace("plain", ""), text(&read).replace("same", ""));
    assert!(read.status_line() == again.status_line(), "{again}\n{read}");
    // Nobody's prediction is written over.
    let over = program(home.path(), &["predictions", data, "--pred", plain, "--csv", plain]);
    assert_eq!(over.status.code(), Some(2));
}

trait StatusLine {
    fn status_line(&self) -> Vec<String>;
}

impl StatusLine for String {
    /// The numbers of the only source.
    fn status_line(&self) -> Vec<String> {
        self.lines().nth(1).unwrap_or_default().split_whitespace().map(str::to_owned).collect()
    }
}
