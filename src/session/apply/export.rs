//! Taking things home: curves, Gaussians, parameters, labels, strata, the session itself. What is to be written is gathered
//! here; a thread of the runtime writes it.

use crate::dataset::{Dataset, write_pppr};
use crate::labels::{Record, write_csv, write_json};
use crate::output::replace_file;
use crate::session::command::Export;
use crate::session::effect::{BackgroundTask, Effect};
use crate::session::file::SessionFile;
use crate::session::state::{LogLevel, Session};
use crate::study::{CurveRow, complexity, write_curves, write_erased, write_ply};
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl Session {
    pub(super) fn export(&mut self, what: Export, path: PathBuf) -> Vec<Effect> {
        let task = match what {
            Export::Curves => self.curves_task(path),
            Export::Gaussians => self.gaussians_task(path),
            Export::Parameters => self.parameters_task(path),
            Export::LabelsCsv => self.labels_task(path, false),
            Export::LabelsJson => self.labels_task(path, true),
            Export::Strata => self.strata_task(path),
            Export::Erased => self.erased_task(path),
        };
        if task.is_none() {
            self.note(LogLevel::Error, format!("{}: there is nothing to export yet", what.title()));
        }
        task.map(Effect::Run).into_iter().collect()
    }

    /// What looks whether a file may be written: no input, and not in the data set that is open.
    pub fn output_check(&self) -> OutputCheck {
        OutputCheck { dataset: self.data.dataset.clone() }
    }

    /// Every branch of the fit on screen, iteration by iteration.
    fn curves_task(&self, path: PathBuf) -> Option<BackgroundTask> {
        let (history, check) = (self.fit.history.clone(), self.output_check());
        let arrays: Vec<String> = self.fit.problem.as_ref()?.views.iter().map(|view| view.array.clone()).collect();
        Some(BackgroundTask::new(move || {
            check.file(&path)?;
            let rows = history.branches().iter().flat_map(|branch| {
                branch.rows.iter().map(move |row| CurveRow {
                    branch: branch.id,
                    report: &row.report,
                    majpe_mm: row.majpe_mm,
                    flag: branch
                        .flags
                        .iter()
                        .map(|flag| (flag.iteration, &flag.text))
                        .chain(branch.stops.iter().map(|(at, text)| (*at, text)))
                        .find(|(at, _)| *at == row.report.iteration)
                        .map(|(_, text)| text.as_str()),
                })
            });
            write_curves(&path, &arrays, rows).map_err(|error| error.to_string())?;
            Ok(written(&path))
        }))
    }

    fn gaussians_task(&self, path: PathBuf) -> Option<BackgroundTask> {
        let (shown, problem) = (Arc::clone(self.fit.shown.as_ref()?), Arc::clone(self.fit.problem.as_ref()?));
        let check = self.output_check();
        Some(BackgroundTask::new(move || {
            check.file(&path)?;
            write_ply(&path, &shown.params, &problem.skeleton).map_err(|error| error.to_string())?;
            Ok(written(&path))
        }))
    }

    fn parameters_task(&self, path: PathBuf) -> Option<BackgroundTask> {
        let shown = Arc::clone(self.fit.shown.as_ref()?);
        let check = self.output_check();
        Some(BackgroundTask::new(move || {
            check.file(&path)?;
            write_pppr(&path, &shown.params).map_err(|error| error.to_string())?;
            Ok(written(&path))
        }))
    }

    /// Everybody's labels; in agreement mode only one's own, so that nothing hidden leaves through this door.
    fn labels_task(&self, path: PathBuf, json: bool) -> Option<BackgroundTask> {
        self.labels.place.as_ref()?;
        let mut shared: Vec<Arc<Record>> = Vec::new();
        for (_, records) in self.labels.seen(self.view.label_mode) {
            shared.extend(records.said().map(|(_, record)| Arc::clone(record)));
        }
        let check = self.output_check();
        Some(BackgroundTask::new(move || {
            check.file(&path)?;
            let mut records: Vec<Record> = shared.into_iter().map(Arc::unwrap_or_clone).collect();
            records.sort_by(|a, b| {
                (a.frame.index, &a.frame.path, &a.annotator).cmp(&(b.frame.index, &b.frame.path, &b.annotator))
            });
            let count = records.len();
            let fill = if json { write_json } else { write_csv };
            replace_file(&path, |mut out| fill(&mut out, &records))
                .map_err(|reason| format!("{}: cannot be written: {reason}", path.display()))?;
            Ok(format!("{count} labels written to {}", path.display()))
        }))
    }

    fn erased_task(&self, path: PathBuf) -> Option<BackgroundTask> {
        let (dataset, erased) = (Arc::clone(self.data.dataset.as_ref()?), self.fit.erased());
        let check = self.output_check();
        (!erased.is_empty()).then(|| {
            BackgroundTask::new(move || {
                check.file(&path)?;
                write_erased(&path, &dataset.info().views, &erased).map_err(|error| error.to_string())?;
                Ok(written(&path))
            })
        })
    }

    fn strata_task(&self, path: PathBuf) -> Option<BackgroundTask> {
        let (dataset, strata) = (Arc::clone(self.data.dataset.as_ref()?), Arc::clone(self.strata.result()?));
        let check = self.output_check();
        Some(BackgroundTask::new(move || {
            check.file(&path)?;
            complexity::write_csv(&path, |i| dataset.frame_name(i), &strata).map_err(|error| error.to_string())?;
            Ok(written(&path))
        }))
    }

    pub(super) fn save_session(&mut self, path: PathBuf, window: serde_json::Value) -> Vec<Effect> {
        let Some(file) = SessionFile::of(self, window) else {
            self.note(LogLevel::Error, "there is no session to save: no data set is open".into());
            return Vec::new();
        };
        let check = self.output_check();
        self.session_path = Some(path.clone());
        vec![Effect::Run(BackgroundTask::new(move || {
            check.file(&path)?;
            file.write(&path).map_err(|error| error.to_string())?;
            Ok(format!("session saved to {}", path.display()))
        }))]
    }

    pub(super) fn task_done(&mut self, result: Result<String, String>) -> Vec<Effect> {
        self.writing = self.writing.saturating_sub(1);
        match result {
            Ok(text) => self.hint(text),
            Err(why) => self.note(LogLevel::Error, why),
        }
        Vec::new()
    }
}

fn written(path: &Path) -> String {
    format!("written to {}", path.display())
}

/// Looks, in a thread that may wait for the disk, whether a file may be written.
#[derive(Debug, Clone)]
pub struct OutputCheck {
    dataset: Option<Arc<Dataset>>,
}

impl OutputCheck {
    /// Refuses an input, and what lies in the data set.
    ///
    /// # Errors
    /// Why, in words.
    pub fn file(&self, path: &Path) -> Result<(), String> {
        let Some(dataset) = &self.dataset else { return Ok(()) };
        dataset.inputs().check_file(path).map_err(|error| error.to_string())
    }
}
