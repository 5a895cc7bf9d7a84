//! Joints that networks, other programs or earlier runs predict, beside the fit and the truth.
//!
//! A source ([`Predictions`]) is a file: npz or npy, CSV, JSON as MMPose and COCO write it, Parquet, or the PPPR files of a run. What
//! it says of its joints, unit and axes is taken; what it does not say is asked for once ([`Reading`]) and remembered by the form of
//! the file, never guessed: metres and millimetres differ by a factor that no error shows. Frames are found by name or by index
//! (`matching`), joints by name (`joint_map`), so that a skeleton of 17 joints can stand beside one of 14; errors are those of the joints
//! that both have.
//!
//! ```text
//! file ──> RawPredictions ──(Reading: joints, unit, axes)──> checked ──(skeleton and frames of the data set)──> Predictions
//! ```

mod compare;
mod convention;
mod error;
mod joint_map;
mod look;
mod matching;
mod raw;
mod read;
mod reading;
mod rows;
mod source;
mod start;
mod write;

pub use compare::{Comparison, SourceMeans, compare, compare_with_truth};
pub use convention::{Axes, Unit};
pub use error::PredictionError;
pub use joint_map::{JointMap, JointSource, canonical_joint};
pub use look::looks_like_predictions;
pub use raw::{FileFrame, FrameKey, RawPredictions};
pub use read::{ENDINGS, read_raw};
pub use reading::{Colour, Reading, RememberedReadings};
pub use rows::{PredictionRow, SourceRow, SourceSummary, prediction_row, source_row};
pub use source::{PredictedFrame, Predictions, source_name};
pub use start::{complete_bodies, start_of};
pub use write::{WriteFormat, write_predictions};
