//! `merge`: the shards of any command to what one run of it writes and prints.

use super::common::CsvArgs;
use super::{complexity, count, evidence, fit, study};
use crate::input::open_file;
use crate::output::{FolderLock, Inputs, replace_file};
use crate::study::run::is_run_folder;
use crate::study::shard::{FrameCommand, ShardSpec, is_shard_folder, of_command};
use anyhow::Context as _;
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Shown under the options of `merge --help`.
pub(super) const HELP: &str = "\
What the shards are of, their folders say themselves. DIR becomes what one run of the same command leaves, byte for byte, times \
apart: the run folder of a study; fit.toml, summary.csv, pppr and curves of fit; complexity.csv, count.csv or evidence.csv. The same is \
printed as well. Shards of another command, program version, data set, choice of frames or setting are refused; so is a \
whole of which a shard is missing, which is named. A shard that failed or was killed is done again by itself, with its own number in \
words (--shard 3/8), into any folder.

Exit codes: those of the command, for all frames together; 2 where shards are missing or do not fit.

Examples:
  mhp-inspector merge runs/threshold-* --out runs/threshold
      The shards of a study, in any order.
  mhp-inspector merge shards/* --out whole --json
      The shards of complexity, say, and its JSON on standard output.
  sbatch --array=1-8 samples/slurm/shards.sh runs/walk fit data/walk --preset recommended
      A Slurm array whose tasks are shards; samples/slurm/merge.sh, which waits for it, merges them.";

/// What `merge` is told.
#[derive(Debug, Args)]
pub struct MergeArgs {
    /// The folders of all shards, in any order.
    #[arg(required = true, value_name = "SHARD")]
    pub(super) shards: Vec<PathBuf>,
    /// The folder of the whole.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    cells: CsvArgs,
    /// Print JSON, as the command does with --json.
    #[arg(long)]
    pub(super) json: bool,
}

/// Runs `merge`.
///
/// # Errors
/// Where the folders do not hold all shards of one whole, or DIR cannot be written.
pub(super) fn run(args: &MergeArgs) -> anyhow::Result<ExitCode> {
    args.cells.apply();
    let find = |holds: fn(&Path) -> bool| args.shards.iter().find(|folder| holds(folder));
    match (find(is_run_folder), find(is_shard_folder)) {
        (Some(run), Some(other)) => anyhow::bail!(
            "{} is of a study, {} is not; expected the shards of one command",
            run.display(),
            other.display()
        ),
        (Some(_), None) => study::merge(&args.shards, &args.out, args.json),
        // Where there is none, that is told as of any of them.
        (None, shard) => match shard.map_or(Ok(FrameCommand::Fit), |folder| of_command(folder))? {
            FrameCommand::Fit => fit::merge(args),
            FrameCommand::Complexity => complexity::merge(args),
            FrameCommand::Count => count::merge(args),
            FrameCommand::Evidence => evidence::merge(args),
        },
    }
}

impl MergeArgs {
    /// Makes and holds the folder of the whole that `spec` tells, put together of `shards`, and the folders `below` it.
    ///
    /// # Errors
    /// Where it lies in the data set or in a shard, holds a shard itself, cannot be made, or another process writes it.
    pub(super) fn begin(&self, spec: &ShardSpec, shards: &[PathBuf], below: &[&str]) -> anyhow::Result<WholeFolder> {
        let folder = self.out.clone();
        if is_run_folder(&folder) || is_shard_folder(&folder) {
            anyhow::bail!("{}: holds a shard or a study; give another --out for the whole", folder.display());
        }
        let named = shards.iter().map(|shard| Some(shard.as_path()));
        let inputs = Inputs::default().with_folder(&spec.data.root).with_named(named);
        let lock = FolderLock::claim(&folder, below, &inputs)?;
        Ok(WholeFolder { folder, shards: shards.to_owned(), inputs, _lock: lock })
    }
}

/// The folder of a whole that is being put together.
pub(super) struct WholeFolder {
    folder: PathBuf,
    shards: Vec<PathBuf>,
    inputs: Inputs<'static>,
    _lock: FolderLock,
}

impl WholeFolder {
    /// The place of a file.
    ///
    /// # Errors
    /// Where it is a folder, or an input.
    pub(super) fn file(&self, name: &str) -> anyhow::Result<PathBuf> {
        let file = self.folder.join(name);
        self.inputs.check_replaced(&file)?;
        Ok(file)
    }

    /// Copies a file that all shards have alike.
    ///
    /// # Errors
    /// Where it cannot be read or written.
    pub(super) fn copy_one(&self, name: &str) -> anyhow::Result<()> {
        let to = self.file(name)?;
        self.shards.first().map_or(Ok(()), |shard| copy(&shard.join(name), &to))
    }

    /// Copies the files in the folder `below` of every shard. None has the name of another: they are told from all frames of the
    /// data set.
    ///
    /// # Errors
    /// Where one cannot be read or written.
    pub(super) fn copy_all(&self, below: &str) -> anyhow::Result<()> {
        for from in self.shards.iter().map(|shard| shard.join(below)) {
            let failed = || format!("{}: cannot be read", from.display());
            for entry in std::fs::read_dir(&from).with_context(failed)? {
                let name = entry.with_context(failed)?.file_name();
                // What a killed process left begins with a point.
                if !name.as_encoded_bytes().starts_with(b".") {
                    copy(&from.join(&name), &self.folder.join(below).join(&name))?;
                }
            }
        }
        Ok(())
    }
}

fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    let mut source =
        open_file(from, "a file of results").with_context(|| format!("{}: cannot be read", from.display()))?;
    let written = replace_file(to, |mut out| std::io::copy(&mut source, &mut out).map(drop));
    written.with_context(|| format!("{}: cannot be written", to.display()))
}
