//! Studies over many frames: batch runs and their tables, the hard subset, and what is taken home of a fit.
//!
//! [`run_batch`] fits, [`Summary`] writes the rows to a CSV as they come and [`read_summary`] reads them back, [`Means`] sums them up. [`complexity`] says
//! which frames are hard before anything is fitted, [`frame_evidence`] judges a fit; [`write_ply`] and [`write_curves`]
//! export a state. [`estimate_room`] finds where a radar stands in a room. [`shard`] cuts what is done a frame into parts for several machines. Nothing here knows a window or a terminal.

mod batch;
#[cfg(feature = "train")]
pub mod calibrate;
pub mod complexity;
pub mod count;
#[cfg(feature = "train")]
pub mod cross;
mod erased;
mod evidence;
mod export;
mod file_error;
mod kept;
pub mod radars;
mod results;
mod room;
mod row;
pub mod run;
pub mod shard;
mod summary;
pub mod verification;

pub use batch::{BatchOptions, fit_frame, run_batch};
pub use erased::{read_erased, write_erased};
pub use evidence::{FrameEvidence, frame_evidence, frames_before, state_evidence};
pub use export::{
    CurveRow, ExportError, HeatmapExport, curve_columns, curves_csv, ply, write_cloud_npz, write_cloud_pcd,
    write_cloud_ply, write_curves, write_ply,
};
pub use file_error::FileError;
pub use kept::{FitsFile, FitsOf, FrameStamps, KeptFits, kept_fits};
pub use results::{SummaryRow, read_summary};
pub use room::{RoomError, RoomEstimate, environments, estimate_room};
pub use row::{BatchRow, FitNumbers, FrameFit, Means};
pub use summary::{StudyError, Summary, columns};
