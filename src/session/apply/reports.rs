//! What the worker reports: rows, events, snapshots.

use super::diagnosis::hashes;
use crate::diagnose::joint_errors;
use crate::mhp::StopReason;
use crate::session::effect::Effect;
use crate::session::fit::FitStatus;
use crate::session::history::IterationRow;
use crate::session::state::{FrameSummary, LogLevel, Session};
use crate::worker::{HistoryRow, PreparedFit, Snapshot, WorkerEvent, WorkerMessage};
use std::sync::Arc;

impl Session {
    pub(super) fn worker_message(&mut self, message: WorkerMessage) -> Vec<Effect> {
        match message {
            WorkerMessage::Rows(job, rows) if job == self.fit.job => {
                // What was fitted before is on screen until there is something in its place.
                if let Some((branch, config)) = self.fit.restart.take() {
                    self.fit.history.restart(branch, *config);
                }
                for row in rows {
                    self.push_row(row);
                }
                self.summarise();
                Vec::new()
            }
            WorkerMessage::Event(job, event) if job == self.fit.job => self.worker_event(event),
            WorkerMessage::Rows(..) | WorkerMessage::Event(..) => Vec::new(),
        }
    }

    pub(super) fn push_row(&mut self, row: HistoryRow) {
        let truth = self.data.frame.as_ref().and_then(|frame| frame.truth.as_ref());
        let a_person = self.data.dataset.as_ref().map_or(0, |dataset| dataset.info().skeleton.joints.len());
        // As `fit` has it: persons carry no identity.
        let errors = truth.and_then(|truth| joint_errors(row.kept.positions(), &truth.joints, a_person));
        let majpe_mm = errors.map(|errors| errors.majpe_mm);
        let state = row.kept.state().cloned();
        self.fit.history.push(row.branch, IterationRow { report: row.report, state, majpe_mm });
    }

    pub(super) fn summarise(&mut self) {
        let Some(row) = self.fit.branch().and_then(|branch| branch.rows.last()) else { return };
        if row.report.iteration == 0 {
            self.forget_summary(self.fit.frame);
            return;
        }
        let hashes = row.state.as_ref().map(|state| {
            let config = self.fit.branch().map_or(self.config, super::super::Branch::newest_config);
            Box::new(hashes(&state.params, &config, row.report.iteration))
        });
        let counted = self.fit.branch().map_or(self.config, super::super::Branch::newest_config).people == 0;
        let summary = FrameSummary {
            reason: self.fit.reason.map(str::to_owned),
            hashes,
            iterations: Some(row.report.iteration),
            loss: Some(row.report.loss),
            terms: row.report.terms.map(Some),
            iou: mean_known(&row.report.iou),
            converged: Some(row.report.converged),
            majpe_mm: row.majpe_mm,
            batch: false,
            people: row.state.as_ref().filter(|_| counted).map(|state| state.params.shape().persons),
            annotated: self
                .data
                .frame
                .as_ref()
                .and_then(|frame| frame.person_count.or_else(|| frame.truth.as_ref().map(|truth| truth.persons))),
            joints: row
                .state
                .as_ref()
                .map(|state| state.params.positions().iter().map(|p| p.map(|x| x as f32)).collect()),
        };
        self.summaries.change().insert(self.fit.frame, summary);
    }

    /// True where a fit in this session said something of a frame, not only a table of results.
    fn is_summarised(&self, frame: usize) -> bool {
        self.summaries.get(&frame).is_some_and(|summary| summary.hashes.is_some())
    }

    /// Changes what a fit in this session says of the frame on screen; not what a table of results says of it.
    fn change_summary(&mut self, change: impl FnOnce(&mut FrameSummary)) {
        if self.is_summarised(self.fit.frame)
            && let Some(summary) = self.summaries.change().get_mut(&self.fit.frame)
        {
            change(summary);
        }
    }

    /// Forgets what a fit in this session said of a frame; what a table of results says of it stays.
    pub(super) fn forget_summary(&mut self, frame: usize) {
        if self.is_summarised(frame) {
            self.summaries.change().remove(&frame);
        }
    }

    pub(super) fn worker_event(&mut self, event: WorkerEvent) -> Vec<Effect> {
        match event {
            WorkerEvent::Prepared(prepared) => self.prepared(*prepared),
            WorkerEvent::ConfigApplied { branch, iteration, config } => {
                self.fit.history.flag(branch, iteration, *config);
                Vec::new()
            }
            WorkerEvent::Refitted { branch, config } => {
                self.fit.restart = Some((branch, config));
                Vec::new()
            }
            WorkerEvent::Broke { branch, iteration, breakpoint } => {
                self.broke(branch, iteration, breakpoint);
                Vec::new()
            }
            WorkerEvent::Finished { run, branch, iteration, reason, run_ms } => {
                if run == self.fit.run.0 && branch == self.fit.history.active_id() {
                    self.fit.status = FitStatus::Paused;
                    self.fit.run_ms = Some(run_ms);
                    self.fit.reason = Some(reason.text());
                    self.change_summary(|summary| summary.reason = Some(reason.text().to_owned()));
                    // A single step is seen on the screen; the log is for runs.
                    // What a finger asks for is told when it is lifted.
                    // What a breakpoint stops was told by it.
                    let told = reason == StopReason::Breakpoint;
                    if iteration > self.fit.run.1 + 1 && run != self.fit.refit_run && !told {
                        let why = match reason {
                            StopReason::Converged => "the convergence criterion holds",
                            other => other.text(),
                        };
                        self.note(LogLevel::Info, format!("{why} at iteration {iteration} after {run_ms:.0} ms"));
                    }
                }
                Vec::new()
            }
            WorkerEvent::Failed(text) => {
                self.fit.status = FitStatus::Paused;
                self.fit.reason = Some("failed");
                self.note(LogLevel::Error, text);
                Vec::new()
            }
            WorkerEvent::Lost(text) => {
                self.fit.status = FitStatus::Failed(text.clone());
                self.fit.reason = Some("failed");
                self.note(LogLevel::Error, text);
                Vec::new()
            }
        }
    }

    pub(super) fn prepared(&mut self, prepared: PreparedFit) -> Vec<Effect> {
        for warning in &prepared.warnings {
            self.note(LogLevel::Warning, warning.clone());
        }
        if let Some(found) = &prepared.found_start {
            for note in &found.initialisation.notes {
                self.note(LogLevel::Info, note.clone());
            }
        }
        let joints = prepared.initial.shape().total_joints();
        if self.joint.is_some_and(|joint| joint >= joints) {
            self.joint = None;
        }
        self.fit.problem = Some(prepared.problem);
        self.fit.initial = Some(prepared.initial);
        self.identify();
        self.fit.init_ms = prepared.init_ms;
        self.fit.step_ms = prepared.step_ms;
        if prepared.found_start.is_some() {
            self.fit.found_start = prepared.found_start;
        }
        self.fit.status = FitStatus::Paused;
        // A fit that comes back, from this session or from a file, is known to the list again.
        self.summarise();
        if let Some(cursor) = self.fit.cursor.take() {
            return self.goto_iteration(cursor);
        }
        if let Some(iteration) = self.aim.iteration.take().filter(|&iteration| iteration > self.fit.head()) {
            return self.run_to(iteration);
        }
        if self.view.run_on_open && self.fit.head() == 0 {
            return self.toggle_run();
        }
        Vec::new()
    }

    pub(super) fn snapshot(&mut self, snapshot: Snapshot) {
        if snapshot.job != self.fit.job || snapshot.branch != self.fit.history.active_id() {
            return;
        }
        let wanted = match self.fit.cursor {
            // An answer to a look back that is over by now would show the past as the present.
            None => snapshot.live || snapshot.iteration == self.fit.head(),
            Some(cursor) => !snapshot.live && snapshot.iteration == cursor,
        };
        // Settings may have changed since the newest row was made; the list tells what holds now.
        if snapshot.live && snapshot.iteration == self.fit.head() {
            self.change_summary(|summary| {
                summary.loss = Some(snapshot.evaluation.loss);
                summary.terms = snapshot.evaluation.terms.map(Some);
                summary.iou = mean_known(&snapshot.evaluation.iou);
            });
        }
        if wanted {
            self.fit.shown_hashes = Some(hashes(&snapshot.params, &snapshot.config, snapshot.iteration));
            self.fit.shown = Some(Arc::new(snapshot));
        }
    }

    /// Positions of the joints that are drawn, m, world frame; empty where nothing is fitted yet.
    pub fn shown_positions(&self) -> &[crate::geometry::Vec3] {
        self.fit.shown.as_ref().map_or(&[], |snapshot| snapshot.params.positions())
    }
}

/// The mean over the views whose IoU is defined.
pub(in crate::session) fn mean_known(iou: &[Option<f64>]) -> Option<f64> {
    let known: Vec<f64> = iou.iter().flatten().copied().collect();
    (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
}
