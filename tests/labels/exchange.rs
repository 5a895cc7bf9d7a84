//! Labels taken home and brought back through the real program: agreement, export, import and stats.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "tests fail by panicking")]

use crate::blob;
use mhp_inspector::labels::{Label, Record, read_acts, read_journal, read_table};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const HEAD: &str = "frame,annotator,time,F1,F2,F3,F4,clean,unsure,note";

/// A data set of twelve frames `frames/000` to `frames/011`, and a folder for tables.
struct Desk(tempfile::TempDir);

impl Desk {
    fn new() -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        blob::write_dataset(&desk.data(), 12);
        desk
    }

    fn data(&self) -> PathBuf {
        self.0.path().join("data")
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn journal(&self, annotator: &str) -> PathBuf {
        self.data().join(format!("mhp-labels/{annotator}.labels.jsonl"))
    }

    fn table(&self, name: &str, head: &str, rows: &[&str]) -> PathBuf {
        let path = self.at(name);
        std::fs::write(&path, format!("{head}\n{}\n", rows.join("\n"))).unwrap();
        path
    }

    fn labels<S: AsRef<std::ffi::OsStr>>(&self, args: &[S]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
        command.arg("labels").args(args).current_dir(self.0.path()).env("MHP_INSPECTOR_HOME", self.at("home"));
        command.output().unwrap()
    }

    fn done<S: AsRef<std::ffi::OsStr>>(&self, args: &[S]) -> String {
        let output = self.labels(args);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    }

    fn json<S: AsRef<std::ffi::OsStr>>(&self, args: &[S]) -> Value {
        serde_json::from_str(&self.done(args)).unwrap()
    }

    /// One line on standard error, code 2, nothing on standard output.
    fn refused<S: AsRef<std::ffi::OsStr>>(&self, args: &[S]) -> String {
        let output = self.labels(args);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(output.stdout.is_empty() && message.lines().count() == 1 && message.len() < 600, "{message}");
        message.trim_end().strip_prefix("error: ").expect("begins with `error: `").to_owned()
    }

    fn tag(&self, annotator: &str, frames: &[usize], tag: &str) {
        for frame in frames {
            self.done(&[
                "tag",
                "data",
                "--annotator",
                annotator,
                "--frame",
                &format!("frames/{frame:03}"),
                "--add",
                tag,
            ]);
        }
    }

    /// anna: F1 on 0 1 2, clean on 3 4, and a note alone on 5. bo: F1 on 1 2 3, F2 on 2, clean on 4, and one taken back.
    fn two_annotators(&self) {
        self.tag("anna", &[0, 1, 2], "F1");
        self.tag("anna", &[3, 4], "clean");
        self.done(&["tag", "data", "--annotator", "anna", "--frame", "5", "--note", "=look \"again\",\nplease"]);
        self.tag("bo", &[1, 2, 3], "F1");
        self.tag("bo", &[2], "F2");
        self.tag("bo", &[4, 0], "clean");
        self.done(&["tag", "data", "--annotator", "bo", "--frame", "0", "--remove", "clean"]);
    }
}

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

fn counts(table: &Value) -> [u64; 4] {
    ["both", "only_a", "only_b", "neither"].map(|key| table[key].as_u64().unwrap())
}

fn labels_of(records: Vec<Record>) -> Vec<(String, Label)> {
    records.into_iter().map(|record| (record.frame.path, record.label)).collect()
}

#[test]
fn journals_and_their_tables_agree_alike() {
    let desk = Desk::new();
    desk.two_annotators();
    let journals = [desk.journal("anna"), desk.journal("bo")].map(|path| path.display().to_string());
    let found = desk.json(&["agreement", &journals[0], &journals[1], "--json"]);
    // Judged by both: 1 2 3 4.
    assert_eq!(keys(&found), ["F1", "F2", "F3", "F4", "clean", "pooled", "unsure"]);
    for (_, table) in found.as_object().unwrap() {
        for key in ["kappa", "raw", "both", "only_a", "only_b", "neither", "frames", "prevalence_a", "unreliable"] {
            assert!(table.get(key).is_some(), "{key}");
        }
    }
    assert_eq!(counts(&found["F1"]), [2, 0, 1, 1]);
    assert_eq!((found["F1"]["kappa"].as_f64(), found["F1"]["raw"].as_f64()), (Some(0.5), Some(0.75)));
    assert_eq!(counts(&found["F2"]), [0, 0, 1, 3]);
    assert_eq!(found["F2"]["kappa"], 0.0);
    assert_eq!(counts(&found["clean"]), [1, 1, 0, 2]);
    assert!(found["F3"]["kappa"].is_null() && found["F3"]["raw"] == 1.0);
    assert_eq!(counts(&found["pooled"]), [3, 1, 2, 18]);
    let pooled = ["frames", "frames_only_in_a", "frames_only_in_b"].map(|key| found["pooled"][key].as_u64().unwrap());
    assert_eq!(pooled, [4, 1, 0]);
    assert!(found["F1"]["unreliable"].as_str().unwrap().starts_with("only 2 of 4 lack it"));

    desk.done(&["export", "data", "--csv", "all.csv", "--json", "all.json"]);
    for table in ["all.csv", "all.json", "data"] {
        let both = ["--annotator-a", "anna", "--annotator-b", "bo"];
        assert_eq!(desk.json(&[&["agreement", table, table, "--json"], &both[..]].concat()), found, "{table}");
    }
    let message = desk.refused(&["agreement", "all.csv", &journals[1]]);
    assert_eq!(message, "all.csv: labels of 2: anna, bo; expected --annotator-a NAME");
    let message = desk.refused(&["agreement", &journals[0], "all.csv", "--annotator-b", "cy"]);
    assert_eq!(message, "all.csv: no labels by `cy`; there are some by anna, bo");
    let disputes = desk.json(&["agreement", &journals[0], &journals[1], "--json", "--disputes"]);
    assert_eq!(disputes["clean"]["disputes"], serde_json::json!([{"frame": "frames/003", "a": true, "b": false}]));
    let text = desk.done(&["agreement", &journals[0], &journals[1], "--disputes"]);
    for wanted in
        ["4 frames judged by both; 1 by A alone, 0 by B alone", "* F3: neither used it", "frames/002  F2 only by B"]
    {
        assert!(text.contains(wanted), "{wanted}: {text}");
    }
}

#[test]
fn files_without_a_frame_in_common_are_null_and_zero() {
    let desk = Desk::new();
    let one = desk.table("one.csv", HEAD, &["a,x,,1,0,0,0,0,0,"]);
    let other = desk.table("other.csv", HEAD, &["b,y,,1,0,0,0,0,0,"]);
    std::fs::write(desk.at("empty"), "").unwrap();
    let one = one.to_str().unwrap();
    for b in [other.to_str().unwrap(), "empty"] {
        let found = desk.json(&["agreement", one, b, "--json"]);
        for (_, table) in found.as_object().unwrap() {
            assert!(table["kappa"].is_null() && table["raw"].is_null() && counts(table) == [0; 4], "{table}");
        }
        assert_eq!(found["pooled"]["frames_only_in_a"], 1);
    }
    assert!(desk.done(&["agreement", "empty", "empty"]).contains("0 frames judged by both"));
}

#[test]
fn a_person_and_the_machine() {
    let desk = Desk::new();
    let head = "frame,F1,F2,F3,F4,clean,unsure,machine_F1,machine_F3,machine_shown";
    let rows = ["a,1,0,0,0,0,0,0.8,0.1,0", "b,0,0,0,0,1,0,0.6,,1", "c,1,0,0,0,0,0,,,0"];
    let table = desk.table("a.csv", head, &rows);
    let table = table.to_str().unwrap();
    let found = desk.json(&["agreement", table, "--machine", "--json"]);
    assert_eq!(keys(&found), ["F1", "F2", "F3", "F4", "pooled"]);
    assert_eq!((counts(&found["F1"]), counts(&found["F3"])), ([1, 0, 1, 0], [0, 0, 0, 1]));
    let extra = ["frames", "machine_shown", "unscored"].map(|key| found["pooled"][key].as_u64().unwrap());
    assert_eq!(extra, [2, 1, 1]);
    let strict = desk.json(&["agreement", table, "--machine", "--threshold", "0.7", "--json"]);
    assert_eq!(counts(&strict["F1"]), [1, 0, 0, 1]);
    assert!(desk.done(&["agreement", table, "--machine"]).contains("of them 1 with the scores on screen"));
    for wrong in ["NaN", "1.5", "half"] {
        let output = desk.labels(&["agreement", table, "--machine", "--threshold", wrong]);
        assert_eq!(output.status.code(), Some(2));
    }
}

#[test]
fn an_export_comes_home_as_it_left() {
    let desk = Desk::new();
    desk.two_annotators();
    let told = desk.done(&["export", "data", "--csv", "all.csv", "--json", "all.json"]);
    assert_eq!(told, "10 labels by anna, bo, in all.csv\n10 labels by anna, bo, in all.json\n");
    assert_eq!(desk.done(&["export", "data", "--csv", "-"]), std::fs::read_to_string(desk.at("all.csv")).unwrap());
    let rows =
        |name: &str| read_table(&desk.at(name)).unwrap().rows.into_iter().map(|row| row.record).collect::<Vec<_>>();
    assert_eq!(rows("all.csv"), rows("all.json"));
    let order: Vec<String> = rows("all.csv").iter().map(|r| format!("{} {}", r.frame.index, r.annotator)).collect();
    assert_eq!(order, ["0 anna", "1 anna", "1 bo", "2 anna", "2 bo", "3 anna", "3 bo", "4 anna", "4 bo", "5 anna"]);

    let before = ["anna", "bo"].map(|name| read_journal(&desk.journal(name)).unwrap());
    std::fs::rename(desk.data().join("mhp-labels"), desk.at("away")).unwrap();
    let told = desk.done(&["import", "data", "all.csv"]);
    assert!(told.starts_with("anna: 6 labels imported, 0 the same; in "), "{told}");
    for (name, before) in ["anna", "bo"].into_iter().zip(before) {
        let after = read_journal(&desk.journal(name)).unwrap();
        let said: Vec<Record> = before.into_iter().filter(|record| !record.label.is_empty()).collect();
        assert!(after.iter().all(|record| record.act == "import from all.csv"));
        let same = |a: &Record, b: &Record| {
            (&a.frame, &a.label, &a.time, &a.judged) == (&b.frame, &b.label, &b.time, &b.judged)
        };
        assert!(after.len() == said.len() && after.iter().zip(&said).all(|(a, b)| same(a, b)), "{after:?}");
    }
    let bytes = std::fs::read(desk.journal("anna")).unwrap();
    for table in ["all.csv", "all.json"] {
        let told = desk.done(&["import", "data", table]);
        assert!(told.starts_with("anna: 0 labels imported, 6 the same"), "{told}");
    }
    assert_eq!(std::fs::read(desk.journal("anna")).unwrap(), bytes, "a second import writes nothing");
}

#[test]
fn an_import_replaces_only_what_is_older_and_keeps_the_rest_of_the_history() {
    let desk = Desk::new();
    desk.tag("anna", &[0, 1], "F1");
    let rows =
        ["frames/000,anna,2020-01-01T00:00:00Z,0,1,0,0,0,0,", "frames/001,anna,2999-01-01T00:00:00Z,0,1,0,0,0,0,new"];
    desk.table("sheet.csv", HEAD, &rows);
    let would = desk.done(&["import", "data", "sheet.csv", "--dry-run"]);
    assert!(would.contains("1 label would be imported, 0 the same, 1 kept because the row is not newer"), "{would}");
    assert_eq!(read_acts(&desk.journal("anna")).unwrap().len(), 2);
    desk.done(&["import", "data", "sheet.csv"]);
    let tags = || labels_of(read_journal(&desk.journal("anna")).unwrap());
    let said: Vec<String> =
        tags().into_iter().map(|(frame, label)| format!("{frame} {} {}", label.tags, label.note)).collect();
    assert_eq!(said, ["frames/000 F1 ", "frames/001 F2 new"]);
    assert!(desk.done(&["import", "data", "sheet.csv", "--replace"]).contains("1 label imported, 1 the same"));
    assert_eq!(tags()[0].1.tags.to_string(), "F2");
    assert_eq!(read_acts(&desk.journal("anna")).unwrap().len(), 4, "nothing is deleted");
    desk.done(&["import", "data", "sheet.csv", "--annotator", "cy"]);
    assert_eq!(read_journal(&desk.journal("cy")).unwrap().len(), 2);
}

#[test]
fn one_bad_row_and_nothing_is_imported() {
    let desk = Desk::new();
    desk.tag("anna", &[0], "F1");
    let good = "frames/003,anna,,1,0,0,0,0,0,";
    desk.table("good.csv", HEAD, &[good]);
    let folder = |desk: &Desk| {
        let mut files: Vec<_> =
            std::fs::read_dir(desk.data().join("mhp-labels")).unwrap().map(|f| f.unwrap().path()).collect();
        files.sort();
        files.into_iter().map(|file| std::fs::read(file).unwrap()).collect::<Vec<_>>()
    };
    let before = folder(&desk);
    let cases = [
        ("frames/004,anna,,2,0,0,0,0,0,", "bad.csv: line 3, column `F1`: `2`; expected 1 or 0"),
        (
            "frames/099,anna,,1,0,0,0,0,0,",
            "bad.csv: line 3: frame `frames/099` is not in the data set data; --keep-unknown",
        ),
        ("4,anna,,1,0,0,0,0,0,", "bad.csv: line 3: frame `4` is not in the data set"),
        ("frames/004,,,1,0,0,0,0,0,", "bad.csv: line 3: no annotator; expected a name in the column `annotator`"),
        ("frames/004,anna,,1", "bad.csv: line 3: 4 cells; the header has 10"),
        (
            "frames/000,anna,,1,0,0,0,0,0,",
            "bad.csv: line 3: frame `frames/000` of annotator `anna` is on line 2 already",
        ),
        (
            "frames/003,anna ,,1,0,0,0,0,0,",
            "bad.csv: line 3: frame `frames/003` of `anna` is also on line 2 of good.csv",
        ),
    ];
    for (row, wanted) in cases {
        desk.table("bad.csv", HEAD, &["frames/000,anna,2999-01-01T00:00:00Z,0,1,0,0,0,0,", row]);
        let message = desk.refused(&["import", "data", "good.csv", "bad.csv"]);
        assert!(message.starts_with(wanted), "{message}");
        assert_eq!(folder(&desk), before, "{row}");
    }
    // Cells that no map of the data set has, in either form.
    for region in ["hori[0..=99, 0..=3]", "hori[0..=3]", "side[0..=3, 0..=3]"] {
        let row = format!("frames/004,anna,1,0,0,0,0,0,\"{region}\"");
        desk.table("bad.csv", "frame,annotator,F1,F2,F3,F4,clean,unsure,region", &[&row]);
        let message = desk.refused(&["import", "data", "good.csv", "bad.csv"]);
        let wanted = format!("`{region}` is in no map; expected cells of hori of 48 × 32 bins or vert of 48 × 32 bins");
        assert_eq!(message, format!("bad.csv: line 2: column `region`: {wanted}"));
        desk.done(&["export", "bad.csv", "--json", "bad.json"]);
        let message = desk.refused(&["import", "data", "good.csv", "bad.json"]);
        assert_eq!(message, format!("bad.json: line 1: column `region`: {wanted}"));
        assert_eq!(folder(&desk), before, "{region}");
    }
    desk.table("bad.csv", HEAD, &["frames/099,dee,,1,0,0,0,0,0,"]);
    desk.done(&["import", "data", "bad.csv", "--keep-unknown"]);
    assert_eq!(labels_of(read_journal(&desk.journal("dee")).unwrap())[0].0, "frames/099");
}

#[test]
fn what_cannot_be_read_or_written_is_told_in_one_line() {
    let desk = Desk::new();
    desk.tag("anna", &[0], "F1");
    desk.table("no-f3.csv", "frame,F1,F2,F4,clean,unsure", &["a,1,0,0,0,0"]);
    std::fs::write(desk.at("latin.csv"), [HEAD.as_bytes(), b"\na,x,,1,0,0,0,0,0,caf\xe9\n"].concat()).unwrap();
    std::fs::write(desk.at("huge.csv"), "x".repeat(30_000_000)).unwrap();
    std::fs::write(desk.at("other.labels.jsonl"), "{\"a\":1}\n").unwrap();
    std::fs::create_dir(desk.at("folder")).unwrap();
    let journal = desk.journal("anna").display().to_string();
    let cases = [
        ("no-f3.csv", "no-f3.csv: line 1: no column `F3`"),
        ("latin.csv", "latin.csv: line 2, column `note`: is not UTF-8 text"),
        ("huge.csv", "huge.csv: line 1: no columns `frame`"),
        ("other.labels.jsonl", "other.labels.jsonl: no journal of labels"),
        ("folder", "expected a data set, a journal (*.labels.jsonl), or labels exported as CSV or JSON: folder"),
        ("none.csv", "none.csv: cannot be read"),
    ];
    for (file, wanted) in cases {
        let message = desk.refused(&["agreement", &journal, file]);
        assert!(message.starts_with(wanted), "{message}");
        if file != "other.labels.jsonl" && file != "folder" {
            assert!(desk.refused(&["import", "data", file]).starts_with(wanted));
        }
    }
    let bytes = std::fs::read(&journal).unwrap();
    assert!(desk.refused(&["export", "data", "--json", &journal]).contains("lies in the data set"));
    let message = desk.refused(&["export", "data", "--json", &journal, "--into-data"]);
    assert!(message.ends_with("is named like a journal, which is never replaced; expected another name"), "{message}");
    assert_eq!(std::fs::read(&journal).unwrap(), bytes);
    assert!(
        desk.refused(&["export", "data", "--csv", "nowhere/a.csv"]).starts_with("nowhere/a.csv: cannot be written")
    );
    assert!(desk.refused(&["export", "data", "--csv", "folder"]).starts_with("folder: cannot be written"));
    assert_eq!(left_over(desk.0.path()), Vec::<String>::new());
}

/// Temporary files that were not moved into place.
fn left_over(folder: &Path) -> Vec<String> {
    let names =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned());
    names.filter(|name| name.contains(".tmp")).collect()
}

#[test]
fn statistics_of_a_data_set() {
    let desk = Desk::new();
    desk.two_annotators();
    let found = desk.json(&["stats", "data", "--json"]);
    assert_eq!(keys(&found), ["anna", "bo"]);
    let anna = &found["anna"];
    assert_eq!((anna["frames"].as_u64(), anna["notes"].as_u64(), anna["acts"].as_u64()), (Some(6), Some(1), Some(6)));
    assert_eq!((anna["tags"]["F1"].as_u64(), anna["tags"]["clean"].as_u64()), (Some(3), Some(2)));
    assert_eq!(anna["groups"]["frames"]["tags"], anna["tags"], "all frames are of one scene");
    assert_eq!(
        (found["bo"]["frames"].as_u64(), found["bo"]["acts"].as_u64()),
        (Some(4), Some(7)),
        "one was taken back"
    );
    let days: u64 = found["bo"]["days"].as_object().unwrap().values().map(|n| n.as_u64().unwrap()).sum();
    assert_eq!(days, 7);
    assert!(anna["median_s"].as_f64().unwrap() >= 0.0);
    let journal = desk.journal("bo").display().to_string();
    assert_eq!(desk.json(&["stats", &journal, "--json"])["bo"], found["bo"]);
    assert_eq!(keys(&desk.json(&["stats", "data", "--annotator", "bo", "--by", "sequence", "--json"])), ["bo"]);
    let by_day = desk.json(&["stats", "data", "--by", "day", "--json"]);
    let days = keys(&by_day["anna"]["groups"]);
    assert_eq!(days.len(), 1, "{days:?}");
    assert_eq!(by_day["anna"]["groups"][&days[0]]["frames"], anna["frames"]);
    let by_stratum = desk.json(&["stats", "data", "--by", "stratum", "--json"]);
    let strata = by_stratum["anna"]["groups"].as_object().unwrap();
    assert!(strata.keys().all(|name| ["easy", "medium", "hard"].contains(&name.as_str())), "{strata:?}");
    let graded: u64 = strata.values().map(|counts| counts["frames"].as_u64().unwrap()).sum();
    assert_eq!(graded, anna["frames"].as_u64().unwrap());
    let message = desk.refused(&["stats", &journal, "--by", "stratum"]);
    assert!(message.contains("expected a data set, not a file of labels"), "{message}");
    let text = desk.done(&["stats", "data"]);
    assert!(text.contains("frames") && text.contains("7 acts on 1 day") && text.starts_with("anna\n"), "{text}");
}
