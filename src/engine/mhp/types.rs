//! What an evaluation of the objective and a step of the fit answer.

use super::{TermGroup, Terms, Weight};
use crate::body::{Group, Pppr, PpprShape};
use crate::config::FitConfig;
use serde::{Deserialize, Serialize};
use smallvec::{SmallVec, smallvec};

/// One IoU a view; `None` where both masks are empty. Up to four views take no heap, so that a report allocates nothing.
pub type Ious = SmallVec<[Option<f64>; 4]>;

/// Which scalar the per-cell kernel of the forward model computes in. Per-joint quantities are always f64.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Double precision: the oracle.
    F64,
    /// Single precision: the fast path, some seventy times as fast and right to five digits.
    #[default]
    F32,
}

/// The objective at one set of parameters, with its gradient.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// L, the sum of the terms under their weights: [`super::formula`].
    pub loss: f64,
    /// The unweighted terms.
    pub terms: Terms,
    /// Forward-consistency IoU of each view over its EM region; `None` where both masks are empty.
    pub iou: Ious,
    /// ∂L/∂Θ, the total.
    pub gradient: Pppr,
    /// What it is made of, in the order of [`Weight::ALL`]: the gradient of the sum that each weighs, unweighted.
    pub gradients: [Pppr; Weight::COUNT],
}

impl Evaluation {
    /// All zeros, to be filled by [`super::Objective::evaluate_into`].
    pub fn zeros(shape: PpprShape) -> Self {
        Self {
            loss: 0.0,
            terms: Terms::default(),
            iou: Ious::new(),
            gradient: Pppr::zeros(shape),
            gradients: std::array::from_fn(|_| Pppr::zeros(shape)),
        }
    }

    /// ∂L_EM/∂Θ, unweighted.
    pub fn em_gradient(&self) -> &Pppr {
        &self.gradients[Weight::Em as usize]
    }

    /// What a group of terms contributes to ∂L/∂Θ under the weights of `config`: the numbers of flat joint `joint` in
    /// `of`. Those of all groups add up to the total.
    pub fn joint_gradient(&self, group: TermGroup, config: &FitConfig, of: Group, joint: usize) -> SmallVec<[f64; 4]> {
        let mut sum: SmallVec<[f64; 4]> = smallvec![0.0; self.gradient.shape().width(of)];
        for weight in group.weights() {
            let part = self.gradients[weight as usize].joint(of, joint);
            sum.iter_mut().zip(part).for_each(|(sum, x)| *sum += weight.of(config) * x);
        }
        sum
    }
}

/// What is known of the fit after `iteration` Adam steps (0: the initial pose).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StepReport {
    /// Adam steps taken.
    pub iteration: usize,
    /// L of the parameters at this iteration.
    pub loss: f64,
    /// Unweighted terms of the same.
    pub terms: Terms,
    /// Forward-consistency IoU of each view.
    pub iou: Ious,
    /// The convergence criterion of SPEC section 4 at this iteration.
    pub converged: bool,
}

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// The asked number of iterations was done.
    Iterations,
    /// The convergence criterion held and the configuration says to stop there.
    Converged,
    /// Somebody stopped it.
    Stopped,
    /// A breakpoint held.
    Breakpoint,
}

impl StopReason {
    /// In words.
    pub fn text(self) -> &'static str {
        match self {
            Self::Iterations => "all iterations done",
            Self::Converged => "converged",
            Self::Stopped => "stopped",
            Self::Breakpoint => "stopped at a breakpoint",
        }
    }

    /// The word in tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Iterations => "iterations",
            Self::Converged => "converged",
            Self::Stopped => "stopped",
            Self::Breakpoint => "breakpoint",
        }
    }
}

/// Why a fit cannot be set up or go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// A map has no finite cell.
    #[error("array `{array}` has no finite cell; expected at least one number that is neither NaN nor infinite")]
    NoFiniteCell {
        /// Key of the map.
        array: String,
    },
    /// A map's shape does not match its view.
    #[error("array `{array}` has {got} cells; its view's axes make {expected}")]
    WrongShape {
        /// Key of the map.
        array: String,
        /// Cells found.
        got: usize,
        /// Cells expected.
        expected: usize,
    },
    /// A view that the forward model cannot compute.
    #[error("view `{array}`: {reason}")]
    WrongView {
        /// Key of the map.
        array: String,
        /// What is wrong and what was expected.
        reason: String,
    },
    /// The parameters do not match the skeleton or the radar.
    #[error("parameters have {what} = {got}; expected {expected}")]
    WrongParameters {
        /// Which size.
        what: &'static str,
        /// Found.
        got: usize,
        /// Expected.
        expected: usize,
    },
    /// Nothing in the map to start from.
    #[error("no start pose: {reason}")]
    NoStart {
        /// Why.
        reason: String,
    },
    /// A loss or parameter became NaN or infinite.
    #[error("diverged at iteration {iteration}: {term} of {joint} is not finite")]
    Diverged {
        /// The iteration that could not be done.
        iteration: usize,
        /// Name of the joint.
        joint: String,
        /// The parameter group or loss term.
        term: String,
    },
}
