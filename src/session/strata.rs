//! How hard the frames are, as far as it has been computed.

use super::tracked::Tracked;
use crate::study::complexity::{Complexity, FrameComplexity, Stratum};
use std::sync::Arc;

/// Data sets of up to this many frames are graded as soon as they are opened; larger ones when asked, or where an earlier
/// run has left its result. Reading 20,000 MMVR frames takes about two minutes of two cores.
pub(super) const AT_ONCE: usize = 20_000;

/// How far the grading is.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum StrataStatus {
    /// Not asked for.
    #[default]
    Absent,
    /// Under way.
    Running {
        /// Frames done.
        done: u64,
        /// Of how many; 0 where unknown.
        total: u64,
    },
    /// There.
    Ready,
    /// It could not be done.
    Failed(String),
}

/// The strata of the open data set.
#[derive(Debug, Default)]
pub struct Strata {
    /// How far it is.
    pub status: StrataStatus,
    result: Tracked<Option<Arc<Complexity>>>,
}

impl Strata {
    /// Nothing is known any more, as of a data set that was just opened.
    pub(super) fn clear(&mut self) {
        self.status = StrataStatus::Absent;
        *self.result.change() = None;
    }

    /// The statistics are there.
    pub(super) fn set(&mut self, complexity: Arc<Complexity>) {
        self.status = StrataStatus::Ready;
        *self.result.change() = Some(complexity);
    }

    /// Another number whenever other statistics are there.
    pub fn revision(&self) -> u64 {
        self.result.revision()
    }

    /// The statistics of all frames.
    pub fn result(&self) -> Option<&Arc<Complexity>> {
        self.result.as_ref()
    }

    /// The statistics of a frame.
    pub fn of(&self, frame: usize) -> Option<&FrameComplexity> {
        self.result.as_ref()?.frame(frame)
    }

    /// False where the frame's file could not be read.
    pub fn is_readable(&self, frame: usize) -> bool {
        self.result.as_ref().is_none_or(|result| result.frames.get(frame).is_none_or(Option::is_some))
    }

    /// Frames of a stratum.
    pub fn count(&self, stratum: Stratum) -> usize {
        self.result.as_ref().map_or(0, |result| result.counts.in_stratum(stratum))
    }
}
