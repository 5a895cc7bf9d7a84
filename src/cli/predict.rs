//! `predict`: joints of a trained network, as a file of predictions.

use super::common::{complain, config, inputs, open, presets, print};
use super::frames::{FrameRange, chosen};
use super::pose::params_of;
use crate::config::Preset;
use crate::dataset::Dataset;
use crate::geometry::{Vec3, add};
use crate::network::{ModelError, ParamsOf, PoseNetwork, prediction_inputs};
use crate::output::Inputs;
use crate::predictions::{Predictions, Reading, SourceSummary, WriteFormat, prediction_row, write_predictions};
use crate::task::milliseconds;
use anyhow::Context as _;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Shown under the options of `predict --help`.
pub(super) const HELP: &str = "\
The model says what it reads: the parameters of a fit (each frame is fitted as `fit` does, unless --params says where fits lie), or \
the measured maps. The file is one that `predictions`, `fit --init` and the window read.

Examples:
  mhp-inspector predict pose.safetensors data/walk --out pose.npz
      Fits each frame and writes what the network makes of it; prints errors where there is truth, and the time.
  mhp-inspector predict pose.safetensors data/walk --params results --out pose.parquet
      The same of fits that are there.";

/// What `predict` is told.
#[derive(Debug, Args)]
pub struct PredictArgs {
    /// A model, as `train-pose` writes it.
    model: PathBuf,
    /// The data set.
    path: PathBuf,
    /// Where the joints are written: .npz, .csv, .json or .parquet.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Fits to read: the folder of `fit --out`. Without it each frame is fitted.
    #[arg(long, value_name = "DIR")]
    params: Option<PathBuf>,
    /// Settings of the fits.
    #[arg(long, value_name = "NAME", default_value = Preset::default().name(), value_parser = presets())]
    preset: Preset,
    /// Fit configuration instead of the preset.
    #[arg(long, value_name = "FIT.toml", conflicts_with = "preset")]
    config: Option<PathBuf>,
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
    let network = PoseNetwork::read(&args.model)?;
    let dataset = open(&args.path, args.manifest.as_deref())?;
    fits(&network, &dataset, args)?;
    let format = WriteFormat::of(&args.out).with_context(|| {
        format!("{}: expected a name that ends in .npz, .csv, .json or .parquet", args.out.display())
    })?;
    let guarded: Inputs<'_> =
        inputs(&dataset, &args.path, &[Some(&args.model), args.params.as_deref(), args.manifest.as_deref()]);
    guarded.check_replaced(&args.out)?;
    let frames: Vec<usize> = chosen(args.frames, &args.path, &dataset)?.collect();
    let settings = if args.config.is_some() { config(args.config.as_deref())? } else { args.preset.config() };
    let params = if network.card.features.needs_fit() {
        params_of(&dataset, &frames, args.params.as_deref(), &settings)?
    } else {
        ParamsOf::new()
    };
    let (mut answers, mut left_out, mut network_ms) = (Vec::with_capacity(frames.len()), 0usize, 0.0);
    for &index in &frames {
        let (features, architecture) = (network.card.features, network.card.architecture);
        let Ok(read) = prediction_inputs(&dataset, index, &params, features, architecture) else {
            left_out += 1;
            continue;
        };
        let began = Instant::now();
        let persons: Vec<Vec<Vec3>> = read
            .iter()
            .map(|(input, middle)| network.answer(input).into_iter().map(|p| add(p, *middle)).collect())
            .collect();
        network_ms += milliseconds(began);
        answers.push((dataset.frame_name(index).to_owned(), persons));
    }
    if answers.is_empty() {
        anyhow::bail!("{}: no frame has what the model reads", args.path.display());
    }
    write_predictions(&args.out, format, &network.card.joints, &answers)?;
    if left_out > 0 {
        complain(&format!("note: {left_out} frames have no fit and no prediction"));
    }
    let mean_ms = network_ms / answers.len() as f64;
    let mut text = format!(
        "{} frames to {}\n{} on {}, {} parameters, {:.1} MB; {mean_ms:.2} ms a frame ({:.0} a second) of the network alone\n",
        answers.len(),
        args.out.display(),
        network.card.architecture,
        network.card.features,
        network.parameters(),
        4e-6 * network.parameters() as f64,
        1000.0 / mean_ms.max(1e-6),
    );
    text += &errors(args, &dataset, &frames)?;
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// Whether the model reads such data.
fn fits(network: &PoseNetwork, dataset: &Dataset, args: &PredictArgs) -> Result<(), ModelError> {
    let wrong = |message: String| Err(ModelError::Misfit { message, path: args.model.clone() });
    let (card, info) = (&network.card, dataset.info());
    if card.features.needs_fit() && card.joints != info.skeleton.joints {
        let joints = |of: &[String]| format!("{} joints, {}, …", of.len(), of.first().map_or("", String::as_str));
        return wrong(format!(
            "it reads fits of {}; the data set's have {}",
            joints(&card.joints),
            joints(&info.skeleton.joints)
        ));
    }
    if card.features == crate::network::Features::Pppr && card.doppler_features != info.radar.doppler_features {
        let (of, is) = (card.doppler_features, info.radar.doppler_features);
        return wrong(format!("it reads {of} Doppler features a joint; the data set's radar has {is}"));
    }
    if !card.features.of_joints() && card.maps.len() != info.views.len() {
        return wrong(format!("it reads {} maps; the data set has {}", card.maps.len(), info.views.len()));
    }
    Ok(())
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
