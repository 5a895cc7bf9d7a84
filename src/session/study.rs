//! A study's run on screen: its folder, what was read of it, and which row of its table is in the frame list.

use super::results::FoundResults;
use super::state::FrameSummary;
use super::tracked::Tracked;
use super::work::Work;
use crate::dataset::Dataset;
use crate::study::complexity::Complexity;
use crate::study::run::{GridAxis, Run, RunRequest, RunRow, StudyKind};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The run on screen.
#[derive(Debug, Default)]
pub struct StudyView {
    /// What was read, and where.
    pub run: Tracked<Option<(PathBuf, Arc<Run>)>>,
    /// A folder that is being read.
    pub reading: Option<PathBuf>,
    /// The row of the table whose frames are in the list.
    pub row: Option<usize>,
    /// How far the study is that was begun here.
    pub work: Work,
    /// Which study that is; while it is shown, its table grows.
    pub(super) begun: Option<StudyKind>,
    /// Whether the study that was begun here is the one on screen.
    pub(super) follow: bool,
}

/// What a person asks to be studied, on the listed frames, from the settings in force.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyOrder {
    /// Which study.
    pub study: StudyKind,
    /// The axes of a sweep; empty for every other study.
    pub grid: Vec<GridAxis>,
}

/// A study, ready to be begun.
#[derive(Debug, Clone)]
pub struct StudyRequest {
    /// The data set.
    pub dataset: Arc<Dataset>,
    /// What is studied.
    pub run: RunRequest,
    /// The strata of its frames, where they are known.
    pub complexity: Option<Arc<Complexity>>,
    /// Rows of it that are done already.
    pub known: Vec<RunRow>,
}

impl StudyView {
    /// The run.
    pub fn shown(&self) -> Option<&Run> {
        self.run.as_ref().map(|(_, run)| run.as_ref())
    }

    /// The row whose frames are in the list, in words, where the run lies in `folder`.
    pub(super) fn shown_row(&self, folder: &Path) -> Option<String> {
        let (_, run) = self.run.as_ref().filter(|(lies, _)| lies == folder)?;
        Some(format!("{} {}", run.spec.study, run.table.get(self.row?)?.labels.join(", ")))
    }

    /// Whether the open data set may be the run's: the same name and arrays, and frames enough. (Its fingerprint is not for
    /// the window's thread.)
    pub fn is_of(&self, dataset: &Dataset) -> bool {
        let info = dataset.info();
        self.shown().is_some_and(|run| {
            let data = &run.spec.data;
            data.name == info.name
                && data.end <= dataset.len()
                && data.arrays.iter().eq(info.views.iter().map(|view| &view.array))
        })
    }
}

/// The filter that shows the frames of a row: all that have a result, also those that could not be fitted.
pub(super) const ROW_FILTER: &str = "reason:iterations|converged|counted|error";

/// Finds the frames of row `row` of the table, of `scene` or of all, in a data set, by their names.
pub(super) fn frames_of_row(run: &Run, row: usize, scene: Option<&str>, dataset: &Arc<Dataset>) -> FoundResults {
    let names: HashMap<&str, usize> = (0..dataset.len()).map(|index| (dataset.frame_name(index), index)).collect();
    let (mut summaries, mut unknown, mut first_unknown) = (BTreeMap::new(), 0, None);
    let of_row = run.table.get(row).into_iter().flat_map(|of| run.rows_of(of));
    for of in of_row.filter(|of| scene.is_none() || of.origin.scene.as_deref() == scene) {
        if let Some(&index) = names.get(of.name.as_str()) {
            let counted = run.spec.variants.get(of.variant).is_some_and(|variant| variant.config.people == 0);
            summaries.insert(index, summary(of, counted));
        } else {
            unknown += 1;
            first_unknown.get_or_insert_with(|| of.name.clone());
        }
    }
    FoundResults { dataset: Arc::clone(dataset), summaries, unknown, first_unknown }
}

fn summary(row: &RunRow, counted: bool) -> FrameSummary {
    let fit = row.fit.as_ref().ok();
    FrameSummary {
        iterations: fit.map(|fit| fit.iterations),
        loss: fit.map(|fit| fit.loss),
        terms: fit.map(|fit| fit.terms).unwrap_or_default(),
        iou: fit.and_then(crate::study::run::RunNumbers::mean_iou),
        converged: fit.map(|fit| fit.converged),
        majpe_mm: fit.and_then(|fit| fit.majpe_mm),
        reason: Some(row.fit.as_ref().map_or_else(|why| format!("error: {why}"), |fit| fit.reason.clone())),
        hashes: None,
        batch: false,
        people: fit.filter(|_| counted).map(|fit| fit.persons),
        annotated: fit.and_then(|fit| fit.annotated),
        joints: None,
    }
}
