//! The state that is explored: a frame's fit, or given parameters.

use crate::body::Pppr;
use crate::cli::common::{EraseArg, PeopleArg, PrecisionArg, open, presets, settings};
use crate::config::{FitConfig, Preset};
use crate::dataset::{Dataset, Frame, read_pppr};
use crate::explore::ExploredState;
use crate::mhp::{ErasedCells, Masks, Objective, Precision, Problem, masks, simulate, without};
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
    #[command(flatten)]
    erase: EraseArg,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

/// A frame, and the state of its fit that is explored.
pub(super) struct State {
    pub(super) frame: Frame,
    pub(super) of: ExploredState,
}

impl StateArgs {
    pub(super) fn open(&self) -> anyhow::Result<(Dataset, FitConfig)> {
        let config = self.people.of(&settings(self.config.as_deref(), self.preset, self.iterations)?);
        Ok((open(&self.path, self.manifest.as_deref())?, config))
    }

    pub(super) fn precision(&self) -> Precision {
        self.precision.into()
    }

    /// The cells that no fit sees.
    pub(super) fn erased(&self, dataset: &Dataset) -> anyhow::Result<Arc<[ErasedCells]>> {
        Ok(self.erase.read(dataset)?.into())
    }

    /// The frame as it was measured, and the parameters that were given for it.
    pub(super) fn measured(
        &self,
        dataset: &Dataset,
        index: usize,
    ) -> anyhow::Result<(Frame, Arc<Problem>, Option<Pppr>)> {
        let frame = dataset.load(index)?;
        let in_file = || dataset.frame_path(index).display().to_string();
        let problem = Arc::new(problem_of(dataset, &frame).with_context(in_file)?);
        let given = |file: &PathBuf| -> anyhow::Result<Pppr> {
            let params = read_pppr(file, None)?;
            problem.check(&params).with_context(|| file.display().to_string())?;
            Ok(params)
        };
        let given = self.params.as_ref().map(given).transpose()?;
        Ok((frame, problem, given))
    }

    /// The state of a frame.
    pub(super) fn state(&self, dataset: &Dataset, index: usize, config: &FitConfig) -> anyhow::Result<State> {
        let (erased, precision) = (self.erased(dataset)?, self.precision());
        let (frame, problem, given) = self.measured(dataset, index)?;
        let (initial, params) = if let Some(params) = given {
            (params.clone(), params)
        } else {
            let options =
                BatchOptions { config: *config, precision, erased: erased.to_vec(), ..BatchOptions::default() };
            let fit = fit_frame(dataset, index, &options, None).map_err(anyhow::Error::msg)?;
            (fit.initial, fit.params)
        };
        Ok(State { frame, of: ExploredState { problem, erased, config: *config, precision, initial, params } })
    }
}

impl State {
    /// H_sim of every view, as the window shows it, and the masks.
    pub(super) fn maps(&self) -> anyhow::Result<(Vec<Vec<f64>>, Vec<Masks>)> {
        let ExploredState { problem, erased, config, initial, params, .. } = &self.of;
        let objective = Objective::new(without(problem, erased)?, *config, Precision::F32, initial)?;
        let h_sim = simulate(problem, config, Precision::F32, params);
        let masks = h_sim.iter().enumerate().map(|(view, map)| masks(&objective, view, map)).collect();
        Ok((h_sim, masks))
    }

    /// What a joint is called; with its person where there are several.
    pub(super) fn name(&self, joint: usize) -> String {
        let skeleton = &self.of.problem.skeleton;
        let joints = skeleton.joints.len().max(1);
        let name = skeleton.shown_name(joint % joints);
        if self.of.params.shape().persons > 1 { format!("person {} {name}", joint / joints + 1) } else { name }
    }
}
