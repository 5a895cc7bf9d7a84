//! The only mutator: a command in, effects out.

use super::command::{Command, Effect};
use super::fit::{Fit, FitStatus};
use super::history::{History, Row, difference};
use super::state::{FrameSummary, LOG_LINES, LogLevel, LogLine, Opening, RECENT, Session};
use crate::body::{Group, Pppr};
use crate::config::FitConfig;
use crate::dataset::{Dataset, DatasetError, Frame};
use crate::diagnose::majpe_mm;
use crate::worker::{HistoryRow, Prepare, Prepared, Snapshot, Start, WorkerCommand, WorkerEvent, WorkerMessage};
use std::path::PathBuf;
use std::sync::Arc;

/// Fits of frames that were left are kept up to this many.
const KEPT_FITS: usize = 16;
/// Bytes of states that each of them may keep.
const KEPT_FIT_BYTES: usize = 4 << 20;

impl Session {
    /// Applies one command and answers what the outside has to do for it.
    pub fn apply(&mut self, command: Command) -> Vec<Effect> {
        match command {
            Command::Open(path) => self.open(path),
            Command::Pick(kind) => vec![Effect::Pick(kind)],
            Command::OpenBare(path, choice) => {
                self.data.bare = None;
                self.data.opening = Some(opening(path.clone()));
                vec![Effect::OpenBare(path, choice)]
            }
            Command::DismissBare => {
                self.data.bare = None;
                Vec::new()
            }
            Command::CancelOpen => {
                self.data.opening = None;
                vec![Effect::CancelOpen]
            }
            Command::OpenProgress { stage, done, total } => {
                if let Some(opening) = &mut self.data.opening {
                    (opening.stage, opening.done, opening.total) = (stage, done, total);
                }
                Vec::new()
            }
            Command::Opened(path, result) => self.opened(path, result),
            Command::GotoFrame(index) => self.goto_frame(index),
            Command::StepFrames(by) => {
                let last = self.data.len().saturating_sub(1);
                let target = self.data.frame_index.saturating_add_signed(by).min(last);
                if self.data.playing && target == self.data.frame_index {
                    self.data.playing = false;
                }
                self.goto_frame(target)
            }
            Command::FrameLoaded(index, result) => self.frame_loaded(index, result),
            Command::TogglePlay => {
                self.data.playing = !self.data.playing && self.data.len() > 1;
                Vec::new()
            }
            Command::ToggleRun => self.toggle_run(),
            Command::StepFit(n) => self.step_fit(n),
            Command::StepBack(n) => {
                let target = self.fit.shown_iteration().saturating_sub(n);
                self.goto_iteration(target)
            }
            Command::GotoIteration(iteration) => self.goto_iteration(iteration),
            Command::FollowLive => self.follow_live(),
            Command::Reset => self.reset(),
            Command::Discard => self.discard(),
            Command::SelectBranch(id) => self.select_branch(id),
            Command::SetConfig(config) => self.set_config(config),
            Command::SetPrecision(precision) => {
                if self.precision == precision {
                    return Vec::new();
                }
                self.precision = precision;
                self.reset()
            }
            Command::SetWarmStart(on) => {
                self.warm_start = on;
                Vec::new()
            }
            Command::EditParams(params) => self.edit(*params),
            Command::Worker(message) => self.worker_message(message),
            Command::Snapshot(snapshot) => {
                self.snapshot(*snapshot);
                Vec::new()
            }
            Command::SelectJoint(joint) => {
                self.joint = joint;
                Vec::new()
            }
            Command::SetView(view) => {
                self.view = *view;
                Vec::new()
            }
            Command::Log(level, text) => {
                self.note(level, text);
                Vec::new()
            }
            Command::ClearLog => {
                self.log.clear();
                Vec::new()
            }
            Command::ClearRecent => {
                self.data.recent.clear();
                Vec::new()
            }
        }
    }

    /// Writes a line to the log; warnings and errors also become the notice.
    pub(super) fn note(&mut self, level: LogLevel, text: String) {
        match level {
            LogLevel::Info => tracing::debug!("{text}"),
            LogLevel::Warning => tracing::warn!("{text}"),
            LogLevel::Error => tracing::error!("{text}"),
        }
        if level != LogLevel::Info {
            let count = self.notice.as_ref().map_or(0, |(count, ..)| *count);
            self.notice = Some((count + 1, level, text.clone()));
        }
        if self.log.len() == LOG_LINES {
            self.log.pop_front();
        }
        self.log.push_back(LogLine { at: std::time::SystemTime::now(), level, text });
    }

    // ---- data ----

    fn open(&mut self, path: PathBuf) -> Vec<Effect> {
        self.data.bare = None;
        self.data.opening = Some(opening(path.clone()));
        vec![Effect::Open(path)]
    }

    fn opened(&mut self, path: PathBuf, result: Result<Arc<Dataset>, DatasetError>) -> Vec<Effect> {
        self.data.opening = None;
        let dataset = match result {
            Ok(dataset) => dataset,
            Err(DatasetError::NeedsAxes(catalog)) => {
                self.data.bare = Some((path, catalog));
                return Vec::new();
            }
            Err(DatasetError::Cancelled) => {
                self.note(LogLevel::Info, format!("opening {} was cancelled", path.display()));
                return Vec::new();
            }
            Err(error) => {
                self.note(LogLevel::Error, error.to_string());
                return Vec::new();
            }
        };
        self.remember(path);
        let frames = dataset.len();
        let info = dataset.info();
        let opened = format!("opened {}: {frames} frame{}", info.name, if frames == 1 { "" } else { "s" });
        let assumptions = info.assumptions.clone();
        self.note(LogLevel::Info, opened);
        for assumption in assumptions {
            self.note(LogLevel::Info, assumption);
        }
        let start = dataset.start_index();
        let mut effects = self.leave_frame();
        self.fits.clear();
        self.left.clear();
        self.summaries.clear();
        self.data.frame = None;
        self.data.playing = false;
        self.data.dataset = Some(Arc::clone(&dataset));
        self.joint = None;
        effects.push(Effect::UseDataset(dataset));
        self.data.frame_index = start;
        effects.extend(self.load(start));
        effects
    }

    fn remember(&mut self, path: PathBuf) {
        let path = std::path::absolute(&path).unwrap_or(path);
        self.data.recent.retain(|known| *known != path);
        self.data.recent.insert(0, path);
        self.data.recent.truncate(RECENT);
    }

    fn goto_frame(&mut self, index: usize) -> Vec<Effect> {
        if index >= self.data.len() || (index == self.data.frame_index && self.data.error.is_none()) {
            return Vec::new();
        }
        self.data.frame_index = index;
        self.load(index)
    }

    fn load(&mut self, index: usize) -> Vec<Effect> {
        self.data.loading = Some(index);
        self.data.error = None;
        vec![Effect::Load(index)]
    }

    fn frame_loaded(&mut self, index: usize, result: Result<Arc<Frame>, DatasetError>) -> Vec<Effect> {
        if self.data.loading != Some(index) {
            return Vec::new();
        }
        self.data.loading = None;
        let frame = match result {
            Ok(frame) => frame,
            Err(error) => {
                let text = error.to_string();
                self.data.playing = false;
                self.data.error = Some(text.clone());
                self.data.frame = None;
                self.note(LogLevel::Error, text);
                return self.leave_frame();
            }
        };
        let warm = self.warm_params();
        let mut effects = self.leave_frame();
        for note in &frame.notes {
            self.note(LogLevel::Info, format!("{}: {note}", frame.name));
        }
        self.data.frame = Some(frame);
        effects.extend(self.begin_fit(index, warm));
        effects
    }

    /// The parameters that a warm start would take from the fit on screen.
    fn warm_params(&self) -> Option<Pppr> {
        if !self.warm_start {
            return None;
        }
        let branch = self.fit.branch()?;
        branch.state_at(branch.head()).filter(|(iteration, _)| *iteration > 0).map(|(_, state)| state.params.clone())
    }

    /// Puts the fit on screen aside, so that coming back finds it again.
    fn leave_frame(&mut self) -> Vec<Effect> {
        let mut fit = std::mem::take(&mut self.fit);
        if fit.problem.is_none() {
            return Vec::new();
        }
        fit.shown = None;
        fit.status = FitStatus::Paused;
        fit.history.shrink(KEPT_FIT_BYTES);
        self.left.retain(|frame| *frame != fit.frame);
        if fit.head() > 0 || fit.history.branches().len() > 1 {
            self.left.push_back(fit.frame);
            self.fits.insert(fit.frame, fit);
            while self.left.len() > KEPT_FITS {
                if let Some(oldest) = self.left.pop_front() {
                    self.fits.remove(&oldest);
                }
            }
        }
        vec![Effect::Send(WorkerCommand::Discard)]
    }

    /// Prepares the fit of the frame on screen: the one that was left there, a warm start, or a new one.
    fn begin_fit(&mut self, index: usize, warm: Option<Pppr>) -> Vec<Effect> {
        let resumed = self.fits.remove(&index).filter(|fit| fit.initial.is_some());
        let (Some(dataset), Some(frame)) = (&self.data.dataset, &self.data.frame) else { return Vec::new() };
        self.jobs += 1;
        let (fit, start) = match resumed {
            Some(fit) => {
                let state = fit.branch().and_then(|b| b.state_at(b.head())).map(|(_, state)| Arc::clone(state));
                match (state, fit.initial.clone()) {
                    (Some(state), Some(initial)) => (fit, Start::Resume { initial, state }),
                    _ => (Fit::default(), Start::Initialise),
                }
            }
            None => (Fit::default(), warm.map_or(Start::Initialise, Start::Warm)),
        };
        let resuming = matches!(start, Start::Resume { .. });
        self.fit = Fit { job: self.jobs, frame: index, status: FitStatus::Preparing, ..fit };
        if resuming {
            // Settings that changed meanwhile are recorded where they take effect.
            let (id, head) = (self.fit.history.active_id(), self.fit.head());
            self.fit.history.flag(id, head, self.config);
        } else {
            self.fit.history = History::new(self.config);
            self.fit.cursor = None;
        }
        let info = dataset.info();
        vec![Effect::Send(WorkerCommand::Prepare(Box::new(Prepare {
            job: self.jobs,
            branch: self.fit.history.active_id(),
            radar: info.radar.clone(),
            skeleton: info.skeleton.clone(),
            views: info.views.clone(),
            frame: Arc::clone(frame),
            config: self.config,
            precision: self.precision,
            start,
        })))]
    }

    // ---- fit ----

    fn toggle_run(&mut self) -> Vec<Effect> {
        if self.fit.is_running() {
            return vec![Effect::Send(WorkerCommand::Pause)];
        }
        if !self.fit.is_ready() {
            return Vec::new();
        }
        let (head, asked) = (self.fit.head(), self.config.iterations);
        let target = if head < asked { asked } else { head + asked };
        self.run_to(target)
    }

    fn run_to(&mut self, target: usize) -> Vec<Effect> {
        self.fit.cursor = None;
        self.fit.status = FitStatus::Running;
        self.fit.reason = None;
        vec![Effect::Send(WorkerCommand::RunTo(target))]
    }

    fn step_fit(&mut self, n: usize) -> Vec<Effect> {
        if !self.fit.is_ready() {
            return Vec::new();
        }
        let (shown, head) = (self.fit.shown_iteration(), self.fit.head());
        if shown < head {
            // States may be thinned out: the next one that is kept, or a step would stay where it is.
            let wanted = (shown + n).min(head);
            let next = self.fit.branch().and_then(|branch| branch.kept_from(wanted));
            return self.goto_iteration(next.unwrap_or(head));
        }
        if self.fit.is_running() {
            return Vec::new();
        }
        self.run_to(head + n)
    }

    fn goto_iteration(&mut self, iteration: usize) -> Vec<Effect> {
        let Some(branch) = self.fit.branch() else { return Vec::new() };
        let wanted = iteration.clamp(branch.start(), branch.head());
        if wanted == branch.head() {
            return self.follow_live();
        }
        let Some((kept, state)) = branch.state_at(wanted) else { return Vec::new() };
        let (id, config, state) = (branch.id, branch.config_at(kept), Arc::clone(state));
        if self.fit.cursor == Some(kept) || !self.fit.is_ready() {
            return Vec::new();
        }
        self.fit.cursor = Some(kept);
        vec![Effect::Send(WorkerCommand::Inspect { branch: id, state, config })]
    }

    /// Back to the newest iteration: its state is looked at until the worker publishes a newer one.
    fn follow_live(&mut self) -> Vec<Effect> {
        if self.fit.cursor.take().is_none() || self.fit.is_running() {
            return Vec::new();
        }
        self.inspect_head()
    }

    fn inspect_head(&self) -> Vec<Effect> {
        let Some(branch) = self.fit.branch() else { return Vec::new() };
        let Some((_, state)) = branch.state_at(branch.head()) else { return Vec::new() };
        let (id, config, state) = (branch.id, branch.newest_config(), Arc::clone(state));
        vec![Effect::Send(WorkerCommand::Inspect { branch: id, state, config })]
    }

    fn reset(&mut self) -> Vec<Effect> {
        let Some(frame) = self.data.frame.as_ref().map(|frame| frame.index) else { return Vec::new() };
        self.fits.remove(&frame);
        self.summaries.remove(&frame);
        self.note(LogLevel::Info, "reset: a new start pose with the current settings".into());
        self.begin_fit(frame, None)
    }

    fn discard(&mut self) -> Vec<Effect> {
        if !self.fit.is_ready() {
            return Vec::new();
        }
        let id = self.fit.history.active_id();
        if let Some((parent, at)) = self.fit.history.discard(id) {
            self.note(LogLevel::Info, format!("discarded branch {id}; back on branch {parent}, which it left at {at}"));
        } else {
            self.fit.history.keep_start();
            self.note(LogLevel::Info, "discarded the run; back at the start pose".into());
        }
        self.fit.status = FitStatus::Paused;
        self.fit.reason = None;
        self.continue_active()
    }

    fn select_branch(&mut self, id: u32) -> Vec<Effect> {
        if !self.fit.is_ready() || id == self.fit.history.active_id() {
            return Vec::new();
        }
        self.fit.history.activate(id);
        self.continue_active()
    }

    /// The worker continues at the head of the active branch, with that branch's newest settings.
    fn continue_active(&mut self) -> Vec<Effect> {
        self.fit.cursor = None;
        self.fit.status = FitStatus::Paused;
        let Some(branch) = self.fit.branch() else { return Vec::new() };
        let Some((_, state)) = branch.state_at(branch.head()) else { return Vec::new() };
        let (id, config, state) = (branch.id, branch.newest_config(), Arc::clone(state));
        self.config = FitConfig { iterations: self.config.iterations, ..config };
        self.summarise();
        vec![Effect::Send(WorkerCommand::Branch { branch: id, state, config: self.config })]
    }

    fn set_config(&mut self, config: FitConfig) -> Vec<Effect> {
        let config = match config.validated() {
            Ok(config) => config,
            Err(error) => {
                self.note(LogLevel::Error, error.to_string());
                return Vec::new();
            }
        };
        if config == self.config {
            return Vec::new();
        }
        let steering_only = FitConfig {
            iterations: self.config.iterations,
            stop_when_converged: self.config.stop_when_converged,
            ..config
        } == self.config;
        self.config = config;
        if matches!(self.fit.status, FitStatus::Idle | FitStatus::Failed(_)) {
            return Vec::new();
        }
        if !steering_only && let Some(effects) = self.branch_at_cursor() {
            return effects;
        }
        vec![Effect::Send(WorkerCommand::Configure(config))]
    }

    /// Where an earlier iteration is looked at: starts a branch there with the current settings.
    fn branch_at_cursor(&mut self) -> Option<Vec<Effect>> {
        let at = self.fit.cursor?;
        let branch = self.fit.branch()?;
        let (kept, state) = branch.state_at(at).map(|(k, s)| (k, Arc::clone(s)))?;
        let parent = branch.id;
        let old = branch.config_at(kept);
        // Until the worker answers with the row under the new settings, the branch begins with the one that is known.
        let row = branch.row(kept).cloned();
        let id = self.fit.history.begin(Some((parent, kept)), self.config);
        if let Some(row) = row {
            self.fit.history.push(id, row);
        }
        self.fit.cursor = None;
        self.fit.status = FitStatus::Paused;
        let what = difference(&old, &self.config);
        let what = if what.is_empty() { "edited by hand".into() } else { what };
        self.note(LogLevel::Info, format!("branch {id} begins at iteration {kept} of branch {parent}: {what}"));
        Some(vec![Effect::Send(WorkerCommand::Branch { branch: id, state, config: self.config })])
    }

    fn edit(&mut self, params: Pppr) -> Vec<Effect> {
        if !self.fit.is_ready() {
            return Vec::new();
        }
        if !params.is_finite() {
            self.note(LogLevel::Error, "an edited parameter is not a finite number; nothing was changed".into());
            return Vec::new();
        }
        // An edit needs a branch of its own, or it would rewrite the row that is already there.
        if self.fit.cursor.is_none() && self.fit.branch().is_some_and(|b| b.rows.len() > 1) {
            self.fit.cursor = Some(self.fit.head());
        }
        let mut effects = self.branch_at_cursor().unwrap_or_default();
        effects.push(Effect::Send(WorkerCommand::Edit(Box::new(params))));
        effects
    }

    // ---- reports of the worker ----

    fn worker_message(&mut self, message: WorkerMessage) -> Vec<Effect> {
        match message {
            WorkerMessage::Rows(job, rows) if job == self.fit.job => {
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

    fn push_row(&mut self, row: HistoryRow) {
        let majpe_mm = self.data.frame.as_ref().and_then(|frame| frame.truth.as_ref()).and_then(|truth| {
            let positions: Vec<_> =
                (0..row.state.params.shape().total_joints()).map(|j| row.state.params.position(j)).collect();
            majpe_mm(&positions, &truth.joints)
        });
        self.fit.history.push(row.branch, Row { report: row.report, state: Some(row.state), majpe_mm });
    }

    fn summarise(&mut self) {
        let Some(row) = self.fit.branch().and_then(|branch| branch.rows.last()) else { return };
        if row.report.iteration == 0 {
            self.summaries.remove(&self.fit.frame);
            return;
        }
        let known: Vec<f64> = row.report.iou.iter().flatten().copied().collect();
        let summary = FrameSummary {
            iterations: row.report.iteration,
            loss: row.report.loss,
            iou: (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64),
            converged: row.report.converged,
            majpe_mm: row.majpe_mm,
        };
        self.summaries.insert(self.fit.frame, summary);
    }

    fn worker_event(&mut self, event: WorkerEvent) -> Vec<Effect> {
        match event {
            WorkerEvent::Prepared(prepared) => self.prepared(*prepared),
            WorkerEvent::ConfigApplied { branch, iteration, config } => {
                self.fit.history.flag(branch, iteration, config);
                Vec::new()
            }
            WorkerEvent::Finished { branch, iteration, reason, run_ms } => {
                if branch == self.fit.history.active_id() {
                    self.fit.status = FitStatus::Paused;
                    self.fit.run_ms = Some(run_ms);
                    self.fit.reason = Some(reason.text());
                    if self.fit.branch().is_some_and(|b| b.rows.len() > 2) {
                        self.note(
                            LogLevel::Info,
                            format!("{} at iteration {iteration} after {run_ms:.0} ms", reason.text()),
                        );
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

    fn prepared(&mut self, prepared: Prepared) -> Vec<Effect> {
        for warning in &prepared.warnings {
            self.note(LogLevel::Warning, warning.clone());
        }
        if let Some(found) = &prepared.initialisation {
            for note in &found.notes {
                self.note(LogLevel::Info, note.clone());
            }
        }
        let joints = prepared.initial.shape().total_joints();
        if self.joint.is_some_and(|joint| joint >= joints) {
            self.joint = None;
        }
        self.fit.problem = Some(prepared.problem);
        self.fit.initial = Some(prepared.initial);
        self.fit.init_ms = prepared.init_ms;
        if prepared.initialisation.is_some() {
            self.fit.initialisation = prepared.initialisation;
        }
        self.fit.status = FitStatus::Paused;
        if let Some(cursor) = self.fit.cursor.take() {
            return self.goto_iteration(cursor);
        }
        if self.view.run_on_open && self.fit.head() == 0 {
            return self.toggle_run();
        }
        Vec::new()
    }

    fn snapshot(&mut self, snapshot: Snapshot) {
        if snapshot.job != self.fit.job || snapshot.branch != self.fit.history.active_id() {
            return;
        }
        let wanted = match self.fit.cursor {
            // An answer to a look back that is over by now would show the past as the present.
            None => snapshot.live || snapshot.iteration == self.fit.head(),
            Some(cursor) => !snapshot.live && snapshot.iteration == cursor,
        };
        if wanted {
            self.fit.shown = Some(Arc::new(snapshot));
        }
    }

    /// Positions of the joints that are drawn, m, world frame; empty where nothing is fitted yet.
    pub fn shown_positions(&self) -> Vec<crate::geometry::Vec3> {
        self.fit.shown.as_ref().map_or_else(Vec::new, |snapshot| {
            snapshot.params.group(Group::Position).chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect()
        })
    }
}

fn opening(path: PathBuf) -> Opening {
    Opening { path, stage: "looking".into(), done: 0, total: 0 }
}
