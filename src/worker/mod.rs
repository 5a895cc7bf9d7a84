//! The thread that runs a fit, and its protocol.
//!
//! Window to worker: a bounded channel of [`WorkerCommand`]s, all drained before each step, blocking while nothing runs.
//! Worker to window: three lanes by what may be lost: the latest [`Snapshot`] (only the newest matters), every
//! [`HistoryRow`] (none may be lost), and rare [`WorkerEvent`]s. Every message carries the job it belongs to; the
//! receiver drops stale ones. A panic inside a job becomes an event and the thread goes on.

mod handle;
mod protocol;
mod thread;

pub use handle::Worker;
pub use protocol::{
    HistoryRow, JobId, Kept, Prepare, PreparedFit, Snapshot, Start, WorkerCommand, WorkerEvent, WorkerMessage,
};
