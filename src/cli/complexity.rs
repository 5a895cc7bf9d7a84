//! `complexity`: which frames of a data set are hard, as a table, CSV or JSON.

mod report;

use super::common::{CsvArgs, complain, inputs, open, print, print_json};
use super::merge::MergeArgs;
use super::shards::{ShardArgs, end};
use super::{EXIT_BAD_INPUT, EXIT_SOME_FAILED};
use crate::dataset::Dataset;
use crate::study::StudyError;
use crate::study::complexity::{
    self, Complexity, ComplexityOptions, MeasuredFrame, cache_folder, measure, ranked, write_csv,
};
use crate::study::shard::{FrameCommand, ShardFolder, ShardSpec, Whole};
use crate::task::{Job, Progress};
use clap::Args;
use crossbeam_channel::{RecvTimeoutError, bounded};
use indicatif::{ProgressBar, ProgressStyle};
use serde::{Deserialize, Serialize};
use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

/// Shown under the options of `complexity --help`.
pub(super) const HELP: &str = "\
Statistics, each the mean over the views of a frame:
  peak_density      cells above all their neighbours and above the percentile 100-kappa, over all cells
  static_dominance  share of the bins above that percentile that are so in each of the last T frames of the sequence;
                    undefined for its first T-1 frames
  human_saliency    sum of the cells above the percentile 100-tau over the sum of the map
hardness is the mean of their normalised ranks, human_saliency reversed: 0 is the easiest frame, 1 the hardest. stratum is
its third: easy, medium, hard. Columns: frame peak_density static_dominance human_saliency hardness stratum; what is
undefined is empty (null in JSON), and so is everything of a frame that cannot be read.

What was measured is kept in the user's cache folder and measured again where a file has another size or time.

Exit codes: 0 every frame was read; 1 some were not; 2 none was, or the input is bad.

Examples:
  mhp-inspector complexity data/mmvr
      How many frames are easy, medium, hard; and the ten hardest.
  mhp-inspector complexity data/mmvr --csv complexity.csv
      The same, and a row a frame.
  mhp-inspector complexity data/mmvr --shard 2/8 --out shards/2
      Measures the second of eight parts; `mhp-inspector merge shards/* --out whole` ranks all frames.";

/// What `complexity` is told.
#[derive(Debug, Args)]
pub struct ComplexityArgs {
    /// An MMVR tree or any folder inside one, a `*_radar.npz` (its folder), a folder with `dataset.toml`, or an
    /// `.npy`/`.npz` of maps.
    path: PathBuf,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
    /// Write a row a frame.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    cells: CsvArgs,
    /// One JSON array, an object a frame, instead of the summary.
    #[arg(long)]
    json: bool,
    /// κ, %: a bin is strong above the percentile 100 − κ of its map.
    #[arg(long, value_name = "PERCENT", default_value_t = ComplexityOptions::default().kappa_pct)]
    kappa: f64,
    /// T, frames: static is what is strong in the last T frames, the frame itself included.
    #[arg(long, value_name = "FRAMES", default_value_t = ComplexityOptions::default().window)]
    window: usize,
    /// τ, %: the human mask is what lies above the percentile 100 − τ of its map.
    #[arg(long, value_name = "PERCENT", default_value_t = ComplexityOptions::default().tau_pct)]
    tau: f64,
    /// Read every frame, and keep nothing in the cache folder.
    #[arg(long)]
    no_cache: bool,
    #[command(flatten)]
    part: ShardArgs,
}

/// Runs `complexity`.
///
/// # Errors
/// Where an option or the data set is bad, FILE cannot be written, or no frame at all could be read.
pub(super) fn run(args: &ComplexityArgs) -> anyhow::Result<ExitCode> {
    args.cells.apply();
    let options = ComplexityOptions { kappa_pct: args.kappa, window: args.window, tau_pct: args.tau };
    let options = options.validated().map_err(|error| anyhow::anyhow!("--{error}"))?;
    let dataset = Arc::new(open(&args.path, args.manifest.as_deref())?);
    let inputs = inputs(&dataset, &args.path, &[args.manifest.as_deref()]);
    let cache = if args.no_cache { None } else { cache_folder() };
    if let Some((shard, out)) = args.part.asked() {
        let (frames, settings) = (0..dataset.len(), Settings { options, sequences: dataset.sequences() });
        let spec = ShardSpec::new(FrameCommand::Complexity, &dataset, &frames, shard, &settings)?;
        let folder = ShardFolder::begin(out, &[], spec, &inputs)?;
        let frames = shard.stretch(&frames);
        let rows = watched(&dataset, frames.len(), move |dataset, progress| {
            measure(dataset, frames, &options, cache.as_deref(), progress)
        })?;
        folder.finish(&rows)?;
        return Ok(end(shard, out, &rows));
    }
    if let Some(file) = &args.csv {
        inputs.check_file(file)?;
    }
    let complexity = compute(&dataset, options, cache)?;
    let named =
        Named { data_set: &dataset.info().name, sequences: dataset.sequences(), frame: &|i| dataset.frame_name(i) };
    tell(&named, &complexity, args.csv.as_deref(), args.json)
}

/// Runs `merge` on shards of `complexity`: now that all frames are known, they are ranked.
///
/// # Errors
/// Where they are not one whole, or the folder cannot be written.
pub(super) fn merge(args: &MergeArgs) -> anyhow::Result<ExitCode> {
    let Whole { spec, rows, folders } = Whole::<MeasuredFrame>::read(&args.shards)?;
    let Settings { options, sequences } = spec.settings()?;
    let whole = args.begin(&spec, &folders, &[])?;
    let file = whole.file("complexity.csv")?;
    let (names, measured): (Vec<String>, Vec<_>) = rows.into_iter().map(|row| (row.frame, row.measured)).unzip();
    let named = Named { data_set: &spec.data.name, sequences, frame: &|i| names.get(i).map_or("", String::as_str) };
    tell(&named, &ranked(options, measured), Some(&file), args.json)
}

/// What the statistics and their summary depend on, besides the frames.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    sequences: usize,
    options: ComplexityOptions,
}

/// What things are called.
struct Named<'a> {
    data_set: &'a str,
    sequences: usize,
    frame: &'a dyn Fn(usize) -> &'a str,
}

/// Writes the table, prints.
fn tell<'a>(named: &Named<'a>, complexity: &'a Complexity, csv: Option<&Path>, json: bool) -> anyhow::Result<ExitCode> {
    if let Some(file) = csv {
        write_csv(file, named.frame, complexity)?;
    }
    let frames = complexity.frames.len();
    if json {
        print_json(&complexity::json(named.frame, complexity)?)?;
    } else if complexity.counts.failed < frames {
        print(&report::summary(named, complexity))?;
    }
    Ok(tell_failures(complexity))
}

/// Computes beside this thread, which moves the bar.
///
/// # Errors
/// As [`crate::study::complexity::compute`].
pub(super) fn compute(
    dataset: &Arc<Dataset>,
    options: ComplexityOptions,
    cache: Option<PathBuf>,
) -> Result<Complexity, StudyError> {
    watched(dataset, dataset.len(), move |dataset, progress| {
        complexity::compute(dataset, &options, cache.as_deref(), progress)
    })
}

/// Works beside this thread, which moves a bar of so many frames.
fn watched<T: Send + 'static>(
    dataset: &Arc<Dataset>,
    frames: usize,
    work: impl FnOnce(&Dataset, &Progress) -> Result<T, StudyError> + Send + 'static,
) -> Result<T, StudyError> {
    let (sender, done) = bounded(1);
    let wake = move || {
        // The receiver lives until the answer is here.
        let _ = sender.send(());
    };
    let dataset = Arc::clone(dataset);
    let broken = |message| StudyError::Internal { message };
    let mut job = Job::start("complexity", move |progress: &Progress| work(&dataset, progress), broken, wake);
    let bar = progress_bar(frames);
    while let Err(RecvTimeoutError::Timeout) = done.recv_timeout(Duration::from_millis(100)) {
        show(&bar, job.progress());
    }
    bar.finish_and_clear();
    job.poll().unwrap_or_else(|| Err(broken("the computation ended without an answer".into())))
}

fn show(bar: &ProgressBar, progress: &Progress) {
    let state = progress.state();
    bar.set_position(state.done);
    bar.set_message(state.stage);
}

/// On standard error, and only where somebody can see it move.
fn progress_bar(frames: usize) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} frames, {msg}, {elapsed} gone, {eta} to go");
    ProgressBar::new(frames as u64).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// Failures that are told one by one.
const TOLD: usize = 10;

fn tell_failures(complexity: &Complexity) -> ExitCode {
    let (failed, frames) = (complexity.failures.len(), complexity.frames.len());
    if failed == 0 {
        return ExitCode::SUCCESS;
    }
    for (_, why) in complexity.failures.iter().take(TOLD) {
        complain(&format!("warning: {why}"));
    }
    if failed == frames {
        complain(&format!("error: none of {frames} frames could be read"));
        return ExitCode::from(EXIT_BAD_INPUT);
    }
    complain(&format!("warning: {failed} of {frames} frames could not be read"));
    ExitCode::from(EXIT_SOME_FAILED)
}
