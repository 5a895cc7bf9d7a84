//! Truth in metres beside a frame whose own files have no room for it: an npz with the keys of SPEC section 6. Public data sets have
//! none; simulated ones in the same layout do.

use super::Truth;
use super::generic::{read_truth, scalar};
use super::npz::NpzArchive;
use std::path::Path;

/// What such a file says; all `None` where there is none.
#[derive(Debug, Default)]
pub(super) struct Known {
    pub(super) truth: Option<Truth>,
    pub(super) person_count: Option<usize>,
    pub(super) timestamp_s: Option<f64>,
}

/// Reads the file where it is; what is wrong with it becomes a note.
pub(super) fn truth_beside(path: &Path, joints: usize, notes: &mut Vec<String>) -> Known {
    if !path.exists() {
        return Known::default();
    }
    let read = || {
        let mut file = NpzArchive::open(path)?;
        let truth = read_truth(&mut file, joints)?;
        let timestamp_s = scalar(&mut file, "timestamp_s")?;
        let person_count = truth.as_ref().map(|truth| truth.persons);
        Ok::<Known, super::NpzError>(Known { truth, person_count, timestamp_s })
    };
    read().unwrap_or_else(|error| {
        notes.push(format!("no truth: {error}"));
        Known::default()
    })
}
