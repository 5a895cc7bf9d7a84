//! A data set of empty files, to label its frames through the library and through the program.
#![expect(clippy::unwrap_used, reason = "a test stops where its material cannot be made")]

use mhp_inspector::folders::HOME_VARIABLE;
use mhp_inspector::labels::{Change, FrameId, Journal, Judged, LabelPlace, LabelStore, Outcome};
use std::io::Write as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};

const MANIFEST: &str = r#"name = "case"
layout = "npz"
frames = "frames/*.npz"
skeleton = "coco17"

[[view]]
array = "hm"
psf = { range_m = 0.05, azimuth_rad = 0.05, elevation_rad = 0.0, doppler_mps = 0.1 }
axes = [ { kind = "range", bins = 16, lo = 0.5, hi = 6.0 }, { kind = "azimuth", bins = 8, lo = 0.96, hi = -1.04 } ]
"#;

/// A data set of which only names are read, and a home for the program.
pub(crate) struct Case {
    pub(crate) folder: tempfile::TempDir,
}

impl Case {
    pub(crate) fn new(frames: usize) -> Self {
        let case = Self { folder: tempfile::tempdir().unwrap() };
        std::fs::create_dir_all(case.data().join("frames")).unwrap();
        std::fs::write(case.data().join("dataset.toml"), MANIFEST).unwrap();
        for index in 0..frames {
            std::fs::write(case.data().join(format!("frames/{index:04}.npz")), b"").unwrap();
        }
        case
    }

    pub(crate) fn data(&self) -> PathBuf {
        self.folder.path().join("data")
    }

    pub(crate) fn home(&self) -> PathBuf {
        self.folder.path().join("home")
    }

    pub(crate) fn labels(&self) -> PathBuf {
        self.data().join("mhp-labels")
    }

    pub(crate) fn place(&self) -> LabelPlace {
        LabelPlace::in_folder(&self.labels())
    }

    pub(crate) fn file(&self, annotator: &str) -> PathBuf {
        self.labels().join(format!("{annotator}.labels.jsonl"))
    }

    pub(crate) fn journal(&self, annotator: &str) -> Journal {
        Journal::open(&self.place(), annotator, "f00d").unwrap()
    }

    pub(crate) fn program(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
        command.env(HOME_VARIABLE, self.home()).arg("labels");
        let (name, rest) = arguments.split_first().unwrap();
        command.arg(name).arg(self.data()).args(rest);
        command
    }

    pub(crate) fn told(&self, arguments: &[&str]) -> (String, String) {
        let output = self.program(arguments).output().unwrap();
        let (out, err) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {err}");
        (out, err)
    }

    /// What the program says to bad input: one line, exit code 2.
    pub(crate) fn refusal(&self, arguments: &[&str], stdin: &str) -> String {
        let mut child = self.program(arguments);
        child.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = child.spawn().unwrap();
        let _ = child.stdin.take().unwrap().write_all(stdin.as_bytes());
        let output = child.wait_with_output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        let errors: Vec<&str> = stderr.lines().filter(|line| line.starts_with("error: ")).collect();
        assert_eq!(errors.len(), 1, "{stderr}");
        assert!(!stderr.contains("panicked"), "{stderr}");
        errors[0].to_owned()
    }
}

pub(crate) fn name(index: usize) -> String {
    format!("frames/{index:04}")
}

pub(crate) fn frame(index: usize) -> FrameId {
    FrameId { path: name(index), index }
}

pub(crate) fn commit(journal: &mut Journal, index: usize, change: Change) -> Vec<Outcome> {
    journal.commit("test", &[(frame(index), change)], &Judged::default()).unwrap()
}

pub(crate) fn tags(place: &LabelPlace, annotator: &str, index: usize) -> String {
    let store = LabelStore::read(place).unwrap();
    store.label(annotator, &name(index)).map(|record| record.label.tags.to_string()).unwrap_or_default()
}
