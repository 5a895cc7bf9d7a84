//! `study merge`: shards to one run.

use super::run::tell;
use crate::cli::common::CsvArgs;
use crate::study::run::merge_runs;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// What `study merge` is told.
#[derive(Debug, Args)]
pub struct MergeArgs {
    /// The run folders of all shards, in any order.
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// The folder of the whole.
    #[arg(long, value_name = "RUN")]
    out: PathBuf,
    #[command(flatten)]
    cells: CsvArgs,
    /// Print the table as JSON instead of Markdown.
    #[arg(long)]
    json: bool,
}

/// Runs `study merge`.
///
/// # Errors
/// As [`merge_runs`], or where no row was fitted.
pub(super) fn run(args: &MergeArgs) -> anyhow::Result<ExitCode> {
    args.cells.apply();
    tell(&merge_runs(&args.runs, &args.out)?, args.json)
}
