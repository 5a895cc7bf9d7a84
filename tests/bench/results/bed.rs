//! What sections measure with: the program, a folder for its results, the shared data.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where measurements run.
pub(crate) struct Bed {
    folder: tempfile::TempDir,
    machine: String,
}

impl Bed {
    pub(crate) fn new() -> Self {
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let model =
            info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": ").map(|(_, name)| name));
        let cores = std::thread::available_parallelism().map_or(0, usize::from);
        let day = time::OffsetDateTime::now_utc().date();
        let machine = format!(
            "Measured {day} with version {}; {cores} cores of {}.",
            env!("CARGO_PKG_VERSION"),
            model.unwrap_or("a processor that does not tell its name")
        );
        Self { folder: tempfile::tempdir().unwrap(), machine }
    }

    /// When and where, a line.
    pub(crate) fn machine(&self) -> &str {
        &self.machine
    }

    /// A place for results.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The project's own file or folder.
    pub(crate) fn own(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
    }

    /// Something of the shared folder beside the checkout, if it is there.
    pub(crate) fn shared(name: &str) -> Option<PathBuf> {
        let path = Self::own("../shared").join(name);
        path.exists().then_some(path)
    }

    /// Runs the program and answers what it printed.
    pub(crate) fn program(&self, arguments: &[&str]) -> String {
        self.tried(arguments).unwrap_or_else(|said| panic!("{arguments:?}: {said}"))
    }

    /// Runs the program and answers what it printed, or what it complained of.
    pub(crate) fn tried(&self, arguments: &[&str]) -> Result<String, String> {
        let program = std::env::var_os("MHP_PROGRAM").unwrap_or_else(|| env!("CARGO_BIN_EXE_mhp-inspector").into());
        let mut command = Command::new(program);
        let output = command.args(arguments).current_dir(self.folder.path()).output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
        if output.status.code().is_some_and(|code| code < 2) {
            Ok(text(output.stdout))
        } else {
            Err(text(output.stderr))
        }
    }

    /// Simulates a data set, once.
    pub(crate) fn simulated(&self, name: &str, options: &str) -> PathBuf {
        let folder = self.path(name);
        if !folder.exists() {
            let words: Vec<&str> = ["simulate", name].into_iter().chain(options.split_whitespace()).collect();
            self.program(&words);
        }
        folder
    }

    /// Runs a study and answers its folder.
    pub(crate) fn study(&self, name: &str, data: &Path, run: &str, options: &[&str]) -> PathBuf {
        let words = ["study", name, data.to_str().unwrap(), "--out", run];
        self.program(&words.into_iter().chain(options.iter().copied()).collect::<Vec<_>>());
        self.path(run)
    }

    /// What a command of this project prints that needs the window, as a block; with what it reads from the environment.
    pub(crate) fn with_window(command: &str, environment: &[(&str, &str)]) -> String {
        let mut words = command.split(' ').skip(1);
        let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
        let mut run = Command::new(cargo);
        run.args(&mut words).envs(environment.iter().copied()).current_dir(env!("CARGO_MANIFEST_DIR"));
        let output = run.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let said = String::from_utf8(output.stdout).unwrap();
        // Of a test what it says, not that it is one.
        let lines: Vec<&str> =
            said.lines().filter(|line| !line.starts_with("test ") && !line.starts_with("running ")).collect();
        let set: Vec<String> = environment.iter().map(|(name, value)| format!("{name}={value} ")).collect();
        format!("`{}{command}`:\n\n```text\n{}\n```", set.concat(), lines.join("\n").trim())
    }

    /// Another bench of this project: what it printed, as a block.
    pub(crate) fn bench(name: &str) -> String {
        let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
        // As this one was built: another choice of features would build everything once more.
        let features: &[&str] = if cfg!(feature = "viewer") { &[] } else { &["--no-default-features"] };
        let output = Command::new(cargo)
            .args(["bench", "--locked", "--bench", name])
            .args(features)
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).unwrap();
        format!("`cargo bench --no-default-features --bench {name}`:\n\n```text\n{}\n```", text.trim())
    }
}

/// A Markdown table; the first row is its head, numbers stand right.
pub(crate) fn table(rows: &[Vec<String>]) -> String {
    let mut text = String::new();
    for (k, row) in rows.iter().enumerate() {
        writeln!(text, "| {} |", row.join(" | ")).unwrap();
        if k == 0 {
            let rule: Vec<&str> = (0..row.len()).map(|column| if column == 0 { "---" } else { "---:" }).collect();
            writeln!(text, "| {} |", rule.join(" | ")).unwrap();
        }
    }
    text
}

/// Words as the cells of a table.
pub(crate) fn row(cells: &[&str]) -> Vec<String> {
    cells.iter().map(|&cell| cell.to_owned()).collect()
}

/// Mean of the means of groups, and half of its 95 % interval over the groups (normal).
pub(crate) fn over_groups(groups: &[Vec<f64>]) -> (f64, f64) {
    let means: Vec<f64> = groups.iter().filter(|group| !group.is_empty()).map(|group| mean(group)).collect();
    let middle = mean(&means);
    let squares = means.iter().map(|x| (x - middle).powi(2)).sum::<f64>();
    let spread = (squares / (means.len() as f64 - 1.0)).sqrt() / (means.len() as f64).sqrt();
    (middle, 1.96 * spread)
}

fn mean(numbers: &[f64]) -> f64 {
    numbers.iter().sum::<f64>() / numbers.len() as f64
}
