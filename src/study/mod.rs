//! Studies over many frames: batch runs and their tables, and the hard subset.
//!
//! [`run_batch`] fits, [`Summary`] writes the rows to a CSV as they come, [`Means`] sums them up. [`complexity`] says
//! which frames are hard before anything is fitted. Nothing here knows a window or a terminal.

mod batch;
pub mod complexity;
mod row;
mod summary;

pub use batch::{BatchOptions, fit_frame, run_batch};
pub use row::{FitNumbers, FrameFit, FrameRow, Means};
pub use summary::{StudyError, Summary, columns};
