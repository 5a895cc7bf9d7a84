//! Results of a batch that was fitted elsewhere, by the frames of the open data set.

use super::state::FrameSummary;
use crate::dataset::Dataset;
use crate::study::{SummaryRow, read_summary};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::sync::Arc;

/// What a table of results says of a data set's frames.
#[derive(Debug, Clone)]
pub struct FoundResults {
    /// The data set that the frames were looked for in.
    pub dataset: Arc<Dataset>,
    /// A line a frame.
    pub summaries: BTreeMap<usize, FrameSummary>,
    /// Rows of frames that the data set does not have.
    pub unknown: usize,
    /// The name of the first of them.
    pub first_unknown: Option<String>,
}

impl FoundResults {
    /// Reads a table and finds its frames by their names; where one comes twice, the last row counts.
    ///
    /// # Errors
    /// As [`read_summary`], in words.
    pub fn read(path: &Path, dataset: &Arc<Dataset>) -> Result<Self, String> {
        let rows = read_summary(path).map_err(|error| error.to_string())?;
        let names: HashMap<&str, usize> = (0..dataset.len()).map(|index| (dataset.frame_name(index), index)).collect();
        let (mut summaries, mut unknown, mut first_unknown) = (BTreeMap::new(), 0, None);
        for row in rows {
            // Another program may have put spaces around its commas.
            if let Some(&index) = names.get(row.frame.as_str()).or_else(|| names.get(row.frame.trim())) {
                summaries.insert(index, summary(row));
            } else {
                unknown += 1;
                first_unknown.get_or_insert(row.frame);
            }
        }
        Ok(Self { dataset: Arc::clone(dataset), summaries, unknown, first_unknown })
    }
}

/// A frame that could not be fitted has a reason and no numbers.
fn summary(row: SummaryRow) -> FrameSummary {
    FrameSummary {
        iterations: row.iterations,
        loss: row.loss,
        terms: row.terms,
        iou: row.iou,
        converged: row.converged,
        majpe_mm: row.majpe_mm,
        reason: row.reason,
        hashes: None,
        batch: false,
        people: row.people,
        annotated: row.annotated,
        joints: None,
    }
}
