//! `train-pose`: teaches MLP+PPPR on data with truth.

use super::common::{at_least_one, complain, epochs_bar, open, print};
use super::pose::{FitsArgs, params_of};
use crate::network::{
    Architecture, Example, ExampleSet, Features, ModelCard, ParamsOf, TrainPoseOptions, TrainedEpoch, examples,
    train_pose,
};
use crate::output::replace_file;
use anyhow::{Context as _, bail};
use clap::Args;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Shown under the options of `train-pose --help`.
pub(super) const HELP: &str = "\
Models: mlp, the paper's A.6 (48 numbers, the mean over the joints -> 2048 -> 1792 -> 3 a joint; ReLU, dropout 0.30); mlp-joints, \
every joint's numbers about the body's middle; mlp-window, those of five frames. Features: pppr, pppr-heatmap, heatmap, fit-joints. \
AdamW, at most 200 epochs, early stopping after 20. Whole sequences are kept for validation, never single frames: neighbours are \
alike. Killed at any time, the same command goes on where the last epoch ended, to the same weights.

Examples:
  mhp-inspector simulate train --preset easy --frames 1200 && mhp-inspector fit train --out train-fits
  mhp-inspector train-pose train --params train-fits --features pppr --model mlp --out pose
      Writes pose/model.safetensors with its card, pose/card.md, pose/curves.csv.
  mhp-inspector train-pose train --features heatmap --model mlp --out heatmap
      The same network on the measured maps.";

/// What `train-pose` is told.
#[derive(Debug, Args)]
pub struct TrainPoseArgs {
    /// Data sets with joints in metres.
    #[arg(required = true)]
    data: Vec<PathBuf>,
    /// Fits of each data set, in their order: folders of `fit --out`. Without them each frame is fitted.
    #[arg(long, value_name = "DIR")]
    params: Vec<PathBuf>,
    /// What the network reads.
    #[arg(long, value_parser = str::parse::<Features>)]
    features: Features,
    /// How it is built.
    #[arg(long, default_value = "mlp", value_parser = str::parse::<Architecture>)]
    model: Architecture,
    /// Folder for model.safetensors, card.md, curves.csv and the checkpoint.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    fits: FitsArgs,
    #[command(flatten)]
    learning: LearningArgs,
    /// Every how many sequences one is kept for validation.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = at_least_one)]
    validation_every: usize,
}

/// How a network is taught.
#[derive(Debug, Args)]
pub(super) struct LearningArgs {
    /// Passes over the examples at most.
    #[arg(long, default_value_t = TrainPoseOptions::default().epochs, value_parser = at_least_one)]
    pub(super) epochs: usize,
    /// Passes without a better validation error after which it ends.
    #[arg(long, default_value_t = TrainPoseOptions::default().patience, value_parser = at_least_one)]
    patience: usize,
    /// Examples a step.
    #[arg(long, default_value_t = TrainPoseOptions::default().batch, value_parser = at_least_one)]
    batch: usize,
    /// AdamW's step.
    #[arg(long, default_value_t = TrainPoseOptions::default().learning_rate)]
    learning_rate: f64,
    /// Widths of the hidden layers.
    #[arg(long, value_name = "N,N", value_delimiter = ',', default_values_t = TrainPoseOptions::default().hidden)]
    hidden: Vec<usize>,
    /// Seed of weights, order, dropout and of which sequences are kept for validation.
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
}

impl LearningArgs {
    /// # Errors
    /// Where a layer has no width.
    pub(super) fn options(&self) -> anyhow::Result<TrainPoseOptions> {
        if self.hidden.contains(&0) {
            bail!("--hidden: a layer of 0; expected widths of 1 or more");
        }
        Ok(TrainPoseOptions {
            epochs: self.epochs,
            patience: self.patience,
            batch: self.batch,
            learning_rate: self.learning_rate,
            hidden: self.hidden.clone(),
            seed: self.seed,
            ..TrainPoseOptions::default()
        })
    }
}

/// Runs `train-pose`.
///
/// # Errors
/// Where data teach nothing, or a file cannot be written.
pub(super) fn run(args: &TrainPoseArgs) -> anyhow::Result<ExitCode> {
    if !args.params.is_empty() && args.params.len() != args.data.len() {
        bail!(
            "--params: {} folders for {} data sets; expected one each, in their order",
            args.params.len(),
            args.data.len()
        );
    }
    let options = args.learning.options()?;
    std::fs::create_dir_all(&args.out).with_context(|| format!("{}: cannot be made", args.out.display()))?;
    let (mut sets, mut card, mut told) = (Vec::<ExampleSet>::new(), None::<ModelCard>, Vec::new());
    for (k, path) in args.data.iter().enumerate() {
        let (found, of, note) = data_of(args, path, args.params.get(k).map(PathBuf::as_path))?;
        complain(&format!("note: {note}"));
        told.push(note);
        if let Some(known) = &card
            && (known.joints != of.joints
                || known.doppler_features != of.doppler_features
                || known.maps.len() != of.maps.len())
        {
            bail!(
                "{}: its joints, Doppler features or maps are not those of {}",
                path.display(),
                args.data[0].display()
            );
        }
        card.get_or_insert(of);
        sets.extend(found);
    }
    let card = card.context("no data set")?;
    let (train, validation) = split(&sets, args.learning.seed, args.validation_every)?;
    complain(&format!("note: {} examples to learn from, {} to validate with", train.len(), validation.len()));
    let bar = epochs_bar(options.epochs);
    let checkpoint = args.out.join("checkpoint.safetensors");
    let (mut network, curves) = train_pose(&card, &train, &validation, &options, Some(&checkpoint), |curve| {
        bar.set_position(curve.epoch as u64);
        bar.set_message(format!("{:.1} mm", curve.best_mm));
        true
    })?;
    bar.finish_and_clear();
    network.card.notes = notes(args, &told, train.len(), validation.len(), &curves);
    network.write(&args.out.join("model.safetensors"))?;
    write_text(&args.out.join("curves.csv"), &curves_csv(&curves))?;
    let text = markdown(&network.card);
    write_text(&args.out.join("card.md"), &text)?;
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// Examples of a data set, the card of a model of it, and what was left out in words.
fn data_of(
    args: &TrainPoseArgs,
    path: &Path,
    params: Option<&Path>,
) -> anyhow::Result<(Vec<ExampleSet>, ModelCard, String)> {
    let dataset = open(path, None)?;
    let settings = args.fits.settings()?;
    let all: Vec<usize> = (0..dataset.len()).collect();
    let params =
        if args.features.needs_fit() { params_of(&dataset, &all, params, &settings)? } else { ParamsOf::new() };
    let (sets, left_out) = examples(&dataset, &params, args.features, args.model).map_err(anyhow::Error::msg)?;
    let info = dataset.info();
    let card = ModelCard::of_data(info, args.features, args.model);
    let frames: usize = sets.iter().map(|set| set.examples.len()).sum();
    let why: Vec<String> = left_out.iter().map(|(why, n)| format!("{n} frames left out: {why}")).collect();
    let rest = if why.is_empty() { String::new() } else { format!(" ({})", why.join(", ")) };
    let note = format!("{}: {frames} examples of {} sequences{rest}", info.name, sets.len());
    Ok((sets, card, note))
}

/// Whole sequences to learn from, and to validate with.
fn split(sets: &[ExampleSet], seed: u64, every: usize) -> anyhow::Result<(Vec<&Example>, Vec<&Example>)> {
    if sets.len() < 2 {
        bail!(
            "one sequence; expected two or more: frames beside each other are alike, and a network tested on them tells nothing"
        );
    }
    let every = every.clamp(2, sets.len());
    let (mut train, mut validation) = (Vec::new(), Vec::new());
    for (k, set) in sets.iter().enumerate() {
        let into = if (k as u64 + seed).is_multiple_of(every as u64) { &mut validation } else { &mut train };
        into.extend(&set.examples);
    }
    Ok((train, validation))
}

fn notes(
    args: &TrainPoseArgs,
    data: &[String],
    train: usize,
    validation: usize,
    curves: &[TrainedEpoch],
) -> Vec<String> {
    let best = curves.iter().min_by(|a, b| a.validation_mm.total_cmp(&b.validation_mm));
    let mut notes =
        vec![format!("mhp-inspector {} train-pose, seed {}", env!("CARGO_PKG_VERSION"), args.learning.seed)];
    notes.extend(data.iter().cloned());
    notes.push(format!("{train} examples learned from, {validation} of other sequences to validate with"));
    if let Some(best) = best {
        notes.push(format!(
            "validation MAJPE {:.1} mm after epoch {} of {}",
            best.validation_mm,
            best.epoch,
            curves.len()
        ));
    }
    notes
}

fn curves_csv(curves: &[TrainedEpoch]) -> String {
    let mut text = String::from("epoch,loss,validation_majpe_mm,best_majpe_mm\n");
    for curve in curves {
        let _ = writeln!(text, "{},{},{},{}", curve.epoch, curve.loss, curve.validation_mm, curve.best_mm);
    }
    text
}

fn markdown(card: &ModelCard) -> String {
    let mut text = format!(
        "# MLP+PPPR: {} on {}\n\nAnswers {} joints in metres{}; {} parameters.\n\n",
        card.architecture,
        card.features,
        card.joints.len(),
        if card.centred { ", about the middle of the fitted body" } else { ", in the radar's frame" },
        card.parameters,
    );
    for note in &card.notes {
        let _ = writeln!(text, "- {note}");
    }
    text
}

fn write_text(path: &Path, text: &str) -> anyhow::Result<()> {
    replace_file(path, |out| out.write_all(text.as_bytes()))
        .with_context(|| format!("{}: cannot be written", path.display()))
}
