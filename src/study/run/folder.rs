//! Run folders: begun or gone on with, merged, read back.

use super::super::FileError;
use super::engine::execute;
use super::error::RunError;
use super::journal::{JOURNAL_FILE, Rows, RunJournal, read, rewrite};
use super::markdown;
use super::output::{self, TABLE_FILE, json_text};
use super::plan::RunPlan;
use super::row::RunRow;
use super::spec::{RUN_FILE, RunSpec};
use super::table::{SceneTable, TableRow, by_scene, table};
use crate::dataset::Dataset;
use crate::output::{FolderLock, Inputs};
use crate::study::shard::{Part as _, gather};
use crate::task::Progress;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// A watcher of a run is told no more often.
const LEAST_BETWEEN: Duration = Duration::from_millis(250);

/// A run as it lies on disk, finished or not.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// What it is.
    pub spec: RunSpec,
    /// Rows so far, by variant, then by frame; those fitted only on the way to others included.
    pub rows: Vec<RunRow>,
    /// Whether it ended.
    pub complete: bool,
    /// The table of these rows.
    pub table: Vec<TableRow>,
    /// The same for each scene, where there are several.
    pub scenes: Vec<SceneTable>,
}

impl Run {
    fn of(spec: RunSpec, rows: &Rows, complete: bool) -> Self {
        let (table, scenes) = (table(&spec, rows), by_scene(&spec, rows));
        Self { spec, rows: rows.values().cloned().collect(), complete, table, scenes }
    }

    /// What of it is of one scene; `None` where it has no such scene, or no other.
    #[must_use]
    pub fn of_scene(&self, scene: &str) -> Option<Self> {
        let table = self.scenes.iter().find(|table| table.scene == scene)?.rows.clone();
        let rows = self.rows.iter().filter(|row| row.origin.scene.as_deref() == Some(scene)).cloned().collect();
        Some(Self { spec: self.spec.clone(), rows, complete: self.complete, table, scenes: Vec::new() })
    }

    /// Reads a run folder.
    ///
    /// # Errors
    /// Where it holds no run, or its files cannot be read.
    pub fn read(folder: &Path) -> Result<Self, RunError> {
        let spec = RunSpec::read(folder)?;
        let rows = read(folder, &spec)?;
        Ok(Self::of(spec, &rows, folder.join(TABLE_FILE).is_file()))
    }

    /// The table as Markdown.
    pub fn markdown(&self) -> String {
        markdown::text(&self.spec, &self.table, &self.scenes)
    }

    /// The table as JSON.
    pub fn json(&self) -> String {
        json_text(&self.spec, &self.table, &self.scenes)
    }

    /// The rows of a row of the table, by frame.
    pub fn rows_of<'a>(&'a self, of: &'a TableRow) -> impl Iterator<Item = &'a RunRow> + 'a {
        let inside = |row: &&RunRow| of.stratum.is_none_or(|word| row.stratum.is_some_and(|s| s.word() == word));
        self.rows.iter().filter(|row| !row.passing && row.variant == of.variant).filter(inside)
    }
}

/// Whether `folder` holds a run.
pub fn is_run_folder(folder: &Path) -> bool {
    folder.join(RUN_FILE).is_file()
}

/// The folder that a run is written to, and what it must not be written over.
#[derive(Debug)]
pub struct RunFolder<'a> {
    /// The folder; made where it is not there.
    pub path: PathBuf,
    /// What is read.
    pub inputs: Inputs<'a>,
}

impl<'a> RunFolder<'a> {
    /// A folder that must not lie in the data set.
    pub fn of_data(path: &Path, dataset: &'a Dataset) -> Self {
        Self { path: path.to_owned(), inputs: dataset.inputs() }
    }
}

/// How often a watcher is told: for the first row, then as seldom as keeps the work undisturbed.
#[derive(Default)]
struct Pace {
    next: Option<Instant>,
}

impl Pace {
    fn tell(&mut self, tell: impl FnOnce()) {
        let began = Instant::now();
        if self.next.is_none_or(|next| began >= next) {
            tell();
            self.next = Some(Instant::now() + LEAST_BETWEEN.max(20 * began.elapsed()));
        }
    }
}

/// Does `plan` in a folder; where it holds the same run, rows that are done are not done again. Progress counts rows; a watcher
/// gets the run as it grows, several times a second at most.
///
/// # Errors
/// Where the folder holds another run, lies in the data set or cannot be written, another process works on it, there is no thread,
/// or on cancel.
pub fn execute_run(
    dataset: &Dataset,
    plan: &RunPlan,
    RunFolder { path: folder, inputs }: &RunFolder<'_>,
    threads: usize,
    progress: &Progress,
    watcher: Option<&(dyn Fn(Run) + Sync)>,
) -> Result<Run, RunError> {
    let _lock = claim(folder, inputs)?;
    if is_run_folder(folder) {
        let there = RunSpec::read(folder)?;
        if let Some((what, there, here)) = there.difference(&plan.spec) {
            return Err(RunError::OtherRun { what, there, here, path: folder.to_owned() });
        }
    } else if folder.join(JOURNAL_FILE).exists() {
        let message = format!("there is a journal without {RUN_FILE}; give another folder, or remove it");
        return Err(FileError::Damaged { message, path: folder.to_owned() }.into());
    } else {
        plan.spec.write(folder)?;
    }
    let pace = Mutex::new(Pace::default());
    let grown = |rows: &Rows| {
        if let Some(watcher) = watcher {
            let mut pace = pace.lock().unwrap_or_else(PoisonError::into_inner);
            pace.tell(|| watcher(Run::of(plan.spec.clone(), rows, false)));
        }
    };
    let rows = execute(dataset, plan, RunJournal::open(folder, &plan.spec)?, folder, threads, progress, &grown)?;
    output::write(folder, &plan.spec, &rows)?;
    Ok(Run::of(plan.spec.clone(), &rows, true))
}

/// Begins the folder of `plan` with rows that are done: those of its variants and frames. Where there is a run already nothing
/// is changed, for what is done there counts.
///
/// # Errors
/// As [`execute_run`], of the folder.
pub fn seed_run(
    plan: &RunPlan,
    RunFolder { path: folder, inputs }: &RunFolder<'_>,
    rows: &[RunRow],
) -> Result<(), RunError> {
    let _lock = claim(folder, inputs)?;
    if is_run_folder(folder) || folder.join(JOURNAL_FILE).exists() {
        return Ok(());
    }
    plan.spec.write(folder)?;
    let of_plan = |row: &&RunRow| row.variant < plan.spec.variants.len() && plan.frames.contains(&row.frame);
    let known = rows.iter().filter(of_plan).map(|row| ((row.variant, row.frame), row.clone())).collect();
    rewrite(&folder.join(JOURNAL_FILE), &plan.spec, &known)
}

/// Refuses a folder for a run that lies in the data set, or whose files are inputs. It need not be there.
///
/// # Errors
/// As told.
pub fn check_run_folder(folder: &Path, inputs: &Inputs<'_>) -> Result<(), RunError> {
    inputs.check_folder(folder)?;
    let files = output::FILES.into_iter().chain([RUN_FILE, JOURNAL_FILE]);
    Ok(files.map(|file| folder.join(file)).try_for_each(|file| inputs.check_replaced(&file))?)
}

/// Makes and holds the folder of a run.
fn claim(folder: &Path, inputs: &Inputs<'_>) -> Result<FolderLock, RunError> {
    check_run_folder(folder, inputs)?;
    Ok(FolderLock::claim(folder, &[], inputs)?)
}

/// Makes one run of its shards, in `out`.
///
/// # Errors
/// Where a folder is no complete shard, they are not of one run, one is missing or comes twice, or `out` cannot be written.
pub fn merge_runs(folders: &[impl AsRef<Path>], out: &Path) -> Result<Run, RunError> {
    let (spec, parts) = gather::<RunSpec>(folders)?;
    let mut rows = Rows::new();
    for (folder, part) in &parts {
        rows.extend(read(folder, part)?);
    }
    let _lock = claim(out, &Inputs::default().with_folder(&spec.data.root))?;
    if is_run_folder(out) {
        let there = RunSpec::read(out)?;
        if let Some((what, there, here)) = there.difference(&spec) {
            return Err(RunError::OtherRun { what, there, here, path: out.to_owned() });
        }
    }
    spec.write(out)?;
    rewrite(&out.join(JOURNAL_FILE), &spec, &rows)?;
    output::write(out, &spec, &rows)?;
    Ok(Run::of(spec, &rows, true))
}
