//! Text from data that wants to be more than text: nothing of it acts on a terminal, forges a line, breaks JSON or is computed
//! by a spreadsheet, whichever subcommand shows it; and everything comes back as it was.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::blob;
use mhp_inspector::dataset::Dataset;
use mhp_inspector::labels::read_table;
use mhp_inspector::study::read_summary;
use mhp_inspector::task::Progress;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::{Command, Output};

const FRAMES: [&str; 8] =
    ["=1+1", "-2", "\t3", "@4\nerror: forged", " 5 ", "6\u{1b}[31m\u{9b}2J\u{7f}", "'=7", "é τ 中文 👩‍👩‍👧 \u{202e}8"];
const WHO: &str = "=ada\u{1b}]0;mine\u{7}\u{202e}\nbo";
const NOTE: &str = "-see\r\n\u{1b}[2J\u{85}τ \"the\" wall 👩‍👩‍👧";

struct Desk(tempfile::TempDir);

impl Desk {
    fn new() -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        let data = desk.data();
        blob::write_dataset(&data, FRAMES.len());
        for (k, name) in FRAMES.iter().enumerate() {
            std::fs::rename(data.join(format!("frames/{k:03}.npz")), data.join(format!("{name}.npz"))).unwrap();
        }
        let manifest = blob::MANIFEST.replace("frames/*.npz", "*.npz");
        let manifest = manifest.replace("\"blob\"", r#""blob\u001B]0;x\u0007\u202E\nerror: none""#);
        std::fs::write(data.join("dataset.toml"), manifest).unwrap();
        desk
    }

    fn data(&self) -> PathBuf {
        self.0.path().join("da\u{1b}[2J\nta")
    }

    fn run(&self, arguments: &[&str]) -> Output {
        let data = self.data();
        let arguments = arguments.iter().map(|&word| if word == "DATA" { data.to_str().unwrap() } else { word });
        let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
        command.args(arguments).current_dir(self.0.path()).env("MHP_INSPECTOR_HOME", self.0.path().join("home"));
        command.output().unwrap()
    }

    /// What a command says, on both channels: without anything that is not seen.
    fn said(&self, arguments: &[&str]) -> (String, String) {
        let output = self.run(arguments);
        let (out, err) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {err}");
        is_harmless(&format!("{arguments:?}, standard output"), &out);
        is_harmless(&format!("{arguments:?}, standard error"), &err);
        (out, err)
    }

    fn json(&self, arguments: &[&str]) -> Value {
        serde_json::from_str(&self.said(arguments).0).unwrap()
    }

    fn frames(&self) -> Vec<String> {
        let dataset = Dataset::open(&self.data(), &Progress::new()).unwrap();
        (0..dataset.len()).map(|index| dataset.frame_name(index).to_owned()).collect()
    }

    fn cells(&self, name: &str) -> Vec<Vec<String>> {
        let mut table = csv::ReaderBuilder::new().from_path(self.0.path().join(name)).unwrap();
        table.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect()
    }
}

fn is_harmless(what: &str, text: &str) {
    let hidden = |c: char| {
        c != '\n' && c.is_control()
            || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{200e}' | '\u{200f}')
    };
    let found: Vec<char> = text.chars().filter(|&c| hidden(c)).collect();
    assert!(found.is_empty(), "{what}: {found:?} in {text}");
    assert!(!text.lines().any(|line| line.starts_with("error: ") || line.starts_with("bo")), "{what}: {text}");
}

fn texts(rows: &Value, key: &str) -> BTreeSet<String> {
    rows.as_array().unwrap().iter().map(|row| row[key].as_str().unwrap().to_owned()).collect()
}

#[test]
fn no_subcommand_lets_data_act_on_the_terminal() {
    let desk = Desk::new();
    let names: BTreeSet<String> = desk.frames().into_iter().collect();
    assert_eq!(names, FRAMES.map(str::to_owned).into());
    let (info, _) = desk.said(&["info", "DATA"]);
    assert!(info.contains("data set    blob\\u{1b}]0;x\\u{7}\\u{202e}\\nerror: none\n"), "{info}");
    assert_eq!(desk.json(&["info", "DATA", "--json"])["name"], "blob\u{1b}]0;x\u{7}\u{202e}\nerror: none");
    let (table, _) = desk.said(&["complexity", "DATA", "--csv", "complexity.csv"]);
    for shown in ["6\\u{1b}[31m\\u{9b}2J\\u{7f}", "@4\\nerror: forged", "é τ 中文 👩‍👩‍👧 \\u{202e}8"] {
        assert!(table.contains(shown), "{shown}: {table}");
    }
    assert_eq!(texts(&desk.json(&["complexity", "DATA", "--json"]), "frame"), names);
    let (table, _) = desk.said(&["count", "DATA", "--csv", "count.csv"]);
    assert_eq!(table.split("\n\n").next().unwrap().lines().count(), 1 + FRAMES.len(), "a line a frame: {table}");
    assert_eq!(texts(&desk.json(&["count", "DATA", "--json"])["frames"], "frame"), names);
    let few = ["--iterations", "2"];
    desk.said(&[&["evidence", "DATA", "--csv", "evidence.csv"], &few[..]].concat());
    assert_eq!(texts(&desk.json(&[&["evidence", "DATA", "--json"], &few[..]].concat()), "frame"), names);
    let (table, _) = desk.said(&[&["fit", "DATA", "--out", "fits"], &few[..]].concat());
    assert_eq!(table.lines().count(), 2 + FRAMES.len(), "{table}");
    assert_eq!(texts(&desk.json(&[&["fit", "DATA", "--json"], &few[..]].concat())["frames"], "frame"), names);
    desk.said(&["study", "threshold", "DATA", "--out", "run", "--iterations", "1"]);

    // The same tables in a spreadsheet, and here again.
    let computed = |name: &str| name.trim_start_matches('\'').starts_with(['=', '-', '\t', '@']);
    let guarded: BTreeSet<String> =
        FRAMES.iter().map(|name| if computed(name) { format!("'{name}") } else { (*name).to_owned() }).collect();
    for (table, column) in [("complexity.csv", 0), ("count.csv", 0), ("evidence.csv", 0), ("fits/summary.csv", 0)] {
        let rows = desk.cells(table);
        assert_eq!(rows.iter().map(|row| row[column].clone()).collect::<BTreeSet<_>>(), guarded, "{table}");
    }
    let rows = desk.cells("run/rows.csv");
    assert!(guarded.iter().all(|name| rows.iter().any(|row| row.contains(name))), "{rows:?}");
    let read = read_summary(&desk.0.path().join("fits/summary.csv")).unwrap();
    assert_eq!(read.into_iter().map(|row| row.frame).collect::<Vec<_>>(), desk.frames(), "--results finds every frame");
    desk.said(&["complexity", "DATA", "--csv", "plain.csv", "--csv-plain"]);
    assert_eq!(desk.cells("plain.csv").into_iter().map(|row| row[0].clone()).collect::<BTreeSet<_>>(), names);
}

#[test]
fn labels_of_hostile_names_are_shown_and_come_home() {
    let desk = Desk::new();
    for frame in FRAMES {
        // `--frame=` because a name may begin with a dash.
        let frame = format!("--frame={frame}");
        desk.said(&["labels", "tag", "DATA", "--annotator", WHO, &frame, "--add", "F1", &format!("--note={NOTE}")]);
    }
    let (shown, _) = desk.said(&["labels", "show", "DATA"]);
    assert_eq!(shown.lines().count(), FRAMES.len(), "{shown}");
    assert!(shown.contains("=ada\\u{1b}]0;mine\\u{7}\\u{202e}\\nbo  "), "{shown}");
    assert!(shown.contains("\"-see\\r\\n\\u{1b}[2J\\u{85}τ \\\"the\\\" wall 👩‍👩‍👧\""), "{shown}");
    let records = desk.json(&["labels", "show", "DATA", "--json"]);
    assert!(records.as_array().unwrap().iter().all(|r| r["annotator"] == WHO && r["label"]["note"] == NOTE));
    desk.said(&["labels", "stats", "DATA"]);
    assert_eq!(desk.json(&["labels", "stats", "DATA", "--json"]).as_object().unwrap().keys().next().unwrap(), WHO);
    desk.said(&["labels", "agreement", "DATA", "--machine", "--disputes"]);
    let (told, _) = desk.said(&["labels", "export", "DATA", "--csv", "all.csv", "--json", "all.json"]);
    assert_eq!(told.lines().count(), 2, "{told}");
    let read = |name: &str| {
        let rows = read_table(&desk.0.path().join(name)).unwrap().rows;
        rows.into_iter().map(|row| row.record).collect::<Vec<_>>()
    };
    assert_eq!(read("all.csv"), read("all.json"));
    let cells = desk.cells("all.csv");
    assert!(cells.iter().flatten().all(|cell| !cell.starts_with(['=', '+', '-', '@', '\t', '\r'])), "{cells:?}");
    // Home, and out again: the same labels; damaged lines of a journal of such a name are told in one line each.
    let away = desk.0.path().join("away");
    std::fs::rename(desk.data().join("mhp-labels"), &away).unwrap();
    desk.said(&["labels", "import", "DATA", "all.csv"]);
    desk.said(&["labels", "export", "DATA", "--csv", "again.csv"]);
    let labels =
        |name: &str| read(name).into_iter().map(|r| (r.frame, r.annotator, r.label, r.time)).collect::<Vec<_>>();
    assert_eq!(labels("again.csv"), labels("all.csv"));
    desk.said(&["labels", "export", "DATA", "--csv", "plain.csv", "--csv-plain"]);
    assert!(desk.cells("plain.csv").iter().all(|row| row[2] == WHO && row[13] == NOTE));
    std::fs::remove_dir_all(desk.data().join("mhp-labels")).unwrap();
    desk.said(&["labels", "import", "DATA", "plain.csv", "--csv-plain"]);
    std::fs::write(
        desk.data().join("mhp-labels/x\u{1b}[2J\nerror: y.labels.jsonl"),
        "{\"format\":\"mhp-labels\",\"version\":1}\nx\n",
    )
    .unwrap();
    let (_, told) = desk.said(&["labels", "show", "DATA"]);
    assert!(told.contains("x\\u{1b}[2J\\nerror: y.labels.jsonl:2: damaged line, skipped"), "{told}");
}

#[test]
fn errors_are_one_line_whatever_they_repeat() {
    let desk = Desk::new();
    let refused = |arguments: &[&str]| {
        let output = desk.run(arguments);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        let rest = message.strip_prefix("error: ").unwrap().to_owned();
        is_harmless(&format!("{arguments:?}"), &rest);
        rest
    };
    assert_eq!(refused(&["labels", "show", "DATA", "--annotator", WHO]).lines().count(), 1);
    assert_eq!(refused(&["info", "no\u{1b}[2J\nerror: x"]).lines().count(), 1);
    let unknown = refused(&["labels", "tag", "DATA", "--annotator", "a", "--frame", "x\u{9b}\ny", "--add", "F1"]);
    assert!(unknown.lines().count() == 1 && unknown.contains("`x\\u{9b}\\ny`"), "{unknown}");
    // What the shell found and no option takes.
    assert!(refused(&["info", "DATA", "6\u{1b}[31m"]).contains("6\\u{1b}[31m"));
    let manifest = blob::MANIFEST.replace("frames/*.npz", "*.npz").replace("\"hori\"", r#""ho\u001B[2J\nri""#);
    std::fs::write(desk.data().join("dataset.toml"), manifest).unwrap();
    let missing = refused(&["info", "DATA"]);
    assert!(missing.lines().count() == 1 && missing.contains("ho\\u{1b}[2J\\nri"), "{missing}");
}
