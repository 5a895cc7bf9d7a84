//! Opening a session file: the data set first, then what was on screen.

use crate::config::FitConfig;
use crate::dataset::Dataset;
use crate::mhp::Precision;
use crate::session::compared::ResultSide;
use crate::session::effect::{Effect, PinRequest};
use crate::session::file::{SavedFit, SavedFrame, SessionFile};
use crate::session::fit::{Fit, FitStatus};
use crate::session::history::History;
use crate::session::pins::Pin;
use crate::session::state::{LogLevel, Session};
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl Session {
    /// A session file was read, or could not be.
    pub(super) fn session_read(&mut self, path: PathBuf, result: Result<Box<SessionFile>, String>) -> Vec<Effect> {
        let opened = result.and_then(|file| Ok((file.dataset_path(&path).map_err(|error| error.to_string())?, file)));
        match opened {
            Ok((dataset, file)) => {
                self.restoring = Some((path, file));
                self.open(dataset)
            }
            Err(why) => {
                self.note(LogLevel::Error, why);
                Vec::new()
            }
        }
    }

    /// Puts back what a session file says, once its data set is open. Answers the frame to show.
    pub(super) fn restore(&mut self, dataset: &Arc<Dataset>) -> Option<(usize, Vec<Effect>)> {
        let (path, file) = self.restoring.take()?;
        let same = dataset.fingerprint() == file.dataset.fingerprint;
        if same {
            let summaries = self.summaries.change();
            *summaries = file.summaries;
            summaries.retain(|&frame, _| frame < dataset.len());
            *self.best_basins.change() = file.best_basins;
            self.best_basins.change().retain(|&frame, share| frame < dataset.len() && share.is_finite());
            for (side, set) in ResultSide::ALL.into_iter().zip(file.results) {
                self.results.set(side, set);
            }
        } else {
            let text = "the data set is not the one that the session was saved with; frames are found by their names";
            self.note(LogLevel::Warning, text.into());
        }
        let Some(frame) = find(dataset, &file.frame) else {
            self.note(LogLevel::Error, format!("{}: its frame {} is not there", path.display(), file.frame.path));
            return None;
        };
        self.session_path = Some(path.clone());
        self.view = file.view.in_range();
        self.config = config(&file.config, &path).unwrap_or(self.config);
        self.precision = precision(file.single_precision);
        self.warm_start = file.warm_start;
        self.along = file.along;
        self.joint = file.joint;
        self.queue.set_text(file.filter);
        match file.fit.map(|fit| resumed(fit, frame, &path)) {
            Some(Some(fit)) => {
                self.fits.insert(frame, fit);
                self.left.push_back(frame);
            }
            Some(None) => {
                let text =
                    "its fit is not whole and was left out: a state is missing, or its numbers do not fit together";
                self.note(LogLevel::Warning, format!("{}: {text}", path.display()));
            }
            None => {}
        }
        let mut effects = vec![Effect::RestoreWindow(file.window)];
        effects.extend(self.restore_breakpoints(file.breakpoints));
        let sources = file.predictions.into_iter();
        self.sources.waiting.extend(sources.map(|source| (source.path, source.reading)));
        for (k, saved) in file.pins.into_iter().enumerate() {
            let (Some(at), Some(config)) = (find(dataset, &saved.frame), config(&saved.config, &path)) else {
                self.note(
                    LogLevel::Warning,
                    format!("pin {}: its frame {} is not there", saved.name, saved.frame.path),
                );
                continue;
            };
            let pin = Pin {
                id: self.pins.made,
                name: saved.name,
                frame: at,
                frame_name: saved.frame.path,
                config,
                precision: precision(saved.single_precision),
                initial: saved.initial,
                params: saved.params,
                rows: saved.rows,
                snapshot: None,
            };
            self.pins.made += 1;
            if file.baseline == Some(k) {
                self.pins.baseline = Some(pin.id);
            }
            effects.push(Effect::DrawPin(Box::new(PinRequest { dataset: Arc::clone(dataset), pin: pin.clone() })));
            self.pins.list.push(pin);
        }
        Some((frame, effects))
    }
}

fn precision(single: bool) -> Precision {
    if single { Precision::F32 } else { Precision::F64 }
}

/// Checked when the file was read.
fn config(text: &str, path: &Path) -> Option<FitConfig> {
    FitConfig::parse(text, path).ok()
}

fn find(dataset: &Dataset, frame: &SavedFrame) -> Option<usize> {
    if dataset.frame_name(frame.index) == frame.path {
        return Some(frame.index);
    }
    (0..dataset.len()).find(|&index| dataset.frame_name(index) == frame.path)
}

/// The fit as it was left. Its size is checked against the data set by the worker that resumes it.
fn resumed(saved: SavedFit, frame: usize, path: &Path) -> Option<Fit> {
    let shape = saved.initial.shape();
    let fits = |params: &crate::body::Pppr| params.shape() == shape;
    let whole = saved.states.iter().all(|s| fits(&s.params) && fits(&s.adam.first) && fits(&s.adam.second));
    let head = saved.rows.last()?.report.iteration;
    if !whole || !saved.states.iter().any(|state| state.iteration == head) {
        return None;
    }
    let changes = saved.changes.iter().filter_map(|change| Some((change.after, config(&change.config, path)?)));
    let history = History::restored(
        &config(&saved.config, path)?,
        saved.rows,
        saved.states,
        changes.collect(),
        (saved.erased, saved.stops),
    );
    Some(Fit {
        frame,
        status: FitStatus::Paused,
        initial: Some(saved.initial),
        edited: saved.edited,
        cursor: saved.cursor,
        history,
        ..Fit::default()
    })
}
