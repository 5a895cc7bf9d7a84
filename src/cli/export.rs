//! `export`: what other programs read: parameters, simulated maps in the input's own files, point clouds.

mod frame;

use super::common::{PrecisionArg, complain, inputs, open, print, progress_bar};
use super::frames::{FrameRange, chosen};
use super::{EXIT_BAD_INPUT, EXIT_SOME_FAILED};
use crate::config::{FitConfig, Preset};
use crate::dataset::Dataset;
use crate::escape::one_line;
use crate::output::{FileNames, FolderLock, Inputs};
use crate::representation::HeatmapScale;
use crate::study::HeatmapExport;
use anyhow::Context as _;
use clap::{Args, ValueEnum};
use frame::Exported;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Shown under the options of `export --help`.
pub(super) const HELP: &str = "\
pppr     DIR/pppr/NAME.npz: position, log_scale, rotation, velocity, beta, omega, float64; NAME with `_` for `/`, and with a
         digest behind it where that is no file's name or another frame's.
heatmap  DIR/heatmap/...: the simulated map in the place of the measured one, in files of the same names, keys, shapes, dtypes,
         byte and memory order; what else is in a file, and labels beside it, are copied. A model made for the data set reads
         the folder unchanged. Of a stacked file (frames along the first axis) the chosen frames are written; XRF55's stacks
         are written whole. In HuPR's complex cubes the amplitude of elevation bin 3, which is the map, becomes the simulated one;
         phases stay, and the other bins keep their ratio to it up to 1. dataset.toml comes last: a folder that lacks the
         data set's is not complete. Frames from outside the data set's folder come into heatmap/frames.
pc       DIR/pc/NAME.npz, .ply, .pcd: points where a detector finds something in the simulated map: x, y, z (m), v_r (m/s,
         positive moving away), intensity, view.

Scale of maps and intensities: `match` multiplies each view of a frame by one number, so that the mean over the mask of the
simulated map is that of the measured one over its own, and lets nothing fall below the smallest measured value; `none` writes
H_sim as the forward model gives it.

DIR must not lie in the data set, unless --into-data is given; what is read is never replaced.

Exit codes: 0 every frame was exported; 1 some were not; 2 none was, or the input is bad.

Examples:
  mhp-inspector export data/mmvr --out enhanced --what heatmap
      Fits every frame and writes enhanced/heatmap as a tree like data/mmvr.
  mhp-inspector export data/walk --out take-home --params results/pppr --frames 0..10
      All three, from the parameters that `fit --out results` wrote.
  mhp-inspector export data/walk --out clouds --what pc --format pcd,ply --preset recommended
      Point clouds for two kinds of reader.";

/// The folders in DIR.
const PARAMS: &str = "pppr";
const CLOUDS: &str = "pc";
const HEATMAPS: &str = "heatmap";

/// What can be exported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum What {
    /// Parameters.
    Pppr,
    /// Simulated maps in the input's files.
    Heatmap,
    /// Point clouds.
    Pc,
}

/// Files of point clouds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum CloudFormat {
    /// numpy.
    Npz,
    /// Stanford's polygon format, binary.
    Ply,
    /// The Point Cloud Library's format, binary.
    Pcd,
}

/// What becomes of the values of a simulated map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ScaleArg {
    /// In the input's scale.
    Match,
    /// As computed.
    None,
}

/// What `export` is told.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// An MMVR tree or any folder inside one, a `*_radar.npz`, a folder with `dataset.toml`, or an `.npy`/`.npz` of maps.
    path: PathBuf,
    /// Folder for what is exported.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Frames, counted from 0, as in Rust: 5..12 (12 not included), 5..=11, 5.., ..12, or 7 alone. Default: all.
    #[arg(long, value_name = "A..B")]
    frames: Option<FrameRange>,
    /// What to export.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "pppr,heatmap,pc")]
    what: Vec<What>,
    /// The folder of fitted parameters, NAME.npz a frame, as `fit --out` writes it. Without it every frame is fitted here.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["preset", "iterations"])]
    params: Option<PathBuf>,
    /// Files of point clouds.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "npz,ply,pcd")]
    format: Vec<CloudFormat>,
    /// Scale of maps and intensities.
    #[arg(long, value_enum, default_value = "match")]
    scale: ScaleArg,
    /// The settings of the fits and of the simulation.
    #[arg(long, value_name = "NAME", default_value = Preset::default().name(), value_parser = super::common::presets())]
    preset: Preset,
    /// A fit configuration instead of a preset; keys that it lacks are those of `baseline`.
    #[arg(long, value_name = "FIT.toml", conflicts_with = "preset")]
    config: Option<PathBuf>,
    /// Adam steps of a frame, instead of the configuration's.
    #[arg(long, value_name = "N")]
    iterations: Option<usize>,
    /// Scalar of the per-cell kernel.
    #[arg(long, value_enum, default_value = "f32")]
    precision: PrecisionArg,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

impl ExportArgs {
    fn wants(&self, what: What) -> bool {
        self.what.contains(&what)
    }

    fn scale(&self) -> HeatmapScale {
        match self.scale {
            ScaleArg::Match => HeatmapScale::Match,
            ScaleArg::None => HeatmapScale::None,
        }
    }

    fn config(&self) -> anyhow::Result<FitConfig> {
        let config = self.config.as_deref().map_or_else(|| Ok(self.preset.config()), FitConfig::from_file)?;
        let iterations = self.iterations.unwrap_or(config.iterations);
        Ok(FitConfig { iterations, ..config }.validated()?)
    }
}

/// Runs `export`.
///
/// # Errors
/// Where an argument or the data set is bad, DIR cannot be written, or no frame could be exported.
pub(super) fn run(args: &ExportArgs) -> anyhow::Result<ExitCode> {
    let config = args.config()?;
    let dataset = open(&args.path, args.manifest.as_deref())?;
    let frames = chosen(args.frames, &args.path, &dataset)?;
    let named = [args.params.as_deref(), args.config.as_deref(), args.manifest.as_deref()];
    let inputs = inputs(&dataset, &args.path, &named);
    let manifest = args.manifest.as_deref().or_else(|| is_manifest(&args.path).then_some(args.path.as_path()));
    let new = || HeatmapExport::new(&dataset, &inputs, &args.out.join(HEATMAPS), manifest, &frames);
    let heatmaps = args.wants(What::Heatmap).then(new).transpose()?;
    let wanted = [(What::Pppr, PARAMS), (What::Pc, CLOUDS), (What::Heatmap, HEATMAPS)];
    let below: Vec<&str> = wanted.into_iter().filter(|(what, _)| args.wants(*what)).map(|(_, name)| name).collect();
    let _lock = FolderLock::claim(&args.out, &below, &inputs)?;
    let job = Job { args, config, dataset: &dataset, inputs: &inputs, names: dataset.file_names() };
    let failures = job.all(frames.clone(), heatmaps).with_context(|| left(&args.out))?;
    end(&failures, frames.len(), args)
}

fn is_manifest(path: &Path) -> bool {
    path.is_file() && path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"))
}

fn left(out: &Path) -> String {
    format!("{}: the export is not complete; what was written before stays", out.display())
}

/// What the threads share.
struct Job<'a> {
    args: &'a ExportArgs,
    config: FitConfig,
    dataset: &'a Dataset,
    inputs: &'a Inputs<'a>,
    names: FileNames,
}

impl Job<'_> {
    /// Exports frames side by side; maps are written in the order in which they come. The failures by frame.
    fn all(
        &self,
        frames: Range<usize>,
        mut heatmaps: Option<HeatmapExport<'_>>,
    ) -> anyhow::Result<BTreeMap<usize, String>> {
        heatmaps.as_ref().map_or(Ok(()), HeatmapExport::begin)?;
        let bar = progress_bar(frames.len());
        let (next, end) = (AtomicUsize::new(frames.start), frames.end);
        let threads = std::thread::available_parallelism().map_or(1, usize::from).clamp(1, frames.len().max(1));
        let (outbox, inbox) = crossbeam_channel::bounded::<(usize, Result<Exported, String>)>(threads);
        let mut failures = BTreeMap::new();
        std::thread::scope(|scope| {
            for k in 0..threads {
                let (next, outbox) = (&next, outbox.clone());
                let work = move || {
                    loop {
                        let index = next.fetch_add(1, Ordering::Relaxed);
                        if index >= end || outbox.send((index, self.frame(index))).is_err() {
                            return;
                        }
                    }
                };
                std::thread::Builder::new().name(format!("export {k}")).spawn_scoped(scope, work)?;
            }
            drop(outbox);
            for (index, exported) in inbox {
                bar.inc(1);
                let written = exported.and_then(|exported| match &mut heatmaps {
                    Some(heatmaps) => heatmaps.add(index, &exported.maps).map_err(|error| error.to_string()),
                    None => Ok(()),
                });
                if let Err(why) = written {
                    failures.insert(index, why);
                }
            }
            Ok::<(), std::io::Error>(())
        })
        .context("no thread to work on")?;
        bar.finish_and_clear();
        if failures.len() < frames.len()
            && let Some(heatmaps) = heatmaps
        {
            heatmaps.finish(failures.is_empty())?;
        }
        Ok(failures)
    }
}

fn end(failures: &BTreeMap<usize, String>, frames: usize, args: &ExportArgs) -> anyhow::Result<ExitCode> {
    let done = frames - failures.len();
    let out = one_line(&args.out.display().to_string()).into_owned();
    if done > 0 {
        print(&format!("{done} of {frames} frames written to {out}\n"))?;
    }
    let Some(why) = failures.values().next() else { return Ok(ExitCode::SUCCESS) };
    match frames {
        1 => complain(&format!("error: {why}")),
        _ if done == 0 => complain(&format!("error: none of {frames} frames could be exported; the first: {why}")),
        _ => {
            complain(&format!(
                "warning: {} of {frames} frames could not be exported; the first: {why}",
                failures.len()
            ));
        }
    }
    if done > 0 && args.wants(What::Heatmap) {
        complain(&format!(
            "warning: {out}/{HEATMAPS} is not complete: it has {done} of {frames} frames and gets no dataset.toml"
        ));
    }
    Ok(ExitCode::from(if done == 0 { EXIT_BAD_INPUT } else { EXIT_SOME_FAILED }))
}
