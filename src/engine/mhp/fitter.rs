//! The fitter: one `step` is one Adam update and one evaluation. It knows no thread, file or window.

use super::adam::Adam;
use super::articulation::Articulation;
use super::convergence::{LOOK_BACK, converged};
use super::motion::{MotionState, Window, WindowLoss};
use super::{Evaluation, FitError, Objective, Precision, Problem, StepReport, StopReason, Weight};
use crate::body::{Group, Pppr};
use crate::config::{FitConfig, Parameterization};
use crate::geometry::Vec3;
use serde::{Deserialize, Serialize};
use smallvec::{SmallVec, smallvec};
use std::sync::Arc;

/// Where a fit begins that is given, and not found in the maps.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenStart {
    /// All of the persons.
    pub params: Pppr,
    /// Where their joints were given, world frame, m, in the order of the parameters; `None` for one that is only assumed.
    pub given: Vec<Option<Vec3>>,
}

impl GivenStart {
    /// All joints of these persons were given.
    pub fn whole(params: Pppr) -> Self {
        Self { given: params.positions().iter().copied().map(Some).collect(), params }
    }
}

/// Everything that another step needs: restoring it continues the run bit for bit under the same configuration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FitState {
    /// Adam steps taken.
    pub iteration: usize,
    /// Parameters at that iteration.
    pub params: Pppr,
    /// Adam's moments.
    pub adam: Adam,
    /// Where the window stands, while the parameterization is motion; empty otherwise.
    #[serde(default)]
    pub motion: MotionState,
    /// Where joints were given, world frame, m, in the order of the parameters: L_given holds them there (`mhp/terms/given.rs`). Empty
    /// where none was.
    #[serde(default)]
    pub given: Vec<Option<Vec3>>,
    /// Losses of the last iterations (up to six), the current one last: the convergence criterion looks back five.
    pub losses: SmallVec<[f64; LOOK_BACK + 2]>,
}

impl FitState {
    /// Where a fit that begins at `params` stands before its first step.
    pub fn at_start(params: Pppr) -> Self {
        let adam = Adam::new(params.shape());
        let (motion, given, losses) = (MotionState::default(), Vec::new(), SmallVec::new());
        Self { iteration: 0, params, adam, motion, given, losses }
    }

    /// The same where the joints were given, and not found in the maps.
    pub fn given(GivenStart { params, given }: GivenStart) -> Self {
        Self { given, ..Self::at_start(params) }
    }
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
    /// The frames that are fitted together, while the parameterization is motion.
    window: Option<Window>,
    /// What the window says of the current parameters, and room for what it says of the next.
    window_loss: [WindowLoss; 2],
    /// Whether the current evaluation lacks what a window's step does not need.
    unseen: bool,
    /// Joints as a hand left them since the last step, m; a window puts them a little elsewhere. Empty where no hand did.
    handed: Vec<Vec3>,
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
        Self::starting_at(problem, config, precision, FitState::at_start(initial))
    }

    /// As [`Self::new`], at the parameters of a state and where it says that joints were given.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn starting_at(
        problem: Arc<Problem>,
        config: FitConfig,
        precision: Precision,
        state: FitState,
    ) -> Result<Self, FitError> {
        let body = Articulation::new(&problem.skeleton);
        let objective = Objective::new(problem, config, precision, &state.params)?;
        let evaluation = Evaluation::zeros(state.params.shape());
        let (next, next_evaluation) = (Arc::new(state.clone()), evaluation.clone());
        let mut fitter = Self {
            objective,
            body,
            state: Arc::new(state),
            evaluation,
            next,
            next_evaluation,
            turns: Vec::new(),
            window: None,
            window_loss: Default::default(),
            unseen: false,
            handed: Vec::new(),
        };
        fitter.begin()?;
        Ok(fitter)
    }

    /// Evaluates the current parameters, in a window where the settings ask for one, as those of a fit that begins.
    fn begin(&mut self) -> Result<(), FitError> {
        let (config, precision) = (*self.objective.config(), self.objective.precision());
        let mut state = FitState::clone(&self.state);
        self.window = None;
        state.motion = MotionState::default();
        if config.parameterization == Parameterization::Motion {
            let problem = Arc::clone(self.objective.problem());
            // Where there is none, persons stay where they are.
            self.window = Window::fitted(&problem, &config, precision, &state.params)?.ok();
            if let Some(window) = &mut self.window {
                let mut coordinates = window.coordinates_of(&state.params);
                let mut found = WindowLoss::default();
                let how = (&*problem, &config);
                window.choose_brightness(how, precision, (&mut coordinates, &state.params), &mut found);
                let of = (coordinates.as_slice(), &state.params);
                if window.explains((&problem, &config), precision, of, &mut self.window_loss[0]) {
                    window.place(&coordinates, &mut state.params);
                    state.motion = MotionState::at(coordinates);
                } else {
                    self.window = None;
                }
            }
        }
        let shape = state.params.shape();
        self.evaluation = Evaluation::zeros(shape);
        let Self { objective, window, evaluation, window_loss: [window_loss, _], .. } = self;
        evaluate_state(objective, window.as_mut(), &state, true, (evaluation, window_loss))?;
        self.unseen = false;
        state.losses = smallvec![self.evaluation.loss];
        self.state = Arc::new(state);
        Ok(())
    }

    /// Steps until iteration `last`, or until the loss has converged where the settings stop there; `watch` sees every
    /// iteration, the one that it stands at included.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn run_to(&mut self, last: usize, mut watch: impl FnMut(StepReport, &Pppr)) -> Result<StopReason, FitError> {
        self.run_until(last, |fitter| {
            watch(fitter.report(), fitter.params());
            false
        })
    }

    /// As [`Self::run_to`], and not beyond an iteration at which `stops` says so; it is asked at the first one too, where nothing
    /// stops.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn run_until(&mut self, last: usize, mut stops: impl FnMut(&Self) -> bool) -> Result<StopReason, FitError> {
        stops(self);
        while self.iteration() < last {
            let converged = self.step()?.converged;
            if stops(self) {
                return Ok(StopReason::Breakpoint);
            }
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
        self.advance(true)?;
        Ok(self.report())
    }

    /// Steps as [`Self::run_to`], where nobody watches: what a window's step does not need, the IoU and the gradient of the frame that
    /// is fitted, is worked out at the end alone. `stops` is asked before each step, where the loss and the parameters are known.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn run_unseen(&mut self, last: usize, mut stops: impl FnMut(&Self) -> bool) -> Result<StopReason, FitError> {
        let mut reason = StopReason::Iterations;
        while self.iteration() < last && reason == StopReason::Iterations {
            if stops(self) {
                reason = StopReason::Breakpoint;
                continue;
            }
            self.advance(false)?;
            if self.has_converged() && self.config().stop_when_converged {
                reason = StopReason::Converged;
            }
        }
        if self.unseen {
            self.evaluate_now()?;
        }
        Ok(reason)
    }

    fn advance(&mut self, seen: bool) -> Result<(), FitError> {
        self.handed.clear();
        let Self {
            objective, body, state, evaluation, next, next_evaluation, turns, window, window_loss, unseen, ..
        } = self;
        // What somebody keeps stays as it is.
        if Arc::get_mut(next).is_none() {
            *next = Arc::new(FitState::clone(state));
        }
        let next_state = Arc::make_mut(next);
        next_state.iteration = state.iteration + 1;
        next_state.losses.clone_from(&state.losses);
        next_state.given.clone_from(&state.given);
        let how = (objective.config(), objective.precision());
        let moved = (&mut next_state.adam, &mut next_state.params);
        state.adam.update(&state.params, &evaluation.gradient, how, body, turns, moved);
        hold_scales(&state.params, &mut next_state.params, objective.config().scale_max_m);
        let [loss_now, loss_next] = window_loss;
        if let Some(window) = window.as_ref() {
            let at = (objective.config(), next_state.iteration);
            state.motion.advance(window, &loss_now.gradient, at, &mut next_state.motion);
            window.place(&next_state.motion.coordinates, &mut next_state.params);
        }
        evaluate_state(objective, window.as_mut(), next_state, seen, (next_evaluation, loss_next))?;
        *unseen = !seen && window.is_some();
        next_state.losses.push(next_evaluation.loss);
        let surplus = next_state.losses.len().saturating_sub(LOOK_BACK + 1);
        next_state.losses.drain(..surplus);
        std::mem::swap(state, next);
        std::mem::swap(evaluation, next_evaluation);
        window_loss.swap(0, 1);
        Ok(())
    }

    /// What is known of the current parameters; also at iteration 0.
    pub fn report(&self) -> StepReport {
        StepReport {
            iteration: self.state.iteration,
            loss: self.evaluation.loss,
            terms: self.evaluation.terms,
            iou: self.evaluation.iou.clone(),
            converged: self.has_converged(),
        }
    }

    fn has_converged(&self) -> bool {
        let (skeleton, criterion) = (&self.objective.problem().skeleton, self.objective.config().convergence);
        converged(criterion, skeleton, &self.state.params, &self.state.losses)
    }

    /// Loss and gradients of the current parameters.
    pub fn evaluation(&self) -> &Evaluation {
        &self.evaluation
    }

    /// The current parameters.
    pub fn params(&self) -> &Pppr {
        &self.state.params
    }

    /// Whether a fit in a space of motion leaves the persons where they start: its prior knows nothing of the skeleton, or the
    /// start explains the maps too little.
    pub fn is_held(&self) -> bool {
        self.config().parameterization == Parameterization::Motion && self.window.is_none()
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
        self.handed.clear();
        // Of a start nothing is known yet: neither its loss nor its place in a window.
        let fits = |window: &Window| state.motion.coordinates.len() == window.numbers();
        if state.losses.is_empty() || !self.window.as_ref().is_none_or(fits) {
            return self.set_state(FitState::clone(&state));
        }
        let Self { objective, window, evaluation, window_loss: [window_loss, _], .. } = self;
        evaluate_state(objective, window.as_mut(), &state, true, (evaluation, window_loss))?;
        self.unseen = false;
        self.state = state;
        Ok(())
    }

    /// Begins anew at `state`, whose coordinates are not known; stays where it is where that cannot be.
    fn set_state(&mut self, state: FitState) -> Result<(), FitError> {
        let before = std::mem::replace(&mut self.state, Arc::new(state));
        let losses = self.state.losses.clone();
        if let Err(error) = self.begin() {
            self.state = before;
            self.evaluate_now()?;
            return Err(error);
        }
        if losses.len() > 1 {
            Arc::make_mut(&mut self.state).losses = losses;
        }
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
        let kept = (Arc::clone(&self.state), self.window.take());
        // With a floor and without, coordinates are of other numbers, too.
        let another = config.parameterization != before.parameterization || config.height != before.height;
        let evaluated = if config.parameterization == Parameterization::Motion || another {
            let before = Arc::clone(&kept.0);
            self.begin_again(&before, &config, another)
        } else {
            self.evaluate_now()
        };
        match evaluated {
            Ok(()) => {
                if another {
                    let state = Arc::make_mut(&mut self.state);
                    state.adam = Adam::new(state.params.shape());
                }
                if let Some(last) = Arc::make_mut(&mut self.state).losses.last_mut() {
                    *last = self.evaluation.loss;
                }
                Ok(())
            }
            Err(error) => {
                self.objective.set_config(before);
                (self.state, self.window) = kept;
                self.evaluate_now()?;
                Err(error)
            }
        }
    }

    /// A window for other settings; coordinates and moments stay where they are those of a window already.
    fn begin_again(&mut self, before: &FitState, config: &FitConfig, another: bool) -> Result<(), FitError> {
        let (motion, losses, params) = (before.motion.clone(), before.losses.clone(), before.params.clone());
        self.begin()?;
        let state = Arc::make_mut(&mut self.state);
        state.losses = losses;
        let fits = motion.coordinates.len() == state.motion.coordinates.len();
        if config.parameterization == Parameterization::Motion && !another && fits {
            state.motion = motion;
            state.params = params;
            return self.evaluate_now();
        }
        Ok(())
    }

    /// Evaluates the current parameters.
    fn evaluate_now(&mut self) -> Result<(), FitError> {
        let Self { objective, window, evaluation, window_loss: [window_loss, _], state, unseen, .. } = self;
        *unseen = false;
        evaluate_state(objective, window.as_mut(), state, true, (evaluation, window_loss))
    }

    /// Takes parameters edited by hand at the current iteration; Adam's moments start anew. Whoever was moved is
    /// where the hand put all of the joints: what it left in place was seen, too.
    ///
    /// # Errors
    /// Where `params` has the wrong sizes, or it or its loss is not finite; the fitter then stays where it was.
    pub fn set_params(&mut self, params: Pppr) -> Result<(), FitError> {
        self.objective.problem().check(&params)?;
        let mut state = FitState::clone(&self.state);
        state.adam = Adam::new(params.shape());
        let (joints, positions) = (params.shape().joints.max(1), params.positions().to_vec());
        state.given.resize(positions.len(), None);
        let is_at = |places: &[Vec3], k: usize, person: &[Vec3]| places.chunks(joints).nth(k) == Some(person);
        let persons = positions.chunks(joints).zip(state.given.chunks_mut(joints));
        for (k, (person, given)) in persons.enumerate() {
            // A hand goes on from where it left the body, or from where the window put it.
            if !is_at(self.state.params.positions(), k, person) && !is_at(&self.handed, k, person) {
                given.iter_mut().zip(person).for_each(|(given, joint)| *given = Some(*joint));
            }
        }
        state.params = params;
        state.losses.clear();
        self.set_state(state)?;
        self.handed = positions;
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

/// Evaluates a state, in its window where there is one, and refuses what is not finite. What only shows the frame that is fitted is
/// left out where it is not `seen` and a window needs it not.
fn evaluate_state(
    objective: &mut Objective,
    window: Option<&mut Window>,
    state: &FitState,
    seen: bool,
    (evaluation, loss): (&mut Evaluation, &mut WindowLoss),
) -> Result<(), FitError> {
    objective.hold_to(&state.given);
    evaluate_into(objective, &state.params, state.iteration, seen || window.is_none(), evaluation)?;
    let Some(window) = window else { return Ok(()) };
    let (config, precision) = (*objective.config(), objective.precision());
    // How the persons look is what all frames say of it; where they are is the window's affair.
    let em = &mut evaluation.gradients[Weight::Em as usize];
    loss.places.clear();
    loss.places.extend_from_slice(em.group(Group::Position));
    em.reset(state.params.shape());
    let of = (state.motion.coordinates.as_slice(), &state.params);
    window.evaluate((objective.problem(), &config), precision, of, Some(em), loss);
    em.group_mut(Group::Position).copy_from_slice(&loss.places);
    let kinematic: SmallVec<[Weight; 8]> =
        Weight::ALL.iter().copied().filter(|&weight| weight != Weight::Em && weight.of(&config) != 0.0).collect();
    evaluation.gradient.reset(state.params.shape());
    for weight in kinematic {
        evaluation.gradient.add_scaled(weight.of(&config), &evaluation.gradients[weight as usize]);
    }
    window.pull_back(&state.motion.coordinates, &state.params, &evaluation.gradient, &mut loss.gradient);
    evaluation.gradient.add_scaled(config.w_em, &evaluation.gradients[Weight::Em as usize]);
    let weighed = |weight: f64, value: f64| if weight > 0.0 { value } else { 0.0 };
    let prior = weighed(config.w_prior, loss.prior);
    for (key, value) in [("em", loss.em), ("prior", prior), ("net", weighed(config.w_net, loss.network))] {
        evaluation.terms.put(key, value);
    }
    evaluation.loss = evaluation.terms.loss(&config);
    if evaluation.loss.is_finite() && loss.gradient.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    Err(FitError::Diverged {
        iteration: state.iteration,
        joint: "all joints".to_owned(),
        term: "the window's loss".to_owned(),
    })
}

fn evaluate_into(
    objective: &mut Objective,
    params: &Pppr,
    iteration: usize,
    with_maps: bool,
    evaluation: &mut Evaluation,
) -> Result<(), FitError> {
    let names = |joint: usize| joint_name(objective, params, joint);
    if let Some((joint, group)) = first_non_finite(params) {
        return Err(FitError::Diverged { iteration, joint: names(joint), term: group.key().to_owned() });
    }
    if with_maps {
        objective.evaluate_into(params, evaluation);
    } else {
        objective.evaluate_without_maps(params, evaluation);
    }
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
