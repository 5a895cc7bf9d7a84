//! Predictions of others: opened, asked about, compared, taken as the start of a fit.

use crate::dataset::Dataset;
use crate::geometry::Vec3;
use crate::predictions::{Colour, PredictionError, Predictions, Reading, start_of};
use crate::session::effect::Effect;
use crate::session::sources::{MOST_SOURCES, Source, SourceErrors, SourceQuestion};
use crate::session::state::{LogLevel, Session};
use crate::worker::Start;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

impl Session {
    pub(super) fn open_predictions(&mut self, path: PathBuf, reading: Reading) -> Vec<Effect> {
        self.sources.question = None;
        let opening = self.data.opening.is_some();
        let Some(dataset) = self.data.dataset.clone().filter(|_| !opening && !self.sources.reading) else {
            if opening || self.sources.reading {
                // One after the other: their order says their colours.
                self.sources.waiting.push((path, reading));
            } else {
                self.note(
                    LogLevel::Error,
                    format!("{}: open the data set first that these are predictions of", path.display()),
                );
            }
            return Vec::new();
        };
        self.sources.reading = true;
        vec![Effect::ReadPredictions(path, Box::new(reading), dataset)]
    }

    /// The next of those that were asked for while the data set was being opened, or another source read.
    pub(super) fn load_waiting_predictions(&mut self) -> Vec<Effect> {
        if self.sources.waiting.is_empty() || self.sources.reading {
            return Vec::new();
        }
        let (path, reading) = self.sources.waiting.remove(0);
        self.open_predictions(path, reading)
    }

    /// The question about a file is closed without an answer.
    pub(super) fn dismiss_predictions(&mut self) -> Vec<Effect> {
        self.sources.question = None;
        self.load_waiting_predictions()
    }

    /// Another data set: its frames are not theirs.
    pub(super) fn forget_predictions(&mut self) {
        self.sources.list.change().clear();
        (self.sources.question, self.sources.made, self.sources.reading) = (None, 0, false);
    }

    /// A file was read, or asks something, or cannot be used; the next that waits follows.
    pub(super) fn predictions_read(
        &mut self,
        path: PathBuf,
        reading: Reading,
        dataset: &Arc<Dataset>,
        result: Result<Box<Predictions>, PredictionError>,
    ) -> Vec<Effect> {
        if self.data.dataset.as_ref().is_none_or(|open| !Arc::ptr_eq(open, dataset)) {
            return Vec::new();
        }
        self.sources.reading = false;
        let mut effects = self.take_predictions(path, reading, dataset, result);
        if self.sources.question.is_none() {
            effects.extend(self.load_waiting_predictions());
        }
        effects
    }

    fn take_predictions(
        &mut self,
        path: PathBuf,
        reading: Reading,
        dataset: &Arc<Dataset>,
        result: Result<Box<Predictions>, PredictionError>,
    ) -> Vec<Effect> {
        let predictions = match result {
            Ok(predictions) => Arc::new(*predictions),
            Err(error) => {
                let told = reading.unit.is_some() || reading.axes.is_some();
                let why = error.to_string();
                if error.is_question()
                    || (told && matches!(error, PredictionError::Unit { .. } | PredictionError::Skeleton { .. }))
                {
                    self.sources.question = Some(SourceQuestion { path, reading, why });
                } else {
                    self.note(LogLevel::Error, why);
                }
                return Vec::new();
            }
        };
        let name = predictions.name.clone();
        for note in &predictions.notes {
            self.note(LogLevel::Info, format!("{name}: {note}"));
        }
        let known = self.sources.list().iter().position(|source| source.name() == name);
        if known.is_none() && self.sources.list().len() >= MOST_SOURCES {
            self.note(
                LogLevel::Error,
                format!("{MOST_SOURCES} sources of predictions are open, and no more can be; remove one first"),
            );
            return Vec::new();
        }
        let before = known.and_then(|at| self.sources.get(at));
        let hue = before.map_or(self.sources.made, |source| source.hue);
        let colour = predictions.colour.or_else(|| before.and_then(|source| source.colour));
        let source = Source { predictions: Arc::clone(&predictions), hue, colour, shown: true, errors: None };
        if let Some(at) = known {
            self.sources.list.change()[at] = source;
        } else {
            self.sources.made += 1;
            self.sources.list.change().push(source);
        }
        let notes =
            if predictions.notes.is_empty() { String::new() } else { format!("; {}", predictions.notes.join("; ")) };
        self.hint(format!("{name}: predictions of {} of {} frames{notes}", predictions.len(), dataset.len()));
        vec![Effect::ComparePredictions(predictions, Arc::clone(dataset))]
    }

    /// What a source says against the truth was read.
    pub(super) fn predictions_compared(&mut self, of: &Arc<Predictions>, errors: Arc<SourceErrors>) -> Vec<Effect> {
        let list = self.sources.list.change();
        if let Some(source) = list.iter_mut().find(|source| Arc::ptr_eq(&source.predictions, of)) {
            source.errors = Some(errors);
        }
        Vec::new()
    }

    pub(super) fn show_predictions(&mut self, slot: usize, shown: bool) -> Vec<Effect> {
        if let Some(source) = self.sources.list.change().get_mut(slot) {
            source.shown = shown;
        }
        Vec::new()
    }

    pub(super) fn colour_predictions(&mut self, slot: usize, colour: Option<Colour>) -> Vec<Effect> {
        if let Some(source) = self.sources.list.change().get_mut(slot) {
            source.colour = colour;
        }
        Vec::new()
    }

    pub(super) fn remove_predictions(&mut self, slot: usize) -> Vec<Effect> {
        if slot < self.sources.list().len() {
            let gone = self.sources.list.change().remove(slot);
            self.note(LogLevel::Info, format!("{}: no longer shown; the file is untouched", gone.name()));
        }
        Vec::new()
    }

    /// The fit of the frame on screen begins at what is predicted of it.
    pub(super) fn start_from_predictions(&mut self, slot: usize) -> Vec<Effect> {
        let (Some(source), Some(dataset), Some(frame)) = (self.sources.get(slot), &self.data.dataset, &self.data.frame)
        else {
            return Vec::new();
        };
        let (name, index) = (source.name().to_owned(), frame.index);
        let Some(problem) = &self.fit.problem else {
            self.hint("the frame is still being prepared; try again in a moment".into());
            return Vec::new();
        };
        let Some(start) = start_of(&source.predictions, dataset, index, problem, &self.config) else {
            self.hint(format!("{name} predicts nobody in this frame"));
            return Vec::new();
        };
        self.fits.remove(&index);
        self.forget_summary(index);
        let people = start.params.shape().persons;
        let word = if people == 1 { "person" } else { "people" };
        self.hint(format!("the fit begins at what {name} predicts: {people} {word}"));
        self.begin_fit_at(index, Some(Start::Given(start)))
    }

    /// The largest distance between a source and the fit of a frame, mm.
    pub fn disagreement_mm(&self, index: usize) -> Option<f64> {
        let joints = self.data.dataset.as_ref()?.info().skeleton.joints.len();
        let fit = self.fit_joints(index)?;
        let of = self.sources.list().iter().filter_map(|source| source.numbers(index, Some(&fit), joints).to_fit_mm);
        of.max_by(f64::total_cmp)
    }

    /// The largest MAJPE of a source in each frame whose truth is known, mm.
    pub fn prediction_errors_mm(&self) -> BTreeMap<usize, f64> {
        let mut largest = BTreeMap::new();
        let known = self.sources.list().iter().filter_map(|source| source.errors.as_ref());
        for (&frame, &[majpe_mm, _]) in known.flat_map(|errors| &errors.frames) {
            let of: &mut f64 = largest.entry(frame).or_insert(majpe_mm);
            *of = of.max(majpe_mm);
        }
        largest
    }

    /// The joints of the fit of a frame, m, where this session knows them.
    pub fn fit_joints(&self, index: usize) -> Option<Vec<Vec3>> {
        if index == self.fit.frame && self.fit.head() > 0 {
            let branch = self.fit.branch()?;
            return Some(branch.state_at(branch.head())?.1.params.positions().to_vec());
        }
        let joints = self.summaries.get(&index)?.joints.as_ref()?;
        Some(joints.iter().map(|p| p.map(f64::from)).collect())
    }
}
