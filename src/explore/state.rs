//! The state of a fit that slices and maps are taken around.

use super::Halt;
use crate::body::Pppr;
use crate::config::FitConfig;
use crate::mhp::{ErasedCells, Objective, Precision, Problem, without};

use std::sync::Arc;

/// Parameters of a frame with all that its loss depends on.
///
/// **In a window** (`parameterization = "motion"`) the fit minimises the mean over several frames and a prior of their motion;
/// what is evaluated here is the frame's own share: L_EM of its maps, and the terms that one frame has.
#[derive(Debug, Clone)]
pub struct ExploredState {
    /// The frame as it was measured.
    pub problem: Arc<Problem>,
    /// Cells that the fit does not see.
    pub erased: Arc<[ErasedCells]>,
    /// Settings.
    pub config: FitConfig,
    /// Scalar of the per-cell kernel.
    pub precision: Precision,
    /// The pose that the EM region is laid around.
    pub initial: Pppr,
    /// The parameters.
    pub params: Pppr,
}

impl ExploredState {
    /// Whether another one is the same.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.problem, &other.problem)
            && self.erased == other.erased
            && (self.config, self.precision) == (other.config, other.precision)
            && self.params == other.params
            && self.initial == other.initial
    }

    /// What the fit sees of the frame.
    pub(super) fn seen(&self) -> Result<Arc<Problem>, Halt> {
        without(&self.problem, &self.erased).map_err(Halt::failed)
    }

    /// The loss of `seen`, with the EM region of the fit. What maps say is explored: joints that were given hold nothing here.
    pub(super) fn objective(&self, seen: &Arc<Problem>) -> Result<Objective, Halt> {
        Objective::new(Arc::clone(seen), self.config, self.precision, &self.initial).map_err(Halt::failed)
    }
}
