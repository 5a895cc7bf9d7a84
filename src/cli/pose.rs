//! What `train-pose` and `predict` share: parameters of frames, kept or fitted.

use super::common::{config, presets, progress_bar};
use crate::config::{FitConfig, Preset};
use crate::dataset::{Dataset, read_pppr};
use crate::mhp::Precision;
use crate::network::ParamsOf;
use crate::study::{BatchOptions, fit_frame};
use anyhow::bail;
use clap::Args;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The folder of parameters inside one of results.
const PARAMS: &str = "pppr";

/// With which settings frames are fitted that a network reads.
#[derive(Debug, Args)]
pub(super) struct FitsArgs {
    /// Settings of the fits.
    #[arg(long, value_name = "NAME", default_value = Preset::default().name(), value_parser = presets())]
    preset: Preset,
    /// Fit configuration instead of the preset.
    #[arg(long, value_name = "FIT.toml", conflicts_with = "preset")]
    config: Option<PathBuf>,
}

impl FitsArgs {
    /// # Errors
    /// Where the configuration cannot be used.
    pub(super) fn settings(&self) -> anyhow::Result<FitConfig> {
        if self.config.is_some() { config(self.config.as_deref()) } else { Ok(self.preset.config()) }
    }
}

/// The parameters of `frames`: those of a folder of `fit --out`, or fitted here and now. Frames without are left out.
///
/// # Errors
/// Where the folder has none of the frames, or no frame can be fitted.
pub(super) fn params_of(
    dataset: &Dataset,
    frames: &[usize],
    folder: Option<&Path>,
    config: &FitConfig,
) -> anyhow::Result<ParamsOf> {
    let found: Vec<(usize, Result<_, String>)> = if let Some(folder) = folder {
        let inner = folder.join(PARAMS);
        let folder = if inner.is_dir() { inner } else { folder.to_owned() };
        let names = dataset.file_names();
        let read = |&index: &usize| {
            let file = folder.join(format!("{}.npz", names.of(index, dataset.frame_name(index))));
            file.is_file().then(|| (index, read_pppr(&file, None).map_err(|error| error.to_string())))
        };
        frames.iter().filter_map(read).collect()
    } else {
        let bar = progress_bar(frames.len());
        let options = BatchOptions { config: *config, precision: Precision::F32, ..BatchOptions::default() };
        let fit = |&index: &usize| {
            let fit = fit_frame(dataset, index, &options, None).map(|fit| fit.params);
            bar.inc(1);
            (index, fit)
        };
        let fitted = frames.par_iter().map(fit).collect();
        bar.finish_and_clear();
        fitted
    };
    let first = found.iter().find_map(|(_, params)| params.as_ref().err().cloned());
    let joints = dataset.info().skeleton.joints.len();
    let mut params = ParamsOf::new();
    for (index, of) in found {
        let Ok(of) = of else { continue };
        if of.shape().joints != joints {
            bail!("{}: its fit has {} joints, the data set {joints}", dataset.frame_name(index), of.shape().joints);
        }
        params.insert(index, Arc::new(of));
    }
    match (params.is_empty(), folder, first) {
        (true, _, Some(why)) => bail!("no frame has a fit; the first: {why}"),
        (true, Some(folder), None) => bail!("{}: no parameters of this data set's frames", folder.display()),
        _ => Ok(params),
    }
}
