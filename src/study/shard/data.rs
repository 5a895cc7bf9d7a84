//! The data that rows are of, as specifications name them.

use super::{FrameRanges, stamp};
use crate::dataset::Dataset;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Which frames of the range are studied.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Subset {
    /// All.
    All,
    /// The hard stratum.
    Hard,
}

/// The data that a run or a shard is about.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataSpec {
    /// Name of the data set.
    pub name: String,
    /// Where it lay; the only part that may differ between shards.
    #[serde(with = "crate::folders::portable_path")]
    pub root: PathBuf,
    /// How it lies on disk, as [`crate::dataset::Layout::word`] says it; "" in a run of an older program.
    #[serde(default)]
    pub layout: String,
    /// [`crate::dataset::Dataset::fingerprint`]: layout, arrays, shapes, names.
    pub fingerprint: String,
    /// Of the files' sizes and of the maps of three frames.
    pub content: String,
    /// Arrays of the views, in order.
    pub arrays: Vec<String>,
    /// First frame of the range.
    pub first: usize,
    /// One past the last frame of the range.
    pub end: usize,
    /// Frames that are studied.
    pub frames: usize,
    /// Which of the range.
    pub subset: Subset,
    /// The frames asked for where they are no range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub listed: Option<FrameRanges>,
}

impl DataSpec {
    /// Of frames of a data set, of which `frames` are studied.
    pub fn of(dataset: &Dataset, asked: &FrameRanges, frames: usize, subset: Subset) -> Self {
        let (info, range) = (dataset.info(), asked.hull());
        Self {
            name: info.name.clone(),
            root: std::path::absolute(&info.root).unwrap_or_else(|_| info.root.clone()),
            layout: info.layout.word().to_owned(),
            fingerprint: dataset.fingerprint().to_owned(),
            content: stamp::content(dataset, &range),
            arrays: info.views.iter().map(|view| view.array.clone()).collect(),
            first: range.start,
            end: range.end,
            frames,
            subset,
            listed: asked.has_gaps().then(|| asked.clone()),
        }
    }

    /// The frames asked for, as text.
    pub fn asked(&self) -> String {
        self.listed.as_ref().map_or_else(|| format!("{}..{}", self.first, self.end), FrameRanges::to_string)
    }

    /// In words, what tells one data set from another.
    pub(in crate::study) fn told(&self) -> String {
        format!("{} {} {}", self.name, self.fingerprint, self.content)
    }

    /// In words, which frames.
    pub(in crate::study) fn told_frames(&self) -> String {
        let word = if self.subset == Subset::Hard { "hard" } else { "all" };
        format!("{} of {} ({word})", self.frames, self.asked())
    }
}
