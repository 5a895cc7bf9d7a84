//! The hard subset: statistics and strata against an independent implementation and committed answers, the cache, the job,
//! the command line.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

mod cache;
mod cli;
mod definitions;
mod job;
mod naive;
mod ranking;
mod sets;
#[path = "../common/tree.rs"]
mod tree;
