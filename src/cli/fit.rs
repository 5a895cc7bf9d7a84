//! `fit`: frames of a data set, one after the other or side by side, into a table and parameter files.

mod table;

use super::common::{
    CsvArgs, PrecisionArg, complain, inputs, open, presets, print, print_json, progress_bar, settings,
};
use super::frames::{FrameRange, chosen};
use super::{EXIT_BAD_INPUT, EXIT_SOME_FAILED};
use crate::config::{FitConfig, Preset, listing};
use crate::dataset::Dataset;
use crate::output::{FolderLock, replace_file};
use crate::study::{BatchOptions, BatchRow, Means, Summary, columns, run_batch};
use anyhow::Context as _;
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use table::Table;

/// Shown under the options of `fit --help`.
pub(super) const HELP: &str = "\
Columns: frame iterations converged reason people annotated loss em bone rigid joint sep coll iou_<array>... majpe_mm \
pa_majpe_mm init_ms fit_ms. What is unknown is empty (null in JSON): the errors in mm where the data set has no joints in \
metres, init_ms where the frame before was the start. Errors are of the smaller of the two numbers of people, paired best; \
their means leave out the frames where another number is annotated than was fitted, and say how many. A frame that cannot be fitted has the reason `error: ...`, and the run goes on.

Exit codes: 0 every frame was fitted; 1 some were not; 2 none was, or the input is bad.

Examples:
  mhp-inspector fit data/d1s1/000/00383_radar.npz
      One frame of MMVR with the defaults; prints its row.
  mhp-inspector fit data/d1s1 --frames 0..900 --warm-start --out results
      A minute of MMVR, each frame from the one before; writes results/summary.csv, fit.toml, pppr/*.npz.
  mhp-inspector fit data/walk --frames 7 --out results --ply --curves
      Also the Gaussians of the end as pppr/*.ply and every iteration as curves/*.csv.";

/// Shown under them by `fit --help`, and not by `fit -h`: also every setting.
pub(super) fn long_help() -> String {
    format!("{HELP}\n\n{}", listing())
}

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
    #[arg(long, value_name = "NAME", default_value = "default", value_parser = presets())]
    preset: Preset,
    /// Persons that are fitted at once, instead of the configuration's; 0 fits as many as are counted.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=8))]
    people: Option<u8>,
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
    #[command(flatten)]
    cells: CsvArgs,
    /// Start each frame from the result of the one before in its sequence; one frame at a time then.
    #[arg(long)]
    warm_start: bool,
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
    let mut config = settings(args.config.as_deref(), args.preset, args.iterations)?;
    config.people = args.people.map_or(config.people, usize::from);
    let dataset = open(&args.path, args.manifest.as_deref())?;
    let frames = chosen(args.frames, &args.path, &dataset)?;
    let arrays: Vec<String> = dataset.info().views.iter().map(|view| view.array.clone()).collect();
    let prepared = args.out.as_deref().map(|out| prepare(out, args, &dataset, &config, &arrays)).transpose()?;
    let (_lock, mut summary) = prepared.unzip();
    let options = BatchOptions {
        config,
        precision: args.precision.into(),
        warm_start: args.warm_start,
        params_folder: args.out.as_ref().map(|out| out.join(PARAMS)),
        ply: args.ply,
        curves_folder: args.out.as_ref().filter(|_| args.curves).map(|out| out.join(CURVES)),
    };
    let bar = progress_bar(frames.len());
    let mut report = Report::new(arrays, args.json);
    let done = run_batch(&dataset, frames, &options, |row| {
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

/// Makes and holds the folders, writes the settings, and begins the table: what cannot be written is told before anything is
/// fitted.
fn prepare(
    out: &Path,
    args: &FitArgs,
    dataset: &Dataset,
    config: &FitConfig,
    arrays: &[String],
) -> anyhow::Result<(FolderLock, Summary)> {
    let inputs = inputs(dataset, &args.path, &[args.config.as_deref(), args.manifest.as_deref()]);
    let below = if args.curves { &[PARAMS, CURVES][..] } else { &[PARAMS] };
    let lock = FolderLock::claim(out, below, &inputs)?;
    let [settings, table] = ["fit.toml", "summary.csv"].map(|name| out.join(name));
    [&settings, &table].into_iter().try_for_each(|file| inputs.check_replaced(file))?;
    let precision = match args.precision {
        PrecisionArg::F64 => "f64",
        PrecisionArg::F32 => "f32",
    };
    let head = format!(
        "# mhp-inspector {} fit of {}\n# precision {precision}, {}\n",
        env!("CARGO_PKG_VERSION"),
        dataset.info().root.display().to_string().escape_debug(),
        if args.warm_start { "warm start" } else { "every frame from its own peaks" },
    );
    let text = head + &config.to_toml();
    let written = replace_file(&settings, |out| out.write_all(text.as_bytes()));
    written.with_context(|| format!("{}: cannot be written", settings.display()))?;
    Ok((lock, Summary::create(&table, arrays)?))
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
