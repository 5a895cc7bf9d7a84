//! The only two mutators: a command or a report in, effects out.
//!
//! Here are the tables from both to functions; `data` opens and loads, `queue` filters and orders the frames, `labels`
//! writes what people say, `diagnosis` takes in strata and evidence, `fit` steers the optimiser, `hand` moves the body,
//! `explore` tries what else a fit could have done, `reports` takes in what the worker says.

mod batch;
mod breakpoints;
mod compared;
mod data;
mod diagnosis;
mod erase;
mod explore;
mod export;
mod fit;
mod hand;
mod labels;
mod live;
mod pins;
mod presets;
mod queue;
mod reports;
mod restore;
mod results;
mod sources;
mod study;

pub use erase::ErasedEffect;
pub use export::OutputCheck;
pub(super) use reports::mean_known;

use super::command::Command;
use super::effect::Effect;
use super::presets::PresetCard;
use super::report::Report;
use super::state::{LOG_LINES, LogLevel, LogLine, Notice, Session};
use super::strata::StrataStatus;

impl Session {
    /// Does what a person asks, and answers what the outside has to do for it.
    pub fn apply(&mut self, command: Command) -> Vec<Effect> {
        let effects = self.act(command);
        self.settle(effects)
    }

    /// Takes in what a thread tells, and answers what the outside has to do for it.
    pub fn report(&mut self, report: Report) -> Vec<Effect> {
        let effects = self.learn(report);
        self.settle(effects)
    }

    /// What follows from any change.
    fn settle(&mut self, mut effects: Vec<Effect>) -> Vec<Effect> {
        self.writing += effects.iter().filter(|effect| matches!(effect, Effect::Run(_))).count();
        effects.extend(self.ask_evidence());
        self.refresh_queue();
        effects
    }

    fn act(&mut self, command: Command) -> Vec<Effect> {
        match command {
            Command::Open(path) => {
                // Asked for by a person: what a session file said of another data set is void.
                self.restoring = None;
                self.open(path)
            }
            Command::OpenAt(path, aim) => {
                self.restoring = None;
                let effects = self.open(path);
                self.aim = aim;
                effects
            }
            Command::Pick(kind) => vec![Effect::Pick(kind)],
            Command::OpenBare(path, choice) => {
                self.data.bare = None;
                self.data.opening = Some(data::opening(path.clone()));
                vec![Effect::OpenBare(path, choice)]
            }
            Command::DismissBare => {
                self.restoring = None;
                self.data.bare = None;
                Vec::new()
            }
            Command::OpenCapture(path, form) => {
                self.data.capture = None;
                self.data.opening = Some(data::opening(path.clone()));
                vec![Effect::OpenCapture(path, form)]
            }
            Command::DismissCapture => {
                self.restoring = None;
                self.data.capture = None;
                Vec::new()
            }
            Command::CancelOpen => {
                self.restoring = None;
                self.data.opening = None;
                vec![Effect::CancelOpen]
            }
            Command::GotoFrame(index) => self.goto_frame(index),
            Command::StepFrames(by) => self.step_frames(by),
            Command::StepQueue(by) => self.step_queue(by),
            Command::NextUntagged => self.next_untagged(),
            Command::GotoLastEdited => self.goto_last_edited(),
            Command::SetFilter(text) => self.set_filter(text),
            Command::SetSort(sort) => self.set_sort(sort),
            Command::SaveView(name) => self.save_view(&name),
            Command::UseView(name) => self.use_view(&name),
            Command::RemoveView(name) => {
                self.view.saved_views.retain(|view| view.name != name);
                Vec::new()
            }
            Command::SelectFrames(frames) => self.select_frames(frames),
            Command::ToggleTag(tag) => self.toggle_tag(tag),
            Command::SetNote(frames, note) => self.set_note(frames, note),
            Command::SetPerson(person) => self.set_person(person),
            Command::SetRegion(frame, region) => self.set_region(frame, region),
            Command::SetVerdict(verdict) => self.set_verdict(verdict),
            Command::ClearLabel => self.clear_label(),
            Command::Undo => self.undo(),
            Command::Redo => self.redo(),
            Command::SetAnnotator(name) => self.set_annotator(&name),
            Command::RefreshLabels => vec![Effect::RefreshLabels],
            Command::ComputeStrata => self.compute_strata(),
            Command::CancelStrata => vec![Effect::CancelStrata],
            Command::PinFit => self.pin_fit(),
            Command::RemovePin(id) => self.remove_pin(id),
            Command::RenamePin(id, name) => self.rename_pin(id, &name),
            Command::SetBaseline(id) => self.set_baseline(id),
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
            Command::SetConfig(config) => self.set_config(&config),
            Command::DragConfig(config) => self.drag_config(&config),
            Command::DragErase(region) => self.drag_erase(&region),
            Command::DragEraseCells(view, cells) => self.drag_erase_cells(view, cells),
            Command::EraseEcho(view, cell) => self.erase_echo(view, cell),
            Command::DragFit(fit) => self.drag_fit(*fit),
            Command::EndDrag => self.end_drag(),
            Command::AddBreakpoint(text) => self.add_breakpoint(&text),
            Command::RemoveBreakpoint(id) => self.remove_breakpoint(id),
            Command::EnableBreakpoint(id, on) => self.enable_breakpoint(id, on),
            Command::ToggleReplay => self.toggle_replay(),
            Command::PlayOn(seconds) => self.play_on(seconds),
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
            Command::SetAlong(on) => {
                if self.along == on {
                    return Vec::new();
                }
                self.along = on;
                self.reset()
            }
            Command::EditParams(params) => self.edit(*params),
            Command::DragBody(moved) => self.drag_body(moved),
            Command::NudgeBody(by) => self.nudge_body(by),
            Command::SelectJoint(joint) => {
                self.joint = joint;
                Vec::new()
            }
            Command::SetView(view) => {
                let faster = view.speed != self.view.speed;
                self.view = *view;
                if faster { self.set_speed() } else { Vec::new() }
            }
            Command::Export(what, path) => self.export(what, path),
            Command::SaveSession(path, window) => self.save_session(path, window),
            Command::OpenSession(path) => vec![Effect::ReadSession(path)],
            Command::FitListed => self.fit_listed(),
            Command::PauseBatch => self.pause_batch(),
            Command::CancelBatch => self.cancel_batch(),
            Command::KeepResults(side) => self.keep_results(side),
            Command::ForgetResults(side) => self.forget_results(side),
            Command::LoadResults(path) => self.load_results(path),
            Command::OpenPredictions(path, reading) => self.open_predictions(path, *reading),
            Command::DismissPredictions => self.dismiss_predictions(),
            Command::ColourPredictions(slot, colour) => self.colour_predictions(slot, colour),
            Command::ShowPredictions(slot, shown) => self.show_predictions(slot, shown),
            Command::RemovePredictions(slot) => self.remove_predictions(slot),
            Command::StartFromPredictions(slot) => self.start_from_predictions(slot),
            Command::ComparePresets => self.compare_presets(),
            Command::ClosePresets => {
                self.presets = PresetCard::Closed;
                Vec::new()
            }
            Command::RunStudy(order) => self.run_study(order),
            Command::PauseStudy => self.pause_study(),
            Command::CancelStudy => self.cancel_study(),
            Command::OpenRun(folder) => self.open_run(&folder),
            Command::ShowStudyRow { row, scene } => self.show_study_row(row, scene),
            Command::Explore(kind) => self.explore(kind),
            Command::StopExploring(kind) => self.stop_exploring(kind),
            Command::KeepTuning => self.keep_tuning(),
            Command::RunTask(task) => vec![Effect::Run(task)],
            Command::ClearLog => {
                self.log.clear();
                Vec::new()
            }
            Command::ClearRecent => {
                self.data.recent.clear();
                Vec::new()
            }
            Command::OfferPaths(paths) => {
                self.data.recent.extend(paths);
                Vec::new()
            }
        }
    }

    fn learn(&mut self, report: Report) -> Vec<Effect> {
        match report {
            Report::Picked(path) => {
                self.restoring = None;
                self.open(path)
            }
            Report::OpenProgress { stage, done, total } => {
                if let Some(opening) = &mut self.data.opening {
                    (opening.stage, opening.done, opening.total) = (stage, done, total);
                }
                Vec::new()
            }
            Report::Opened(path, result) => self.opened(path, result),
            Report::LabelsOpened(id, result) => self.labels_opened(id, result),
            Report::LabelsWritten(written) => self.labels_written(written),
            Report::LabelsRefreshed(table) => self.labels_refreshed(table),
            Report::LabelsWarned(warnings) => self.labels_warned(warnings),
            Report::LabelsPlaced(place) => self.labels_placed(place),
            Report::StrataProgress { done, total } => {
                if let StrataStatus::Running { done: shown, total: of } = &mut self.strata.status {
                    (*shown, *of) = (done, total);
                }
                Vec::new()
            }
            Report::StrataDone(result) => self.strata_done(result),
            Report::PinDrawn(id, result) => self.pin_drawn(id, result),
            Report::EvidenceFound(frame, fit, result) => self.evidence_found(frame, fit, result),
            Report::FrameLoaded(index, result) => self.frame_loaded(index, result),
            Report::Worker(message) => self.worker_message(message),
            Report::Snapshot(snapshot) => {
                self.snapshot(*snapshot);
                Vec::new()
            }
            Report::SessionRead(path, result) => self.session_read(path, result),
            Report::ResultsRead(path, result) => self.results_read(&path, result),
            Report::PredictionsRead(path, reading, dataset, result) => {
                self.predictions_read(path, *reading, &dataset, result)
            }
            Report::PredictionsCompared(of, errors) => self.predictions_compared(&of, errors),
            Report::BatchRows(dataset, rows, done) => self.batch_rows(&dataset, rows, done),
            Report::BatchDone(dataset, result) => self.batch_done(&dataset, result),
            Report::KeptFound { dataset, kept, faults } => self.kept_found(&dataset, kept, faults),
            Report::PresetsFitted(fits) => self.presets_fitted(fits),
            Report::StudyProgress(done, total) => {
                self.study.work.advance(done, total);
                Vec::new()
            }
            Report::StudyGrew(folder, run) => self.study_grew(folder, run),
            Report::StudyDone(result) => self.study_done(result),
            Report::RunRead(folder, result) => self.run_read(folder, result),
            Report::Explored(kind, number, news) => self.explored(kind, number, news),
            Report::TaskDone(result) => self.task_done(result),
            Report::Log(level, text) => {
                self.note(level, text);
                Vec::new()
            }
        }
    }

    /// Tells something that needs no attention later: a line of the log and a notification.
    pub(super) fn hint(&mut self, text: String) {
        self.note(LogLevel::Info, text.clone());
        self.notify(LogLevel::Info, text);
    }

    /// The same of the act that was done last, which the notification offers to take back.
    pub(super) fn hint_of_act(&mut self, text: String) {
        self.hint(text);
        if let Some(notice) = &mut self.notice {
            notice.act = Some(self.acts_done);
        }
    }

    fn notify(&mut self, level: LogLevel, text: String) {
        let count = self.notice.as_ref().map_or(0, |notice| notice.count);
        self.notice = Some(Notice { count: count + 1, level, text, act: None });
    }

    /// Writes a line to the log; warnings and errors also become the notice.
    pub(super) fn note(&mut self, level: LogLevel, text: String) {
        tracing::debug!("{text}");
        if level != LogLevel::Info {
            self.notify(level, text.clone());
        }
        if self.log.len() == LOG_LINES {
            self.log.pop_front();
        }
        self.log.push_back(LogLine { at: std::time::SystemTime::now(), level, text });
    }
}
