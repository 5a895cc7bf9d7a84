//! Studies: a run folder comes on screen, the frames of a row of its table come into the list.

use crate::config::from_preset;
use crate::session::effect::{Effect, Trash};
use crate::session::state::{LogLevel, Session};
use crate::session::study::{ROW_FILTER, StudyOrder, StudyRequest};
use crate::session::work::WorkStatus;
use crate::study::run::{Run, RunRequest, points};
use crate::study::shard::{FrameRanges, Subset};
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl Session {
    /// Begins a study of the listed frames, or of the selected ones. Where it was begun before it goes on.
    pub(super) fn run_study(&mut self, order: StudyOrder) -> Vec<Effect> {
        let frames = self.batch_frames();
        self.study_of(order, &frames)
    }

    /// The same of these frames.
    pub(super) fn study_of(&mut self, order: StudyOrder, frames: &[u32]) -> Vec<Effect> {
        let Some(dataset) = self.data.dataset.clone() else { return Vec::new() };
        if self.study.work.is_running() {
            self.note(LogLevel::Warning, "a study is under way: let it end, or cancel it".into());
            return Vec::new();
        }
        let frames = FrameRanges::of_frames(frames.iter().map(|&frame| frame as usize));
        if frames.is_empty() {
            self.note(LogLevel::Warning, "no frame matches the filter: there is nothing to study".into());
            return Vec::new();
        }
        let run = RunRequest {
            study: order.study,
            base: self.config,
            base_name: from_preset(&self.config),
            precision: self.precision,
            frames,
            subset: Subset::All,
            grid: order.grid,
            iterations: None,
            shard: None,
            erased: Arc::default(),
        };
        if let Err(error) = points(run.study, &run.base, &run.grid, dataset.info().layout.word()) {
            self.note(LogLevel::Error, error.to_string());
            return Vec::new();
        }
        self.study.work.begin(0);
        (self.study.begun, self.study.follow) = (Some(order.study), true);
        let complexity = self.strata.result().cloned();
        vec![Effect::StartStudy(Box::new(StudyRequest { dataset, run, complexity, known: Vec::new() }))]
    }

    pub(super) fn pause_study(&mut self) -> Vec<Effect> {
        self.study.work.toggle_pause().map(Effect::PauseStudy).into_iter().collect()
    }

    pub(super) fn cancel_study(&mut self) -> Vec<Effect> {
        if self.study.work.is_running() { vec![Effect::CancelStudy] } else { Vec::new() }
    }

    /// The study that was begun here has more rows.
    pub(super) fn study_grew(&mut self, folder: PathBuf, run: Arc<Run>) -> Vec<Effect> {
        if !self.study.follow {
            return Vec::new();
        }
        self.show_run(folder, run)
    }

    /// It ended: with its run, cancelled (`None`), or it could not go on.
    pub(super) fn study_done(&mut self, result: Result<Option<(PathBuf, Arc<Run>)>, String>) -> Vec<Effect> {
        let status = std::mem::take(&mut self.study.work).status;
        let Some(kind) = self.study.begun.take() else { return Vec::new() };
        match result {
            Ok(Some((folder, run))) => {
                let (rows, variants) = (run.rows.len(), run.spec.variants.len());
                self.hint(format!("{kind}: {variants} variants, {rows} fits; kept in {}", folder.display()));
                self.study_grew(folder, run)
            }
            Ok(None) => {
                let far = match status {
                    WorkStatus::Running { done, total, .. } => format!("after {done} of {total} fits"),
                    WorkStatus::Idle => "before its first fit".to_owned(),
                };
                self.hint(format!("{kind}: stopped {far}; the same study goes on from there"));
                Vec::new()
            }
            Err(why) => {
                self.note(LogLevel::Error, why);
                Vec::new()
            }
        }
    }

    fn show_run(&mut self, folder: PathBuf, run: Arc<Run>) -> Vec<Effect> {
        let again = self.study.run.as_ref().is_some_and(|(old, _)| *old == folder);
        self.study.row = self.study.row.filter(|row| again && *row < run.table.len());
        let old = self.study.run.change().replace((folder, run));
        old.map_or_else(Vec::new, |old| vec![Effect::Free(Trash::new(old))])
    }

    pub(super) fn open_run(&mut self, folder: &Path) -> Vec<Effect> {
        // The file inside a run folder stands for the folder.
        let inside = folder.file_name().is_some_and(|name| name == crate::study::run::RUN_FILE);
        let folder = folder.parent().filter(|_| inside).unwrap_or(folder).to_owned();
        self.study.reading = Some(folder.clone());
        self.study.follow = false;
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
                self.show_run(folder, run)
            }
            Err(why) => {
                self.note(LogLevel::Error, why);
                Vec::new()
            }
        }
    }

    /// Puts the frames of a row into the list, of one scene or of all.
    pub(super) fn show_study_row(&mut self, row: usize, scene: Option<String>) -> Vec<Effect> {
        let Some((folder, run)) = self.study.run.clone().filter(|(_, run)| row < run.table.len()) else {
            return Vec::new();
        };
        let Some(dataset) = self.data.dataset.clone() else {
            self.note(LogLevel::Error, format!("open the data set first: {}", run.spec.data.root.display()));
            return Vec::new();
        };
        self.study.row = Some(row);
        let mut effects = self.set_filter(ROW_FILTER.to_owned());
        effects.push(Effect::FindStudyRow { folder, run, row, scene, dataset });
        effects
    }
}
