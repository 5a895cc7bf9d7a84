//! The state behind the window and the worker thread, without a window.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

#[path = "../common/blob.rs"]
mod blob;

mod acts;
mod another;
mod batch;
mod hand;
mod labels;
mod live;
mod state;
mod worker;

use mhp_inspector::dataset::Dataset;
use mhp_inspector::task::Progress;
use std::path::Path;
use std::sync::Arc;

/// A step of this many milliseconds: settings count from the next step on.
const SLOW_MS: f64 = 1e3;

/// A data set of blobs, made in `folder` and opened.
fn dataset(folder: &Path, frames: usize) -> Arc<Dataset> {
    blob::write_dataset(folder, frames);
    Arc::new(Dataset::open(folder, &Progress::new()).unwrap())
}
