//! One study: arguments to a plan, the plan to a run, the run to its table.

use crate::cli::common::{CsvArgs, EraseArg, PrecisionArg, complain, inputs, open, presets, print, print_json};
use crate::cli::complexity::compute;
use crate::cli::frames::{FrameRange, chosen_set};
use crate::cli::labels::acts_of;
use crate::cli::shards::typed;
use crate::cli::{EXIT_BAD_INPUT, EXIT_SOME_FAILED};
use crate::config::{FitConfig, Preset};
use crate::dataset::Dataset;
use crate::study::complexity::{ComplexityOptions, cache_folder};
use crate::study::run::{GridAxis, Run, RunFolder, RunPlan, RunRequest, StudyKind, check_run_folder, execute_run};
use crate::study::shard::{FrameRanges, Shard, Subset};
use crate::study::verification::taken_out;
use crate::task::Progress;
use clap::Args;
use crossbeam_channel::{RecvTimeoutError, bounded};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How often progress is told where nobody watches a bar.
const TOLD_EVERY: Duration = Duration::from_secs(30);

/// What every study is told.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// An MMVR tree or any folder inside one, a `*_radar.npz`, a folder with `dataset.toml`, or an `.npy`/`.npz` of maps.
    path: PathBuf,
    /// The run folder. Where it holds the same run, what is done is not done again.
    #[arg(long, value_name = "RUN")]
    out: PathBuf,
    /// Frames to study, counted from 0, as in Rust: 5..12 (12 not included), 5..=11, 5.., ..12, or 7 alone; several with
    /// commas between: 0..5,7,9..12. Default: all.
    #[arg(long, value_name = "A..B,…", value_delimiter = ',')]
    frames: Vec<FrameRange>,
    /// Leave out the frames of which a reviewer says that annotation, count or both are wrong (paper A.3: N_verified).
    #[arg(long)]
    verified: bool,
    /// The settings that the study varies.
    #[arg(long, value_name = "NAME", default_value = Preset::default().name(), value_parser = presets())]
    preset: Preset,
    /// A fit configuration instead of a preset; keys that it lacks are those of `baseline`.
    #[arg(long, value_name = "FIT.toml", conflicts_with = "preset")]
    config: Option<PathBuf>,
    /// Adam steps of every fit, instead of the study's own.
    #[arg(long, value_name = "N")]
    iterations: Option<usize>,
    /// Scalar of the per-cell kernel. Double precision is the oracle, seventy times as slow.
    #[arg(long, value_enum, default_value = "f32")]
    precision: PrecisionArg,
    /// Seed of the perturbations, instead of the configuration's.
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Do only part i of n, counted from 1; `auto` inside a Slurm job array. `merge` makes one run of all.
    #[arg(long, value_name = "i/n", value_parser = typed)]
    shard: Option<Shard>,
    /// Threads; default: one for each core. The result is the same with any number.
    #[arg(long, value_name = "N")]
    threads: Option<std::num::NonZeroUsize>,
    #[command(flatten)]
    erase: EraseArg,
    #[command(flatten)]
    cells: CsvArgs,
    /// Print the table as JSON instead of Markdown.
    #[arg(long)]
    json: bool,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

/// What a study on the hard frames is told.
#[derive(Debug, Args)]
pub struct HardArgs {
    /// What every study is told.
    #[command(flatten)]
    pub(super) run: RunArgs,
    /// All frames, not the hard ones only.
    #[arg(long)]
    pub(super) all: bool,
}

/// What a sweep is told.
#[derive(Debug, Args)]
pub struct SweepArgs {
    /// What every study is told.
    #[command(flatten)]
    pub(super) run: RunArgs,
    /// A key of FIT.toml (`table.key` inside a table) and its values; again for each further axis.
    #[arg(long, required = true, value_name = "KEY=V,V")]
    pub(super) grid: Vec<GridAxis>,
}

/// Runs a study. `all` is given where it is of the hard frames unless all are asked for.
///
/// # Errors
/// Where an argument, the data set or the folder is bad, or no row could be fitted.
pub(super) fn run(kind: StudyKind, args: &RunArgs, all: Option<bool>, grid: &[GridAxis]) -> anyhow::Result<ExitCode> {
    args.cells.apply();
    let (base, base_name) = base(args)?;
    let dataset = Arc::new(open(&args.path, args.manifest.as_deref())?);
    let named = [args.config.as_deref(), args.manifest.as_deref(), args.erase.file()];
    check_run_folder(&args.out, &inputs(&dataset, &args.path, &named))?;
    let request = RunRequest {
        study: kind,
        base,
        base_name,
        precision: args.precision.into(),
        frames: frames(args, &dataset)?,
        subset: if all == Some(false) { Subset::Hard } else { Subset::All },
        grid: grid.to_vec(),
        iterations: args.iterations,
        shard: args.shard,
        erased: args.erase.read(&dataset)?.into(),
    };
    let complexity = RunPlan::needs_strata(&request)
        .then(|| compute(&dataset, ComplexityOptions::default(), cache_folder()))
        .transpose()?;
    let plan = RunPlan::new(&dataset, &request, complexity.as_ref())?;
    tell(&execute(&dataset, plan, args)?, args.json)
}

/// The frames that are asked for, without those that a verdict takes out where that is asked for, too.
fn frames(args: &RunArgs, dataset: &Dataset) -> anyhow::Result<FrameRanges> {
    let asked = chosen_set(&args.frames, &args.path, dataset)?;
    if !args.verified {
        return Ok(asked);
    }
    let acts = acts_of(dataset)?;
    let out = taken_out(&acts);
    let kept = FrameRanges::of_frames(asked.iter().filter(|&frame| !out.contains(dataset.frame_name(frame))));
    let retention = 100.0 * kept.len() as f64 / asked.len().max(1) as f64;
    let left_out = asked.len() - kept.len();
    complain(&format!(
        "note: {left_out} of {} frames are left out by a verdict: retention {retention:.1} %",
        asked.len()
    ));
    Ok(kept)
}

/// The settings that the study varies, and their name.
fn base(args: &RunArgs) -> anyhow::Result<(FitConfig, String)> {
    let (mut config, name) = match &args.config {
        Some(file) => (FitConfig::from_file(file)?, "configuration file".to_owned()),
        None => (args.preset.config(), args.preset.name().to_owned()),
    };
    if let Some(seed) = args.seed {
        config.init.seed = seed;
    }
    if let Some(iterations) = args.iterations {
        config.iterations = iterations;
    }
    Ok((config.validated()?, name))
}

/// Works beside this thread, which tells how far it is.
fn execute(dataset: &Arc<Dataset>, plan: RunPlan, args: &RunArgs) -> anyhow::Result<Run> {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    let threads = args.threads.map_or_else(cores, usize::from);
    let (progress, folder, dataset) = (Progress::new(), args.out.clone(), Arc::clone(dataset));
    let (sender, answer) = bounded(1);
    let told = progress.clone();
    let work = move || {
        let done = execute_run(&dataset, &plan, &RunFolder::of_data(&folder, &dataset), threads, &told, None);
        // The receiver lives until the answer is here.
        let _ = sender.send(done);
    };
    let worker = std::thread::Builder::new().name("study".into()).spawn(work)?;
    let done = watch(&progress, &answer);
    if worker.join().is_err() {
        anyhow::bail!("internal error: the study ended without an answer");
    }
    Ok(done.ok_or_else(|| anyhow::anyhow!("internal error: the study ended without an answer"))??)
}

/// A bar where somebody can see it move, else a line now and then.
fn watch<T>(progress: &Progress, answer: &crossbeam_channel::Receiver<T>) -> Option<T> {
    let visible = std::io::stderr().is_terminal();
    let bar = if visible { ProgressBar::new(0) } else { ProgressBar::hidden() };
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} fits, {elapsed} gone, {eta} to go");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let (mut began, mut told): (Option<(Instant, u64)>, Instant) = (None, Instant::now());
    loop {
        match answer.recv_timeout(Duration::from_millis(100)) {
            Ok(answer) => {
                bar.finish_and_clear();
                return Some(answer);
            }
            Err(RecvTimeoutError::Disconnected) => return None,
            Err(RecvTimeoutError::Timeout) => {}
        }
        let state = progress.state();
        if state.total == 0 {
            continue;
        }
        // What an earlier process did says nothing of the speed of this one.
        let (since, first) = *began.get_or_insert_with(|| {
            bar.set_length(state.total);
            bar.set_position(state.done);
            bar.reset_eta();
            (Instant::now(), state.done)
        });
        bar.set_position(state.done);
        if !visible && told.elapsed() >= TOLD_EVERY {
            told = Instant::now();
            let here = state.done.saturating_sub(first).max(1) as f64;
            let left = state.total.saturating_sub(state.done) as f64 * since.elapsed().as_secs_f64() / here;
            complain(&format!("{} of {} fits, about {left:.0} s to go", state.done, state.total));
        }
    }
}

/// Prints the table, and says what could not be fitted.
///
/// # Errors
/// Where nothing can be printed.
pub(super) fn tell(run: &Run, json: bool) -> anyhow::Result<ExitCode> {
    let rows: Vec<_> = run.rows.iter().filter(|row| !row.passing).collect();
    let failed: Vec<_> = rows.iter().filter_map(|row| row.fit.as_ref().err()).collect();
    if json {
        print_json(&run.json())?;
    } else if failed.len() < rows.len() || rows.is_empty() {
        print(&run.markdown())?;
    }
    let Some(why) = failed.first() else { return Ok(ExitCode::SUCCESS) };
    if failed.len() == rows.len() {
        complain(&format!("error: none of {} fits worked; the first: {why}", rows.len()));
        return Ok(ExitCode::from(EXIT_BAD_INPUT));
    }
    complain(&format!("warning: {} of {} fits did not work; the first: {why}", failed.len(), rows.len()));
    Ok(ExitCode::from(EXIT_SOME_FAILED))
}
