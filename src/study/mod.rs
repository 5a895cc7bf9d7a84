//! Batch runs and their tables: fit many frames, one row a frame.
//!
//! [`run_batch`] fits, [`Summary`] writes the rows to a CSV as they come, [`Means`] sums them up. Nothing here knows a
//! window or a terminal.

mod batch;
mod row;
mod summary;

pub use batch::{BatchOptions, fit_frame, run_batch};
pub use row::{FitNumbers, FrameFit, FrameRow, Means};
pub use summary::{StudyError, Summary, columns};
