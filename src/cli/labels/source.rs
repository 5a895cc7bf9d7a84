//! Where labels come from as typed: a data set, a journal, or a table that was exported.

use super::request::Frames;
use crate::cli::common::open;
use crate::dataset::Dataset;
use crate::labels::{LabelPlace, Record, place_acts, read_labels};
use anyhow::{Context as _, bail};
use std::collections::BTreeSet;
use std::path::Path;

/// The endings of files that are data, not labels.
const DATA: [&str; 3] = ["npz", "npy", "toml"];

/// Every record of `path`, in the order of the acts.
///
/// # Errors
/// Where it is none of the three, or cannot be read.
pub(super) fn acts(path: &Path, manifest: Option<&Path>) -> anyhow::Result<Vec<Record>> {
    if is_table(path) {
        return Ok(read_labels(path)?);
    }
    let expected = "expected a data set, a journal (*.labels.jsonl), or labels exported as CSV or JSON";
    acts_of(&open(path, manifest).context(expected)?)
}

/// True for what is no data set, hence a journal or a table.
pub(super) fn is_table(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default();
    !path.is_dir() && !DATA.iter().any(|known| ending.eq_ignore_ascii_case(known))
}

/// Every record of a data set, in the order of the acts; tells what is not as it should be, and touches nothing.
///
/// # Errors
/// Where the journals cannot be read.
pub(in crate::cli) fn acts_of(dataset: &Dataset) -> anyhow::Result<Vec<Record>> {
    let (acts, warnings) = place_acts(&LabelPlace::to_read(&dataset.info().root, dataset.fingerprint()))?;
    for warning in warnings {
        tracing::warn!("{warning}");
    }
    let labels: BTreeSet<(&str, &str)> =
        acts.iter().map(|record| (record.annotator.as_str(), record.frame.path.as_str())).collect();
    warn_of_unknown(dataset, labels.into_iter().map(|(_, frame)| frame));
    Ok(acts)
}

/// Tells how many of these labels, each given by its frame, are of frames that the data set does not have.
pub(super) fn warn_of_unknown<'a>(dataset: &Dataset, labels: impl IntoIterator<Item = &'a str>) {
    let known = Frames::new(dataset);
    let mut unknown = labels.into_iter().filter(|frame| known.named(frame).is_none());
    if let Some(first) = unknown.next() {
        let (count, root) = (counted(1 + unknown.count(), "label"), dataset.info().root.display());
        tracing::warn!("{root}: {count} of frames that are not in this data set, for example {first}; they are kept");
    }
}

/// The annotators, in the order of their names.
pub(super) fn annotators(acts: &[Record]) -> Vec<&str> {
    acts.iter().map(|record| record.annotator.as_str()).collect::<BTreeSet<_>>().into_iter().collect()
}

/// Only what `annotator` said, where one is named.
///
/// # Errors
/// Where that one said nothing, naming those who did.
pub(super) fn only(mut acts: Vec<Record>, annotator: Option<&str>, path: &Path) -> anyhow::Result<Vec<Record>> {
    let Some(name) = annotator.map(str::trim) else { return Ok(acts) };
    let names = annotators(&acts);
    if !names.contains(&name) {
        bail!("{}: no labels by `{name}`; there are some by {}", path.display(), listed(&names));
    }
    acts.retain(|record| record.annotator == name);
    Ok(acts)
}

/// Names for a message.
pub(super) fn listed(names: &[&str]) -> String {
    if names.is_empty() {
        return "nobody".into();
    }
    names.iter().map(|name| if name.is_empty() { "(no name)" } else { name }).collect::<Vec<_>>().join(", ")
}

/// `1 frame`, `2 frames`.
pub(super) fn counted(count: usize, one: &str) -> String {
    format!("{count} {one}{}", if count == 1 { "" } else { "s" })
}
