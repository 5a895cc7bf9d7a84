//! `explore`, `fit --break` and `fit --erase` as they are run: exit codes, and that their numbers are those of the library.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::blob;
use mhp_inspector::config::FitConfig;
use mhp_inspector::dataset::Dataset;
use mhp_inspector::explore::{
    ExploredState, IdleCores, Noise, RadarChange, leave_one_out, observability, tau_ribbon, what_if,
};
use mhp_inspector::mhp::{ErasedCells, JointReturns, Objective, Precision, masks, simulate};
use mhp_inspector::start::problem_of;
use mhp_inspector::study::{BatchOptions, FrameFit, fit_frame, read_erased, write_erased};
use mhp_inspector::task::Progress;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;

fn run(args: &[&str], path: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_mhp-inspector")).args(args).arg(path).output().unwrap()
}

fn json(args: &[&str], path: &Path) -> Value {
    let output = run(args, path);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The blob's first frame as `--preset baseline --iterations 20` fits it.
fn fitted(folder: &Path) -> (Dataset, FitConfig, FrameFit) {
    let dataset = Dataset::open(folder, &Progress::new()).unwrap();
    let config = FitConfig { iterations: 20, ..FitConfig::default() };
    let options = BatchOptions { config, ..BatchOptions::default() };
    let fit = fit_frame(&dataset, 0, &options, None).unwrap();
    (dataset, config, fit)
}

const STATE: [&str; 4] = ["--preset", "baseline", "--iterations", "20"];

#[test]
fn a_fit_stops_at_a_breakpoint_and_says_which() {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 2);
    let found = json(&["fit", "--break", "iteration>=5", "--break", "loss<0", "--json"], folder.path());
    for row in found["frames"].as_array().unwrap() {
        assert_eq!((&row["iterations"], &row["reason"]), (&Value::from(5), &Value::from("breakpoint: iteration>=5")));
    }
    for (condition, expected) in [
        ("iou<x", "`x` is not a number"),
        ("joint tail leaves region", "`tail` is no joint"),
        ("iou_x<1", "no such map"),
    ] {
        let output = run(&["fit", "--break", condition], folder.path());
        assert_eq!(output.status.code(), Some(2));
        assert!(said(&output).contains(expected), "{condition}: {}", said(&output));
    }
}

#[test]
fn a_fit_does_without_erased_cells() {
    let (folder, elsewhere) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    blob::write_dataset(folder.path(), 1);
    let (dataset, config, _) = fitted(folder.path());
    let file = elsewhere.path().join("erased.json");
    let boxed = ErasedCells { view: 0, bins: vec![[10, 30], [8, 20]], cells: Vec::new() };
    let single = ErasedCells::of_cells((1, &dataset.info().views[1]), [700, 701, 702]).unwrap();
    write_erased(&file, &dataset.info().views, &[boxed.clone(), single.clone()]).unwrap();
    assert_eq!(read_erased(&file, &dataset.info().views).unwrap(), [boxed, single]);
    let erase = file.to_str().unwrap();
    let found = json(&["fit", "--erase", erase, "--json", "--preset", "baseline", "--iterations", "20"], folder.path());
    let erased = read_erased(&file, &dataset.info().views).unwrap();
    let options = BatchOptions { config, erased, ..BatchOptions::default() };
    let fit = fit_frame(&dataset, 0, &options, None).unwrap();
    assert_eq!(found["frames"][0]["loss"].as_f64().unwrap(), fit.numbers.report.loss);
    let seen = json(&["fit", "--json", "--preset", "baseline", "--iterations", "20"], folder.path());
    assert_ne!(seen["frames"][0]["loss"], found["frames"][0]["loss"]);
    for (text, expected) in [
        ("{}", "missing field `format`"),
        (r#"{"format":"mhp-erased","version":2,"regions":[]}"#, "expected \"mhp-erased\" and 1"),
        (r#"{"format":"mhp-erased","version":1,"regions":[{"view":"x","bins":[]}]}"#, "`regions[0].view`"),
        (
            r#"{"format":"mhp-erased","version":1,"regions":[{"view":"hori","bins":[[0,99],[0,1]]}]}"#,
            "`regions[0].bins`",
        ),
        (
            r#"{"format":"mhp-erased","version":1,"regions":[{"view":"hori","bins":[[0,9],[0,1]],"cells":[9999]}]}"#,
            "`regions[0].cells`",
        ),
    ] {
        std::fs::write(&file, text).unwrap();
        let output = run(&["fit", "--erase", erase], folder.path());
        assert_eq!(output.status.code(), Some(2));
        assert!(said(&output).contains(expected) && said(&output).contains("erased.json"), "{text}: {}", said(&output));
    }
}

#[test]
fn explorations_tell_the_librarys_numbers() {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 3);
    let (dataset, config, fit) = fitted(folder.path());
    let frame = dataset.load(0).unwrap();
    let problem = Arc::new(problem_of(&dataset, &frame).unwrap());

    let told = json(&[&["explore", "cell", "--cell", "24,16", "--json"], &STATE[..]].concat(), folder.path());
    let returns = JointReturns::new(&problem, &config, &fit.params);
    let first = returns.at(0, 24 * 32 + 16).remove(0);
    assert_eq!(told["lit_by"][0]["share"].as_f64().unwrap(), first.share);
    assert_eq!(told["lit_by"][0]["joint"], problem.skeleton.shown_name(first.joint).as_str());
    assert_eq!(told["without"].as_array().unwrap().len(), 17);

    let told = json(&[&["explore", "tau", "--json"], &STATE[..]].concat(), folder.path());
    let objective = Objective::new(Arc::clone(&problem), config, Precision::F32, &fit.initial).unwrap();
    let h_sim = simulate(&problem, &config, Precision::F32, &fit.params);
    let seen: Vec<_> = h_sim.iter().enumerate().map(|(view, map)| masks(&objective, view, map)).collect();
    let maps: Vec<(&[f64], &[f64])> =
        h_sim.iter().enumerate().map(|(k, sim)| (problem.map(k), sim.as_slice())).collect();
    let ribbon = tau_ribbon(&maps, &seen);
    let ious: Vec<f64> = told["iou_at"].as_array().unwrap().iter().filter_map(Value::as_f64).collect();
    assert_eq!(ious, ribbon.iou.iter().flatten().copied().collect::<Vec<_>>());
    let at_tau = seen.iter().filter_map(mhp_inspector::mhp::Masks::iou).sum::<f64>() / 2.0;
    assert!((told["iou"].as_f64().unwrap() - at_tau).abs() < 1e-12);

    let told = json(&[&["explore", "known", "--frames", "0", "--json"], &STATE[..]].concat(), folder.path());
    let state = ExploredState {
        problem: Arc::clone(&problem),
        erased: Arc::default(),
        config,
        precision: Precision::F32,
        initial: fit.initial.clone(),
        params: fit.params.clone(),
    };
    let known = observability(&state, Noise::Measured, (&IdleCores::all(), &Progress::new())).unwrap();
    assert_eq!(told["frames"][0]["refit_spread_mm"].as_f64().unwrap(), known.spread_mm[0]);
    assert_eq!(told["frames"][0]["least_observable"][0]["name"], known.unseen[0].name.as_str());

    let told = json(&[&["explore", "radar", "--elements", "128", "--json"], &STATE[..]].concat(), folder.path());
    let width = |which: &str| told[which]["views"][0]["psf"]["azimuth_rad"].as_f64().unwrap();
    assert!(width("other") < 0.6 * width("today"), "more elements see finer: {told}");
    let output = run(&["explore", "radar", "--elements", "1"], folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("elements 1: expected 2 to 1024"), "{}", said(&output));

    let told = json(&[&["explore", "closure", "--truth", "--json"], &STATE[..]].concat(), folder.path());
    assert!(
        told["start_majpe_mm"].as_f64().unwrap() < 1500.0 && told["joints"].as_array().unwrap().len() == 17,
        "{told}"
    );
    assert_eq!(told["radar_assumed"].as_array().unwrap().len(), 2);
}

/// What is erased is seen by no exploration: each tells the library's numbers of the state without the cells, others than with them,
/// and a tuning map is the sweep without them, row by row.
#[test]
fn explorations_do_without_erased_cells() {
    let (folder, elsewhere) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    blob::write_dataset(folder.path(), 3);
    let (dataset, config, _) = fitted(folder.path());
    let file = elsewhere.path().join("erased.json");
    let cells = ErasedCells { view: 0, bins: vec![[18, 30], [10, 20]], cells: Vec::new() };
    write_erased(&file, &dataset.info().views, std::slice::from_ref(&cells)).unwrap();
    let erase = ["--erase", file.to_str().unwrap()];
    let options = BatchOptions { config, erased: vec![cells.clone()], ..BatchOptions::default() };
    let fit = fit_frame(&dataset, 0, &options, None).unwrap();
    let problem = Arc::new(problem_of(&dataset, &dataset.load(0).unwrap()).unwrap());
    let state = ExploredState {
        problem,
        erased: [cells].into(),
        config,
        precision: Precision::F32,
        initial: fit.initial,
        params: fit.params,
    };
    let cores = IdleCores::all();
    let both = |what: &[&str]| {
        let with = json(&[what, &STATE[..], &["--json"]].concat(), folder.path());
        (json(&[what, &STATE[..], &["--json"], &erase[..]].concat(), folder.path()), with)
    };

    let known = observability(&state, Noise::Measured, (&cores, &Progress::new())).unwrap();
    let (told, with) = both(&["explore", "known", "--frames", "0"]);
    let spread = |told: &Value| told["frames"][0]["refit_spread_mm"].as_f64().unwrap();
    assert_eq!(spread(&told), known.spread_mm[0]);
    assert_ne!(spread(&told), spread(&with));

    let worth = leave_one_out(&state, (&cores, &Progress::new())).unwrap();
    let (told, with) = both(&["explore", "cell"]);
    assert_eq!(told["iou"].as_f64(), worth.iou);
    assert_ne!(told["iou"], with["iou"]);

    let change = RadarChange { elements: Some(128), ..RadarChange::default() };
    let found = what_if(dataset.info(), &state, &[change; 2], (&cores, &Progress::new())).unwrap();
    let (told, with) = both(&["explore", "radar", "--elements", "128"]);
    let spread = |told: &Value, of: &str| told[of]["refit_spread_mm"].as_f64().unwrap();
    assert_eq!(spread(&told, "other"), found.other.known.spread_mm[0]);
    assert_ne!(spread(&told, "today"), spread(&with, "today"));

    let (told, with) = both(&["explore", "tau"]);
    assert_ne!(told["iou_at"], with["iou_at"]);
    for what in ["ambiguity", "restarts", "landscape"] {
        let (told, with) = both(&["explore", what]);
        assert_ne!(told, with, "{what}");
    }

    let axes = ["--grid", "w_em=0.1,1", "--grid", "tau_pct=5,20"];
    let out = |name: &str| elsewhere.path().join(name).to_str().unwrap().to_owned();
    let (map, swept, all) = (out("map"), out("swept"), out("all"));
    let run_of = |head: &[&str], out: &str, erase: &[&str]| {
        let output =
            run(&[head, &axes[..], &STATE[..], &["--frames", "0", "--out", out], erase].concat(), folder.path());
        assert!(output.status.success(), "{}", said(&output));
    };
    run_of(&["explore", "tuning"], &map, &erase);
    run_of(&["study", "sweep"], &swept, &erase);
    run_of(&["study", "sweep"], &all, &[]);
    let rows = |folder: &str| -> Vec<String> {
        let mut reader = csv::Reader::from_path(Path::new(folder).join("rows.csv")).unwrap();
        let loss = reader.headers().unwrap().iter().position(|head| head == "loss").unwrap();
        reader.records().map(|row| row.unwrap()[loss].to_owned()).collect()
    };
    assert_eq!(rows(&map).len(), 4);
    assert_eq!(rows(&map), rows(&swept));
    assert!(rows(&swept).iter().zip(rows(&all)).all(|(a, b)| *a != b));
    // A folder of the run that sees the cells is not gone on with.
    let output = run(
        &[&["study", "sweep"], &axes[..], &STATE[..], &["--frames", "0", "--out", &all], &erase[..]].concat(),
        folder.path(),
    );
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("erased cells"), "{}", said(&output));
}

/// What a radar would be is kept under a name, listed, and is the radar of a data set whose manifest names it.
#[test]
fn a_radar_that_is_saved_can_be_named_by_a_manifest() {
    let home = tempfile::tempdir().unwrap();
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/walk");
    let data = home.path().join("data");
    std::fs::create_dir_all(data.join("frames")).unwrap();
    std::fs::copy(sample.join("frames/000003.npz"), data.join("frames/000003.npz")).unwrap();
    let manifest = std::fs::read_to_string(sample.join("dataset.toml")).unwrap();
    std::fs::write(data.join("dataset.toml"), &manifest).unwrap();
    let program = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
        let output = command.args(args).env("MHP_INSPECTOR_HOME", home.path()).output().unwrap();
        assert!(output.status.success(), "{args:?}: {}", said(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let path = data.to_str().unwrap();
    let range = |text: &str| text.lines().find(|line| line.starts_with("  widths")).unwrap().to_owned();
    let today = range(&program(&["info", path]));
    program(&[
        "explore",
        "radar",
        path,
        "--preset",
        "baseline",
        "--iterations",
        "2",
        "--bandwidth",
        "4e9",
        "--save",
        "wide",
    ]);
    assert!(home.path().join("radars/wide.toml").is_file() && program(&["radars"]).contains("what-if of walk"));
    // The same maps, by a manifest that names the radar and states no widths.
    let mut named: toml::Table = toml::from_str(&manifest).unwrap();
    named.insert("radar".into(), "wide".into());
    for view in named["view"].as_array_mut().unwrap() {
        let view = view.as_table_mut().unwrap();
        view.remove("psf");
        view.remove("fft");
    }
    std::fs::write(data.join("dataset.toml"), toml::to_string(&named).unwrap()).unwrap();
    let other = range(&program(&["info", path]));
    assert!(today.contains("range 4.124 cm") && other.contains("range 3.093 cm"), "{today}\n{other}");
}
