//! `study` as it is run: the same bytes however often it is killed, with any number of threads, in shards or whole.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::blob;
use crate::scenes::{Scene, write_scenes};
use mhp_inspector::config::{FitConfig, Preset};
use mhp_inspector::output::{FolderLock, Inputs};
use mhp_inspector::study::run::{JOURNAL_FILE, Run, RunNumbers, TABLE_FILE};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

/// What must not depend on how a run was made.
const REPRODUCIBLE: [&str; 5] = ["run.toml", "rows.csv", "rows.parquet", "table.md", "table.json"];

/// A data set of two sequences, and a place for runs.
struct Case {
    folder: tempfile::TempDir,
}

impl Case {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(folder.path().join("data")).unwrap();
        let scene = |folder, clutter, reflector| Scene { folder, frames: 3, clutter, reflector };
        write_scenes(&folder.path().join("data"), &[scene("easy", 0, false), scene("hard", 4, true)]);
        // What is said of how runs are cut holds of any search; one with few starts does not take minutes.
        let few = FitConfig { starts: 3, decode_frames: 2, ..Preset::Recommended.config() };
        std::fs::write(folder.path().join("few.toml"), few.to_toml()).unwrap();
        Self { folder }
    }

    fn data(&self) -> PathBuf {
        self.folder.path().join("data")
    }

    fn run(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `words` of `study`, of which those that begin with `@` are files of this case.
    fn command(&self, words: &[&str], out: &str) -> Command {
        let word = |word: &&str| word.strip_prefix('@').map_or_else(|| PathBuf::from(*word), |name| self.run(name));
        let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
        command.arg("study").arg(words[0]).arg(self.data()).args(words[1..].iter().map(word));
        command.arg("--out").arg(self.run(out));
        command.env("MHP_INSPECTOR_HOME", self.run("home"));
        command
    }

    fn study(&self, words: &[&str], out: &str) -> Output {
        self.command(words, out).output().unwrap()
    }

    /// Runs, and expects success.
    fn done(&self, words: &[&str], out: &str) -> String {
        let output = self.study(words, out);
        assert!(output.status.success(), "{words:?}: {}", text(&output.stderr));
        text(&output.stdout)
    }

    fn merge(&self, runs: &[&str], out: &str) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
        command.arg("merge").args(runs.iter().map(|run| self.run(run)));
        command.arg("--out").arg(self.run(out)).output().unwrap()
    }

    fn bytes(&self, run: &str) -> Vec<(&'static str, Vec<u8>)> {
        REPRODUCIBLE.map(|file| (file, std::fs::read(self.run(run).join(file)).unwrap())).into()
    }

    /// Rows in the journal, torn ones not.
    fn journaled(&self, run: &str) -> usize {
        let text = std::fs::read_to_string(self.run(run).join(JOURNAL_FILE)).unwrap_or_default();
        text.matches('\n').count().saturating_sub(1)
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn same(case: &Case, one: &str, other: &str) {
    for ((file, a), (_, b)) in case.bytes(one).into_iter().zip(case.bytes(other)) {
        assert_eq!(text_or_length(&a), text_or_length(&b), "{file} of {one} and {other}");
        assert!(a == b, "{file} of {one} and {other}");
    }
}

fn text_or_length(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap_or_else(|_| format!("{} bytes", bytes.len()))
}

/// A process that is killed where the test stops first.
struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Warm and cold variants, a subset, perturbed starts: everything that could depend on how it is cut.
const ROBUSTNESS: &[&str] = &["robustness", "--config", "@few.toml", "--iterations", "6", "--seed", "5"];

#[test]
fn a_run_killed_at_any_moment_goes_on_to_the_same_bytes() {
    let case = Case::new();
    let whole: &[&str] = &["robustness", "--all", "--config", "@few.toml", "--iterations", "12", "--threads", "2"];
    case.done(whole, "whole");
    let rows = case.journaled("whole");
    assert_eq!(rows, 11 * 6);
    // The moments at which the journal has this many rows: within the chains, which are done first, and later.
    for (kill, wanted) in [1, 4, rows / 3, 2 * rows / 3].into_iter().enumerate() {
        let silent = |mut command: Command| command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let mut child = Killed(silent(case.command(whole, "killed")));
        while case.journaled("killed") < wanted {
            assert_eq!(child.0.try_wait().unwrap(), None, "it ended before kill {kill}");
            std::thread::yield_now();
        }
        child.0.kill().unwrap();
        assert!(!child.0.wait().unwrap().success(), "it was killed, it did not end");
        assert!(!case.run("killed").join(TABLE_FILE).exists());
    }
    let before = std::fs::read_to_string(case.run("killed").join(JOURNAL_FILE)).unwrap();
    let finished: Vec<&str> = before.split_inclusive('\n').filter(|line| line.ends_with('\n')).collect();
    case.done(whole, "killed");
    let after = std::fs::read_to_string(case.run("killed").join(JOURNAL_FILE)).unwrap();
    assert!(after.starts_with(&finished.concat()), "what was finished is not done again");
    assert_eq!(case.journaled("killed"), rows, "every row once");
    same(&case, "whole", "killed");
    assert!(!case.run("killed").join("chains").exists(), "what was kept to go on is gone");
}

#[test]
fn threads_and_shards_make_no_difference() {
    let case = Case::new();
    case.done(&[ROBUSTNESS, &["--threads", "1"]].concat(), "one");
    case.done(&[ROBUSTNESS, &["--threads", "5"]].concat(), "five");
    same(&case, "one", "five");
    let names: Vec<String> = (1..=4).map(|k| format!("shard{k}")).collect();
    for (k, name) in names.iter().enumerate() {
        case.done(&[ROBUSTNESS, &["--shard", &format!("{}/4", k + 1)]].concat(), name);
    }
    let names: Vec<&str> = names.iter().rev().map(String::as_str).collect();
    let merged = case.merge(&names, "merged");
    assert!(merged.status.success(), "{}", text(&merged.stderr));
    assert_eq!(text(&merged.stdout), std::fs::read_to_string(case.run("one").join("table.md")).unwrap());
    same(&case, "one", "merged");
    // The merged folder is the run: nothing is left to do in it.
    case.done(ROBUSTNESS, "merged");
    same(&case, "one", "merged");
    let refused = |runs: &[&str]| text(&case.merge(runs, "other").stderr);
    assert!(refused(&names[..3]).contains("shard 1/4 is missing"), "{}", refused(&names[..3]));
    assert!(refused(&names[1..3]).contains("shards 1/4, 4/4 are missing"), "{}", refused(&names[1..3]));
    assert!(refused(&[names[0], names[0]]).contains("comes twice"));
    assert!(refused(&["one"]).contains("is no shard"));
    std::fs::remove_file(case.run("shard2").join(TABLE_FILE)).unwrap();
    let unfinished = refused(&names);
    assert!(
        unfinished.contains("shard 2/4 is missing") && unfinished.contains("shard2 is not finished"),
        "{unfinished}"
    );
}

#[test]
fn a_torn_journal_loses_its_torn_line_only() {
    let case = Case::new();
    let words: &[&str] = &["init", "--config", "@few.toml", "--iterations", "3", "--frames", "0..3"];
    case.done(words, "whole");
    case.done(words, "torn");
    let file = case.run("torn").join(JOURNAL_FILE);
    let bytes = std::fs::read(&file).unwrap();
    std::fs::remove_file(case.run("torn").join(TABLE_FILE)).unwrap();
    for cut in [bytes.len() - 1, bytes.len() - 40, bytes.len() / 2, 5, 0] {
        std::fs::write(&file, &bytes[..cut]).unwrap();
        case.done(words, "torn");
        same(&case, "whole", "torn");
    }
}

#[test]
fn another_configuration_or_other_data_are_refused() {
    let case = Case::new();
    let words = |more: &[&'static str]| [&["init", "--iterations", "2", "--frames", "0..2"], more].concat();
    case.done(&words(&[]), "run");
    let refusal = |words: &[&str]| {
        let output = case.study(words, "run");
        assert_eq!(output.status.code(), Some(2));
        text(&output.stderr)
    };
    assert!(refusal(&words(&["--seed", "9"])).contains("another seed: 0, not 9"));
    assert!(refusal(&words(&["--preset", "paper"])).contains("another preset"));
    assert!(refusal(&words(&["--precision", "f64"])).contains("another precision: f32, not f64"));
    assert!(refusal(&words(&["--shard", "1/2"])).contains("another shard: the whole, not 1/2"));
    assert!(refusal(&["threshold", "--iterations", "2"]).contains("another study: init, not threshold"));
    assert!(
        refusal(&["init", "--iterations", "3", "--frames", "0..2"]).contains("another value of iterations: 2, not 3")
    );
    assert!(refusal(&["init", "--iterations", "2", "--frames", "0..3"]).contains("another"));
    let frame = case.data().join("frames/easy/001.npz");
    blob::write_frame(&frame, 1, &|depth, _| if depth > 5.0 { 9.0 } else { 0.0 });
    assert!(refusal(&words(&[])).contains("another data set"));
}

#[test]
fn every_study_has_its_rows_and_no_row_is_without_reason() {
    let case = Case::new();
    // A file that cannot be read is a row with its reason, under every variant.
    std::fs::write(case.data().join("frames/easy/001.npz"), b"PK nonsense").unwrap();
    let studies: [(&[&str], usize); 9] = [
        (&["complexity"], 4),
        (&["robustness", "--all"], 11),
        (&["operators"], 5),
        (&["threshold"], 5),
        (&["weights"], 5),
        (&["init"], 3),
        (&["switches"], 3),
        (&["truth"], 5),
        (&["sweep", "--grid", "w_em=0.1,1", "--grid", "tau_pct=5,10,20"], 6),
    ];
    for (k, (words, rows)) in studies.into_iter().enumerate() {
        let out = format!("run{k}");
        let output = case.study(&[words, &["--iterations", "2", "--frames", "0..3", "--json"]].concat(), &out);
        assert_eq!(output.status.code(), Some(1), "one frame of three cannot be read: {}", text(&output.stderr));
        let table: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(table["study"], words[0]);
        let found = table["rows"].as_array().unwrap();
        if words[0] == "switches" {
            assert!(found.len() > rows);
        } else {
            assert_eq!(found.len(), rows, "{words:?}");
        }
        for row in found.iter().filter(|row| row["stratum"].is_null()) {
            assert_eq!((&row["frames"], &row["failed"]), (&3.into(), &1.into()), "{words:?}");
            let start = row["init_majpe_mm"]["mean"].as_f64().unwrap();
            let label = row["labels"][0].as_str().unwrap();
            let (of_truth, at_truth) = (label.starts_with("truth"), label.starts_with("truth") && !label.contains('±'));
            // Whom no body explains is held at the start, at the truth too.
            assert!(row["majpe_mm"]["mean"].as_f64().unwrap() > 0.0 || at_truth, "{words:?}");
            assert!(if at_truth { start == 0.0 } else { start > 0.0 }, "{words:?}: {start}");
            assert_eq!(row["share_below_truth"].is_number(), words[0] == "truth" && !of_truth);
            assert_eq!(row["share_clearly_below_truth"].is_number(), row["share_below_truth"].is_number());
            assert!(row["share_clearly_below_truth"].as_f64() <= row["share_below_truth"].as_f64());
            assert!(row["converged_share"].is_number() && row["share_improved"].is_number());
        }
        let run = Run::read(&case.run(&out)).unwrap();
        assert!(run.complete);
        let failures: Vec<&str> =
            run.rows.iter().filter_map(|row| row.fit.as_ref().err().map(String::as_str)).collect();
        assert!(failures.iter().all(|why| why.starts_with("frames/easy/001.npz")), "{failures:?}");
        assert_eq!(failures.len(), run.spec.variants.len());
        let rows = csv::Reader::from_path(case.run(&out).join("rows.csv")).unwrap().into_records().count();
        assert_eq!(rows, 3 * run.spec.variants.len());
    }
}

/// Counts do not depend on the cut either, although each looks at the frames before it.
#[test]
fn people_are_counted_by_each_method() {
    let case = Case::new();
    case.done(&["counting"], "whole");
    let run = Run::read(&case.run("whole")).unwrap();
    let names: Vec<&str> = run.table.iter().map(|row| row.labels[0].as_str()).collect();
    assert_eq!(names, ["CFAR + DBSCAN + MLP", "MLP alone", "CNN"]);
    for row in &run.table {
        let counts = row.counts.unwrap();
        assert_eq!((row.frames, counts.frames[1], counts.weighted), (6, 6, None), "no frame has two or three people");
        assert_eq!(counts.overall, counts.by_people[1]);
    }
    let counted =
        Command::new(env!("CARGO_BIN_EXE_mhp-inspector")).args(["count", "--json"]).arg(case.data()).output().unwrap();
    let counted: Value = serde_json::from_slice(&counted.stdout).unwrap();
    for (row, other) in run.rows.iter().filter(|row| row.variant == 0).zip(counted["frames"].as_array().unwrap()) {
        assert_eq!(Some(row.fit.as_ref().unwrap().persons as u64), other["people"].as_u64(), "{}", row.name);
    }
    for k in 1..=2 {
        case.done(&["counting", "--shard", &format!("{k}/2")], &format!("part{k}"));
    }
    assert!(case.merge(&["part1", "part2"], "merged").status.success());
    same(&case, "whole", "merged");
    let timing = std::fs::read_to_string(case.run("whole").join("timing.md")).unwrap();
    assert!(timing.contains("maps/s") && timing.contains("MLP alone"), "{timing}");
}

/// A setting that a run does not know yet takes its default; the run can still be read, and is the same.
#[test]
fn a_run_of_a_program_with_fewer_settings_can_be_read() {
    let case = Case::new();
    case.done(&["init", "--iterations", "2", "--frames", "0..2"], "run");
    let wanted = Run::read(&case.run("run")).unwrap();
    let file = case.run("run").join("run.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let older: Vec<&str> = text.lines().filter(|line| !line.starts_with("w_time")).collect();
    assert!(older.len() < text.lines().count());
    std::fs::write(&file, older.join("\n")).unwrap();
    assert_eq!(Run::read(&case.run("run")).unwrap(), wanted);
}

#[test]
fn complexity_is_cut_by_stratum_and_its_mean_is_of_all() {
    let case = Case::new();
    case.done(&["complexity", "--preset", "baseline", "--iterations", "2"], "run");
    let run = Run::read(&case.run("run")).unwrap();
    let frames: Vec<usize> = run.table.iter().map(|row| row.frames).collect();
    assert_eq!((frames[0] + frames[1] + frames[2], frames[3]), (6, 6));
    assert!(frames.iter().all(|&count| count > 0));
    let labels: Vec<&str> = run.table.iter().map(|row| row.labels[0].as_str()).collect();
    assert_eq!(labels, ["easy", "medium", "hard", "mean"]);
    let mean = |row: usize| run.table[row].majpe_mm.unwrap().mean;
    let weighted: f64 = (0..3).map(|row| mean(row) * frames[row] as f64).sum();
    assert!((mean(3) - weighted / 6.0).abs() < 1e-9);
    assert_eq!(run.rows_of(&run.table[2]).count(), frames[2]);
}

/// What a study says of a frame is what `fit` says of it.
#[test]
fn the_numbers_are_those_of_fit() {
    let case = Case::new();
    case.done(&["init", "--iterations", "4", "--frames", "1..3"], "run");
    let run = Run::read(&case.run("run")).unwrap();
    let fit = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"))
        .args(["fit", "--iterations", "4", "--frames", "1..3", "--json"])
        .arg(case.data())
        .env("MHP_INSPECTOR_HOME", case.run("home"))
        .output()
        .unwrap();
    let fit: Value = serde_json::from_slice(&fit.stdout).unwrap();
    for (row, other) in run.rows.iter().filter(|row| row.variant == 0).zip(fit["frames"].as_array().unwrap()) {
        let numbers = row.fit.as_ref().unwrap();
        assert_eq!(row.name, other["frame"].as_str().unwrap());
        assert_eq!(Some(numbers.loss), other["loss"].as_f64());
        assert_eq!(numbers.majpe_mm, other["majpe_mm"].as_f64());
        assert_eq!(numbers.iou, [other["iou_hori"].as_f64(), other["iou_vert"].as_f64()]);
    }
}

/// A budget's cold rows share one fit; a fit of that length alone is the same.
#[test]
fn shared_fits_are_the_fits_alone() {
    let case = Case::new();
    case.done(&["sweep", "--grid", "iterations=2,7,4", "--grid", "w_em=0.5,0.2", "--frames", "0..2"], "together");
    let together = Run::read(&case.run("together")).unwrap();
    for iterations in ["2", "7", "4"] {
        let out = format!("alone{iterations}");
        let grid = format!("iterations={iterations}");
        case.done(&["sweep", "--grid", &grid, "--grid", "w_em=0.5,0.2", "--frames", "0..2"], &out);
        let alone = Run::read(&case.run(&out)).unwrap();
        for row in &alone.table {
            let same = together.table.iter().find(|other| other.labels == row.labels).unwrap();
            assert_eq!((row.loss, row.majpe_mm, row.iou), (same.loss, same.majpe_mm, same.iou), "{:?}", row.labels);
        }
    }
}

#[test]
fn parquet_holds_what_the_csv_holds() {
    use parquet::file::reader::{FileReader as _, SerializedFileReader};
    use parquet::record::Field;
    let case = Case::new();
    case.done(&["init", "--iterations", "2", "--frames", "0..3"], "run");
    let file = std::fs::File::open(case.run("run").join("rows.parquet")).unwrap();
    let reader = SerializedFileReader::new(file).unwrap();
    let mut table = csv::Reader::from_path(case.run("run").join("rows.csv")).unwrap();
    let heads: Vec<String> = table.headers().unwrap().iter().map(str::to_owned).collect();
    let mut rows = 0;
    for (row, line) in reader.get_row_iter(None).unwrap().zip(table.records()) {
        let (row, line) = (row.unwrap(), line.unwrap());
        for (((name, field), head), cell) in row.get_column_iter().zip(&heads).zip(line.iter()) {
            assert_eq!(name, head);
            let told = match field {
                Field::Null => String::new(),
                Field::Str(text) => text.clone(),
                Field::Long(n) => n.to_string(),
                Field::Double(x) => x.to_string(),
                Field::Bool(flag) => flag.to_string(),
                other => format!("{other:?}"),
            };
            assert_eq!(told, cell, "{name}");
        }
        rows += 1;
    }
    assert_eq!(rows, 9);
}

#[test]
fn bad_requests_say_what_is_wrong() {
    let case = Case::new();
    let refusal = |words: &[&str]| {
        let output = case.study(words, "bad");
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        assert!(!Path::new(&case.run("bad")).join("run.toml").exists(), "nothing is begun");
        text(&output.stderr)
    };
    assert!(refusal(&["sweep", "--grid", "tau=5"]).contains("unknown key `tau`"));
    assert!(refusal(&["sweep", "--grid", "tau_pct=101"]).contains("expected a number in 0.1 ..= 100"));
    assert!(refusal(&["init", "--shard", "3/2"]).contains("expected i/n"));
    assert!(refusal(&["init", "--frames", "5..99"]).contains("the data set has 6"));
    assert!(refusal(&["init", "--preset", "best"]).contains("[possible values: baseline, paper, recommended]"));
    assert!(refusal(&["init", "--seed", "9999999999"]).contains("init.seed is 9999999999; expected"));
}

#[test]
fn a_run_that_another_process_works_on_or_that_lies_in_the_data_is_left_alone() {
    let case = Case::new();
    let lock = FolderLock::claim(&case.run("run"), &[], &Inputs::default()).unwrap();
    let output = case.study(&["threshold", "--iterations", "1"], "run");
    let wanted = format!("another process ({}) is writing here", std::process::id());
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains(&wanted), "{}", text(&output.stderr));
    drop(lock);
    assert_eq!(std::fs::read_dir(case.run("run")).unwrap().count(), 0, "nothing was written");
    let output = case.study(&["threshold", "--iterations", "1"], "data/runs/one");
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("lies in the data set"), "{}", text(&output.stderr));
    assert!(!case.run("data/runs").exists());
}

/// What a study perturbs acts where its row says, or the row says why it cannot.
#[test]
fn a_perturbation_acts_or_its_row_says_why_not() {
    let case = Case::new();
    let words: &[&str] = &["robustness", "--all", "--iterations", "3"];
    for (preset, how) in [
        ("baseline", ["--preset", "baseline"]),
        ("recommended", ["--config", "@few.toml"]),
        ("paper", ["--preset", "paper"]),
    ] {
        case.done(&[words, &how].concat(), preset);
        let run = Run::read(&case.run(preset)).unwrap();
        let fits = |variant: usize| -> Vec<_> {
            run.rows.iter().filter(|row| row.variant == variant).map(|row| row.fit.as_ref().unwrap()).collect()
        };
        let errors = |variant: usize| -> Vec<f64> {
            let of = |fit: &RunNumbers| [fit.majpe_mm, fit.pa_majpe_mm, fit.init_majpe_mm].map(Option::unwrap);
            fits(variant).into_iter().flat_map(of).collect()
        };
        for row in &run.table[1..] {
            // The rounding of a sum that is 0 may differ, and no more.
            let acts =
                errors(row.variant).iter().zip(errors(0)).any(|(perturbed, plain)| (perturbed - plain).abs() > 1e-6);
            assert_eq!(acts, row.note.is_none(), "{preset}, {:?}: {:?}", row.labels, row.note);
        }
        // Every frame of the chain begins with joints that are 5 cm off in each coordinate, not its first alone.
        let warm = fits(run.table.len() - 1);
        let plain = fits(0);
        for (perturbed, plain) in warm.iter().zip(plain) {
            let (perturbed, plain) = (perturbed.init_pa_majpe_mm.unwrap(), plain.init_pa_majpe_mm.unwrap());
            assert!(
                (perturbed * perturbed - plain * plain).max(0.0).sqrt() > 40.0,
                "{preset}: {perturbed} and {plain} mm"
            );
        }
    }
}

/// The paper's columns are of MMVR, HuPR and XRF55: beside other data they are left out, and the table says so.
#[test]
fn the_papers_figures_stand_beside_their_own_data_alone() {
    let case = Case::new();
    for study in ["operators", "threshold", "init", "complexity", "counting"] {
        let table = case.done(&[study, "--iterations", "1", "--frames", "0..3"], study);
        let why = "and not shown: the layout here is npz.";
        assert!(!table.contains("paper MAJPE") && !table.contains("paper weighted") && table.contains(why), "{table}");
        let json: Value = serde_json::from_slice(&std::fs::read(case.run(study).join("table.json")).unwrap()).unwrap();
        assert!(json["paper"].is_null() && json["paper_missing"].as_str().unwrap().ends_with(why));
        assert!(json["rows"].as_array().unwrap().iter().all(|row| row["paper"].is_null()), "{study}");
    }
    let table = case.done(&["budget", "--iterations", "1", "--frames", "0..2"], "budget");
    assert!(!table.contains("paper"), "the paper has no such table: {table}");
    let hupr = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/hupr");
    let study = |name: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
        command.args(["study", name, "--iterations", "1", "--frames", "0"]).arg(&hupr).arg("--out");
        let output = command.arg(case.run(&format!("hupr {name}"))).output().unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let table = study("threshold");
    assert!(table.contains("paper MAJPE") && table.contains("73.7") && table.contains("RETR on single-person HuPR"));
    assert!(!table.contains("71.1"), "MMVR's figure: {table}");
    let table = study("operators");
    assert!(table.contains("are of MMVR and not shown: the layout here is hupr."), "{table}");
}

/// A folder may have any bytes as its name.
#[cfg(target_os = "linux")]
#[test]
fn a_data_set_in_a_folder_that_is_no_text_is_studied() {
    use std::os::unix::ffi::OsStrExt as _;
    let case = Case::new();
    let folder = case.folder.path().join(std::ffi::OsStr::from_bytes(b"data \xff\xfe"));
    std::fs::rename(case.data(), &folder).unwrap();
    let runs = case.folder.path().join(std::ffi::OsStr::from_bytes(b"runs \xff"));
    let study = |more: &[&str], out: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
        command.args(["study", "init", "--iterations", "2", "--frames", "0..2"]).args(more).arg(&folder);
        command.arg("--out").arg(runs.join(out)).env("MHP_INSPECTOR_HOME", case.run("home"));
        command.output().unwrap()
    };
    let output = study(&[], "whole");
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(study(&[], "whole").status.success(), "the same command goes on with it");
    let run = Run::read(&runs.join("whole")).unwrap();
    assert_eq!(run.spec.data.root, std::path::absolute(&folder).unwrap(), "the window can open its data");
    for k in 1..=2 {
        assert!(study(&["--shard", &format!("{k}/2")], &format!("part{k}")).status.success());
    }
    let mut merge = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    merge.arg("merge").args(["part1", "part2"].map(|part| runs.join(part)));
    let merged = merge.arg("--out").arg(runs.join("merged")).output().unwrap();
    assert!(merged.status.success(), "{}", text(&merged.stderr));
    for file in REPRODUCIBLE {
        let bytes = |run: &str| std::fs::read(runs.join(run).join(file)).unwrap();
        assert!(bytes("whole") == bytes("merged"), "{file}");
    }
    // A data set that cannot be opened there is told, in text.
    std::fs::remove_dir_all(&folder).unwrap();
    let refused = study(&[], "none");
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        String::from_utf8(refused.stderr).is_ok_and(|told| told.starts_with("error: ") && told.lines().count() == 1)
    );
}

#[test]
fn every_table_is_told_by_scene_where_frames_come_from_several() {
    let case = Case::new();
    case.done(&["weights", "--iterations", "2", "--preset", "baseline"], "plain");
    let table = |run: &str| -> Value {
        serde_json::from_slice(&std::fs::read(case.run(run).join(TABLE_FILE)).unwrap()).unwrap()
    };
    assert!(table("plain").get("scenes").is_none());
    let manifest = case.data().join("dataset.toml");
    let said = "\n[[origin]]\nframes = \"*hard*\"\nscene = \"hall\"\nsubject = \"b\"\n[[origin]]\nscene = \"lab\"\n";
    std::fs::write(&manifest, std::fs::read_to_string(&manifest).unwrap() + said).unwrap();
    let told = case.done(&["weights", "--iterations", "2", "--preset", "baseline"], "scenes");
    assert!(told.contains("## Scene hall") && told.contains("## Scene lab"), "{told}");
    let (plain, scenes) = (table("plain"), table("scenes"));
    assert_eq!(plain["rows"], scenes["rows"]);
    let parts = scenes["scenes"].as_array().unwrap();
    assert_eq!(parts.iter().map(|part| part["scene"].as_str().unwrap()).collect::<Vec<_>>(), ["hall", "lab"]);
    for (row, all) in plain["rows"].as_array().unwrap().iter().enumerate() {
        let of = |key: &str, part: &Value| part["rows"][row][key]["mean"].as_f64().unwrap();
        let mean = parts.iter().map(|part| of("majpe_mm", part) / 2.0).sum::<f64>();
        assert!((mean - all["majpe_mm"]["mean"].as_f64().unwrap()).abs() < 1e-9);
    }
    let mut rows = csv::Reader::from_path(case.run("scenes").join("rows.csv")).unwrap();
    let heads = rows.headers().unwrap().clone();
    let at = |name: &str| heads.iter().position(|head| head == name).unwrap();
    for row in rows.records().map(Result::unwrap) {
        let hard = row[at("sequence")].contains("hard");
        assert_eq!((&row[at("scene")], &row[at("subject")]), if hard { ("hall", "b") } else { ("lab", "") });
    }
    // A key that is none is told with its line.
    std::fs::write(&manifest, std::fs::read_to_string(&manifest).unwrap() + "[[origin]]\nroom = \"x\"\n").unwrap();
    let refused = text(&case.study(&["weights"], "refused").stderr);
    assert!(refused.contains("dataset.toml:") && refused.contains("room"), "{refused}");
}
