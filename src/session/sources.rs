//! Predictions of others beside the fits of this session: what is loaded, how it is drawn, and what it says of each frame.

use super::tracked::Tracked;
use crate::dataset::Dataset;
use crate::geometry::Vec3;
use crate::predictions::{
    Colour, PredictedFrame, Predictions, Reading, SourceRow, SourceSummary, compare_with_truth, source_row,
};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::Arc;

/// Sources at once at most: each has a colour and two columns.
pub const MOST_SOURCES: usize = 6;

/// A number of a source and a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum SourceNumber {
    /// MAJPE against the truth, mm.
    Error,
    /// PA-MAJPE against the truth, mm.
    AlignedError,
    /// Mean distance to the joints of the fit, mm.
    ToFit,
}

/// What the list knows of a source and a frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SourceNumbers {
    /// MAJPE against the truth, mm.
    pub majpe_mm: Option<f64>,
    /// PA-MAJPE against the truth, mm.
    pub pa_majpe_mm: Option<f64>,
    /// Mean distance to the joints of the fit, mm.
    pub to_fit_mm: Option<f64>,
}

impl SourceNumbers {
    /// One of them.
    pub fn get(&self, number: SourceNumber) -> Option<f64> {
        match number {
            SourceNumber::Error => self.majpe_mm,
            SourceNumber::AlignedError => self.pa_majpe_mm,
            SourceNumber::ToFit => self.to_fit_mm,
        }
    }
}

/// What a source says against the truth of every frame that it has.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SourceErrors {
    /// MAJPE and PA-MAJPE of each frame, mm, by index.
    pub frames: std::collections::BTreeMap<usize, [f64; 2]>,
    /// Their means.
    pub summary: SourceSummary,
}

impl SourceErrors {
    /// Reads the truth of every frame that a source has: not for the window's thread.
    pub fn of(source: &Predictions, dataset: &Dataset) -> Self {
        let joints = dataset.info().skeleton.joints.len();
        let mut errors = Self::default();
        for index in source.frames() {
            let Ok(frame) = dataset.load(index) else { continue };
            let row = source_row(source, None, &frame, joints);
            errors.summary.add(&row);
            if let Some(truth) = &row.truth {
                errors.frames.insert(index, [truth.errors.majpe_mm, truth.errors.pa_majpe_mm]);
            }
        }
        errors
    }
}

/// A source in the window.
#[derive(Debug, Clone)]
pub struct Source {
    /// Its joints by frame.
    pub predictions: Arc<Predictions>,
    /// Which of the colours it has, where nobody chose one.
    pub hue: usize,
    /// What it is drawn in, where somebody chose: its file, or a person since.
    pub colour: Option<Colour>,
    /// Drawn.
    pub shown: bool,
    /// What it says against the truth; `None` until that was read.
    pub errors: Option<Arc<SourceErrors>>,
}

impl Source {
    /// What it is called.
    pub fn name(&self) -> &str {
        &self.predictions.name
    }

    /// What it says of a frame; `fit` are the joints of the fit there.
    pub fn numbers(&self, index: usize, fit: Option<&[Vec3]>, joints: usize) -> SourceNumbers {
        let known = self.errors.as_ref().and_then(|errors| errors.frames.get(&index));
        SourceNumbers {
            majpe_mm: known.map(|[majpe, _]| *majpe),
            pa_majpe_mm: known.map(|[_, aligned]| *aligned),
            to_fit_mm: fit.and_then(|fit| self.to_fit_mm(index, fit, joints)),
        }
    }

    /// Mean distance of its people to those of the fit, paired best, mm.
    fn to_fit_mm(&self, index: usize, fit: &[Vec3], joints: usize) -> Option<f64> {
        let frame = self.predictions.frame(index)?;
        compare_with_truth(&self.predictions, frame, fit, joints).map(|of| of.errors.majpe_mm)
    }

    /// The joints of a frame on the whole skeleton; NaN where it knows none.
    pub fn joints_on(&self, index: usize, joints: usize) -> Vec<Vec3> {
        let Some(PredictedFrame { joints: known, persons }) = self.predictions.frame(index) else { return Vec::new() };
        let map = &self.predictions.map.known;
        let mut all = vec![[f64::NAN; 3]; persons * joints];
        for (person, of) in known.chunks_exact(map.len().max(1)).enumerate() {
            for (&joint, &p) in map.iter().zip(of) {
                if let Some(place) = all.get_mut(person * joints + joint) {
                    *place = p;
                }
            }
        }
        all
    }
}

/// A file whose joints, unit or axes must be told.
#[derive(Debug, Clone, PartialEq)]
pub struct SourceQuestion {
    /// The file.
    pub path: PathBuf,
    /// What was told so far.
    pub reading: Reading,
    /// What is asked for, or what was wrong with the last answer.
    pub why: String,
}

/// All sources of the open data set.
#[derive(Debug, Default)]
pub struct Sources {
    pub(super) list: Tracked<Vec<Source>>,
    pub(super) made: usize,
    /// One whose reading must be told.
    pub question: Option<SourceQuestion>,
    /// A file is being read.
    pub(super) reading: bool,
    /// Files that wait for their data set, or for the one that is being read.
    pub(super) waiting: Vec<(PathBuf, Reading)>,
}

impl Sources {
    /// In the order that they were opened.
    pub fn list(&self) -> &[Source] {
        &self.list
    }

    /// The source at a place of the list.
    pub fn get(&self, slot: usize) -> Option<&Source> {
        self.list.get(slot)
    }

    /// True without any.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Counts up with every change.
    pub fn revision(&self) -> u64 {
        self.list.revision()
    }
}

/// The rows of one frame, for a table: each source with what it says of truth and fit.
pub fn frame_rows(
    sources: &Sources,
    index: usize,
    truth: Option<&[Vec3]>,
    fit: Option<&[Vec3]>,
    joints: usize,
) -> Vec<SourceRow> {
    let row = |source: &Source| {
        let Some(frame) = source.predictions.frame(index) else { return SourceRow::default() };
        let against =
            |of: Option<&[Vec3]>| of.and_then(|of| compare_with_truth(&source.predictions, frame, of, joints));
        SourceRow { persons: Some(frame.persons), truth: against(truth), fit: against(fit) }
    };
    sources.list().iter().map(row).collect()
}
