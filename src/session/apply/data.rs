//! Opening data sets, changing frames, putting fits aside and finding them again.

use crate::body::Pppr;
use crate::config::Preset;
use crate::dataset::{Dataset, DatasetError, Frame};
use crate::session::batch::Batch;
use crate::session::command::StartAt;
use crate::session::effect::Effect;
use crate::session::evidence::EvidenceState;
use crate::session::fit::{Fit, FitStatus};
use crate::session::history::History;
use crate::session::identity::Identities;
use crate::session::pins::Pins;
use crate::session::presets::PresetCard;
use crate::session::settings::SettingsActs;
use crate::session::state::{LogLevel, Opening, RECENT, Session};
use crate::worker::{Prepare, Start, WorkerCommand};
use std::path::PathBuf;
use std::sync::Arc;

/// Fits of frames that were left are kept up to this many.
const KEPT_FITS: usize = 16;
/// Bytes of states that each of them may keep.
const KEPT_FIT_BYTES: usize = 4 << 20;

impl Session {
    pub(super) fn open(&mut self, path: PathBuf) -> Vec<Effect> {
        (self.data.bare, self.data.capture) = (None, None);
        self.aim = StartAt::default();
        self.data.opening = Some(opening(path.clone()));
        vec![Effect::Open(path)]
    }

    pub(super) fn opened(&mut self, path: PathBuf, result: Result<Arc<Dataset>, DatasetError>) -> Vec<Effect> {
        self.data.opening = None;
        let dataset = match result {
            Ok(dataset) => dataset,
            Err(DatasetError::NeedsAxes(catalog)) => {
                self.data.bare = Some((path, catalog));
                return Vec::new();
            }
            Err(DatasetError::NeedsChirp { path: capture }) => {
                self.data.capture = Some(capture);
                return Vec::new();
            }
            Err(DatasetError::Cancelled) => {
                self.restoring = None;
                self.waiting_results = None;
                self.note(LogLevel::Info, format!("opening {} was cancelled", path.display()));
                return Vec::new();
            }
            Err(error) => {
                self.restoring = None;
                self.waiting_results = None;
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
        let mut effects = self.end_drag();
        effects.extend(self.leave_frame());
        if self.batch.is_running() {
            effects.push(Effect::CancelBatch);
        }
        effects.extend(self.forget_explorations());
        self.results_from = None;
        effects.extend(self.clear_results());
        self.forget_frames();
        if self.data.dataset.as_ref().is_some_and(|old| old.info().root != dataset.info().root) {
            self.forget_scene();
        }
        self.data.dataset = Some(Arc::clone(&dataset));
        effects.push(Effect::UseDataset(Arc::clone(&dataset)));
        let start = self.aimed(&dataset).unwrap_or(start);
        let (start, pins) = self.restore(&dataset).unwrap_or((start, Vec::new()));
        effects.extend(pins);
        self.data.frame_index = start;
        effects.extend(self.load(start));
        effects.extend(self.open_labels());
        effects.extend(self.begin_strata());
        effects.extend(self.load_waiting_results());
        effects.extend(self.load_waiting_predictions());
        effects.push(Effect::FindKept(Arc::clone(&dataset)));
        effects
    }

    /// Forgets what speaks of frames, fits, joints and persons by their numbers, which mean others from now on.
    fn forget_frames(&mut self) {
        self.fits.clear();
        self.left.clear();
        self.summaries.change().clear();
        self.best_basins.change().clear();
        self.pins = Pins::default();
        self.forget_predictions();
        self.batch = Batch::default();
        self.evidence = EvidenceState::default();
        self.identities = Identities::default();
        self.settings = SettingsActs::default();
        self.study.row = None;
        self.queue.last_position = 0;
        self.data.frame = None;
        self.data.playing = false;
        self.joint = None;
    }

    /// Forgets what was said of the scene, when another data set takes the place of one: which of its frames are listed, how
    /// many people are in it (the preset says again whether they are counted), and the file that its session is kept in.
    fn forget_scene(&mut self) {
        self.queue.set_text(String::new());
        self.session_path = None;
        let people = Preset::nearest(&self.config).config().people;
        if self.config.people != people {
            self.note(LogLevel::Info, format!("people {} → {people}: this is another data set", self.config.people));
            self.config.people = people;
        }
    }

    /// The frame that was asked for by name or index.
    fn aimed(&mut self, dataset: &Dataset) -> Option<usize> {
        let wanted = self.aim.frame.take()?;
        let index = wanted.parse().ok().filter(|&index: &usize| index < dataset.len());
        let found = index.or_else(|| (0..dataset.len()).find(|&index| dataset.frame_name(index) == wanted));
        if found.is_none() {
            let text = format!("no frame {wanted}: expected a name, or an index from 0 to {}", dataset.len() - 1);
            self.note(LogLevel::Error, text);
        }
        found
    }

    pub(super) fn remember(&mut self, path: PathBuf) {
        let path = std::path::absolute(&path).unwrap_or(path);
        self.data.recent.retain(|known| *known != path);
        self.data.recent.insert(0, path);
        self.data.recent.truncate(RECENT);
    }

    pub(super) fn goto_frame(&mut self, index: usize) -> Vec<Effect> {
        if index >= self.data.len() || (index == self.data.frame_index && self.data.error.is_none()) {
            return Vec::new();
        }
        if index != self.data.frame_index {
            self.view.leave_frame();
        }
        self.data.frame_index = index;
        if let Some(at) = self.queue.position(index) {
            self.queue.last_position = at;
        }
        let mut effects = self.load(index);
        effects.push(Effect::RefreshLabels);
        effects
    }

    pub(super) fn load(&mut self, index: usize) -> Vec<Effect> {
        self.data.loading = Some(index);
        self.data.error = None;
        vec![Effect::Load(index)]
    }

    pub(super) fn frame_loaded(&mut self, index: usize, result: Result<Arc<Frame>, DatasetError>) -> Vec<Effect> {
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
        let mut effects = self.end_drag();
        effects.extend(self.leave_frame());
        for note in &frame.notes {
            self.note(LogLevel::Info, format!("{}: {note}", frame.name));
        }
        self.data.frame = Some(frame);
        effects.extend(self.begin_fit(index, warm));
        self.presets = PresetCard::Closed;
        if std::mem::take(&mut self.presets_first) {
            effects.extend(self.compare_presets());
        }
        effects
    }

    /// The parameters that a warm start would take from the fit on screen.
    pub(super) fn warm_params(&self) -> Option<Pppr> {
        if !self.warm_start {
            return None;
        }
        let branch = self.fit.branch()?;
        branch.state_at(branch.head()).filter(|(iteration, _)| *iteration > 0).map(|(_, state)| state.params.clone())
    }

    /// Puts the fit on screen aside, so that coming back finds it again.
    pub(super) fn leave_frame(&mut self) -> Vec<Effect> {
        // What is in the hand is put down here, not in the next frame.
        if let Some(moving) = self.moving.take() {
            self.end_move(moving);
        }
        let mut fit = std::mem::take(&mut self.fit);
        if fit.problem.is_none() {
            return Vec::new();
        }
        (fit.shown, fit.shown_hashes) = (None, None);
        fit.status = FitStatus::Paused;
        fit.history.shrink(KEPT_FIT_BYTES);
        self.left.retain(|frame| *frame != fit.frame);
        if fit.edited || fit.head() > 0 || fit.history.branches().len() > 1 {
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
    pub(super) fn begin_fit(&mut self, index: usize, warm: Option<Pppr>) -> Vec<Effect> {
        self.begin_fit_at(index, warm.map(Start::Warm))
    }

    /// As [`Self::begin_fit`], at `at` where no fit was left there.
    pub(super) fn begin_fit_at(&mut self, index: usize, at: Option<Start>) -> Vec<Effect> {
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
            None if self.along => (Fit::default(), at.unwrap_or(Start::Along)),
            None => (Fit::default(), at.unwrap_or(Start::Initialise)),
        };
        let resuming = matches!(start, Start::Resume { .. });
        self.fit = Fit { job: self.jobs, frame: index, status: FitStatus::Preparing, ..fit };
        if resuming {
            // Settings that changed meanwhile are recorded where they take effect.
            let (id, head) = (self.fit.history.active_id(), self.fit.head());
            self.fit.history.flag(id, head, self.config);
        } else {
            self.fit.history = History::new(self.config);
            self.fit.start_config = Some(self.config);
            self.fit.cursor = None;
        }
        vec![Effect::Send(WorkerCommand::Prepare(Box::new(Prepare {
            job: self.jobs,
            branch: self.fit.history.active_id(),
            dataset: Arc::clone(dataset),
            frame: Arc::clone(frame),
            config: self.config,
            precision: self.precision,
            start,
            erased: self.fit.erased(),
            around: self.fit.around(),
        })))]
    }
}

/// A data set of which nothing is known yet.
pub(super) fn opening(path: PathBuf) -> Opening {
    Opening { path, stage: "looking".into(), done: 0, total: 0 }
}
