//! The state that is explored: a frame's fit, or given parameters.

use crate::body::Pppr;
use crate::cli::common::{PeopleArg, PrecisionArg, open, presets, settings};
use crate::config::{FitConfig, Preset};
use crate::dataset::{Dataset, Frame, read_pppr};
use crate::mhp::{Masks, Objective, Precision, Problem, masks, simulate};
use crate::start::problem_of;
use crate::study::{BatchOptions, fit_frame};
use anyhow::Context as _;
use clap::Args;
use std::path::PathBuf;
use std::sync::Arc;

/// Whose state.
#[derive(Debug, Args)]
pub(super) struct StateArgs {
    /// An MMVR tree or any folder inside one, a `*_radar.npz`, a folder with `dataset.toml`, or an `.npy`/`.npz` of maps.
    pub(super) path: PathBuf,
    /// Fit configuration; without it the preset.
    #[arg(long, value_name = "FIT.toml", conflicts_with = "preset")]
    config: Option<PathBuf>,
    /// Settings with a name.
    #[arg(long, value_name = "NAME", default_value = Preset::default().name(), value_parser = presets())]
    preset: Preset,
    #[command(flatten)]
    people: PeopleArg,
    /// Adam steps, instead of the configuration's.
    #[arg(long, value_name = "N")]
    iterations: Option<usize>,
    /// Scalar of the per-cell kernel of the fit.
    #[arg(long, value_enum, default_value = "f32")]
    precision: PrecisionArg,
    /// Explore these parameters (PPPR npz) instead of a fit.
    #[arg(long, value_name = "P.npz")]
    params: Option<PathBuf>,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

/// What is explored of one frame.
pub(super) struct State {
    pub(super) frame: Frame,
    pub(super) problem: Arc<Problem>,
    pub(super) config: FitConfig,
    /// The pose that fixes the EM region.
    pub(super) initial: Pppr,
    pub(super) params: Pppr,
}

impl StateArgs {
    pub(super) fn open(&self) -> anyhow::Result<(Dataset, FitConfig)> {
        let config = self.people.of(&settings(self.config.as_deref(), self.preset, self.iterations)?);
        Ok((open(&self.path, self.manifest.as_deref())?, config))
    }

    pub(super) fn precision(&self) -> Precision {
        self.precision.into()
    }

    /// The state of a frame.
    pub(super) fn state(&self, dataset: &Dataset, index: usize, config: &FitConfig) -> anyhow::Result<State> {
        let config = *config;
        let in_file = || dataset.frame_path(index).display().to_string();
        let frame = dataset.load(index)?;
        let problem = Arc::new(problem_of(dataset, &frame).with_context(in_file)?);
        if let Some(file) = &self.params {
            let params = read_pppr(file, None)?;
            problem.check(&params).with_context(|| file.display().to_string())?;
            return Ok(State { frame: frame.clone(), problem, config, initial: params.clone(), params });
        }
        let options = BatchOptions { config, precision: self.precision.into(), ..BatchOptions::default() };
        let fit = fit_frame(dataset, index, &options, None).map_err(anyhow::Error::msg)?;
        Ok(State { frame: frame.clone(), problem, config, initial: fit.initial, params: fit.params })
    }
}

impl State {
    /// H_sim of every view, as the window shows it, and the masks.
    pub(super) fn maps(&self) -> anyhow::Result<(Vec<Vec<f64>>, Vec<Masks>)> {
        let objective = Objective::new(Arc::clone(&self.problem), self.config, Precision::F32, &self.initial)?;
        let h_sim = simulate(&self.problem, &self.config, Precision::F32, &self.params);
        let masks = h_sim.iter().enumerate().map(|(view, map)| masks(&objective, view, map)).collect();
        Ok((h_sim, masks))
    }

    /// What a joint is called; with its person where there are several.
    pub(super) fn name(&self, joint: usize) -> String {
        let joints = self.problem.skeleton.joints.len().max(1);
        let name = self.problem.skeleton.shown_name(joint % joints);
        if self.params.shape().persons > 1 { format!("person {} {name}", joint / joints + 1) } else { name }
    }
}
