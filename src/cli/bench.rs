//! `bench`: what an iteration, a simulation and a whole frame cost here.

use super::common::{PrecisionArg, open, presets, print, print_json};
use crate::body::Pppr;
use crate::config::{EmRegion, FitConfig, Preset};
use crate::dataset::{Dataset, read_pppr};
use crate::mhp::{Fitter, Precision, Problem, simd_path, simulate};
use crate::start::{find_start, problem_of};
use anyhow::Context as _;
use clap::{Args, ValueEnum};
use rayon::prelude::*;
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// Iterations of a whole frame where no preset says how many: as in the paper's timing.
const FRAME_ITERATIONS: usize = 80;
/// Iterations that are not timed: buffers grow, caches warm.
const WARM_UP: usize = 60;
/// How often initialisation, simulation and a whole frame are repeated; the fastest counts.
const REPEATS: usize = 5;
/// How long the batch runs at least.
const BATCH: Duration = Duration::from_secs(1);

/// Shown under the options of `bench --help`.
pub(super) const HELP: &str = "\
Exit codes: 0 measured; 2 bad input.

The fit starts from --params, or from the data set's own params.npz beside its manifest, or from the frame's peaks. The
configuration is the --preset, or a fit.toml beside the manifest, or has every field at its own default (one Adam fit of
masks, as the paper has it, without a search). Times are of one thread, except frames_per_s; frame_ms and frames_per_s are of a
start and the preset's iterations (80 without one) as a batch fits, with nothing known of the maps before.

Examples:
  mhp-inspector bench --dataset case
      An iteration in the EM region, in single precision.
  mhp-inspector bench --dataset samples/walk --preset recommended --threads 1
      A window of five frames with all its starts.
  mhp-inspector bench --dataset case --region full --iterations 500 --json
      On whole maps; one JSON object.";

/// Where the objective is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum RegionArg {
    /// As the configuration says.
    Region,
    /// Whole maps.
    Full,
}

/// What `bench` is told.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// An MMVR tree or any folder inside one, a folder with `dataset.toml`, or an `.npy`/`.npz` of maps.
    #[arg(long, value_name = "DIR")]
    dataset: PathBuf,
    /// PPPR npz to start from.
    #[arg(long, value_name = "P.npz")]
    params: Option<PathBuf>,
    /// A setting by name instead of a fit.toml.
    #[arg(long, value_name = "NAME", value_parser = presets())]
    preset: Option<Preset>,
    /// Iterations that are timed.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..))]
    iterations: u32,
    /// Scalar of the per-cell kernel.
    #[arg(long, value_enum, default_value = "f32")]
    precision: PrecisionArg,
    /// Cells that are compared.
    #[arg(long, value_enum, default_value = "region")]
    region: RegionArg,
    /// Threads of the batch.
    #[arg(long, value_name = "T", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    threads: u16,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// What the program's allocator knows; the binary has one that counts.
#[derive(Debug, Clone, Copy)]
pub struct Meter {
    /// Bytes allocated since the start, whatever became of them.
    pub total_bytes: fn() -> usize,
    /// The most that was held at one time.
    pub peak_bytes: fn() -> usize,
}

static METER: OnceLock<Meter> = OnceLock::new();

/// Tells `bench` where bytes are counted; only the first call counts.
pub fn count_bytes_with(meter: Meter) {
    METER.get_or_init(|| meter);
}

#[derive(Serialize)]
struct Figures {
    us_per_iteration_min: f64,
    us_per_iteration_median: f64,
    init_ms: Option<f64>,
    simulate_ms: f64,
    frame_ms: Option<f64>,
    frames_per_s: Option<f64>,
    bytes_per_iteration: Option<f64>,
    peak_bytes: Option<usize>,
    simd: &'static str,
    precision: Precision,
    cells: Vec<usize>,
    joints: usize,
    threads: u16,
}

/// Runs `bench`.
///
/// # Errors
/// Where the data set, parameters or configuration cannot be read or do not fit each other, or the fit diverges.
pub(super) fn run(args: &BenchArgs) -> anyhow::Result<ExitCode> {
    let figures = measure(args)?;
    if args.json {
        print_json(&format!("{}\n", serde_json::to_string(&figures)?))?;
    } else {
        let table = serde_json::to_value(&figures)?;
        let rows = table.as_object().into_iter().flatten().map(|(key, value)| format!("{key:<24} {value}\n"));
        print(&rows.collect::<String>())?;
    }
    Ok(ExitCode::SUCCESS)
}

fn measure(args: &BenchArgs) -> anyhow::Result<Figures> {
    let dataset = open(&args.dataset, None)?;
    let beside = |name: &str| Some(args.dataset.join(name)).filter(|path| path.is_file());
    let mut config = match (args.preset, beside("fit.toml")) {
        (Some(preset), _) => preset.config(),
        (None, Some(path)) => FitConfig::from_file(&path)?,
        (None, None) => FitConfig::default(),
    };
    if args.region == RegionArg::Full {
        config.em_region = EmRegion::Full;
    }
    let precision = Precision::from(args.precision);
    let problem = problem(&dataset, 0)?;
    // A start that cannot be found from the maps leaves its figures empty.
    // A problem keeps what was worked out of its maps, and shares what its axes decide with the other frames of the data set:
    // each repetition takes one of which nothing is known.
    let fresh = || {
        let mut problem = Arc::unwrap_or_clone(self::problem(&dataset, 0)?);
        problem.views = problem.views.to_vec().into();
        Ok(Arc::new(problem))
    };
    let init_ms = fastest_ms(fresh, |problem| find_start(&problem, &config).is_ok())?;
    let initial = match args.params.clone().or_else(|| beside("params.npz")) {
        Some(path) => read_pppr(&path, None)?,
        None => find_start(&problem, &config)?.initialisation.params,
    };
    let mut fitter = Fitter::new(Arc::clone(&problem), config, precision, initial.clone())?;
    for _ in 0..WARM_UP {
        fitter.step()?;
    }
    let mut times_us = Vec::with_capacity(args.iterations as usize);
    let before = METER.get().map(|meter| (meter.total_bytes)());
    for _ in 0..args.iterations {
        let began = Instant::now();
        fitter.step()?;
        times_us.push(began.elapsed().as_secs_f64() * 1e6);
    }
    let after = METER.get().map(|meter| (meter.total_bytes)());
    times_us.sort_by(f64::total_cmp);
    let bytes = before.zip(after).map(|(before, after)| (after - before) as f64 / f64::from(args.iterations));
    let simulate_ms = fastest_ms(fresh, |problem| !simulate(&problem, &config, precision, &initial).is_empty())?;
    let iterations = args.preset.map_or(FRAME_ITERATIONS, |preset| preset.config().iterations);
    let fit = |problem: &Arc<Problem>| whole_frame(problem, &config, precision, iterations).is_some();
    let frame_ms = fastest_ms(fresh, |problem| fit(&problem))?;
    let frames_per_s = frame_ms.map(|_| batch(args, &dataset, fit)).transpose()?;
    Ok(Figures {
        us_per_iteration_min: tenths(times_us[0]),
        us_per_iteration_median: tenths(times_us[times_us.len() / 2]),
        init_ms,
        simulate_ms: simulate_ms.unwrap_or(f64::NAN),
        frame_ms,
        frames_per_s,
        bytes_per_iteration: bytes,
        peak_bytes: METER.get().map(|meter| (meter.peak_bytes)()),
        simd: simd_path(),
        precision,
        cells: fitter.objective().regions().iter().map(crate::mhp::Region::cells).collect(),
        joints: initial.shape().total_joints(),
        threads: args.threads,
    })
}

fn problem(dataset: &Dataset, index: usize) -> anyhow::Result<Arc<Problem>> {
    let frame = dataset.load(index)?;
    let problem = problem_of(dataset, &frame).with_context(|| dataset.frame_path(index).display().to_string())?;
    Ok(Arc::new(problem))
}

/// Start and the iterations of a fit that nobody watches, as a batch fits; `None` where there is no start or it diverges.
fn whole_frame(problem: &Arc<Problem>, config: &FitConfig, precision: Precision, iterations: usize) -> Option<Pppr> {
    let initial = find_start(problem, config).ok()?.initialisation.params;
    let mut fitter = Fitter::new(Arc::clone(problem), *config, precision, initial).ok()?;
    fitter.run_unseen(iterations, |_| false).ok()?;
    Some(fitter.params().clone())
}

/// Frames a second with loading and all that `fit` does, all threads busy.
fn batch(args: &BenchArgs, dataset: &Dataset, fit: impl Fn(&Arc<Problem>) -> bool + Sync) -> anyhow::Result<f64> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(args.threads)).build()?;
    let round = usize::from(args.threads) * 16;
    let (began, mut done) = (Instant::now(), 0);
    while began.elapsed() < BATCH {
        let frames = done..done + round;
        let one = |index: usize| problem(dataset, index % dataset.len()).map(|problem| fit(&problem));
        pool.install(|| frames.into_par_iter().try_for_each(|index| one(index).map(drop)))?;
        done += round;
    }
    Ok(tenths(done as f64 / began.elapsed().as_secs_f64()))
}

/// The fastest of some repetitions, each of what `fresh` makes untimed, ms; `None` where `work` says that it failed.
fn fastest_ms<T>(fresh: impl Fn() -> anyhow::Result<T>, work: impl Fn(T) -> bool) -> anyhow::Result<Option<f64>> {
    let mut fastest = f64::INFINITY;
    for _ in 0..REPEATS {
        let input = fresh()?;
        let began = Instant::now();
        if !work(input) {
            return Ok(None);
        }
        fastest = fastest.min(began.elapsed().as_secs_f64() * 1e3);
    }
    Ok(Some((fastest * 1e3).round() / 1e3))
}

fn tenths(x: f64) -> f64 {
    (x * 10.0).round() / 10.0
}
