//! Joints of others beside truth and fit: each format there and back, each fault in one message, a fit that begins at them.
#![expect(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

mod faults;
mod formats;
mod network;
mod onnx;
mod program;

use mhp_inspector::dataset::{Dataset, bundled_sample};
use mhp_inspector::geometry::Vec3;
use mhp_inspector::predictions::{PredictionError, Predictions, Reading};
use mhp_inspector::task::Progress;
use std::path::Path;

/// Frames by name, each with its persons' joints.
type Frames = Vec<(String, Vec<Vec<Vec3>>)>;

fn walk() -> Dataset {
    Dataset::open(&bundled_sample().unwrap(), &Progress::new()).unwrap()
}

/// The truth of every frame, so much aside.
fn shifted_truth(dataset: &Dataset, aside_m: f64) -> Frames {
    let joints = dataset.info().skeleton.joints.len();
    let frame = |index: usize| {
        let truth = dataset.load(index).unwrap().truth.unwrap();
        let moved = truth.joints.iter().map(|&[x, y, z]| [x, y + aside_m, z]).collect::<Vec<Vec3>>();
        (dataset.frame_name(index).to_owned(), moved.chunks_exact(joints).map(<[Vec3]>::to_vec).collect())
    };
    (0..dataset.len()).map(frame).collect()
}

/// Opened with nothing told and nothing remembered.
fn open(path: &Path, dataset: &Dataset) -> Result<Predictions, PredictionError> {
    Predictions::open(path, dataset, &Reading::default(), None)
}

fn refusal(path: &Path, dataset: &Dataset, told: &Reading) -> String {
    Predictions::open(path, dataset, told, None).unwrap_err().to_string()
}
