//! The machine's evidence on the fit that is on screen: asked for when the fit comes to rest, kept until another one does.

use super::state::FitHashes;
use crate::dataset::{Dataset, Frame};
use crate::diagnose::Evidence;
use crate::mhp::Problem;
use crate::study::state_evidence;
use crate::worker::Snapshot;
use std::sync::Arc;

/// What the evidence is gathered from.
#[derive(Debug, Clone)]
pub struct EvidenceRequest {
    /// To read the frames before.
    pub dataset: Arc<Dataset>,
    /// The frame.
    pub frame: Arc<Frame>,
    /// Its filled maps.
    pub problem: Arc<Problem>,
    /// The fit.
    pub snapshot: Arc<Snapshot>,
    /// What identifies the fit, which comes back with the answer.
    pub fit: FitHashes,
}

impl EvidenceRequest {
    /// Reads the frames before and computes; takes milliseconds to tenths of a second, hence not for the window's thread.
    pub fn gather(&self) -> Vec<Evidence> {
        let Snapshot { config, params, masks, .. } = self.snapshot.as_ref();
        state_evidence(&self.dataset, &self.frame, &self.problem, config, params, masks)
    }
}

/// What was asked and what is known.
#[derive(Debug, Default)]
pub(super) struct EvidenceState {
    /// Frame and fit that were asked for last.
    pub(super) asked: Option<(usize, FitHashes)>,
    /// The newest answer, and the fit that it is on: an older one of the same frame is shown until the newer one is there.
    pub(super) found: Option<(FitHashes, Result<Vec<Evidence>, String>)>,
    /// The frame that the answer is on.
    pub(super) frame: usize,
}
