//! `study cross-scene` and `study cross-dataset`: networks taught on one part and asked on the others.

use crate::cli::common::{epochs_bar, open, print};
use crate::cli::pose::{FitsArgs, params_of};
use crate::cli::train_pose::LearningArgs;
use crate::dataset::Dataset;
use crate::network::ParamsOf;
use crate::study::cross::{CrossKind, cross, cross_parts, markdown};
use anyhow::{Context as _, bail};
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// What the two studies are told.
#[derive(Debug, Args)]
pub struct CrossArgs {
    /// Data sets with joints in metres.
    #[arg(required = true)]
    data: Vec<PathBuf>,
    /// Fits of each data set, in their order: folders of `fit --out`. Without them each frame is fitted.
    #[arg(long, value_name = "DIR")]
    params: Vec<PathBuf>,
    /// The scene, or the name of the data set, that is learned; the first unless said.
    #[arg(long, value_name = "NAME")]
    train_on: Option<String>,
    /// The run folder: networks with their checkpoints, table.md, table.json.
    #[arg(long, value_name = "RUN")]
    out: PathBuf,
    #[command(flatten)]
    fits: FitsArgs,
    #[command(flatten)]
    learning: LearningArgs,
}

/// Runs one of the two.
///
/// # Errors
/// Where data cannot be read, teach nothing, or a file cannot be written.
pub(super) fn run(kind: CrossKind, args: &CrossArgs) -> anyhow::Result<ExitCode> {
    if !args.params.is_empty() && args.params.len() != args.data.len() {
        let (folders, sets) = (args.params.len(), args.data.len());
        bail!("--params: {folders} folders for {sets} data sets; expected one each, in their order");
    }
    let options = args.learning.options()?;
    let settings = args.fits.settings()?;
    let mut sets: Vec<(Dataset, ParamsOf)> = Vec::with_capacity(args.data.len());
    for (k, path) in args.data.iter().enumerate() {
        let dataset = open(path, None)?;
        let frames: Vec<usize> = (0..dataset.len()).collect();
        let params = params_of(&dataset, &frames, args.params.get(k).map(PathBuf::as_path), &settings)?;
        sets.push((dataset, params));
    }
    let mut parts = cross_parts(kind, &sets);
    if let Some(wanted) = &args.train_on {
        let at = parts.iter().position(|part| part.name == *wanted).with_context(|| {
            let known: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
            format!("--train-on: \"{}\"; expected one of {}", wanted.escape_debug(), known.join(", "))
        })?;
        parts[..=at].rotate_right(1);
    }
    std::fs::create_dir_all(&args.out).with_context(|| format!("{}: cannot be made", args.out.display()))?;
    let bar = epochs_bar(options.epochs);
    let rows = cross(kind, &parts, &options, &args.out, |input, epoch| {
        bar.set_position(epoch.epoch as u64);
        bar.set_message(format!("{}: {:.1} mm", input.name, epoch.best_mm));
    })?;
    bar.finish_and_clear();
    print(&markdown(kind, &rows))?;
    Ok(ExitCode::SUCCESS)
}
