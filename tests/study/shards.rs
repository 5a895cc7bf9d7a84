//! `--shard` and `merge`: what the shards of any command become is what one run of it writes and prints.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::scenes::{Scene, write_scenes};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A data set of two sequences with one frame that cannot be read, and a place for results.
pub(crate) struct Case {
    folder: tempfile::TempDir,
}

impl Case {
    pub(crate) fn new() -> Self {
        let case = Self::without_fault();
        std::fs::write(case.at("data/frames/hard/001.npz"), b"PK nonsense").unwrap();
        case
    }

    fn without_fault() -> Self {
        let case = Self { folder: tempfile::tempdir().unwrap() };
        std::fs::create_dir_all(case.at("data")).unwrap();
        let scene = |folder, frames, clutter, reflector| Scene { folder, frames, clutter, reflector };
        write_scenes(&case.at("data"), &[scene("easy", 4, 0, false), scene("hard", 3, 4, true)]);
        case
    }

    pub(crate) fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `words` of the command line, of which those that begin with `@` are files of this case.
    pub(crate) fn program(&self, words: &[&str]) -> Output {
        let word = |word: &&str| word.strip_prefix('@').map_or_else(|| PathBuf::from(*word), |name| self.at(name));
        let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
        command.args(words.iter().map(word)).env("MHP_INSPECTOR_HOME", self.at("home"));
        command.output().unwrap()
    }

    /// As [`Self::program`], with an exit code; standard output.
    pub(crate) fn ends(&self, code: i32, words: &[&str]) -> String {
        let output = self.program(words);
        assert_eq!(output.status.code(), Some(code), "{words:?}: {}", text(&output.stderr));
        text(&output.stdout)
    }

    fn refused(&self, words: &[&str]) -> String {
        let output = self.program(words);
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        text(&output.stderr)
    }

    /// Does the shards 1 to `count` of a command, into `NAME1` and so on.
    fn shards(&self, name: &str, count: usize, words: &[&str]) -> Vec<String> {
        let shard = |index| {
            let (number, folder) = (format!("{index}/{count}"), format!("@{name}{index}"));
            let output = self.program(&[words, &["--shard", &number, "--out", &folder]].concat());
            assert!(matches!(output.status.code(), Some(0..=2)), "{}", text(&output.stderr));
            assert!(output.stdout.is_empty() || words[0] == "study", "a part is no answer");
            folder
        };
        (1..=count).map(shard).collect()
    }

    fn merge(&self, code: i32, shards: &[String], out: &str, more: &[&str]) -> String {
        let shards: Vec<&str> = shards.iter().rev().map(String::as_str).collect();
        self.ends(code, &[&["merge"], &shards[..], &["--out", out], more].concat())
    }

    /// The files below a folder; tables and texts without their times.
    pub(crate) fn files(&self, folder: &str) -> BTreeMap<PathBuf, Vec<u8>> {
        let (root, mut found, mut open) = (self.at(folder), BTreeMap::new(), vec![self.at(folder)]);
        while let Some(folder) = open.pop() {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    open.push(path);
                } else {
                    let name = path.strip_prefix(&root).unwrap().to_owned();
                    let bytes = if name == Path::new("summary.csv") {
                        timeless_csv(&path)
                    } else {
                        std::fs::read(&path).unwrap()
                    };
                    found.insert(name, bytes);
                }
            }
        }
        found
    }

    pub(crate) fn same(&self, one: &str, other: &str) {
        let (one, other) = (self.files(one), self.files(other));
        assert_eq!(one.keys().collect::<Vec<_>>(), other.keys().collect::<Vec<_>>());
        for (name, bytes) in &one {
            assert!(*bytes == other[name], "{}: {}", name.display(), String::from_utf8_lossy(bytes));
        }
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// A table without the columns of times.
fn timeless_csv(path: &Path) -> Vec<u8> {
    let mut table = csv::ReaderBuilder::new().has_headers(false).from_path(path).unwrap();
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    let kept = |row: &csv::StringRecord| {
        let cells = row.iter().zip(&rows[0]).filter(|(_, head)| !head.ends_with("_ms"));
        cells.map(|(cell, _)| cell).collect::<Vec<_>>().join(",")
    };
    rows.iter().map(kept).collect::<Vec<_>>().join("\n").into_bytes()
}

/// What is printed, without times: lines of JSON, or cells of a table.
fn timeless(text: &str) -> Vec<String> {
    let heads: Vec<&str> = text.lines().next().unwrap_or_default().split_whitespace().collect();
    let line = |line: &str| {
        let line = line.replace(" %", "%");
        let cells = line.split_whitespace().enumerate();
        let cells = cells.filter(|(k, _)| heads.get(*k).is_none_or(|head| !head.ends_with("_ms")));
        cells.map(|(_, cell)| cell).collect::<Vec<_>>().join(" ")
    };
    text.lines().filter(|line| !line.contains("_ms\":")).map(line).collect()
}

#[test]
fn tables_of_shards_are_those_of_one_run() {
    let case = Case::new();
    let commands: [(&[&str], &str, usize); 4] = [
        (&["complexity", "@data", "--no-cache"], "complexity", 3),
        (&["complexity", "@data", "--window", "2"], "complexity", 8),
        (&["count", "@data"], "count", 3),
        (&["evidence", "@data", "--iterations", "2", "--frames", "1..7"], "evidence", 3),
    ];
    for (k, (words, name, count)) in commands.into_iter().enumerate() {
        let csv = format!("@one{k}.csv");
        let printed = case.ends(1, &[words, &["--csv", &csv]].concat());
        let json = case.ends(1, &[words, &["--json"]].concat());
        let shards = case.shards(&format!("{name}{k}-"), count, words);
        let (out, again) = (format!("@whole{k}"), format!("@again{k}"));
        assert_eq!(case.merge(1, &shards, &out, &[]), printed, "{words:?}");
        assert_eq!(case.merge(1, &shards, &again, &["--json"]), json, "{words:?}");
        let bytes = |file: &str| text(&std::fs::read(case.at(&file[1..])).unwrap());
        assert_eq!(bytes(&format!("{out}/{name}.csv")), bytes(&csv), "{words:?}");
    }
}

#[test]
fn fits_of_shards_are_those_of_one_run() {
    let case = Case::new();
    let fit: &[&str] = &["fit", "@data", "--iterations", "3"];
    let all: &[&[&str]] = &[&["--ply", "--curves"], &["--warm-start", "--people", "0"], &["--init", "@one0/pppr"]];
    for (k, more) in all.iter().enumerate() {
        let words = [fit, more].concat();
        let (one, out) = (format!("@one{k}"), format!("@whole{k}"));
        let printed = case.ends(1, &[&words[..], &["--out", &one]].concat());
        let json = case.ends(1, &[&words[..], &["--json", "--out", &format!("{one}-json")]].concat());
        let shards = case.shards(&format!("fit{k}-"), 3, &words);
        assert_eq!(timeless(&case.merge(1, &shards, &out, &[])), timeless(&printed), "{words:?}");
        case.same(&one[1..], &out[1..]);
        let again = case.merge(1, &shards, &out, &["--json"]);
        assert_eq!(timeless(&again), timeless(&json), "into the same folder again: {words:?}");
        case.same(&one[1..], &out[1..]);
    }
}

#[test]
fn a_study_is_merged_by_the_same_command() {
    let case = Case::new();
    let words: &[&str] = &["study", "init", "@data", "--iterations", "2"];
    let printed = case.ends(1, &[words, &["--out", "@one"]].concat());
    let shards = case.shards("run", 3, words);
    assert_eq!(case.merge(1, &shards, "@whole", &[]), printed);
    for file in ["run.toml", "rows.csv", "rows.parquet", "table.md", "table.json"] {
        let bytes = |run: &str| std::fs::read(case.at(run).join(file)).unwrap();
        assert!(bytes("one") == bytes("whole"), "{file}");
    }
}

#[test]
fn a_shard_that_is_missing_is_named_and_done_again_by_itself() {
    let case = Case::without_fault();
    let words: &[&str] = &["count", "@data"];
    let printed = case.ends(0, words);
    let shards = case.shards("s", 3, words);
    let rows = case.at("s2/rows.jsonl");
    let before = std::fs::read(&rows).unwrap();
    std::fs::remove_file(&rows).unwrap();
    std::fs::remove_dir_all(case.at("s3")).unwrap();
    std::fs::create_dir(case.at("s3")).unwrap();
    let why = case.refused(&["merge", "@s1", "@s2", "@s3", "--out", "@whole"]);
    assert!(why.contains("shards 2/3, 3/3 are missing") && why.contains("--shard 2/3, --shard 3/3"), "{why}");
    assert!(why.contains("s2 is not finished") && why.contains("s3 holds no shard"), "{why}");
    assert!(!case.at("whole").exists(), "nothing is begun");
    case.ends(0, &["count", "@data", "--shard", "2/3", "--out", "@s2"]);
    assert_eq!(std::fs::read(&rows).unwrap(), before, "the same bytes again");
    case.ends(0, &["count", "@data", "--shard", "3/3", "--out", "@elsewhere"]);
    let all = [shards[0].clone(), shards[1].clone(), shards[2].clone(), "@elsewhere".to_owned()];
    assert_eq!(case.merge(0, &all, "@whole", &[]), printed, "an empty folder among them does no harm");
}

#[test]
fn shards_of_other_settings_data_or_versions_are_refused() {
    let case = Case::without_fault();
    let fit: &[&str] = &["fit", "@data", "--iterations", "1"];
    case.shards("s", 2, fit);
    let shard = |words: &[&str], out: &str| case.ends(0, &[words, &["--shard", "2/2", "--out", out]].concat());
    let merged = |other: &str| case.refused(&["merge", "@s1", other, "--out", "@whole"]);
    shard(&["fit", "@data", "--iterations", "2"], "@longer");
    let why = merged("@longer");
    assert!(why.contains("longer: has another setting fit.iterations than the first: 2, not 1"), "{why}");
    shard(&["fit", "@data", "--iterations", "1", "--frames", "0..6"], "@fewer");
    assert!(merged("@fewer").contains("has another data set"), "{}", merged("@fewer"));
    shard(&["count", "@data"], "@count");
    assert!(merged("@count").contains("has another command than the first: count, not fit"), "{}", merged("@count"));
    case.ends(0, &[fit, &["--shard", "2/3", "--out", "@third"]].concat());
    assert!(merged("@third").contains("is one of 3 shards, the first one of 2"));
    assert!(merged("@s1").contains("comes twice"));
    case.ends(0, &["study", "init", "@data", "--iterations", "1", "--frames", "0", "--out", "@run"]);
    assert!(merged("@run").contains("expected the shards of one command"));
    case.ends(0, &[fit, &["--out", "@results"]].concat());
    let taken = case.refused(&[fit, &["--shard", "1/2", "--out", "@results"]].concat());
    assert!(taken.contains("pppr: holds other results already"), "{taken}");
    assert!(case.refused(&["merge", "@run", "--out", "@whole"]).contains("is no shard: it was run without --shard"));
    assert!(case.refused(&["merge", "@data", "--out", "@whole"]).contains("nothing to merge"));
    assert!(case.refused(&["merge", "@s1", "@s2", "--out", "@s1"]).contains("give another --out"));
    assert!(case.refused(&["merge", "@s1", "@s2", "--out", "@data"]).contains("lies in the data set"));
    // What lies there belongs to another command line.
    let taken = case.refused(&["fit", "@data", "--iterations", "2", "--shard", "1/2", "--out", "@s1"]);
    assert!(taken.contains("holds a shard with another setting fit.iterations: 1, not 2"), "{taken}");
    let file = case.at("s2/shard.toml");
    let told = std::fs::read_to_string(&file).unwrap();
    let version = concat!("version = \"", env!("CARGO_PKG_VERSION"), "\"");
    assert!(told.contains(version));
    std::fs::write(&file, told.replace(version, "version = \"0.0.1\"")).unwrap();
    assert!(merged("@s2").contains("has another version than the first: 0.0.1"), "{}", merged("@s2"));
    std::fs::write(&file, &told).unwrap();
    let rows = case.at("s2/rows.jsonl");
    std::fs::copy(case.at("longer/rows.jsonl"), &rows).unwrap();
    assert!(merged("@s2").contains("line 1: names shard"), "{}", merged("@s2"));
    // Another data set in the same place.
    std::fs::remove_file(&rows).unwrap();
    crate::blob::write_frame(&case.at("data/frames/easy/000.npz"), 1, &|depth, _| if depth > 5.0 { 9.0 } else { 0.0 });
    assert!(case.refused(&[fit, &["--shard", "2/2", "--out", "@s2"]].concat()).contains("another data set"));
}

#[test]
fn what_is_no_shard_is_refused_in_words() {
    let case = Case::without_fault();
    let asked = |shard: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
        command.arg("count").arg(case.at("data")).args(["--shard", shard, "--out"]).arg(case.at("s"));
        for name in ["ID", "MIN", "MAX", "COUNT", "STEP"] {
            command.env_remove(format!("SLURM_ARRAY_TASK_{name}"));
        }
        command
    };
    let told = |command: &mut Command| {
        let output = command.output().unwrap();
        (output.status.code(), text(&output.stderr))
    };
    let (code, why) = told(&mut asked("0/4"));
    assert!(code == Some(2) && why.contains("counted from 1, here 1/4 to 4/4"), "{why}");
    let (code, why) = told(&mut asked("auto"));
    assert!(code == Some(2) && why.contains("outside of an array give i/n, counted from 1"), "{why}");
    let mut array = asked("auto");
    array.envs([("SLURM_ARRAY_TASK_ID", "0"), ("SLURM_ARRAY_TASK_MIN", "0"), ("SLURM_ARRAY_TASK_COUNT", "4")]);
    let (code, why) = told(&mut array);
    assert!(code == Some(0) && why.contains("shard 1/4: 1 frame in"), "{why}");
    assert!(case.refused(&["count", "@data", "--shard", "1/2"]).contains("--out"));
    assert!(case.refused(&["fit", "@data", "--shard", "1/2"]).contains("--out"));
}
