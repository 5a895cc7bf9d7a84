//! `--shard i/n`: a command over frames, done in parts. The study has flags of its own.

use super::common::complain;
use super::{EXIT_BAD_INPUT, EXIT_SOME_FAILED};
use crate::study::shard::{Shard, ShardRow};
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Reads a shard as typed; `auto` is the task of a Slurm job array.
///
/// # Errors
/// In words, as [`Shard::typed`].
pub(super) fn typed(text: &str) -> Result<Shard, String> {
    Shard::typed(text, |variable| std::env::var(variable).ok())
}

/// The part that a command does which writes no folder otherwise.
#[derive(Debug, Args)]
pub(super) struct ShardArgs {
    /// Do only part i of n, counted from 1, into the folder --out; `auto` inside a Slurm job array. `merge` makes the whole of all.
    #[arg(long, value_name = "i/n", value_parser = typed, requires = "out", conflicts_with_all = ["csv", "json"])]
    shard: Option<Shard>,
    /// The folder of the part.
    #[arg(long, value_name = "DIR", requires = "shard")]
    out: Option<PathBuf>,
}

impl ShardArgs {
    /// The part and its folder, where one is asked for.
    pub(super) fn asked(&self) -> Option<(Shard, &Path)> {
        self.shard.zip(self.out.as_deref())
    }
}

/// Tells on standard error what a finished shard holds, and of its failures how many and the first.
pub(super) fn end(shard: Shard, out: &Path, rows: &[impl ShardRow]) -> ExitCode {
    let frames = rows.len();
    let plural = if frames == 1 { "" } else { "s" };
    complain(&format!(
        "shard {shard}: {frames} frame{plural} in {}; `merge` makes the whole of all shards",
        out.display()
    ));
    let mut failures = rows.iter().filter_map(ShardRow::failure);
    let Some(first) = failures.next() else { return ExitCode::SUCCESS };
    let failed = 1 + failures.count();
    complain(&format!("warning: {failed} of {frames} frames failed; the first: {first}"));
    ExitCode::from(if failed == frames { EXIT_BAD_INPUT } else { EXIT_SOME_FAILED })
}
