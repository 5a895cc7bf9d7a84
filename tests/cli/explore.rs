//! `explore` as it is run: the tuning map is the sweep cell by cell, numbers do not depend on threads, bad input is told.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::blob;
use mhp_inspector::study::run::Run;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn inspector(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    command.args(args).env("MHP_INSPECTOR_HOME", "/nonexistent").output().unwrap()
}

fn explore(what: &str, path: &Path, args: &[&str]) -> Output {
    let fixed = ["--preset", "baseline", "--iterations", "6"];
    inspector(&[&["explore", what, path.to_str().unwrap()], &fixed[..], args].concat())
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn json(output: &Output) -> Value {
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn blob(frames: usize) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), frames);
    folder
}

/// Settings that steps read, that starts read, and how long a run takes: each shares its starts and fits in another way.
#[test]
fn the_tuning_map_is_the_sweep_cell_by_cell() {
    let folder = blob(3);
    let elsewhere = tempfile::tempdir().unwrap();
    for (k, grid) in
        [["w_em=0.1,1", "tau_pct=5..20:3"], ["iterations=2,5,6", "summation=coherent,incoherent"]].iter().enumerate()
    {
        let [mine, theirs] = ["mine", "theirs"].map(|name| elsewhere.path().join(format!("{name}-{k}")));
        let common = ["--frames", "1..3", "--grid", grid[0], "--grid"];
        let output = explore(
            "tuning",
            folder.path(),
            &[&common[..], &[grid[1], "--json", "--out", mine.to_str().unwrap()]].concat(),
        );
        let map = json(&output);
        let list = grid[1].replace("5..20:3", "5,12.5,20");
        let data = folder.path().to_str().unwrap();
        let study = ["study", "sweep", data, "--preset", "baseline", "--iterations", "6"];
        let output = inspector(&[&study[..], &common, &[&list, "--out", theirs.to_str().unwrap()]].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        for file in ["run.toml", "rows.csv", "table.md", "table.json"] {
            let [a, b] = [&mine, &theirs].map(|run| std::fs::read_to_string(run.join(file)).unwrap());
            assert_eq!(a, b, "{file} of {grid:?}");
        }
        let run = Run::read(&theirs).unwrap();
        let cells = map["cells"].as_array().unwrap();
        assert_eq!(cells.len(), run.rows.len());
        for cell in cells {
            let labels: Vec<String> = serde_json::from_value(cell["labels"].clone()).unwrap();
            let row = run
                .rows
                .iter()
                .find(|row| run.spec.variants[row.variant].labels == labels && row.name == cell["frame"]);
            let fit = row.unwrap().fit.as_ref().unwrap();
            assert_eq!(cell["loss"].as_f64(), Some(fit.loss), "{labels:?}");
            assert_eq!(cell["majpe"].as_f64(), fit.majpe_mm, "{labels:?}");
            assert_eq!(cell["iou"].as_f64(), fit.mean_iou(), "{labels:?}");
        }
    }
}

#[test]
fn a_tuning_map_is_printed_with_its_best() {
    let folder = blob(1);
    let output = explore("tuning", folder.path(), &["--grid", "w_em=0.1,1", "--grid", "tau_pct=5,20", "--by", "iou"]);
    let said = text(&output.stdout);
    assert!(said.starts_with("IoU by w_em (across) and tau_pct (down)"), "{said}");
    assert!(said.contains("best by IoU: w_em = ") && said.contains("MAJPE"), "{said}");
}

/// Numbers are the same with any number of threads.
#[test]
fn explorations_depend_on_no_number_of_threads() {
    let folder = blob(1);
    let cases: [(&str, &[&str]); 4] = [
        ("landscape", &["--along", "yaw"]),
        ("landscape", &["--along", "bone_turn", "--and", "z", "--joint", "left_wrist"]),
        ("ambiguity", &[]),
        ("restarts", &["--starts", "12"]),
    ];
    for (what, args) in cases {
        let [one, three] =
            ["1", "3"].map(|threads| explore(what, folder.path(), &[args, &["--json", "--threads", threads]].concat()));
        let (a, b) = (json(&one), json(&three));
        assert_eq!(a, b, "{what} {args:?}");
    }
}

#[test]
fn landscapes_and_maps_say_where_they_are_lowest() {
    let folder = blob(1);
    let slice = json(&explore("landscape", folder.path(), &["--along", "x", "--json"]));
    let values = slice["values"].as_array().unwrap();
    assert_eq!(values.len(), 241);
    let (middle, minimum) = (values[120]["loss"].as_f64().unwrap(), slice["minima"][0]["loss"].as_f64().unwrap());
    assert!(minimum <= middle && slice["way"].as_array().unwrap().len() == 7, "{slice}");
    let map = json(&explore("ambiguity", folder.path(), &["--region", "fit", "--json"]));
    assert_eq!(map["floor"]["values"].as_array().unwrap().len(), 128 * 128);
    let least = map["floor"]["minima"][0]["em"].as_f64().unwrap();
    assert!(least <= map["here"].as_f64().unwrap() + 0.02);
    let said = text(&explore("ambiguity", folder.path(), &[]).stdout);
    assert!(said.contains("minima over the floor") && said.contains("truth: x"), "{said}");
    let cloud = json(&explore("restarts", folder.path(), &["--starts", "12", "--json"]));
    assert_eq!(cloud["restarts"].as_array().unwrap().len(), 12);
    assert!(cloud["best_share"].as_f64().is_some_and(|share| share > 0.0 && share <= 1.0));
}

#[test]
fn bad_input_is_told() {
    let folder = blob(1);
    let cases: [(&str, &[&str], &str); 7] = [
        ("tuning", &["--grid", "tau=1..2:3"], "unknown key `tau`"),
        ("tuning", &["--grid", "tau_pct=1,2", "--grid", "tau_pct=3,4"], "tau_pct is there twice"),
        ("tuning", &["--grid", "w_em=1,2", "--by", "luck"], "expected one of loss, em"),
        ("landscape", &["--along", "sideways"], "expected one of x, y, z, yaw"),
        ("landscape", &["--along", "joint_x"], "give --joint NAME too"),
        ("landscape", &["--along", "joint_x", "--joint", "tail"], "no joint is called tail"),
        ("restarts", &["--starts", "1"], "expected a whole number in 2 ..= 2000"),
    ];
    for (what, args, told) in cases {
        let output = explore(what, folder.path(), args);
        assert_eq!(output.status.code(), Some(2), "{what} {args:?}");
        assert!(text(&output.stderr).contains(told), "{what} {args:?}: {}", text(&output.stderr));
    }
    let output = explore("ambiguity", folder.path(), &["--person", "3"]);
    assert!(text(&output.stderr).contains("there is no person 4"), "{}", text(&output.stderr));
    let output = explore("restarts", folder.path(), &["--frame", "7"]);
    assert!(text(&output.stderr).contains("frame 7 was asked for; expected 0 ..= 0"), "{}", text(&output.stderr));
}
