//! The numbers of a frame: every source against the truth and against the fit.

use super::compare::{Comparison, SourceMeans, compare, compare_with_truth};
use super::source::Predictions;
use crate::dataset::{Dataset, DatasetError, Frame};

/// One source on one frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SourceRow {
    /// Persons that it predicts; `None` where it does not have the frame.
    pub persons: Option<usize>,
    /// Against the truth, where there is one.
    pub truth: Option<Comparison>,
    /// Against the fit, where there is one.
    pub fit: Option<Comparison>,
}

/// A frame with all its sources.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictionRow {
    /// Index in the data set.
    pub index: usize,
    /// The frame's name.
    pub frame: String,
    /// Annotated number of people, where known.
    pub annotated: Option<usize>,
    /// The fit itself, against the truth.
    pub reference: SourceRow,
    /// The sources in their order.
    pub sources: Vec<SourceRow>,
}

impl PredictionRow {
    /// The largest distance between a source and the fit, mm.
    pub fn disagreement_mm(&self) -> Option<f64> {
        let of = self.sources.iter().filter_map(|row| row.fit.as_ref().map(|fit| fit.errors.majpe_mm));
        of.max_by(f64::total_cmp)
    }

    /// The largest error of a source, mm.
    pub fn error_mm(&self) -> Option<f64> {
        let of = self.sources.iter().filter_map(|row| row.truth.as_ref().map(|truth| truth.errors.majpe_mm));
        of.max_by(f64::total_cmp)
    }
}

/// What a source says of a frame.
pub fn source_row(source: &Predictions, fit: Option<&Predictions>, frame: &Frame, joints: usize) -> SourceRow {
    let Some(predicted) = source.frame(frame.index) else { return SourceRow::default() };
    let truth = frame.truth.as_ref().and_then(|truth| compare_with_truth(source, predicted, &truth.joints, joints));
    let against = |fit: &Predictions| compare((source, predicted), (fit, fit.frame(frame.index)?));
    SourceRow { persons: Some(predicted.persons), truth, fit: fit.and_then(against) }
}

/// Reads a frame and compares all sources on it.
///
/// # Errors
/// Where the frame cannot be read.
pub fn prediction_row(
    dataset: &Dataset,
    index: usize,
    sources: &[Predictions],
    fit: Option<&Predictions>,
) -> Result<PredictionRow, DatasetError> {
    let frame = dataset.load(index)?;
    let joints = dataset.info().skeleton.joints.len();
    Ok(PredictionRow {
        index,
        frame: frame.name.clone(),
        annotated: frame.person_count.or_else(|| frame.truth.as_ref().map(|truth| truth.persons)),
        reference: fit.map(|fit| source_row(fit, None, &frame, joints)).unwrap_or_default(),
        sources: sources.iter().map(|source| source_row(source, fit, &frame, joints)).collect(),
    })
}

/// Means of one source over rows: against the truth, and against the fit.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SourceSummary {
    /// Frames that the source has.
    pub frames: usize,
    /// Frames that it does not have.
    pub missing: usize,
    /// Persons of all frames.
    pub persons: usize,
    /// Against the truth.
    pub truth: SourceMeans,
    /// Against the fit.
    pub fit: SourceMeans,
}

impl SourceSummary {
    /// Takes a frame in.
    pub fn add(&mut self, row: &SourceRow) {
        match row.persons {
            Some(persons) => (self.frames, self.persons) = (self.frames + 1, self.persons + persons),
            None => self.missing += 1,
        }
        row.truth.iter().for_each(|truth| self.truth.add(truth));
        row.fit.iter().for_each(|fit| self.fit.add(fit));
    }
}
