//! `predict`: joints of a network, as a file of predictions.

use super::common::{complain, inputs, open, print};
use super::frames::{FrameRange, chosen};
use super::pose::{FitsArgs, params_of};
use crate::dataset::Dataset;
use crate::geometry::Vec3;
use crate::network::{ParamsOf, open_model};
use crate::output::Inputs;
use crate::predictions::{Predictions, Reading, SourceSummary, WriteFormat, prediction_row, write_predictions};
use crate::task::milliseconds;
use anyhow::Context as _;
use clap::Args;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Shown under the options of `predict --help`.
pub(super) const HELP: &str = "\
A model of train-pose says what it reads: the parameters of a fit (each frame is fitted as `fit` does, unless --params says where fits \
lie), or the measured maps. Of a model in ONNX a small TOML says it, M.onnx.toml beside M.onnx or --description FILE:

  [[input]]                 # one for each tensor
  tensor = \"maps\"           # its name in the model
  is = \"map\"                # map, pppr-heatmap, pppr-pc, pppr, fit-joints
  views = [\"hm_hori\"]       # of maps: as channels; all unless said
  frames = [-2, -1, 0]      # beside the one that is asked; [0] unless said
  normalisation = \"max\"     # of maps: none, max, standard, db (no less than floor_db)
  size = [224, 224]         # of maps: brought to these rows and columns
  mean = 0.1                # then taken off, and divided by
  std = 0.25
  shape = [1, 3, 224, 224]  # where the model leaves it open
  # of fit-joints: skeleton or joints, unit, axes, about, mapping = { head = \"nose\" }; of pppr: about; of pppr-pc: points
  [output]
  tensor = \"joints\"         # three numbers a joint, person after person
  skeleton = \"hupr14\"       # or joints = [\"nose\", ...]
  unit = \"m\"
  axes = \"camera\"           # radar unless said
  about = \"pelvis\"          # of the fitted body; radar unless said
  scores = \"scores\"         # a number a person; who has less than least_score is nobody
  take = 4                  # of several rows the one that counts

The file that is written is one that `predictions`, `fit --init` and the window read.

Examples:
  mhp-inspector predict data/walk --model pose.safetensors --out pose.npz
      Fits each frame and writes what the network makes of it; prints errors where there is truth, and the time.
  mhp-inspector predict data/walk --model pose.safetensors --params results --out pose.parquet
      The same of fits that are there.
  mhp-inspector predict data/mmvr --model retr.onnx --out retr.npz
      What somebody else's network makes of the maps; retr.onnx.toml says what its tensors are.";

/// What `predict` is told.
#[derive(Debug, Args)]
pub struct PredictArgs {
    /// The data set.
    path: PathBuf,
    /// A model: as `train-pose` writes it, or in ONNX.
    #[arg(long, value_name = "FILE")]
    model: PathBuf,
    /// What the tensors of a model in ONNX are; the file beside it unless said.
    #[arg(long, value_name = "FILE.toml")]
    description: Option<PathBuf>,
    /// Where the joints are written: .npz, .csv, .json or .parquet.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Fits to read: the folder of `fit --out`. Without it each frame is fitted.
    #[arg(long, value_name = "DIR")]
    params: Option<PathBuf>,
    #[command(flatten)]
    fits: FitsArgs,
    /// Frames, counted from 0: 5..12, 5.., ..12 or 7. Default: all.
    #[arg(long, value_name = "A..B")]
    frames: Option<FrameRange>,
    /// A manifest (as `dataset.toml`) that says what PATH is.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

/// Runs `predict`.
///
/// # Errors
/// Where the model or the data set cannot be used, or the file not be written.
pub(super) fn run(args: &PredictArgs) -> anyhow::Result<ExitCode> {
    let dataset = open(&args.path, args.manifest.as_deref())?;
    let settings = args.fits.settings()?;
    let model = open_model(&args.model, args.description.as_deref(), &dataset, &settings)?;
    let format = WriteFormat::of(&args.out).with_context(|| {
        format!("{}: expected a name that ends in .npz, .csv, .json or .parquet", args.out.display())
    })?;
    let read = [Some(&args.model), args.description.as_ref(), args.params.as_ref(), args.manifest.as_ref()];
    let guarded: Inputs<'_> = inputs(&dataset, &args.path, &read.map(|path| path.map(PathBuf::as_path)));
    guarded.check_replaced(&args.out)?;
    let frames: Vec<usize> = chosen(args.frames, &args.path, &dataset)?.collect();
    let params = if model.needs_fit() {
        let reach = model.reach();
        let read: BTreeSet<usize> =
            frames.iter().flat_map(|&k| k.saturating_sub(reach)..(k + reach + 1).min(dataset.len())).collect();
        let read: Vec<usize> = read.into_iter().collect();
        params_of(&dataset, &read, args.params.as_deref(), &settings)?
    } else {
        ParamsOf::new()
    };
    let (mut answers, mut left_out, mut model_ms) = (Vec::with_capacity(frames.len()), Vec::new(), 0.0);
    for &index in &frames {
        let answered = model.read(&dataset, index, &params).and_then(|read| {
            let began = Instant::now();
            let mut persons: Vec<Vec<Vec3>> = Vec::with_capacity(read.len());
            for input in &read {
                persons.extend(model.answer(input)?);
            }
            model_ms += milliseconds(began);
            Ok(persons)
        });
        let name = dataset.frame_name(index);
        match answered {
            Ok(persons) => answers.push((name.to_owned(), persons)),
            Err(why) => left_out.push(format!("{name}: {why}")),
        }
    }
    if answers.is_empty() {
        let first = left_out.first().map_or(String::new(), |why| format!("; the first, {why}"));
        anyhow::bail!("{}: the model answers of no frame{first}", args.model.display());
    }
    write_predictions(&args.out, format, model.joints(), &answers)?;
    if let Some(first) = left_out.first() {
        complain(&format!("note: {} frames have no prediction; the first, {first}", left_out.len()));
    }
    let mean_ms = model_ms / answers.len() as f64;
    let mut text = format!(
        "{} frames to {}\n{}; {mean_ms:.2} ms a frame ({:.0} a second) of the network alone\n",
        answers.len(),
        args.out.display(),
        model.summary(),
        1000.0 / mean_ms.max(1e-6),
    );
    text += &errors(args, &dataset, &frames)?;
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// The errors of what was written, read back as anybody else would read it.
fn errors(args: &PredictArgs, dataset: &Dataset, frames: &[usize]) -> anyhow::Result<String> {
    let source =
        Predictions::open(&args.out, dataset, &Reading { name: Some("network".into()), ..Reading::default() }, None)?;
    let mut summary = SourceSummary::default();
    for &index in frames {
        let row = prediction_row(dataset, index, std::slice::from_ref(&source), None)?;
        row.sources.iter().for_each(|row| summary.add(row));
    }
    Ok(summary.truth.errors().map_or_else(String::new, |e| {
        format!("MAJPE {:.1} mm, PA-MAJPE {:.1} mm over {} frames\n", e.majpe_mm, e.pa_majpe_mm, summary.truth.frames)
    }))
}
