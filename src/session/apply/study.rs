//! Studies: a run folder comes on screen, the frames of a row of its table come into the list.

use crate::session::effect::{Effect, Trash};
use crate::session::state::{LogLevel, Session};
use crate::session::study::ROW_FILTER;
use crate::study::run::Run;
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl Session {
    pub(super) fn open_run(&mut self, folder: &Path) -> Vec<Effect> {
        // The file inside a run folder stands for the folder.
        let inside = folder.file_name().is_some_and(|name| name == crate::study::run::RUN_FILE);
        let folder = folder.parent().filter(|_| inside).unwrap_or(folder).to_owned();
        self.study.reading = Some(folder.clone());
        vec![Effect::ReadRun(folder)]
    }

    pub(super) fn run_read(&mut self, folder: PathBuf, result: Result<Arc<Run>, String>) -> Vec<Effect> {
        if self.study.reading.as_ref() == Some(&folder) {
            self.study.reading = None;
        }
        match result {
            Ok(run) => {
                let (rows, variants) = (run.rows.len(), run.spec.variants.len());
                let state = if run.complete { "" } else { ", not finished" };
                self.hint(format!("{}: {}, {variants} variants, {rows} fits{state}", folder.display(), run.spec.study));
                let again = self.study.run.as_ref().is_some_and(|(old, _)| *old == folder);
                self.study.row = self.study.row.filter(|row| again && *row < run.table.len());
                let old = self.study.run.change().replace((folder, run));
                old.map_or_else(Vec::new, |old| vec![Effect::Free(Trash::new(old))])
            }
            Err(why) => {
                self.note(LogLevel::Error, why);
                Vec::new()
            }
        }
    }

    /// Puts the frames of a row into the list.
    pub(super) fn show_study_row(&mut self, row: usize) -> Vec<Effect> {
        let Some((folder, run)) = self.study.run.clone().filter(|(_, run)| row < run.table.len()) else {
            return Vec::new();
        };
        let Some(dataset) = self.data.dataset.clone() else {
            self.note(LogLevel::Error, format!("open the data set first: {}", run.spec.data.root.display()));
            return Vec::new();
        };
        self.study.row = Some(row);
        let mut effects = self.set_filter(ROW_FILTER.to_owned());
        effects.push(Effect::FindStudyRow(folder, run, row, dataset));
        effects
    }
}
