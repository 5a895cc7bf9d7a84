//! `fit`: frames of a data set, one after the other or side by side, into a table and parameter files.

mod table;

use super::common::{
    CsvArgs, EraseArg, PeopleArg, PrecisionArg, complain, inputs, open, presets, print, print_json, progress_bar,
    settings,
};
use super::frames::{FrameRange, chosen};
use super::merge::MergeArgs;
use super::shards::{end, typed};
use super::sources::{ReadingArgs, SourceFile};
use super::{EXIT_BAD_INPUT, EXIT_SOME_FAILED};
use crate::condition::{Breakpoint, syntax};
use crate::config::{FitConfig, Preset, listing};
use crate::dataset::Dataset;
use crate::mhp::{ErasedCells, Precision};
use crate::output::{FolderLock, Inputs, replace_file};
use crate::study::shard::{FrameCommand, Shard, ShardFolder, ShardSpec, Whole};
use crate::study::{BatchOptions, BatchRow, Means, Summary, columns, run_batch};
use anyhow::Context as _;
use clap::Args;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use table::Table;

/// Shown under the options of `fit --help`.
pub(super) const HELP: &str = "\
Columns: frame iterations converged reason people annotated loss em bone rigid joint sep coll iou_<array>... majpe_mm \
pa_majpe_mm init_ms fit_ms. What is unknown is empty (null in JSON): the errors in mm where the data set has no joints in \
metres, init_ms where the frame before was the start. Errors are of the smaller of the two numbers of people, paired best; \
their means leave out the frames where another number is annotated than was fitted, and say how many. Persons are in the \
order of their identities through a sequence in the parameter files. A frame that cannot be fitted has the reason `error: ...`, and the run goes on.

Exit codes: 0 every frame was fitted; 1 some were not; 2 none was, or the input is bad.

Examples:
  mhp-inspector fit data/d1s1/000/00383_radar.npz
      One frame of MMVR with the defaults; prints its row.
  mhp-inspector fit data/d1s1 --frames 0..900 --warm-start --out results
      A minute of MMVR, each frame from the one before; writes results/summary.csv, fit.toml, pppr/*.npz.
  mhp-inspector fit data/walk --frames 7 --out results --ply --curves
      Also the Gaussians of the end as pppr/*.ply and every iteration as curves/*.csv.
  mhp-inspector fit data/walk --frames 3 --break 'iou<0.4 iteration>10' --break 'em·kine<-0.9'
      Stops where the masks part, or where the maps and the body want opposite things; the row says which.
  mhp-inspector fit data/walk --frames 3 --erase reflector.json
      As if nothing had been measured in those cells.
  mhp-inspector fit data/walk --init retr.npz --out refined
      Each frame begins at what a network predicted of it, and keeps to it as w_given says.
  mhp-inspector fit data/d1s1 --shard 2/8 --out shards/2
      The second of eight parts, for as many machines; `mhp-inspector merge shards/* --out results` makes the whole.";

/// Shown under them by `fit --help`, and not by `fit -h`: also every setting.
pub(super) fn long_help() -> String {
    format!("{HELP}\n\nConditions of --break. {}\n\n{}", syntax(), listing())
}

/// The settings in force, and the table.
const SETTINGS: &str = "fit.toml";
const SUMMARY: &str = "summary.csv";
/// The folders of parameters and of iterations.
const PARAMS: &str = "pppr";
const CURVES: &str = "curves";

/// What `fit` is told.
#[derive(Debug, Args)]
pub struct FitArgs {
    /// An MMVR tree or any folder inside one, a `*_radar.npz`, a folder with `dataset.toml`, or an `.npy`/`.npz` of maps.
    path: PathBuf,
    /// Frames to fit, counted from 0, as in Rust: 5..12 (12 not included), 5..=11, 5.., ..12, or 7 alone. Default: all,
    /// or the one that PATH names.
    #[arg(long, value_name = "A..B")]
    frames: Option<FrameRange>,
    /// Fit configuration; without it the preset.
    #[arg(long, value_name = "FIT.toml", conflicts_with = "preset")]
    config: Option<PathBuf>,
    /// Settings with a name.
    #[arg(long, value_name = "NAME", default_value = Preset::default().name(), value_parser = presets())]
    preset: Preset,
    #[command(flatten)]
    people: PeopleArg,
    /// Adam steps of a frame, instead of the configuration's.
    #[arg(long, value_name = "N")]
    iterations: Option<usize>,
    /// Scalar of the per-cell kernel.
    #[arg(long, value_enum, default_value = "f32")]
    precision: PrecisionArg,
    /// Folder for summary.csv, fit.toml (the settings in force) and pppr/NAME.npz (the parameters of each frame, `_` for
    /// `/` in its name, and a digest where that is no file's name or another frame's). Without it nothing is written.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// With --out, also pppr/NAME.ply: the Gaussians for viewers of 3-D Gaussian splats, with velocity, person and joint.
    #[arg(long, requires = "out")]
    ply: bool,
    /// With --out, also curves/NAME.csv: loss, terms, IoU and joint error of every iteration.
    #[arg(long, requires = "out")]
    curves: bool,
    /// Do only part i of n, counted from 1, into the folder --out; `auto` inside a Slurm job array. `merge` makes the whole of all.
    #[arg(long, value_name = "i/n", value_parser = typed, requires = "out", conflicts_with = "json")]
    shard: Option<Shard>,
    #[command(flatten)]
    cells: CsvArgs,
    /// Start each frame from the result of the one before in its sequence; one frame at a time then.
    #[arg(long)]
    warm_start: bool,
    /// Stop a fit at the first iteration at which this holds; may be given several times.
    #[arg(long = "break", value_name = "CONDITION")]
    breakpoints: Vec<Breakpoint>,
    /// Start each frame where its people are predicted, instead of at its own peaks: "refine this prediction by the radar". A file of
    /// joints (npz, npy, CSV, JSON, Parquet) or the PPPR of an earlier run; `predictions --help` tells more.
    #[arg(long, value_name = "FILE", conflicts_with = "warm_start")]
    init: Option<PathBuf>,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    erase: EraseArg,
    /// One JSON object instead of a table: `frames` with the keys of the columns, and `mean`.
    #[arg(long)]
    json: bool,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

/// Runs `fit`.
///
/// # Errors
/// Where the configuration, the data set or the range of frames is bad, DIR cannot be written, or no frame at all could
/// be fitted.
pub(super) fn run(args: &FitArgs) -> anyhow::Result<ExitCode> {
    args.cells.apply();
    let config = args.people.of(&settings(args.config.as_deref(), args.preset, args.iterations)?);
    let dataset = open(&args.path, args.manifest.as_deref())?;
    let frames = chosen(args.frames, &args.path, &dataset)?;
    let arrays: Vec<String> = dataset.info().views.iter().map(|view| view.array.clone()).collect();
    let inputs = inputs(
        &dataset,
        &args.path,
        &[args.config.as_deref(), args.manifest.as_deref(), args.erase.file(), args.init.as_deref()],
    );
    let init = args.init.as_ref().map(|path| {
        let source = args.reading.open(&SourceFile { name: None, colour: None, path: path.clone() }, &dataset)?;
        source.notes.iter().for_each(|note| complain(&format!("note: {}: {note}", path.display())));
        anyhow::Ok(Arc::new(source))
    });
    let options = BatchOptions {
        init: init.transpose()?,
        config,
        precision: args.precision.into(),
        warm_start: args.warm_start,
        params_folder: args.out.as_ref().map(|out| out.join(PARAMS)),
        ply: args.ply,
        curves_folder: args.out.as_ref().filter(|_| args.curves).map(|out| out.join(CURVES)),
        breakpoints: args.breakpoints.clone(),
        erased: args.erase.read(&dataset)?,
    };
    let names: Vec<&str> = arrays.iter().map(String::as_str).collect();
    for breakpoint in &args.breakpoints {
        let known = breakpoint.check(&dataset.info().skeleton, &names);
        known.map_err(|why| anyhow::anyhow!("--break {breakpoint}: {why}"))?;
    }
    if let (Some(shard), Some(out)) = (args.shard, &args.out) {
        return part(shard, out, &dataset, &frames, &options, &inputs);
    }
    let prepared = args.out.as_deref().map(|out| prepare(out, &dataset, &options, &arrays, &inputs)).transpose()?;
    let (_lock, mut summary) = prepared.unzip();
    let bar = progress_bar(frames.len());
    let mut report = Report::new(arrays, args.json);
    let frames: Vec<usize> = frames.collect();
    let done = run_batch(&dataset, &frames, &options, |row| {
        bar.inc(1);
        summary.as_mut().map_or(Ok(()), |summary| summary.add(&row))?;
        report.add(row);
        Ok(())
    });
    bar.finish_and_clear();
    let closed = summary.map_or(Ok(()), Summary::finish);
    done.and(closed)?;
    report.tell()
}

/// Fits a part of `frames` into the folder of a shard; whole sequences of them with a warm start, or for several people.
fn part(
    shard: Shard,
    out: &Path,
    dataset: &Dataset,
    frames: &Range<usize>,
    options: &BatchOptions,
    inputs: &Inputs<'_>,
) -> anyhow::Result<ExitCode> {
    let settings = Settings {
        precision: options.precision,
        warm_start: options.warm_start,
        ply: options.ply,
        curves: options.curves_folder.is_some(),
        fit: options.config,
        breakpoints: options.breakpoints.iter().map(ToString::to_string).collect(),
        erased: options.erased.clone(),
        init: options.init.as_ref().map(|source| source.digest()),
    };
    let spec = ShardSpec::new(FrameCommand::Fit, dataset, frames, shard, &settings)?;
    let folder = ShardFolder::begin(out, shelves(settings.curves), spec, inputs)?;
    write_settings(out, dataset, options, inputs)?;
    // Who is who goes on through a sequence, as a warm start does.
    let whole = options.warm_start || options.config.people != 1;
    let mine = if whole { shard.sequences(dataset, frames) } else { shard.stretch(frames) };
    let bar = progress_bar(mine.len());
    let mut rows = Vec::with_capacity(mine.len());
    let mine: Vec<usize> = mine.collect();
    let done = run_batch(dataset, &mine, options, |row| {
        bar.inc(1);
        rows.push(row);
        Ok(())
    });
    bar.finish_and_clear();
    done?;
    folder.finish(&rows)?;
    Ok(end(shard, out, &rows))
}

/// Runs `merge` on shards of `fit`.
///
/// # Errors
/// Where they are not one whole, or the folder cannot be written.
pub(super) fn merge(args: &MergeArgs) -> anyhow::Result<ExitCode> {
    let Whole { spec, rows, folders } = Whole::<BatchRow>::read(&args.shards)?;
    let settings: Settings = spec.settings()?;
    let whole = args.begin(&spec, &folders, shelves(settings.curves))?;
    whole.copy_one(SETTINGS)?;
    shelves(settings.curves).iter().try_for_each(|shelf| whole.copy_all(shelf))?;
    let mut summary = Summary::create(&whole.file(SUMMARY)?, &spec.data.arrays)?;
    let mut report = Report::new(spec.data.arrays, args.json);
    for row in rows {
        summary.add(&row)?;
        report.add(row);
    }
    summary.finish()?;
    report.tell()
}

/// What the fits and their files depend on, besides the frames.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    precision: Precision,
    warm_start: bool,
    ply: bool,
    curves: bool,
    fit: FitConfig,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    breakpoints: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    erased: Vec<ErasedCells>,
    /// Tells the predictions that frames start from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    init: Option<String>,
}

/// The folders below that of the results.
fn shelves(curves: bool) -> &'static [&'static str] {
    if curves { &[PARAMS, CURVES] } else { &[PARAMS] }
}

/// Makes and holds the folders, writes the settings, and begins the table: what cannot be written is told before anything is
/// fitted.
fn prepare(
    out: &Path,
    dataset: &Dataset,
    options: &BatchOptions,
    arrays: &[String],
    inputs: &Inputs<'_>,
) -> anyhow::Result<(FolderLock, Summary)> {
    let lock = FolderLock::claim(out, shelves(options.curves_folder.is_some()), inputs)?;
    let table = out.join(SUMMARY);
    inputs.check_replaced(&table)?;
    write_settings(out, dataset, options, inputs)?;
    Ok((lock, Summary::create(&table, arrays)?))
}

/// Writes the settings in force.
fn write_settings(out: &Path, dataset: &Dataset, options: &BatchOptions, inputs: &Inputs<'_>) -> anyhow::Result<()> {
    let settings = out.join(SETTINGS);
    inputs.check_replaced(&settings)?;
    let precision = match options.precision {
        Precision::F64 => "f64",
        Precision::F32 => "f32",
    };
    let head = format!(
        "# mhp-inspector {} fit of {}\n# precision {precision}, {}\n",
        env!("CARGO_PKG_VERSION"),
        dataset.info().root.display().to_string().escape_debug(),
        match &options.init {
            Some(source) => format!("every frame from {}", source.path.display().to_string().escape_debug()),
            None if options.warm_start => "warm start".into(),
            None => "every frame from its own peaks".into(),
        },
    );
    let text = head + &options.config.to_toml();
    let written = replace_file(&settings, |out| out.write_all(text.as_bytes()));
    written.with_context(|| format!("{}: cannot be written", settings.display()))
}

/// What is printed at the end.
struct Report {
    columns: Vec<String>,
    means: Means,
    first_error: Option<String>,
    table: Table,
    /// One object a row, where JSON was asked for.
    json: Option<Vec<Value>>,
}

impl Report {
    fn new(arrays: Vec<String>, json: bool) -> Self {
        Self {
            columns: columns(&arrays),
            means: Means::new(arrays.len()),
            first_error: None,
            table: Table::new(arrays),
            json: json.then(Vec::new),
        }
    }

    fn add(&mut self, row: BatchRow) {
        self.means.add(&row);
        if let (None, Err(why)) = (&self.first_error, &row.fit) {
            self.first_error = Some(why.clone());
        }
        match &mut self.json {
            Some(rows) => rows.push(row.json(&self.columns)),
            None => self.table.add(row),
        }
    }

    fn tell(self) -> anyhow::Result<ExitCode> {
        let (frames, failed) = (self.means.frames, self.means.failed);
        let nothing = failed == frames;
        if let Some(rows) = self.json {
            let object = json!({ "frames": rows, "mean": self.means.json(&self.columns) });
            print_json(&(serde_json::to_string_pretty(&object).context("writing JSON")? + "\n"))?;
        } else if !nothing {
            print(&self.table.text(&self.means))?;
        }
        let Some(why) = self.first_error else { return Ok(ExitCode::SUCCESS) };
        match frames {
            1 => complain(&format!("error: {why}")),
            _ if nothing => complain(&format!("error: none of {frames} frames could be fitted; the first: {why}")),
            _ => complain(&format!("warning: {failed} of {frames} frames could not be fitted; the first: {why}")),
        }
        Ok(ExitCode::from(if nothing { EXIT_BAD_INPUT } else { EXIT_SOME_FAILED }))
    }
}
