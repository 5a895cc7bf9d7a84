//! L(Θ) and ∂L/∂Θ; SPEC section 4.

use super::floors::hard_iou;
use super::frame_em::FrameEm;
use super::percentile::percentile;
use super::region::{self, Region};
use super::terms::{self, Inputs};
use super::{Evaluation, FitError, Precision, Problem, TERMS, TermId, Weight};
use crate::body::Pppr;
use crate::config::FitConfig;
use crate::geometry::Vec3;
use std::sync::Arc;

/// The objective of one fit: its EM region and the mask of H_ori are fixed by the initial parameters.
pub struct Objective {
    /// As it was measured, and as fits with this configuration see it.
    measured: Arc<Problem>,
    problem: Arc<Problem>,
    config: FitConfig,
    precision: Precision,
    centres: Vec<Vec3>,
    regions: Vec<Region>,
    em: FrameEm,
    initial: Pppr,
    /// Where the frames around say that each person's middle is, m; empty where they say nothing.
    anchors: Vec<Vec3>,
    /// Where joints were given, m; empty where none was.
    given: Vec<Option<Vec3>>,
    warnings: Vec<String>,
}

/// Hard masks of one view over its whole map, C order; false outside the EM region.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Masks {
    /// B_ori
    pub ori: Vec<bool>,
    /// B_sim
    pub sim: Vec<bool>,
    /// The EM region.
    pub inside: Vec<bool>,
}

impl Masks {
    /// Forward-consistency IoU; `None` where both masks are empty.
    pub fn iou(&self) -> Option<f64> {
        hard_iou(self.ori.iter().copied().zip(self.sim.iter().copied()))
    }
}

impl Objective {
    /// Fixes the EM region around the persons of `initial`.
    ///
    /// # Errors
    /// Where `initial` has the wrong sizes or a position that is not finite.
    pub fn new(
        problem: Arc<Problem>,
        config: FitConfig,
        precision: Precision,
        initial: &Pppr,
    ) -> Result<Self, FitError> {
        problem.check(initial)?;
        let (measured, problem) = (Arc::clone(&problem), problem.shared_under(&config));
        let centres = region::centres(initial);
        let (regions, warnings) = region::regions(&problem.views, config.em_region, &centres)?;
        let em = FrameEm::new(&problem.measured(&config), &regions, &config, precision);
        let mut objective = Self {
            measured,
            problem,
            config,
            precision,
            centres,
            regions,
            em,
            initial: initial.clone(),
            anchors: Vec::new(),
            given: Vec::new(),
            warnings,
        };
        objective.anchor();
        Ok(objective)
    }

    /// Looks up where the frames around say that each person is, where that has a weight.
    fn anchor(&mut self) {
        if self.config.w_time > 0.0 && self.anchors.is_empty() {
            self.anchors = self.problem.anchors(&self.config, &self.initial);
        }
    }

    /// Changes the configuration; the EM region stays around the same initial persons.
    pub fn set_config(&mut self, config: FitConfig) {
        let before = std::mem::replace(&mut self.config, config);
        let seen = |config: &FitConfig| (config.range_offset, config.sidelobes);
        if seen(&config) != seen(&before) {
            self.problem = Arc::clone(&self.measured).shared_under(&config);
            self.anchors.clear();
        }
        if (config.em_region, seen(&config)) != (before.em_region, seen(&before))
            && let Ok((regions, warnings)) = region::regions(&self.problem.views, config.em_region, &self.centres)
        {
            (self.regions, self.warnings) = (regions, warnings);
        }
        let asked = |config: &FitConfig| {
            let compared = (config.objective, config.clutter, config.tau_pct);
            (config.em_region, seen(config), compared, config.body, config.summation)
        };
        if asked(&config) != asked(&before) {
            self.em = FrameEm::new(&self.problem.measured(&config), &self.regions, &config, self.precision);
        }
        self.anchor();
    }

    /// Holds joints, in the order of the parameters, to where they were given, world frame, m (L_given); to nothing where that is empty.
    pub fn hold_to(&mut self, given: &[Option<Vec3>]) {
        if self.given != given {
            self.given.clear();
            self.given.extend_from_slice(given);
        }
    }

    /// The configuration in force.
    pub fn config(&self) -> &FitConfig {
        &self.config
    }

    /// The problem.
    pub fn problem(&self) -> &Arc<Problem> {
        &self.problem
    }

    /// The precision of the per-cell kernel.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// The EM region of each view.
    pub fn regions(&self) -> &[Region] {
        &self.regions
    }

    /// What had to be widened, in words.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// L, its terms and its gradients at `params`, which must have the sizes of the initial parameters (those of another
    /// number of persons are accepted).
    pub fn evaluate(&mut self, params: &Pppr) -> Evaluation {
        let mut evaluation = Evaluation::zeros(params.shape());
        self.evaluate_into(params, &mut evaluation);
        evaluation
    }

    /// As [`Self::evaluate`], into an evaluation of before: in single precision nothing is allocated from the second
    /// time on where there are no more than four views.
    pub fn evaluate_into(&mut self, params: &Pppr, evaluation: &mut Evaluation) {
        self.evaluate_gained(params, &terms::WHOLE, true, evaluation);
    }

    /// As [`Self::evaluate_into`], without what the maps say: of L_EM neither value nor gradient, and no IoU.
    pub(super) fn evaluate_without_maps(&mut self, params: &Pppr, evaluation: &mut Evaluation) {
        self.evaluate_gained(params, &terms::WHOLE, false, evaluation);
    }

    /// ∂L_t/∂Θ of a term alone, unweighted; 0 for one that is not evaluated, because its weight is 0.
    pub fn term_gradient(&mut self, term: TermId, params: &Pppr) -> Pppr {
        let mut evaluation = Evaluation::zeros(params.shape());
        if term.is_of_maps() {
            self.evaluate_gained(params, &term.alone(), true, &mut evaluation);
        } else {
            let Self { problem, config, anchors, given, .. } = &*self;
            let inputs = Inputs { skeleton: &problem.skeleton, config, params, anchors, given };
            terms::evaluate(&inputs, 0.0, &term.alone(), &mut evaluation.gradients);
        }
        evaluation.gradients[term.weight as usize].clone()
    }

    /// As [`Self::evaluate_into`], each term's gradient times its gain; with what the maps say or without.
    fn evaluate_gained(
        &mut self,
        params: &Pppr,
        gains: &[f64; TERMS.len()],
        with_maps: bool,
        evaluation: &mut Evaluation,
    ) {
        let Evaluation { loss, terms, iou, gradient, gradients } = evaluation;
        for gradient in gradients.iter_mut() {
            gradient.reset(params.shape());
        }
        let em_gradient = &mut gradients[Weight::Em as usize];
        iou.clear();
        let Self { problem, config, precision, em, anchors, given, .. } = self;
        let config = &*config;
        let mut of_maps = || em.evaluate((&problem.radar, config), *precision, params, em_gradient, Some(iou));
        let em = if with_maps { of_maps() } else { 0.0 };
        let inputs = Inputs { skeleton: &problem.skeleton, config, params, anchors, given };
        *terms = terms::evaluate(&inputs, em, gains, gradients);
        *loss = terms.loss(config);
        terms::weighted_sum_into(config, gradients, gradient);
    }

    /// L_EM alone, without its gradient.
    pub fn em_loss(&self, params: &Pppr) -> f64 {
        self.em.loss((&self.problem.radar, &self.config), self.precision, params)
    }
}

/// The masks of a view for a simulated whole map `sim_map` (from [`super::simulate`]). A map of another size gives an
/// empty mask.
pub fn masks(objective: &Objective, view: usize, sim_map: &[f64]) -> Masks {
    let (Some(region), Some(shape)) =
        (objective.regions.get(view), objective.problem.views.get(view).map(crate::radar::View::shape))
    else {
        return Masks { ori: Vec::new(), sim: Vec::new(), inside: Vec::new() };
    };
    let cells = shape.iter().product();
    let indices = region.indices(&shape);
    let left = objective.em.left(view);
    let is_left = |k: usize| left.is_none_or(|left| left.get(k) == Some(&true));
    let indices_left = || indices.iter().enumerate().filter(|(k, _)| is_left(*k));
    let simulated: Vec<f64> = indices_left().filter_map(|(_, &i)| sim_map.get(i).copied()).collect();
    let threshold = percentile(&simulated, 100.0 - objective.config.tau_pct);
    let mut masks = Masks { ori: vec![false; cells], sim: vec![false; cells], inside: vec![false; cells] };
    let ori = objective.em.ori(view);
    for (k, &cell) in indices_left() {
        masks.inside[cell] = true;
        masks.ori[cell] = ori.get(k) == Some(&true);
        masks.sim[cell] = sim_map.get(cell).is_some_and(|&h| h > threshold);
    }
    masks
}
