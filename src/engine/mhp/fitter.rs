//! The fitter: one `step` is one Adam update and one evaluation. It knows no thread, file or window.

use super::adam::Adam;
use super::articulation::Articulation;
use super::convergence::{LOOK_BACK, converged};
use super::{Evaluation, FitError, Objective, Precision, Problem, StepReport, StopReason};
use crate::body::{Group, Pppr};
use crate::config::FitConfig;
use serde::{Deserialize, Serialize};
use smallvec::{SmallVec, smallvec};
use std::sync::Arc;

/// Everything that another step needs: restoring it continues the run bit for bit under the same configuration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FitState {
    /// Adam steps taken.
    pub iteration: usize,
    /// Parameters at that iteration.
    pub params: Pppr,
    /// Adam's moments.
    pub adam: Adam,
    /// Losses of the last iterations (up to six), the current one last: the convergence criterion looks back five.
    pub losses: SmallVec<[f64; LOOK_BACK + 2]>,
}

/// Adam on the objective of one frame.
pub struct Fitter {
    objective: Objective,
    body: Articulation,
    /// Shared with whoever keeps the history; what nobody keeps is written over.
    state: Arc<FitState>,
    evaluation: Evaluation,
    // Of the next step, until it is known to be finite; then they change places with those above.
    next: Arc<FitState>,
    next_evaluation: Evaluation,
    /// The step by the coordinates of root and bones.
    turns: Vec<f64>,
}

impl Fitter {
    /// Sets up a fit that starts at `initial`, and evaluates it (iteration 0).
    ///
    /// # Errors
    /// Where `initial` has the wrong sizes, or it or its loss is not finite.
    pub fn new(
        problem: Arc<Problem>,
        config: FitConfig,
        precision: Precision,
        initial: Pppr,
    ) -> Result<Self, FitError> {
        let body = Articulation::new(&problem.skeleton);
        let mut objective = Objective::new(problem, config, precision, &initial)?;
        let evaluation = evaluate(&mut objective, &initial, 0)?;
        let adam = Adam::new(initial.shape());
        let losses = smallvec![evaluation.loss];
        let state = FitState { iteration: 0, params: initial, adam, losses };
        let (state, next, next_evaluation) = (Arc::new(state.clone()), Arc::new(state), evaluation.clone());
        Ok(Self { objective, body, state, evaluation, next, next_evaluation, turns: Vec::new() })
    }

    /// Steps until iteration `last`, or until the loss has converged where the settings stop there; `watch` sees every
    /// iteration, the one that it stands at included.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn run_to(&mut self, last: usize, mut watch: impl FnMut(StepReport, &Pppr)) -> Result<StopReason, FitError> {
        watch(self.report(), self.params());
        while self.iteration() < last {
            let report = self.step()?;
            let converged = report.converged;
            watch(report, self.params());
            if converged && self.config().stop_when_converged {
                return Ok(StopReason::Converged);
            }
        }
        Ok(StopReason::Iterations)
    }

    /// One Adam step from the current parameters, then their evaluation.
    ///
    /// # Errors
    /// [`FitError::Diverged`] where the new parameters or their loss are not finite; the fitter then stays where it was.
    pub fn step(&mut self) -> Result<StepReport, FitError> {
        let Self { objective, body, state, evaluation, next, next_evaluation, turns } = self;
        // What somebody keeps stays as it is.
        if Arc::get_mut(next).is_none() {
            *next = Arc::new(FitState::clone(state));
        }
        let next_state = Arc::make_mut(next);
        next_state.iteration = state.iteration + 1;
        next_state.losses.clone_from(&state.losses);
        let how = (objective.config(), objective.precision());
        let moved = (&mut next_state.adam, &mut next_state.params);
        state.adam.update(&state.params, &evaluation.gradient, how, body, turns, moved);
        hold_scales(&state.params, &mut next_state.params, objective.config().scale_max_m);
        evaluate_into(objective, &next_state.params, next_state.iteration, next_evaluation)?;
        next_state.losses.push(next_evaluation.loss);
        let surplus = next_state.losses.len().saturating_sub(LOOK_BACK + 1);
        next_state.losses.drain(..surplus);
        std::mem::swap(state, next);
        std::mem::swap(evaluation, next_evaluation);
        Ok(self.report())
    }

    /// What is known of the current parameters; also at iteration 0.
    pub fn report(&self) -> StepReport {
        let (skeleton, criterion) = (&self.objective.problem().skeleton, self.objective.config().convergence);
        StepReport {
            iteration: self.state.iteration,
            loss: self.evaluation.loss,
            terms: self.evaluation.terms,
            iou: self.evaluation.iou.clone(),
            converged: converged(criterion, skeleton, &self.state.params, &self.state.losses),
        }
    }

    /// Loss and gradients of the current parameters.
    pub fn evaluation(&self) -> &Evaluation {
        &self.evaluation
    }

    /// The current parameters.
    pub fn params(&self) -> &Pppr {
        &self.state.params
    }

    /// Adam steps taken.
    pub fn iteration(&self) -> usize {
        self.state.iteration
    }

    /// The state to come back to.
    pub fn state(&self) -> Arc<FitState> {
        Arc::clone(&self.state)
    }

    /// Goes to `state`; the configuration stays as it is.
    ///
    /// # Errors
    /// Where the state's parameters have the wrong sizes or are not finite; the fitter then stays where it was.
    pub fn restore(&mut self, state: Arc<FitState>) -> Result<(), FitError> {
        self.objective.problem().check(&state.params)?;
        self.evaluation = evaluate(&mut self.objective, &state.params, state.iteration)?;
        self.state = state;
        Ok(())
    }

    /// Changes the configuration from the next step on; the current parameters are evaluated anew. The EM region stays
    /// around the initial persons. Another parameterisation starts Adam's moments anew: they are moments of other numbers.
    ///
    /// # Errors
    /// Where the loss is not finite under the new configuration, which is then not taken.
    pub fn set_config(&mut self, config: FitConfig) -> Result<(), FitError> {
        let before = *self.objective.config();
        self.objective.set_config(config);
        match evaluate(&mut self.objective, &self.state.params, self.state.iteration) {
            Ok(evaluation) => {
                let state = Arc::make_mut(&mut self.state);
                if let Some(last) = state.losses.last_mut() {
                    *last = evaluation.loss;
                }
                if config.parameterization != before.parameterization {
                    state.adam = Adam::new(state.params.shape());
                }
                self.evaluation = evaluation;
                Ok(())
            }
            Err(error) => {
                self.objective.set_config(before);
                Err(error)
            }
        }
    }

    /// Takes parameters edited by hand at the current iteration; Adam's moments start anew.
    ///
    /// # Errors
    /// Where `params` has the wrong sizes, or it or its loss is not finite; the fitter then stays where it was.
    pub fn set_params(&mut self, params: Pppr) -> Result<(), FitError> {
        self.objective.problem().check(&params)?;
        self.evaluation = evaluate(&mut self.objective, &params, self.state.iteration)?;
        let state = Arc::make_mut(&mut self.state);
        state.adam = Adam::new(params.shape());
        state.params = params;
        state.losses = smallvec![self.evaluation.loss];
        Ok(())
    }

    /// The configuration in force.
    pub fn config(&self) -> &FitConfig {
        self.objective.config()
    }

    /// The objective: regions, warnings, masks.
    pub fn objective(&self) -> &Objective {
        &self.objective
    }
}

/// Brings the Gaussians of a step back to `scale_max_m` where they grew beyond it, m; one that was wider before does not grow.
/// The objective knows no such bound: where a map's mask has more cells than a body, it is best served by Gaussians as large
/// as a room.
fn hold_scales(before: &Pppr, after: &mut Pppr, scale_max_m: f64) {
    let most = scale_max_m.ln();
    for (after, &before) in after.group_mut(Group::LogScale).iter_mut().zip(before.group(Group::LogScale)) {
        // A NaN stays, for it must be told.
        if *after > most {
            *after = before.clamp(most, f64::MAX).min(*after);
        }
    }
}

/// Evaluates, and refuses what is not finite.
fn evaluate(objective: &mut Objective, params: &Pppr, iteration: usize) -> Result<Evaluation, FitError> {
    let mut evaluation = Evaluation::zeros(params.shape());
    evaluate_into(objective, params, iteration, &mut evaluation)?;
    Ok(evaluation)
}

fn evaluate_into(
    objective: &mut Objective,
    params: &Pppr,
    iteration: usize,
    evaluation: &mut Evaluation,
) -> Result<(), FitError> {
    let names = |joint: usize| joint_name(objective, params, joint);
    if let Some((joint, group)) = first_non_finite(params) {
        return Err(FitError::Diverged { iteration, joint: names(joint), term: group.key().to_owned() });
    }
    objective.evaluate_into(params, evaluation);
    if let Some((joint, group)) = first_non_finite(&evaluation.gradient) {
        let term = format!("the gradient of {}", group.key());
        return Err(FitError::Diverged { iteration, joint: joint_name(objective, params, joint), term });
    }
    let terms = evaluation.terms.iter().map(|(term, value)| (term.label, value));
    match terms.chain([("L", evaluation.loss)]).find(|(_, value)| !value.is_finite()) {
        Some((term, _)) => Err(FitError::Diverged { iteration, joint: "all joints".to_owned(), term: term.to_owned() }),
        None => Ok(()),
    }
}

fn first_non_finite(params: &Pppr) -> Option<(usize, Group)> {
    if params.is_finite() {
        return None;
    }
    (0..params.shape().total_joints())
        .flat_map(|joint| Group::ALL.map(|group| (joint, group)))
        .find(|&(joint, group)| params.joint(group, joint).iter().any(|x| !x.is_finite()))
}

fn joint_name(objective: &Objective, params: &Pppr, joint: usize) -> String {
    let shape = params.shape();
    let name = objective.problem().skeleton.shown_name(joint % shape.joints.max(1));
    if shape.persons > 1 { format!("{name} of person {}", joint / shape.joints.max(1)) } else { name }
}
