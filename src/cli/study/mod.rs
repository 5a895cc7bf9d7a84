//! `study`: variants of a configuration over many frames, as a run folder with its table.

#[cfg(feature = "train")]
mod cross;
mod run;

use crate::study::run::merge_runs;
use clap::Subcommand;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Shown under the options of `study --help`.
pub(super) const HELP: &str = "\
RUN is a folder: run.toml (the configuration of every variant, seed, version, data set), journal.jsonl (rows as they were \
done), rows.csv and rows.parquet (a row a frame and variant), table.md and table.json, timing.csv and timing.md. A run that \
was killed goes on where it stopped when the same command is given again. All files but the times are the same bytes for the \
same command, however often it was killed, with any number of threads, and for shards that are merged.

Columns of a table: MAJPE and PA-MAJPE (mm, persons paired best) of the fit and of its start, the share of frames that are \
nearer to truth than their start, forward-consistency IoU, the share that converged; pixels and shares where there are only \
image labels. Frames where another number of persons was fitted than is annotated are counted and left out; OSPA is of all \
frames, a person who is missed or invented costs 500 mm in it.

Exit codes: 0 every row was fitted; 1 some were not; 2 none was, or the input is bad.

Examples:
  mhp-inspector study complexity data/walk --out runs/complexity
      Easy, medium and hard frames, and their mean.
  mhp-inspector study robustness data/mmvr --out runs/robustness --preset recommended
      The hard frames, from starts that are perturbed on purpose.
  mhp-inspector study sweep data/walk --grid w_em=0.1,0.5,1 --grid tau_pct=5,10,20 --out runs/sweep
      Nine configurations; keys are those of FIT.toml.
  mhp-inspector study threshold data/mmvr --shard auto --out runs/threshold-$SLURM_ARRAY_TASK_ID
      One part of eight, as a task of a Slurm array with --array=1-8.
  mhp-inspector merge runs/threshold-* --out runs/threshold
      The whole.";

/// The studies, and what is done with their folders.
#[derive(Debug, Subcommand)]
pub enum StudyCommand {
    /// One configuration by easy, medium and hard frames: errors, IoU, convergence.
    Complexity(run::RunArgs),
    /// Starts perturbed on purpose: noise and bias of positions, corrupt velocities, lost peaks; and the warm start.
    /// 80 iterations, on the hard frames.
    Robustness(run::HardArgs),
    /// The radar simulation without each of its four operators.
    Operators(run::RunArgs),
    /// Thresholds τ of 5, 10, 30, 70 and 100 %: the share of cells in a mask.
    Threshold(run::RunArgs),
    /// Five pairs of weights of the electromagnetic and the kinematic terms.
    Weights(run::RunArgs),
    /// The start without positions (P) or velocities (V) from the maps.
    Init(run::RunArgs),
    /// 5 to 100 iterations, from a frame's own peaks and from the frame before: errors, IoU, and times in timing.md.
    Budget(run::RunArgs),
    /// Each switch of the presets: what `recommended` adds to `baseline`, one by one, and without each; and each place where
    /// `baseline` leaves the paper's words, taken to the letter, and all of them.
    Switches(run::RunArgs),
    /// How often the number of people is right, by number and weighted by 91, 8 and 1 %; speed in timing.md.
    Counting(run::RunArgs),
    /// Fits from the annotated joints beside fits from the program's own start: how far the fit leaves the truth, held there
    /// (w_given) and not, in how many frames the loss prefers where it ends by itself, and what becomes of joints that are given with
    /// errors of 30 and 60 mm an axis.
    Truth(run::RunArgs),
    /// Any grid over the configuration: numbers, switches and choices.
    #[command(after_long_help = crate::config::listing())]
    Sweep(run::SweepArgs),
    /// Networks taught on one scene and asked on the others (paper 5.2.2), by what they read: heatmaps, PPPR, PPPR-Heatmap.
    #[cfg(feature = "train")]
    CrossScene(cross::CrossArgs),
    /// The same across data sets, of other radars for example (paper 5.2.3).
    #[cfg(feature = "train")]
    CrossDataset(cross::CrossArgs),
}

/// Runs `study`.
///
/// # Errors
/// Where the configuration, the data set, the range, the grid or a folder is bad, or no row at all could be fitted.
pub(super) fn run(command: &StudyCommand) -> anyhow::Result<ExitCode> {
    use crate::study::run::StudyKind as Kind;
    match command {
        StudyCommand::Complexity(args) => run::run(Kind::Complexity, args, None, &[]),
        StudyCommand::Robustness(args) => run::run(Kind::Robustness, &args.run, Some(args.all), &[]),
        StudyCommand::Operators(args) => run::run(Kind::Operators, args, None, &[]),
        StudyCommand::Threshold(args) => run::run(Kind::Threshold, args, None, &[]),
        StudyCommand::Weights(args) => run::run(Kind::Weights, args, None, &[]),
        StudyCommand::Init(args) => run::run(Kind::Init, args, None, &[]),
        StudyCommand::Budget(args) => run::run(Kind::Budget, args, None, &[]),
        StudyCommand::Switches(args) => run::run(Kind::Switches, args, None, &[]),
        StudyCommand::Counting(args) => run::run(Kind::Counting, args, None, &[]),
        StudyCommand::Truth(args) => run::run(Kind::Truth, args, None, &[]),
        StudyCommand::Sweep(args) => run::run(Kind::Sweep, &args.run, None, &args.grid),
        #[cfg(feature = "train")]
        StudyCommand::CrossScene(args) => cross::run(crate::study::cross::CrossKind::Scene, args),
        #[cfg(feature = "train")]
        StudyCommand::CrossDataset(args) => cross::run(crate::study::cross::CrossKind::Dataset, args),
    }
}

/// Makes one run of the shards of a study.
///
/// # Errors
/// As [`merge_runs`], or where no row was fitted.
pub(super) fn merge(shards: &[PathBuf], out: &Path, json: bool) -> anyhow::Result<ExitCode> {
    run::tell(&merge_runs(shards, out)?, json)
}
