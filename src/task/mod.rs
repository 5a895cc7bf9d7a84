//! Work off the caller's thread: how far it is ([`Progress`]), its answer and a way to stop it (`Job`), panics that become errors,
//! and how long it took.

mod job;
mod panic;
mod progress;

pub(crate) use job::Job;
pub(crate) use panic::{catch_panic, panic_as_error};
pub use progress::{Cancelled, Progress, ProgressState};

use std::time::Instant;

/// Milliseconds since `began`, to the microsecond: more digits would only be noise in a table.
pub(crate) fn milliseconds(began: Instant) -> f64 {
    (began.elapsed().as_secs_f64() * 1e6).round() / 1e3
}
