//! What the explorations of one frame are told, and the fit that they explore.

use super::frame::StateArgs;
use crate::body::Pppr;
use crate::config::FitConfig;
use crate::dataset::{Dataset, Frame};
use crate::explore::{ExploredState, Halt, IdleCores, RestartRequest, RestartSettings, restart_cloud};
use crate::geometry::Vec3;
use crate::mhp::{ErasedCells, FitState, Fitter, Precision, Problem, without};
use crate::start::{find_start_in, problem_of};
use crate::study::BatchOptions;
use crate::task::Progress;
use anyhow::Context as _;
use clap::Args;
use std::sync::Arc;

/// What they are told.
#[derive(Debug, Args)]
pub(super) struct TargetArgs {
    #[command(flatten)]
    state: StateArgs,
    /// The frame, counted from 0. Default: the first, or the one that PATH names.
    #[arg(long, value_name = "I")]
    frame: Option<usize>,
    /// Threads; default: one for each core. The result is the same with any number.
    #[arg(long, value_name = "N")]
    threads: Option<std::num::NonZeroUsize>,
    /// Everything as JSON instead of a summary.
    #[arg(long)]
    pub(super) json: bool,
}

/// A frame with its fit.
pub(super) struct Target {
    pub(super) frame: Frame,
    pub(super) problem: Arc<Problem>,
    erased: Arc<[ErasedCells]>,
    config: FitConfig,
    /// The start that was found, or the parameters that were given.
    initial: Pppr,
    /// Every state of the fit; one, where parameters were given.
    pub(super) states: Vec<Arc<FitState>>,
    /// ∂L/∂Θ at the last.
    pub(super) gradient: Pppr,
    precision: Precision,
    pub(super) cores: IdleCores,
}

impl TargetArgs {
    /// Opens the data set, finds the start, and fits as the window does; `fitted` where the fit itself is needed.
    ///
    /// # Errors
    /// Where the data, the frame, the settings or the parameters are bad, or the frame cannot be fitted.
    pub(super) fn open(&self, fitted: bool) -> anyhow::Result<Target> {
        let (dataset, config) = self.state.open()?;
        let index = self.frame.or_else(|| dataset.named_frame()).unwrap_or(0);
        anyhow::ensure!(
            index < dataset.len(),
            "{}: frame {index} was asked for; expected 0 ..= {}",
            self.state.path.display(),
            dataset.len().saturating_sub(1)
        );
        let told = || dataset.frame_path(index).display().to_string();
        let (erased, precision) = (self.state.erased(&dataset)?, self.state.precision());
        let (frame, problem, given) = self.state.measured(&dataset, index)?;
        let fitted = fitted && given.is_none();
        let initial = match given {
            Some(params) => params,
            None => find_start_in(&dataset, index, &problem, &config).with_context(told)?.initialisation.params,
        };
        let seen = without(&problem, &erased).with_context(told)?;
        let mut fitter = Fitter::new(seen, config, precision, initial.clone()).with_context(told)?;
        let mut states = vec![fitter.state()];
        if fitted {
            while fitter.iteration() < config.iterations {
                let report = fitter.step().with_context(told)?;
                states.push(fitter.state());
                if report.converged && config.stop_when_converged {
                    break;
                }
            }
        }
        let gradient = fitter.evaluation().gradient.clone();
        let cores = self.threads.map_or_else(IdleCores::all, |threads| IdleCores::of(threads.into()));
        Ok(Target { frame, problem, erased, config, initial, states, gradient, precision, cores })
    }
}

impl Target {
    /// The parameters at the end of the fit.
    pub(super) fn params(&self) -> &Pppr {
        self.states.last().map_or(&self.initial, |state| &state.params)
    }

    /// The state that is explored: at the end of the fit, or at its start.
    pub(super) fn state(&self, at_start: bool) -> ExploredState {
        ExploredState {
            problem: Arc::clone(&self.problem),
            erased: Arc::clone(&self.erased),
            config: self.config,
            precision: self.precision,
            initial: self.initial.clone(),
            params: if at_start { self.initial.clone() } else { self.params().clone() },
        }
    }

    /// The annotated joints, m.
    pub(super) fn truth(&self) -> Option<Arc<[Vec3]>> {
        self.frame.truth.as_ref().map(|truth| truth.joints.clone().into())
    }

    /// A flat joint by its name.
    ///
    /// # Errors
    /// Where the skeleton has none of it.
    pub(super) fn joint(&self, name: &str) -> anyhow::Result<usize> {
        let skeleton = &self.problem.skeleton;
        skeleton
            .joint(name)
            .with_context(|| format!("no joint is called {name}; expected one of {}", skeleton.joints.join(", ")))
    }
}

/// The share of `starts` starts of a frame, spread as usual, whose fits end in the best basin; `None` where it cannot be fitted.
pub(in crate::cli) fn best_basin(
    dataset: &Dataset,
    index: usize,
    options: &BatchOptions,
    starts: usize,
) -> Option<f64> {
    let frame = dataset.load(index).ok()?;
    let problem = Arc::new(problem_of(dataset, &frame).ok()?);
    let initial = find_start_in(dataset, index, &problem, &options.config).ok()?.initialisation.params;
    let state = ExploredState {
        problem,
        erased: Arc::default(),
        config: options.config,
        precision: options.precision,
        params: initial.clone(),
        initial,
    };
    let settings = RestartSettings { starts, ..RestartSettings::default() };
    let request = RestartRequest { state, settings, truth: None };
    // Frames are judged side by side: each on one core.
    restart_cloud(&request, &IdleCores::of(1), &Progress::new()).ok()?.best_share()
}

/// Why an exploration has no answer.
pub(super) fn halted(halt: Halt) -> anyhow::Error {
    match halt {
        Halt::Failed(why) => anyhow::anyhow!(why),
        Halt::Cancelled => anyhow::anyhow!("internal error: it was cancelled by nobody"),
    }
}
