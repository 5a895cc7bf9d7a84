//! `fit` as it is run: exit codes, the table, the files, and that its numbers are those of the library.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "tests fail by panicking")]

use crate::common;
use mhp_inspector::body::{Group, Pppr, PpprShape, Skeleton};
use mhp_inspector::config::{FIELDS, FitConfig, Preset};
use mhp_inspector::dataset::npz::{ArrayView, write};
use mhp_inspector::dataset::{Dataset, Manifest, read_pppr};
use mhp_inspector::diagnose::joint_errors;
use mhp_inspector::mhp::{Fitter, Precision, Problem, predict, simulate};
use mhp_inspector::output::{FolderLock, Inputs};
use mhp_inspector::radar::RadarConfig;
use mhp_inspector::start::{find_start_along, problem_of};
use mhp_inspector::study::{BatchOptions, StudyError, run_batch};
use mhp_inspector::task::Progress;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Arc;

const MANIFEST: &str = r#"name = "small"
layout = "npz"
frames = "*/*.npz"
frame_rate_hz = 10.0
skeleton = "coco17"

[[view]]
array = "hm_hori"
psf = { range_m = 0.06, azimuth_rad = 0.03, elevation_rad = 0.0, doppler_mps = 0.1 }
axes = [ { kind = "depth_h", bins = 64, lo = 5.0, hi = 1.0 }, { kind = "y", bins = 48, lo = 1.5, hi = -1.5 } ]

[[view]]
array = "hm_vert"
psf = { range_m = 0.06, azimuth_rad = 0.0, elevation_rad = 0.03, doppler_mps = 0.1 }
axes = [ { kind = "depth_v", bins = 64, lo = 5.0, hi = 1.0 }, { kind = "z", bins = 48, lo = -1.5, hi = 1.5 } ]
"#;

const COLUMNS: &str = "frame,iterations,converged,reason,people,annotated,loss,em,bone,rigid,joint,sep,coll,time,prior,net,given,iou_hm_hori,iou_hm_vert,\
                       majpe_mm,pa_majpe_mm,init_ms,fit_ms";

/// A standing body in front of the radar, coco17, by (forward, to the left, up) of each joint.
fn body(forward_m: f64, left_m: f64) -> Pppr {
    let pairs = [("eye", 0.03, 0.68), ("ear", 0.08, 0.66), ("shoulder", 0.20, 0.45), ("elbow", 0.24, 0.15)];
    let pairs = pairs.into_iter().chain([("wrist", 0.26, -0.1), ("hip", 0.12, -0.08), ("knee", 0.12, -0.5)]);
    let pairs: Vec<(&str, f64, f64)> = pairs.chain([("ankle", 0.12, -0.9)]).collect();
    let skeleton = Skeleton::preset("coco17").unwrap();
    let shape = PpprShape { persons: 1, joints: 17, doppler_features: 32 };
    let mut params = Pppr::zeros(shape);
    for (joint, name) in skeleton.joints.iter().enumerate() {
        let pair = pairs.iter().find(|(part, ..)| name.ends_with(part));
        let (aside, up) = pair.map_or((0.0, 0.65), |&(_, aside, up)| (aside, up));
        let aside = if name.starts_with("right") { -aside } else { aside };
        params.set_vec3(Group::Position, joint, [forward_m, left_m + aside, up - 0.2]);
        params.set_vec3(Group::LogScale, joint, [0.08_f64.ln(); 3]);
        params.joint_mut(Group::Rotation, joint)[0] = 1.0;
    }
    params
}

/// A data set of the bodies' own maps over a little background, with their joints as truth.
struct Small {
    folder: tempfile::TempDir,
    results: tempfile::TempDir,
}

impl Small {
    fn new(frames: &[(&str, f64)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("dataset.toml"), MANIFEST).unwrap();
        let small = Self { folder, results: tempfile::tempdir().unwrap() };
        for &(name, left_m) in frames {
            small.add(name, left_m);
        }
        small
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    /// A place for results, which do not go into the data set.
    fn out(&self, name: &str) -> PathBuf {
        self.results.path().join(name)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.path().join(format!("{name}.npz"))
    }

    fn add(&self, name: &str, left_m: f64) {
        let manifest = Manifest::from_file(&self.path().join("dataset.toml")).unwrap();
        let blank: Vec<Vec<f64>> = manifest.views.iter().map(|view| vec![1.0; view.cells()]).collect();
        let blank: Vec<&[f64]> = blank.iter().map(Vec::as_slice).collect();
        let skeleton = Skeleton::preset("coco17").unwrap();
        let problem = Problem::new(RadarConfig::default(), skeleton, manifest.views.clone(), &blank).unwrap();
        let truth = body(3.0, left_m);
        let mut maps = simulate(&problem, &FitConfig::default(), Precision::F64, &truth);
        for map in &mut maps {
            let largest = map.iter().copied().fold(0.0, f64::max);
            for (cell, value) in map.iter_mut().enumerate() {
                // A fixed speckle: nothing in it is random from run to run.
                let speckle = ((cell as f64 * 12.9898).sin() * 43_758.545_3).fract().abs();
                *value += largest * 1e-2 * (0.5 + speckle);
            }
        }
        self.write(name, &maps, truth.group(Group::Position));
    }

    /// The same frame with `people` annotated, each where the one person is.
    fn annotate(&self, name: &str, people: usize) {
        let dataset = self.open();
        let index = (0..dataset.len()).find(|&index| dataset.frame_name(index) == name).unwrap();
        let frame = dataset.load(index).unwrap();
        let maps: Vec<Vec<f64>> = frame.maps.iter().map(|map| map.data.clone()).collect();
        let joints: Vec<f64> = frame.truth.unwrap().joints.into_iter().flatten().collect();
        self.write_people(name, &maps, &joints.repeat(people), people);
    }

    fn write(&self, name: &str, maps: &[Vec<f64>], joints: &[f64]) {
        self.write_people(name, maps, joints, 1);
    }

    fn write_people(&self, name: &str, maps: &[Vec<f64>], joints: &[f64], people: usize) {
        let file = self.file(name);
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        let map = |k: usize| ArrayView::f64(&[64, 48], &maps[k]);
        let joints = ArrayView::f64(&[people, 17, 3], joints);
        write(&file, &[("hm_hori", map(0)), ("hm_vert", map(1)), ("joints", joints)]).unwrap();
    }

    fn damage(&self, name: &str) {
        self.write(name, &[vec![1.0; 64 * 48], vec![f64::NAN; 64 * 48]], &[0.5; 51]);
    }

    fn open(&self) -> Dataset {
        Dataset::open(self.path(), &Progress::new()).unwrap()
    }
}

fn fit(path: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    command.arg("fit").arg(path).args(args).env("MHP_INSPECTOR_HOME", "/nonexistent").output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn code(output: &Output) -> i32 {
    output.status.code().expect("ended by itself, not by a signal from outside")
}

/// Rows of a summary by column.
fn summary(out: &Path) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(out.join("summary.csv")).unwrap();
    assert_eq!(reader.headers().unwrap().iter().collect::<Vec<_>>().join(","), COLUMNS);
    reader.deserialize().map(|row| row.unwrap()).collect()
}

fn column<'a>(rows: &'a [BTreeMap<String, String>], key: &str) -> Vec<&'a str> {
    rows.iter().map(|row| row[key].as_str()).collect()
}

/// What the library makes of a frame, from `start` or its own peaks: loss and parameters.
fn by_hand(dataset: &Dataset, index: usize, config: &FitConfig, start: Option<Pppr>) -> (f64, Pppr) {
    let problem = Arc::new(problem_of(dataset, &dataset.load(index).unwrap()).unwrap());
    let start = match start {
        Some(before) => predict(&problem, config, &before),
        None => find_start_along(dataset, index, &problem, config).unwrap().initialisation.params,
    };
    let mut fitter = Fitter::new(problem, *config, Precision::default(), start).unwrap();
    for _ in 0..config.iterations {
        fitter.step().unwrap();
    }
    (fitter.report().loss, fitter.params().clone())
}

#[test]
fn a_batch_writes_rows_in_order_and_goes_on_after_a_bad_frame() {
    let small = Small::new(&[("a/000", 0.0), ("a/001", 0.1), ("a/003", 0.2), ("b/000", -0.3)]);
    small.damage("a/002");
    let out = small.out("deep/out");
    let output = fit(small.path(), &["--iterations", "6", "--out", out.to_str().unwrap()]);
    assert_eq!(code(&output), 1, "{}", text(&output.stderr));
    let stderr = text(&output.stderr);
    assert!(stderr.starts_with("warning: 1 of 5 frames could not be fitted; the first: "), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");

    let rows = summary(&out);
    assert_eq!(column(&rows, "frame"), ["a/000", "a/001", "a/002", "a/003", "b/000"]);
    assert_eq!(column(&rows, "iterations"), ["6", "6", "", "6", "6"]);
    let reason = &rows[2]["reason"];
    assert!(
        reason.starts_with("error: ") && reason.contains("a/002.npz: array `hm_vert` has no finite cell"),
        "{reason}"
    );
    assert!(COLUMNS.split(',').filter(|key| *key != "frame" && *key != "reason").all(|key| rows[2][key].is_empty()));
    let mut files: Vec<String> = std::fs::read_dir(out.join("pppr"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    assert_eq!(files, ["a_000.npz", "a_001.npz", "a_003.npz", "b_000.npz"]);

    let config = FitConfig::from_file(&out.join("fit.toml")).unwrap();
    assert_eq!(config, FitConfig { iterations: 6, ..Preset::Recommended.config() });
    let dataset = small.open();
    for (index, row) in rows.iter().enumerate().filter(|(index, _)| *index != 2) {
        let (loss, params) = by_hand(&dataset, index, &config, None);
        assert_eq!(row["loss"].parse(), Ok(loss), "frame {index}");
        let written = read_pppr(&out.join("pppr").join(row["frame"].replace('/', "_") + ".npz"), None).unwrap();
        assert_eq!(written, params, "frame {index}");
        let joints: Vec<_> = (0..17).map(|joint| written.position(joint)).collect();
        let errors = joint_errors(&joints, &dataset.load(index).unwrap().truth.unwrap().joints, 17).unwrap();
        assert_eq!(row["majpe_mm"].parse(), Ok(errors.majpe_mm));
        assert_eq!(row["pa_majpe_mm"].parse(), Ok(errors.pa_majpe_mm));
        assert!(row["init_ms"].parse::<f64>().unwrap() > 0.0 && row["fit_ms"].parse::<f64>().unwrap() > 0.0);
    }
}

#[test]
fn a_warm_start_follows_a_sequence_and_no_further() {
    let small = Small::new(&[("a/000", 0.0), ("a/001", 0.05), ("a/003", 0.1), ("b/000", -0.3)]);
    small.damage("a/002");
    let out = small.out("out");
    let output = fit(
        small.path(),
        &["--iterations", "5", "--warm-start", "--preset", "baseline", "--out", out.to_str().unwrap()],
    );
    assert_eq!(code(&output), 1);
    let rows = summary(&out);
    let fresh: Vec<bool> = column(&rows, "init_ms").iter().map(|cell| !cell.is_empty()).collect();
    assert_eq!(fresh, [true, false, false, true, true], "after a bad frame and in a new sequence: from the peaks");
    let config = FitConfig { iterations: 5, ..FitConfig::default() };
    let dataset = small.open();
    let (_, first) = by_hand(&dataset, 0, &config, None);
    let (loss, _) = by_hand(&dataset, 1, &config, Some(first));
    assert_eq!(rows[1]["loss"].parse(), Ok(loss));
    let (loss, _) = by_hand(&dataset, 4, &config, None);
    assert_eq!(rows[4]["loss"].parse(), Ok(loss));
}

/// Without a preset the settings are those that are recommended, people counted; the paper's are one option away.
#[test]
fn the_recommended_settings_are_taken_unless_others_are_asked_for() {
    let small = Small::new(&[("a/000", 0.0), ("a/001", 0.05)]);
    let rows = |args: &[&str]| {
        let output = fit(small.path(), &[args, &["--iterations", "3", "--json"]].concat());
        assert_eq!(code(&output), 0, "{}", text(&output.stderr));
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        let rows = told["frames"].as_array().unwrap().clone();
        rows.into_iter().map(|row| [row["loss"].clone(), row["people"].clone()]).collect::<Vec<_>>()
    };
    let usual = rows(&[]);
    assert_eq!(usual, rows(&["--preset", "recommended"]));
    assert_ne!(usual, rows(&["--preset", "paper"]));
    assert_eq!(Preset::default().config().people, 0, "as many as are counted");
}

#[test]
fn json_has_the_keys_of_the_columns_and_the_means() {
    let small = Small::new(&[("a/000", 0.0), ("a/001", 0.1), ("a/002", 0.2)]);
    let before = std::fs::read_dir(small.path()).unwrap().count();
    let output = fit(small.path(), &["--frames", "1..=2", "--iterations", "4", "--json", "--precision", "f32"]);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    assert_eq!(text(&output.stderr), "", "no bar where nobody watches");
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows = told["frames"].as_array().unwrap();
    assert_eq!(rows.iter().map(|row| row["frame"].as_str().unwrap()).collect::<Vec<_>>(), ["a/001", "a/002"]);
    for row in rows {
        let mut wanted: Vec<&str> = COLUMNS.split(',').collect();
        wanted.sort_unstable();
        assert_eq!(row.as_object().unwrap().keys().collect::<Vec<_>>(), wanted);
        assert_eq!((&row["iterations"], &row["reason"]), (&Value::from(4), &Value::from("iterations")));
        assert!(row["converged"].is_boolean());
    }
    for key in ["loss", "em", "iou_hm_hori", "iou_hm_vert", "majpe_mm", "pa_majpe_mm", "fit_ms"] {
        let values: Vec<f64> = rows.iter().map(|row| row[key].as_f64().unwrap()).collect();
        let mean = told["mean"][key].as_f64().unwrap();
        assert!((mean - f64::midpoint(values[0], values[1])).abs() <= 1e-12 * mean.abs(), "{key}");
    }
    let converged = rows.iter().filter(|row| row["converged"] == true).count();
    assert_eq!(told["mean"]["converged_share"], converged as f64 / 2.0);
    assert_eq!(std::fs::read_dir(small.path()).unwrap().count(), before, "without --out nothing is written");
}

#[test]
fn a_run_stops_at_convergence_where_the_configuration_says_so() {
    let small = Small::new(&[("a/000", 0.0)]);
    let config = small.path().join("fit.toml");
    std::fs::write(&config, "stop_when_converged = true\niterations = 50\n").unwrap();
    let output = fit(small.path(), &["--config", config.to_str().unwrap(), "--json"]);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    let row = &serde_json::from_slice::<Value>(&output.stdout).unwrap()["frames"][0];
    assert_eq!((&row["reason"], &row["converged"]), (&Value::from("converged"), &Value::from(true)));
    assert!((1..50).contains(&row["iterations"].as_u64().unwrap()), "{row}");
}

#[test]
fn the_table_shows_twenty_rows_and_the_means_of_all() {
    let small = Small::new(&[("a/000", 0.0)]);
    for k in 1..23 {
        std::fs::copy(small.file("a/000"), small.file(&format!("a/{k:03}"))).unwrap();
    }
    // Frames that are all the same show furniture, and nobody is counted.
    let output = fit(small.path(), &["--people", "1", "--iterations", "1"]);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    let table = text(&output.stdout);
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines.len(), 1 + 20 + 1 + 1, "{table}");
    assert!(lines[0].starts_with("frame") && lines[1].starts_with("a/000") && lines[20].starts_with("a/019"));
    assert_eq!(lines[21], "... and 3 more frames");
    assert!(lines[22].starts_with("mean ") && lines[22].ends_with("23 of 23 frames fitted"), "{table}");
    let right_edge = |line: &str, word: &str| line.find(word).map(|at| at + word.len());
    assert_eq!(right_edge(lines[0], "iterations"), right_edge(lines[1], " 1"), "numbers stand under their head");
}

/// Two people are annotated and one is fitted: the row has an error, the mean leaves it out and says so.
#[test]
fn frames_with_other_people_than_annotated_are_told_and_left_out_of_the_errors() {
    let small = Small::new(&[("a/000", 0.0), ("a/001", 0.1), ("a/002", 0.2)]);
    small.annotate("a/001", 2);
    let out = small.out("out");
    let output = fit(small.path(), &["--iterations", "3", "--people", "1", "--out", out.to_str().unwrap()]);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    let last = text(&output.stdout).lines().last().unwrap().to_owned();
    let told = "3 of 3 frames fitted; errors over 2, 1 left out: another number of people is annotated";
    assert!(last.ends_with(told), "{last}");
    let rows = summary(&out);
    assert_eq!(column(&rows, "people"), ["1", "1", "1"]);
    assert_eq!(column(&rows, "annotated"), ["1", "2", "1"]);
    let errors: Vec<f64> = column(&rows, "majpe_mm").iter().map(|cell| cell.parse().unwrap()).collect();
    let json = fit(small.path(), &["--iterations", "3", "--people", "1", "--json"]);
    let mean = &serde_json::from_slice::<Value>(&json.stdout).unwrap()["mean"];
    assert_eq!((&mean["errors_over"], &mean["count_mismatched"]), (&Value::from(2), &Value::from(1)));
    let expected = f64::midpoint(errors[0], errors[2]);
    assert!((mean["majpe_mm"].as_f64().unwrap() - expected).abs() < 1e-9, "{mean}: {errors:?}");
    let read = mhp_inspector::study::read_summary(&out.join("summary.csv")).unwrap();
    let counts: Vec<_> = read.iter().map(|row| (row.people, row.annotated)).collect();
    assert_eq!(counts, [(Some(1), Some(1)), (Some(1), Some(2)), (Some(1), Some(1))]);
}

#[test]
fn frames_of_one_flat_name_do_not_overwrite_each_other() {
    let small = Small::new(&[("a/b_c", 0.0), ("a_b/c", 0.1)]);
    let out = small.out("out");
    let output = fit(small.path(), &["--iterations", "1", "--out", out.to_str().unwrap()]);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    // The first digits of the SHA-256 of `a/b_c` and `a_b/c`.
    let files = ["a_b_c-ab14be7080849174.npz", "a_b_c-02d7306b94c0342a.npz"].map(|name| out.join("pppr").join(name));
    let [first, second] = files.map(|file| read_pppr(&file, None).unwrap());
    assert_ne!(first, second);
}

/// All of them, with their defaults, and no page of them under `-h`.
#[test]
fn the_long_help_lists_every_setting() {
    let help = |args: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_mhp-inspector")).args(args).output().unwrap();
        text(&output.stdout)
    };
    for args in [&["fit", "--help"][..], &["study", "sweep", "--help"]] {
        let told = help(args);
        for field in FIELDS {
            let row = format!("{} = {}", field.key, field.text(field.default()));
            assert!(told.contains(&row), "{args:?}: {row}");
        }
    }
    assert!(!help(&["fit", "-h"]).contains("scale_max_m"));
}

/// What is out of range is named; what is in range and strange ends.
#[test]
fn hostile_settings_are_refused_or_end() {
    let small = Small::new(&[("a/000", 0.0)]);
    let (file, out) = (small.out("FIT.toml"), small.out("out"));
    let run = |settings: &str| {
        std::fs::write(&file, settings).unwrap();
        fit(small.path(), &["--frames", "0..1", "--config", file.to_str().unwrap(), "--out", out.to_str().unwrap()])
    };
    let refused = [
        ("tau_pct = 1e-300", "tau_pct is 1e-300; expected a number in 0.1 ..= 100"),
        ("softness = 1e-300", "softness is 1e-300; expected a number in 0.01 ..= 10"),
        ("learning_rate = 1e300", "learning_rate is 1e300; expected a number in 0.000001 ..= 1"),
        ("learning_rates = { log_scale = 1e300 }", "learning_rates.log_scale is 1e300; expected a number in 0 ..= 1"),
        ("iterations = 1000000000000000000", "iterations is 1e18; expected a whole number in 1 ..= 100000"),
        ("people = 1000000000", "people is 1000000000; expected a whole number in 0 ..= 8"),
        ("scale_max_m = 0.0", "scale_max_m is 0; expected a number in 0.01 ..= 10"),
        ("em_region = { half_width_m = inf }", "half_width_m = METRES } with METRES > 0"),
    ];
    for (settings, told) in refused {
        let output = run(settings);
        assert_eq!(code(&output), 2, "{settings}: {}", text(&output.stderr));
        assert!(text(&output.stderr).contains(told), "{settings}: {}", text(&output.stderr));
    }
    let taken = [
        "em_region = { half_width_m = 1e308 }",
        "em_region = { half_width_m = 1e-308 }",
        "tau_pct = 0.1\nsoftness = 0.01\nlearning_rate = 1.0",
        "tau_pct = 100\nsoftness = 10.0\nw_em = 1000.0\nw_kine = 0.0\nlearning_rate = 1.0",
    ];
    for settings in taken {
        let _ = std::fs::remove_dir_all(&out);
        let output = run(&format!("iterations = 50\n{settings}"));
        let told = text(&output.stderr);
        assert!(code(&output) == 0 || told.contains("diverged at iteration"), "{settings}: {told}");
    }
}

#[test]
fn where_no_frame_can_be_fitted_the_code_is_two_and_the_table_still_valid() {
    let small = Small::new(&[]);
    small.damage("a/000");
    small.damage("a/001");
    let out = small.out("out");
    let output = fit(small.path(), &["--out", out.to_str().unwrap()]);
    assert_eq!(code(&output), 2);
    let stderr = text(&output.stderr);
    assert!(stderr.starts_with("error: none of 2 frames could be fitted; the first: "), "{stderr}");
    assert_eq!((stderr.lines().count(), text(&output.stdout).as_str()), (1, ""));
    assert!(column(&summary(&out), "reason").iter().all(|reason| reason.starts_with("error: ")));
}

#[test]
fn an_error_of_the_sink_ends_the_batch() {
    let small = Small::new(&[("a/000", 0.0)]);
    for k in 1..40 {
        std::fs::copy(small.file("a/000"), small.file(&format!("a/{k:03}"))).unwrap();
    }
    let pppr = small.path().join("pppr");
    std::fs::create_dir(&pppr).unwrap();
    let options = BatchOptions {
        config: FitConfig { iterations: 1, ..FitConfig::default() },
        precision: Precision::F64,
        warm_start: false,
        params_folder: Some(pppr.clone()),
        ply: false,
        curves_folder: None,
        ..BatchOptions::default()
    };
    let mut told = Vec::new();
    let full = || StudyError::Write { reason: std::io::Error::other("disk full"), path: "summary.csv".into() };
    let error = run_batch(&small.open(), &(0..40).collect::<Vec<_>>(), &options, |row| {
        told.push(row.index);
        if told.len() < 3 { Ok(()) } else { Err(full()) }
    });
    assert_eq!(error.unwrap_err().to_string(), "summary.csv: cannot be written: disk full");
    assert_eq!(told, [0, 1, 2]);
    let fitted = std::fs::read_dir(&pppr).unwrap().count();
    assert!((3..40).contains(&fitted), "{fitted} frames were fitted before the threads noticed");
}

#[test]
fn the_real_mmvr_frame_reaches_the_asked_iou() {
    let Some(shared) = common::shared() else { return };
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("fit.toml");
    std::fs::write(&config, "learning_rate = 3e-3\n").unwrap();
    let run = |path: &str, args: &[&str]| {
        let output = fit(&shared.join(path), &[args, &["--json"]].concat());
        assert_eq!(code(&output), 0, "{}", text(&output.stderr));
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(told["frames"].as_array().unwrap().len(), 1);
        let row = told["frames"][0].clone();
        assert_eq!((&row["iterations"], &row["converged"]), (&Value::from(100), &Value::from(true)));
        assert!(row["majpe_mm"].is_null(), "pixels are no truth in metres");
        [row["iou_hm_hori"].as_f64().unwrap(), row["iou_hm_vert"].as_f64().unwrap()]
    };
    let [hori, vert] = run("data/mmvr", &["--preset", "baseline"]);
    println!("baseline: IoU {hori:.3} {vert:.3}");
    assert!(f64::midpoint(hori, vert) >= 0.52, "{hori} {vert}");
    let [hori, vert] = run("data/mmvr/00383_radar.npz", &["--config", config.to_str().unwrap()]);
    println!("learning_rate 3e-3: IoU {hori:.3} {vert:.3}");
    assert!(hori >= 0.60 && vert >= 0.55, "{hori} {vert}");
}

fn lines(out: &Path) -> Vec<String> {
    std::fs::read_to_string(out.join("summary.csv")).unwrap().lines().map(str::to_owned).collect()
}

/// Names in a folder that begin with a dot.
fn hidden(folder: &Path) -> Vec<String> {
    let names = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    names.filter(|name| name.starts_with('.')).collect()
}

/// A data set of many frames that are all alike.
fn many(frames: usize) -> Small {
    let small = Small::new(&[("a/000", 0.0)]);
    for k in 1..frames {
        std::fs::copy(small.file("a/000"), small.file(&format!("a/{k:03}"))).unwrap();
    }
    small
}

fn started(path: &Path, args: &[&str]) -> std::process::Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    command.arg("fit").arg(path).args(args).env("MHP_INSPECTOR_HOME", "/nonexistent");
    command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::piped()).spawn().unwrap()
}

#[test]
fn three_at_once_leave_one_whole_table() {
    let small = many(30);
    let out = small.out("out");
    let words = ["--people", "1", "--iterations", "100", "--out", out.to_str().unwrap()];
    let three: Vec<_> = (0..3).map(|_| started(small.path(), &words)).collect();
    let mut done = 0;
    for child in three {
        let output = child.wait_with_output().unwrap();
        match output.status.code() {
            Some(0) => done += 1,
            _ => assert!(text(&output.stderr).contains("another process"), "{}", text(&output.stderr)),
        }
    }
    assert!(done >= 1);
    let rows = summary(&out);
    let wanted: Vec<String> = (0..30).map(|k| format!("a/{k:03}")).collect();
    assert_eq!(column(&rows, "frame"), wanted);
    assert_eq!((hidden(&out), lines(&out).len()), (Vec::new(), 31), "no lock and no half file stays");

    // Deterministically: while this process holds the folder, no other writes it, and is told who does.
    let lock = FolderLock::claim(&out, &[], &Inputs::default()).unwrap();
    let output = fit(small.path(), &words);
    let wanted = format!("out: another process ({}) is writing here", std::process::id());
    assert_eq!(code(&output), 2);
    assert!(text(&output.stderr).contains(&wanted), "{}", text(&output.stderr));
    drop(lock);
    assert_eq!(code(&fit(small.path(), &["--people", "1", "--iterations", "1", "--out", out.to_str().unwrap()])), 0);
}

#[test]
fn a_killed_fit_leaves_a_whole_table_and_the_next_one_cleans_up() {
    let small = many(40);
    let out = small.out("out");
    let mut child = started(small.path(), &["--people", "1", "--iterations", "3000", "--out", out.to_str().unwrap()]);
    let rows = || std::fs::read_to_string(out.join("summary.csv")).unwrap_or_default().matches('\n').count();
    while rows() < 3 {
        assert_eq!(child.try_wait().unwrap(), None, "there was time to kill it");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let left = summary(&out);
    assert!((2..40).contains(&left.len()));
    assert!(left.iter().all(|row| row["reason"] == "iterations" && row["loss"].parse::<f64>().is_ok()));
    assert!(hidden(&out).iter().any(|name| name.contains(".tmp")), "{:?}", hidden(&out));
    assert_eq!(code(&fit(small.path(), &["--people", "1", "--iterations", "1", "--out", out.to_str().unwrap()])), 0);
    assert_eq!((hidden(&out), summary(&out).len()), (Vec::new(), 40));
}

#[cfg(unix)]
#[test]
fn a_limit_of_file_size_is_an_error_and_leaves_what_was_there() {
    let small = many(12);
    let out = small.out("out");
    assert_eq!(code(&fit(small.path(), &["--people", "1", "--iterations", "1", "--out", out.to_str().unwrap()])), 0);
    let before = lines(&out);
    let mut command = Command::new("bash");
    command.args(["-c", "ulimit -f 0; exec \"$@\"", "bash", env!("CARGO_BIN_EXE_mhp-inspector"), "fit"]);
    let output =
        command.arg(small.path()).args(["--people", "1", "--iterations", "2", "--out"]).arg(&out).output().unwrap();
    assert_eq!(code(&output), 2, "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("File too large"), "{}", text(&output.stderr));
    assert_eq!((lines(&out), hidden(&out)), (before, Vec::new()));
}

#[test]
fn results_do_not_go_into_the_data_set_and_never_replace_an_input() {
    let small = Small::new(&[("a/000", 0.0), ("a/001", 0.1)]);
    let before = std::fs::read(small.file("a/000")).unwrap();
    let names = || std::fs::read_dir(small.path()).unwrap().count();
    let count = names();
    let run = |out: &Path, more: &[&str]| {
        let output = fit(
            small.path(),
            &[&["--people", "1", "--iterations", "1", "--out", out.to_str().unwrap()], more].concat(),
        );
        (code(&output), text(&output.stderr))
    };
    let (inside, round) = (small.path().join("not/yet"), small.out("none/../link/deep"));
    #[cfg(unix)]
    std::os::unix::fs::symlink(small.path(), small.out("link")).unwrap();
    let places = if cfg!(unix) { vec![small.path(), &inside, &round] } else { vec![small.path(), &inside] };
    for place in places {
        let (code, told) = run(place, &[]);
        assert!(code == 2 && told.contains("lies in the data set") && told.contains("or --into-data"), "{told}");
        assert_eq!(names(), count, "nothing was made");
    }
    let (code, told) = run(&inside, &["--into-data"]);
    assert_eq!(code, 0, "{told}");
    assert!(inside.join("summary.csv").is_file());

    // A result's place that is an input's, under another name: refused with the flag or without.
    let out = small.out("out");
    std::fs::create_dir_all(out.join("pppr")).unwrap();
    let place = out.join("pppr/a_001.npz");
    std::fs::hard_link(small.file("a/000"), &place).unwrap();
    for words in [&[][..], &["--into-data"]] {
        let (code, told) = run(&out, words);
        assert!(code == 1 && told.contains("a_001.npz: is an input, which is never replaced"), "{told}");
    }
    std::fs::remove_file(&place).unwrap();
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(small.file("a/000"), &place).unwrap();
        let (code, told) = run(&out, &[]);
        assert!(code == 1 && told.contains("is an input"), "{told}");
        // A link to what is no input is replaced, not followed.
        let elsewhere = small.out("elsewhere.npz");
        std::fs::write(&elsewhere, "kept").unwrap();
        std::fs::remove_file(&place).unwrap();
        std::os::unix::fs::symlink(&elsewhere, &place).unwrap();
        assert_eq!(run(&out, &[]).0, 0);
        assert_eq!(std::fs::read(&elsewhere).unwrap(), b"kept");
        assert!(!place.is_symlink() && read_pppr(&place, None).is_ok());
        // Nor is a lock that leads elsewhere written to.
        std::os::unix::fs::symlink(&elsewhere, out.join(".lock")).unwrap();
        let (code, told) = run(&out, &[]);
        assert!(code == 2 && told.contains(".lock: is no lock of this program"), "{told}");
        std::fs::remove_file(out.join(".lock")).unwrap();
    }
    // The settings that a fit is told are an input too.
    let settings = out.join("fit.toml");
    let text = std::fs::read_to_string(&settings).unwrap();
    let (code, told) = run(&out, &["--config", settings.to_str().unwrap()]);
    assert!(code == 2 && told.contains("fit.toml: is an input"), "{told}");
    assert_eq!(std::fs::read_to_string(&settings).unwrap(), text);
    assert!(std::fs::read(small.file("a/000")).unwrap() == before);
    // A file, or what nobody may write, in the folder's place.
    let (code, told) = run(&small.out("elsewhere.npz"), &[]);
    assert!(code == 2 && told.contains("elsewhere.npz: cannot be written"), "{told}");
}

#[cfg(unix)]
#[test]
fn frames_of_strange_names_have_a_file_each_inside_the_folder() {
    let long = format!("a/{}", "n".repeat(240));
    let names = ["a/CON", "a/x", "A/x", "a/two\nlines", "a/dot.", &long];
    let small = Small::new(&names.map(|name| (name, 0.0)));
    let manifest = small.path().join("dataset.toml");
    let text = std::fs::read_to_string(&manifest).unwrap();
    assert!(text.contains("frames = \"*/*.npz\""), "{text}");
    let out = small.out("out");
    let words = ["--people", "1", "--iterations", "1", "--out", out.to_str().unwrap(), "--ply", "--curves"];
    let output = fit(small.path(), &words);
    assert_eq!(code(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
    for (folder, ending) in [("pppr", "npz"), ("pppr", "ply"), ("curves", "csv")] {
        let made = std::fs::read_dir(out.join(folder)).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
        let made: Vec<String> = made.filter(|name| name.ends_with(ending)).collect();
        let lower: std::collections::BTreeSet<String> = made.iter().map(|name| name.to_lowercase()).collect();
        assert_eq!((made.len(), lower.len()), (6, 6), "{made:?}");
        assert!(made.iter().all(|name| name.len() < 160 && !name.contains('\n')), "{made:?}");
    }
    assert!(out.join("pppr/a_CON.npz").is_file(), "no device once the folder is in its name");
    // Whichever frames are chosen, a frame's file is the same, and `export` finds it.
    let part = small.out("part");
    assert_eq!(
        code(&fit(
            small.path(),
            &["--people", "1", "--frames", "1", "--iterations", "1", "--out", part.to_str().unwrap()]
        )),
        0
    );
    let first = std::fs::read_dir(part.join("pppr")).unwrap().next().unwrap().unwrap().file_name();
    assert!(out.join("pppr").join(first).is_file());
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    command.arg("export").arg(small.path()).arg("--out").arg(small.out("taken")).args(["--what", "pppr", "--params"]);
    let output = command.arg(out.join("pppr")).output().unwrap();
    assert_eq!(code(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
}
